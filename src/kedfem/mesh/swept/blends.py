"""Sweeps of parts without the small rounds, chamfers and grooves that prevent one; these are reported."""

from collections.abc import Sequence
from dataclasses import replace
from types import ModuleType

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import MeshError
from kedfem.mesh.cad.faces import edge_distance, with_faces
from kedfem.mesh.cad.model import leave_only
from kedfem.mesh.cad.solid_faces import cad_faces
from kedfem.mesh.cad.solids import CadFace, OtherMethodError, Sizing, Solid
from kedfem.mesh.elements.hexahedra import SolidMesh
from kedfem.mesh.layered.layers import layered_mesh, slanted_faces
from kedfem.mesh.session import boundary, connected_groups, gmsh_copy

SHARE = 0.015  # of the part's size: smaller convex blends are left out by default
MOST = 0.5  # % by which leaving them out may change the volume
_ARC = 1.6  # largest width of a round over its radius (π/2), or of a chamfer over its sides (√2)
_MANY = 60  # most blends that are examined one by one
_SAME = 1e-4  # of the part's size: largest distance between the same face of two models


def swept_without_blends(gmsh: ModuleType, solid: Solid, sizing: Sizing) -> SolidMesh:
    """Layers of a solid without the blends that prevent them, a `Method`; the mesh has faces and says what it lacks.

    With `defeature_size`, rounds of smaller radius and chamfers with shorter sides are left out, convex and concave ones.
    Without it only convex ones below SHARE of the part are, which adds material at edges and makes no sharp inner
    corner. Blends near `kept_points` and those in `kept_faces` stay.

    Raises
    ------
    OtherMethodError
        Other faces than small blends prevent layers, a blend must stay, or OpenCASCADE cannot remove one.
    """
    small = SHARE * solid.extent if sizing.defeature_size is None else sizing.defeature_size
    for faces in slanted_faces(gmsh, solid):
        if all(_width(gmsh, face) <= small for face in faces) and not _near(gmsh, faces, sizing, small):
            break
    else:
        raise OtherMethodError(f"{solid.name}: more than small blends prevents layers")
    with gmsh_copy(gmsh, 1.0) as copy:
        bare = _without(copy, solid, faces, concave=sizing.defeature_size is not None)
        mesh = with_faces(copy, bare, layered_mesh(copy, bare, sizing))
    change = 100 * (bare.volume / solid.volume - 1)
    if sizing.defeature_size is None and change > MOST:
        raise OtherMethodError(f"{solid.name}: its small blends are {change:.2g} % of the volume")
    count = "1 blend" if len(faces) == 1 else f"{len(faces)} blends"
    names = ", ".join(face.name for face in faces[:6]) + (", …" if len(faces) > 6 else "")
    words = f"left out: {count} below {1e3 * small:.3g} mm ({names}), {change:+.2g} % of the volume"
    return replace(mesh, method=f"{mesh.method}; {words}")


def _width(gmsh: ModuleType, face: CadFace) -> float:
    """Radius of a round, or approximate side of a chamfer [m]."""
    if np.isfinite(face.radius):
        return face.radius
    edges = gmsh.model.getBoundary([(2, face.tag)], oriented=False)
    around = sum(float(gmsh.model.occ.getMass(1, tag)) for _, tag in edges)
    # a chamfer's width is √2 sides, which is 1.13 times less than the width of a round
    return 2 * face.area / max(around, 1e-300) / _ARC * 1.13


def _near(gmsh: ModuleType, faces: Sequence[CadFace], sizing: Sizing, small: float) -> bool:
    """Whether a joint, load or probe is at one of some faces, or names it."""
    if {face.name for face in faces} & set(sizing.kept_faces):
        return True
    for face in faces:
        for point in sizing.kept_points:
            on, at = gmsh.model.getClosestPoint(2, face.tag, point)
            if gmsh.model.isInside(2, face.tag, at, parametric=True):
                away = float(np.linalg.norm(np.array(on) - point))
            else:
                away = edge_distance(gmsh, face.tag, np.array(point))
            if away <= small:
                return True
    return False


def _without(gmsh: ModuleType, solid: Solid, faces: Sequence[CadFace], concave: bool) -> Solid:
    """The solid in gmsh's copy without some faces of the original; other faces keep their names.

    An OtherMethodError says that OpenCASCADE fails, or that a blend is concave although those must stay.
    """
    ((_, tag),) = gmsh.model.getEntities(3)
    known = cad_faces(gmsh, solid.name, tag, solid.extent, {})
    removed = [_same(face, known, solid.extent).tag for face in faces]
    if not concave:
        edges = [boundary(gmsh, 2, tag) for tag in removed]
        split = len(removed) <= _MANY
        groups = [[removed[i] for i in group] for group in connected_groups(edges)] if split else [removed]
        for group in groups:
            with gmsh_copy(gmsh, 1.0) as trial:  # a copy has the same tags
                if _defeatured(trial, solid, group).volume < solid.volume:
                    raise OtherMethodError(f"{solid.name}: a concave fillet prevents layers")
    bare = _defeatured(gmsh, solid, removed)
    names = {face.tag: (_same(face, solid.faces, solid.extent, loose=True) or face).name for face in bare.faces}
    return Solid(bare.tag, bare.name, bare.volume, bare.low, bare.high,
                 cad_faces(gmsh, solid.name, bare.tag, solid.extent, names))  # fmt: skip


def _defeatured(gmsh: ModuleType, solid: Solid, faces: Sequence[int]) -> Solid:
    """The only solid of gmsh's model without some faces."""
    ((_, tag),) = gmsh.model.getEntities(3)
    try:
        made = gmsh.model.occ.defeature([tag], list(faces), removeVolume=True)
        gmsh.model.occ.synchronize()
        ((_, tag),) = [entity for entity in made if entity[0] == 3]
        leave_only(gmsh, tag)
        found = cad_faces(gmsh, solid.name, tag, solid.extent, {})
    except (MeshError, ValueError) as error:
        raise OtherMethodError(f"{solid.name}: its blends cannot be left out: {error}") from error
    except Exception as error:
        if type(error) is not Exception:  # gmsh raises nothing more special
            raise
        raise OtherMethodError(f"{solid.name}: OpenCASCADE cannot leave its blends out: {error}") from error
    volume = float(gmsh.model.occ.getMass(3, tag))
    if abs(volume / solid.volume - 1) > 0.2 or len(found) > len(solid.faces) - len(faces):
        raise OtherMethodError(f"{solid.name}: OpenCASCADE leaves another part than its blends out")
    return Solid(tag, solid.name, volume, solid.low, solid.high, found)


def _same(face: CadFace, among: Sequence[CadFace], extent: float, loose: bool = False) -> CadFace:
    """The face of another model nearest in centre and area, else `face`; `loose` compares the surfaces alone."""
    slack = _SAME * extent

    def off(other: CadFace) -> float:
        apart = other.centre - face.centre
        far = float(np.linalg.norm(apart))
        if other.kind != face.kind or (loose and face.kind == "other" and far > slack):
            return np.inf
        if loose and face.kind == "plane" and abs(apart @ face.direction) > slack:
            return np.inf
        if loose and face.kind == "plane" and face.direction @ other.direction < 1 - _SAME:
            return np.inf
        if face.kind in {"cylinder", "sphere"} and (
            abs(other.radius - face.radius) > slack or other.inward != face.inward
        ):
            return np.inf
        if loose and face.kind == "cylinder" and np.linalg.norm(np.cross(apart, face.direction)) > slack:
            return np.inf
        return far + 0.0 if loose else far + abs(other.area - face.area) / extent

    best = min(among, key=off)
    return best if np.isfinite(off(best)) else face


def points_in_file(
    points: Sequence[Sequence[float]], origin: Float[np.ndarray, "3"], axes: Float[np.ndarray, "3 3"]
) -> tuple[tuple[float, float, float], ...]:
    """Points of the scene in the part's own frame [m]."""
    return tuple(tuple(float(x) for x in axes @ (np.asarray(at) - origin)) for at in points)  # type: ignore[misc]
