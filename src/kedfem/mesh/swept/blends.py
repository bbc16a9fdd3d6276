"""Parts that could be swept but for small rounds, chamfers and grooves: swept without these, which are reported."""

from collections.abc import Sequence
from dataclasses import replace
from types import ModuleType

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import MeshError
from kedfem.mesh.cad.faces import beyond, with_faces
from kedfem.mesh.cad.model import leave_only
from kedfem.mesh.cad.solid_faces import cad_faces
from kedfem.mesh.cad.solids import CadFace, OtherMethodError, Sizing, Solid
from kedfem.mesh.elements.hexahedra import SolidMesh
from kedfem.mesh.layered.layers import layered_mesh, slanted_faces
from kedfem.mesh.session import boundary, gmsh_copy, touching

SHARE = 0.015  # of the part's size: convex blends smaller than that are left out by themselves
MOST = 0.5  # % of the volume that they may change by themselves
_ARC = 1.6  # width of a round over its radius (π/2), of a chamfer over its sides (√2), at most
_MANY = 60  # blends that are examined one by one
_SAME = 1e-4  # of the part's size: how far apart the same face of two models may be


def swept_without_blends(gmsh: ModuleType, solid: Solid, sizing: Sizing) -> SolidMesh:
    """Layers of a solid without blends that are in their way, a `Method`; the mesh has faces, and says what is left out.

    With `defeature_size` rounds of less radius and chamfers of shorter sides go, whether convex or concave. Without it
    those that are convex and smaller than SHARE of the part: material is added at edges, no sharp inner corner made.
    Blends near the points in `kept` stay.
    """
    small = SHARE * solid.extent if sizing.ignore is None else sizing.ignore
    for faces in slanted_faces(gmsh, solid):
        if all(_width(gmsh, face) <= small for face in faces) and not _near(gmsh, faces, sizing, small):
            break
    else:
        raise OtherMethodError(f"{solid.name}: more than small blends is in the way of layers")
    with gmsh_copy(gmsh, 1.0) as copy:
        bare = _without(copy, solid, faces, concave=sizing.ignore is not None)
        mesh = with_faces(copy, bare, layered_mesh(copy, bare, sizing))
    change = 100 * (bare.volume / solid.volume - 1)
    if sizing.ignore is None and change > MOST:
        raise OtherMethodError(f"{solid.name}: its small blends are {change:.2g} % of the volume")
    count = "1 blend" if len(faces) == 1 else f"{len(faces)} blends"
    names = ", ".join(face.name for face in faces[:6]) + (", …" if len(faces) > 6 else "")
    words = f"left out: {count} below {1e3 * small:.3g} mm ({names}), {change:+.2g} % of the volume"
    return replace(mesh, method=f"{mesh.method}; {words}")


def _width(gmsh: ModuleType, face: CadFace) -> float:
    """The radius of a round, the side of a chamfer, about [m]."""
    if np.isfinite(face.radius):
        return face.radius
    edges = gmsh.model.getBoundary([(2, face.tag)], oriented=False)
    around = sum(float(gmsh.model.occ.getMass(1, tag)) for _, tag in edges)
    # √2 of a chamfer's side, over what a round would be
    return 2 * face.area / max(around, 1e-300) / _ARC * 1.13


def _near(gmsh: ModuleType, faces: Sequence[CadFace], sizing: Sizing, small: float) -> bool:
    """Whether a joint, load or probe sits on one of some faces, or a joint names it."""
    if {face.name for face in faces} & set(sizing.named):
        return True
    for face in faces:
        for point in sizing.kept:
            on, at = gmsh.model.getClosestPoint(2, face.tag, point)
            if gmsh.model.isInside(2, face.tag, at, parametric=True):
                away = float(np.linalg.norm(np.array(on) - point))
            else:
                away = beyond(gmsh, face.tag, np.array(point))
            if away <= small:
                return True
    return False


def _without(gmsh: ModuleType, solid: Solid, faces: Sequence[CadFace], concave: bool) -> Solid:
    """The solid in gmsh's copy without some faces of its original, names of the others kept.

    An OtherMethodError says that OpenCASCADE cannot, or that a blend is concave and those are to stay.
    """
    ((_, tag),) = gmsh.model.getEntities(3)
    known = cad_faces(gmsh, solid.name, tag, solid.extent, {})
    goes = [_same(face, known, solid.extent).tag for face in faces]
    if not concave:
        edges = [boundary(gmsh, 2, tag) for tag in goes]
        groups = [[goes[i] for i in group] for group in touching(edges)] if len(goes) <= _MANY else [goes]
        for group in groups:
            with gmsh_copy(gmsh, 1.0) as trial:  # tags of a copy of a copy are the same again
                if _defeatured(trial, solid, group).volume < solid.volume:
                    raise OtherMethodError(f"{solid.name}: a concave fillet is in the way of layers")
    bare = _defeatured(gmsh, solid, goes)
    names = {face.tag: (_same(face, solid.faces, solid.extent, loose=True) or face).name for face in bare.faces}
    return Solid(bare.tag, bare.name, bare.volume, bare.low, bare.high,
                 cad_faces(gmsh, solid.name, bare.tag, solid.extent, names))  # fmt: skip


def _defeatured(gmsh: ModuleType, solid: Solid, faces: Sequence[int]) -> Solid:
    """The one solid of gmsh's model without some faces."""
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
    """The face of another model that is nearest in centre and area; loose: of one surface, whatever its extent."""
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
    """Places of the scene in the part's own frame."""
    return tuple(tuple(float(x) for x in axes @ (np.asarray(at) - origin)) for at in points)  # type: ignore[misc]
