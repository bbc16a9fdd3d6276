"""Solids of revolution: their axis, and the mesh of the meridian section swept about it."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from types import ModuleType

import numpy as np

from kedfem.arrays import Float
from kedfem.mesh.cad.face_samples import Axis, FaceSamples, Frame, common_axes, face_samples
from kedfem.mesh.cad.solids import OtherMethodError, Sizing, Solid
from kedfem.mesh.cad.words import direction_in_words, face_in_words
from kedfem.mesh.elements.hexahedra import SolidMesh, in_layers, without_unused_nodes
from kedfem.mesh.layered.cusps import without_unused_curves
from kedfem.mesh.layered.division import plan_size
from kedfem.mesh.layered.partition import Plan, Region
from kedfem.mesh.layered.plan_mesh import PlanMesh, plan_mesh
from kedfem.mesh.layered.sections import check_volume, plan_of_sections, reporting, section
from kedfem.mesh.layered.size_trials import sized
from kedfem.mesh.session import gmsh_copy
from kedfem.mesh.swept.core import NEAR, core_mesh, core_radius

_ASIDE = 0.7  # [rad], angle of the section, away from right angles, where seams of faces usually are
_FEWEST, _MOST = 12, 20  # elements to a revolution where no size is asked for
_RING = 20  # the least for a ring: with 16 its first frequency is 0.6 % too high, with 20 0.2 %


@dataclass(frozen=True, slots=True)
class _Meridian:
    """The plan of a meridian section, that outside of the core, the regions inside, the core's radius, the size."""

    outside: Plan
    whole: Plan
    inside: tuple[Region, ...]
    radius: float
    size: float


def revolved_mesh(gmsh: ModuleType, solid: Solid, sizing: Sizing) -> SolidMesh:
    """hex27 mesh of a solid of revolution, a `Method`: pulleys, bushings, shafts, balls.

    The meridian section is meshed as the plan of a layer is, and swept about the axis: in elements of the same size at
    the mean radius or, without a size asked for, 12 to 20 to a revolution for two elements across. Along the axis there
    is a core of extruded discs, because elements swept about their own edge would be wedges.

    Raises
    ------
    OtherMethodError
        A face does not turn about the axis, OpenCASCADE cannot cut the section, or the elements are bad.
    """
    turn = revolution(gmsh, solid)
    return sized(solid, sizing, lambda share: _mesh_about(gmsh, solid, turn, sizing, share))


def revolution(gmsh: ModuleType, solid: Solid) -> Frame:
    """A frame whose origin and first axis are on the axis about which all faces of a solid turn.

    An OtherMethodError names the obstacle if there is none.
    """
    every = list(face_samples(gmsh, solid).values())
    obstacles: list[tuple[float, str]] = []
    for axis in common_axes(solid, every):
        others = [sample.face for sample in every if not sample.revolves_about(axis)]
        if not others:
            return _framed(gmsh, solid, every, axis)
        words = face_in_words(max(others, key=lambda face: face.area))
        reason = f"the {words} is not one of revolution about {direction_in_words(axis[1])}"
        obstacles.append((sum(face.area for face in others), reason))
    reason = min(obstacles)[1] if obstacles else "no face is a surface of revolution"
    raise OtherMethodError(f"{solid.name}: no solid of revolution, as {reason}")


def _framed(gmsh: ModuleType, solid: Solid, every: list[FaceSamples], axis: Axis) -> Frame:
    """The frame; its axis points to the heavier end, so that it turns with the part."""
    point, along = axis
    reach = np.concatenate([sample.places for sample in every]) @ along
    centre = (np.asarray(gmsh.model.occ.getCenterOfMass(3, solid.tag)) - solid.middle) / solid.extent
    along = along if centre @ along >= (reach.max() + reach.min()) / 2 - 1e-6 else -along
    first = np.eye(3)[int(np.argmin(abs(along)))]
    radial = first - (first @ along) * along
    radial /= np.linalg.norm(radial)
    return Frame(solid.middle + solid.extent * point, np.stack([along, radial, np.cross(along, radial)]))


def _mesh_about(gmsh: ModuleType, solid: Solid, turn: Frame, sizing: Sizing, share: float) -> SolidMesh:
    """The mesh swept about the axis, at the solid's place."""
    with _meridian(gmsh, solid, turn, sizing, share) as meridian:
        flat = plan_mesh(solid.name, meridian.outside, meridian.size, sizing)
        around = _elements_around(meridian, sizing)
        mesh = _revolved(flat, around)
        for region in meridian.inside:
            mesh = _with_core(mesh, flat, meridian, region, around)
    about = direction_in_words(turn.axes[0])
    method = f"{flat.kind} swept about {about} in {around} elements{flat.made_by}"
    return SolidMesh(turn.origin + solid.extent * mesh.points @ turn.axes, mesh.cells, method=method)


@contextmanager
def _meridian(gmsh: ModuleType, solid: Solid, turn: Frame, sizing: Sizing, share: float) -> Iterator[_Meridian]:
    """The meridian section in a copy of the model, by the solid's extent: x along the axis, y from it."""
    radial = np.array([0, np.cos(_ASIDE), np.sin(_ASIDE)]) @ turn.axes
    axes = np.stack([turn.axes[0], radial, np.cross(turn.axes[0], radial)])
    with gmsh_copy(gmsh, 1 / solid.extent) as copy:
        with reporting(solid, "it must have a section through its axis"):
            faces = _section(copy, solid, turn, axes)
            whole = _plan(copy, solid, turn, axes, faces)
            check_volume(solid, whole)
            size = share * plan_size(whole, sizing)
            radius = core_radius(whole)
            if radius > 0:
                whole = _plan(copy, solid, turn, axes, _cut(copy, faces, axes, radius))
        inside = tuple(region for region in whole.regions if _reach(whole, region) <= radius + NEAR)
        outside = tuple(region for region in whole.regions if _reach(whole, region) > radius + NEAR)
        yield _Meridian(without_unused_curves(replace(whole, regions=outside)), whole, inside, radius, size)


def _section(gmsh: ModuleType, solid: Solid, turn: Frame, axes: Float[np.ndarray, "3 3"]) -> list[tuple[int, int]]:
    """The faces in which a half-plane through the axis cuts the solid, moved so that the axis' point is the origin."""
    [(_, tag)] = gmsh.model.getEntities(3)
    middle = (solid.middle - turn.origin) @ turn.axes[0] / solid.extent
    corners = np.array([[middle + x, y, 0] for x, y in ((-1, 0), (1, 0), (1, 1.5), (-1, 1.5))])
    faces = section(gmsh, int(tag), turn.origin / solid.extent + corners @ axes)
    gmsh.model.occ.translate(faces, *(-turn.origin / solid.extent))
    return faces


def _cut(
    gmsh: ModuleType, faces: list[tuple[int, int]], axes: Float[np.ndarray, "3 3"], radius: float
) -> list[tuple[int, int]]:
    """The faces of a section divided along a line at a radius."""
    occ = gmsh.model.occ
    boxes = np.reshape([occ.getBoundingBox(*face) for face in faces], (-1, 2, 3))
    low, high = (boxes @ axes[0]).T
    ends = [min(low.min(), high.min()) - 1, max(low.max(), high.max()) + 1]
    line = occ.addLine(*(occ.addPoint(*(np.array([x, radius, 0]) @ axes)) for x in ends))
    pieces = occ.fragment(faces, [(1, line)])[1][: len(faces)]
    return [piece for group in pieces for piece in group if piece[0] == 2]


def _plan(
    gmsh: ModuleType, solid: Solid, turn: Frame, axes: Float[np.ndarray, "3 3"], faces: list[tuple[int, int]]
) -> Plan:
    """The plan of half a section, as thick as the path of its centroid is long (Pappus)."""
    occ = gmsh.model.occ
    masses = np.array([occ.getMass(2, face) for _, face in faces])
    radii = np.array([occ.getCenterOfMass(2, face) for _, face in faces]) @ axes[1]
    path = 2 * np.pi * float(masses @ radii / masses.sum())
    plan = plan_of_sections(gmsh, [faces], axes, solid.extent, np.array([0.0, path]))
    return replace(plan, origin=turn.origin)


def _reach(plan: Plan, region: Region) -> float:
    """The largest radius of a region."""
    return max(float(plan.curves[i].samples[:, 1].max()) for loop in region.loops for i, _ in loop)


def _elements_around(meridian: _Meridian, sizing: Sizing) -> int:
    """Number of elements around the axis, a multiple of four; without a size asked for as many as bending needs."""
    wanted = meridian.whole.heights[-1] / meridian.size
    if sizing.size is None:
        least = _FEWEST if meridian.inside else _RING
        wanted = float(np.clip(wanted, least, _MOST) * sizing.across / 2)
    wanted = max(wanted, 2 * np.pi / sizing.angle, sizing.layers)
    return 4 * max(2, round(float(wanted) / 4))


def _revolved(flat: PlanMesh, around: int) -> SolidMesh:
    """The section's cells swept through a revolution, by the solid's extent: x along the axis, y and z across it."""
    count = len(flat.points)
    mesh = in_layers(flat.points, np.arange(2 * around + 1.0), flat.cells)
    cells = mesh.cells % (2 * around * count)
    x, r, level = mesh.points.T
    angle = level * np.pi / around
    turned = SolidMesh(np.stack([x, r * np.cos(angle), r * np.sin(angle)], axis=1), cells)
    return without_unused_nodes(turned)


def _with_core(mesh: SolidMesh, flat: PlanMesh, meridian: _Meridian, region: Region, around: int) -> SolidMesh:
    """The mesh joined with a core, which shares the nodes between them."""
    loop = region.loops[0]
    samples = np.concatenate([meridian.whole.curves[i].samples for i, _ in loop])
    on = samples[samples[:, 1] > meridian.radius - NEAR, 0]
    x, r = flat.points.T
    nodes = (abs(r - meridian.radius) < NEAR) & (x > on.min() - NEAR) & (x < on.max() + NEAR)
    core = core_mesh(meridian.whole, region, meridian.radius, np.sort(x[nodes]), around)
    from scipy.spatial import KDTree

    distance, nearest = KDTree(mesh.points).query(core.points)
    shared = distance < NEAR
    number = np.empty(len(core.points), dtype=np.int64)
    number[shared] = nearest[shared]
    number[~shared] = len(mesh.points) + np.arange((~shared).sum())
    wanted, outer = int(nodes.sum()) * 2 * around, np.linalg.norm(core.points[:, 1:], axis=1) > meridian.radius - NEAR
    if shared.sum() != wanted or not np.array_equal(shared, outer):
        raise OtherMethodError(f"the core must share {wanted} nodes, got {shared.sum()}")
    points = np.concatenate([mesh.points, core.points[~shared]])
    return SolidMesh(points, np.concatenate([mesh.cells, number[core.cells]]))
