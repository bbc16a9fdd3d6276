"""Solids that consist of layers along one direction: the direction, the mesh of the sections, and its sweep."""

from dataclasses import replace
from types import ModuleType

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.errors import KedfemError
from kedfem.mesh.cad.solid_faces import places_on
from kedfem.mesh.cad.solids import CadFace, OtherMethodError, Sizing, Solid
from kedfem.mesh.cad.words import direction_in_words, face_in_words
from kedfem.mesh.elements.hexahedra import SolidMesh, stacked, without_unused_nodes
from kedfem.mesh.elements.quality import mesh_quality
from kedfem.mesh.layered.cusps import without_cusps
from kedfem.mesh.layered.division import plan_size
from kedfem.mesh.layered.partition import Plan
from kedfem.mesh.layered.plan_mesh import PlanMesh, plan_mesh
from kedfem.mesh.layered.sections import plan_of_slabs
from kedfem.mesh.layered.size_trials import GOOD, SHARES, good_enough

_GAIN = 0.03  # least improvement of the scaled Jacobian by more elements
_ALONG = 1e-5  # sine of the largest angle between a face and the direction, or its normal plane
# unknowns above which no mesh is made: ten times those above which tetrahedra are used instead
FAR_TOO_MANY = 1_500_000
_UNKNOWNS_EACH = 24  # unknowns for each 27-node hexahedron of a large mesh
_SAMPLES = np.linspace(0.0, 1.0, 7)


class TooManyError(OtherMethodError):
    """Sweeping along a direction gives far too many elements, and smaller ones would give more."""


def layered_mesh(gmsh: ModuleType, solid: Solid, sizing: Sizing) -> SolidMesh:
    """hex27 mesh of a solid whose faces are all parallel or perpendicular to one direction, a `Method`.

    The plane faces perpendicular to the direction cut the solid into slabs of constant section. All sections together
    divide the plane into regions. These are meshed as mapped blocks where possible, else with the best of gmsh's
    quadrilaterals, and each is swept through the slabs in which it has material. Elements have the size of
    :func:`~kedfem.mesh.layered.division.plan_size`.

    Raises
    ------
    OtherMethodError
        The solid has no such direction, the sections cannot be meshed, or the elements are too many or too bad.
    """
    best: tuple[float, SolidMesh] | None = None
    refusals: list[str] = []
    tries = [(direction, share) for direction in layer_directions(gmsh, solid) for share in SHARES]
    hopeless = None
    for direction, share in tries:
        if direction is hopeless:
            continue
        try:
            mesh = _mesh_along(gmsh, solid, direction, sizing, share)
        except TooManyError as error:
            hopeless = direction
            refusals.append(str(error))
            continue
        except KedfemError as error:
            refusals.append(str(error))
            continue
        least = mesh_quality(mesh).least
        if best is None or least > best[0] + _GAIN:
            best = least, mesh
        if least >= GOOD:
            break
    if best is None:
        raise OtherMethodError(refusals[0])
    return good_enough(solid, best[1])


def layer_directions(gmsh: ModuleType, solid: Solid) -> tuple[Float[np.ndarray, "3"], ...]:
    """The directions along which a solid consists of layers, that with the largest area across it first.

    An OtherMethodError names the obstacle if there is none.
    """
    found: list[Float[np.ndarray, "3"]] = []
    obstacles: list[tuple[float, str]] = []
    for direction, slanted in _slanted(gmsh, solid):
        if not slanted:
            found.append(direction)
        else:
            largest = max(slanted, key=lambda face: face.area)
            words = f"the {face_in_words(largest)} is neither along nor across {direction_in_words(direction)}"
            obstacles.append((sum(face.area for face in slanted), words))
    if not found:
        obstacle = min(obstacles)[1] if obstacles else "it has no plane face"
        raise OtherMethodError(f"{solid.name}: no layers along one direction, as {obstacle}")
    return tuple(found)


def slanted_faces(gmsh: ModuleType, solid: Solid) -> list[list[CadFace]]:
    """For each direction with plane faces across it the faces neither along nor across it, the least area first."""
    every = [slanted for _, slanted in _slanted(gmsh, solid) if slanted]
    return sorted(every, key=lambda faces: sum(face.area for face in faces))


def _slanted(gmsh: ModuleType, solid: Solid) -> list[tuple[Float[np.ndarray, "3"], list[CadFace]]]:
    """The directions with plane faces across them, the largest area first, and the faces that prevent each."""
    normals = {face.tag: places_on(gmsh, face.tag, _SAMPLES).normals for face in solid.faces}
    flat = [face for face in solid.faces if _fits(normals[face.tag], normals[face.tag][0])]
    directions = _directions([normals[face.tag][0] for face in flat], [face.area for face in flat])
    return [
        (direction, [face for face in solid.faces if not _fits(normals[face.tag], direction)]) for direction in directions
    ]


def _directions(normals: list[Float[np.ndarray, "3"]], areas: list[float]) -> list[Float[np.ndarray, "3"]]:
    """The different directions of normals, opposite ones counted as one, the largest area first."""
    groups: list[tuple[Float[np.ndarray, "3"], float]] = []
    for normal, area in zip(normals, areas, strict=True):
        direction = normal * np.sign(normal[np.argmax(abs(normal) > 0.999 * abs(normal).max())])
        near = (abs(direction) > 1e-9) * direction
        for i, (known, sum_of_areas) in enumerate(groups):
            if np.linalg.norm(np.cross(known, near)) < _ALONG:
                groups[i] = known, sum_of_areas + area
                break
        else:
            groups.append((near / np.linalg.norm(near), area))
    return [direction for direction, _ in sorted(groups, key=lambda group: -group[1])]


def _fits(normals: Float[np.ndarray, "_ 3"], direction: Float[np.ndarray, "3"]) -> bool:
    """Whether a face is perpendicular to the direction everywhere (a cap) or parallel to it everywhere (a wall)."""
    across = np.linalg.norm(np.cross(normals, direction), axis=1).max() < _ALONG
    return bool(across or abs(normals @ direction).max() < _ALONG)


def _mesh_along(
    gmsh: ModuleType, solid: Solid, direction: Float[np.ndarray, "3"], sizing: Sizing, share: float
) -> SolidMesh:
    """The mesh swept along one direction, at the solid's place."""
    with plan_of_slabs(gmsh, solid, direction) as plan_with_cusps:
        size = share * plan_size(plan_with_cusps, sizing)
        plan, filled = without_cusps(plan_with_cusps, size)
        flat = plan_mesh(solid.name, plan, size, sizing)
    layers = np.maximum(np.rint(np.diff(plan.heights) / size).astype(int), max(1, sizing.layers))
    words = _method_in_words(direction, flat, plan, int(layers.sum()))
    _check_count(solid, words, flat, plan, layers, sizing)
    mesh = swept(flat, plan, layers)
    if filled > 0:
        words += f"; cusps between touching edges filled, {100 * filled:.2g} % of the volume"
    return SolidMesh(mesh.points, mesh.cells, method=words)


def _check_count(
    solid: Solid, words: str, flat: PlanMesh, plan: Plan, layers: Int[np.ndarray, " s"], sizing: Sizing
) -> None:
    """Refuse far too many elements before they are made, unless a size is asked for."""
    material = np.stack([region.material for region in plan.regions])[flat.regions]
    unknowns = _UNKNOWNS_EACH * float((material @ layers).sum())
    if sizing.size is None and sizing.across <= 2 and unknowns > FAR_TOO_MANY:
        raise TooManyError(
            f"{solid.name}: {words}: about {unknowns / 1e6:.2g} million unknowns, "
            "since a small step or wall asks for elements as small"
        )


def _method_in_words(direction: Float[np.ndarray, "3"], flat: PlanMesh, plan: Plan, layers: int) -> str:
    """Description of how the mesh was made."""
    slabs = len(plan.heights) - 1
    through = f"{layers} layer{'s' * (layers > 1)}"
    if slabs > 1:
        through = f"{slabs} slabs, {through}"
    return f"{flat.kind} swept along {direction_in_words(direction)} through {through}{flat.made_by}"


def swept(flat: PlanMesh, plan: Plan, layers: Int[np.ndarray, " slabs"]) -> SolidMesh:
    """hex27 mesh: each cell of the plan is swept through the slabs in which its region has material.

    A node's number follows from its place in the plan and its level, so that slabs share the nodes between them.

    Parameters
    ----------
    layers : (slabs,) number of elements through each slab
    """
    points, quads = flat.points, flat.cells
    heights = _levels(plan.heights, layers)
    slab = np.repeat(np.arange(len(layers)), layers)
    material = np.stack([region.material for region in plan.regions])[flat.regions]
    cell, layer = np.nonzero(material[:, slab])
    mesh = stacked(points, heights, quads[cell], layer)
    return without_unused_nodes(replace(mesh, points=plan.extent * (mesh.points @ plan.axes)))


def _levels(bounds: Float[np.ndarray, " h"], layers: Int[np.ndarray, " s"]) -> Float[np.ndarray, " v"]:
    """Heights of the levels of nodes: two for each layer, those at the bounds once."""
    parts = [
        np.linspace(low, high, 2 * count + 1)[1:]
        for low, high, count in zip(bounds[:-1], bounds[1:], layers, strict=True)
    ]
    return np.concatenate([bounds[:1], *parts])
