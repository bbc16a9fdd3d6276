"""The solids of a CAD assembly, and the joints that their round faces suggest: pins in bores, balls in sockets."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from types import ModuleType

import numpy as np

from kedfem.arrays import Float
from kedfem.mesh.cad.faces import axial_bounds, faces_by_surface
from kedfem.mesh.cad.file import cad_file
from kedfem.mesh.cad.model import all_solids
from kedfem.mesh.cad.solids import CadFace, Solid
from kedfem.mesh.isolated import LONGEST, PART, in_own_process
from kedfem.mesh.session import gmsh_model

# least share of a full cylinder that counts as closed, as joints find it (links/surfaces/round_surfaces.py); a keyway
# leaves more
CLOSED = 0.75
BALL = 0.2  # least share of a ball's area; the rounded corner between three walls has an eighth
PLAY = 0.1  # most by which a pin is thinner than its bore, of the bore's radius (an M10 screw's hole has 11 mm)
PRESS = 0.01  # most by which a pressed-in pin is thicker than its bore, of the bore's radius
ASIDE = 0.02  # most distance of axes or centres beyond the play, of the bore's radius: parts are placed by hand
SKEW = 1e-3  # sine of the largest angle between axes taken as parallel: 0.06°
LEAST = 0.05  # least overlap of pin and bore, of the shorter one's length: a pin may end at a bore's rim
GAP = 1.0  # most distance along the axis between two bores of a pin that is not in the file, of their radius
SAME = 1e-3  # most difference of the radii of such bores, of their radius


@dataclass(frozen=True, slots=True)
class AssemblySolid:
    """A solid of an assembly: its name, the diagonal of its bounding box [m], its closed cylinders and its balls."""

    name: str
    extent: float
    round_faces: tuple[CadFace, ...]


def assembly_solids(path: Path, scale: float | None) -> list[AssemblySolid]:
    """All solids of a CAD file, at their places in it, in metres; gmsh runs in a process of its own.

    Parameters
    ----------
    scale : metres per unit of the file; None: the file's own unit

    Raises
    ------
    MeshError
        The file cannot be read, or one of its solids cannot be meshed.
    """
    return in_own_process(path.name, PART, LONGEST, _read, path, scale)


def _read(path: Path, scale: float | None) -> list[AssemblySolid]:
    """The solids, read in this process."""
    file = cad_file(path.name, path, scale)
    with gmsh_model() as gmsh:
        return [
            AssemblySolid(solid.name, solid.extent, tuple(round_faces(gmsh, solid))) for solid in all_solids(gmsh, file)
        ]


def round_faces(gmsh: ModuleType, solid: Solid) -> list[CadFace]:
    """The closed cylinders and the balls of a solid; faces that a CAD file divides along seams are joined."""
    groups = [[solid.faces[i] for i in group] for group in faces_by_surface(gmsh, solid)]
    found = [_round_face(group) for group in groups if group[0].kind in ("cylinder", "sphere")]
    return [each for each in found if each is not None]


def _round_face(parts: list[CadFace]) -> CadFace | None:
    """The faces of one cylinder or ball as one face; None if they are only a part of it, such as a fillet."""
    first, area = parts[0], sum(face.area for face in parts)
    if first.kind == "sphere":
        return first if area >= BALL * 4 * np.pi * first.radius**2 else None
    low, high = axial_bounds(parts)
    if area < CLOSED * 2 * np.pi * first.radius * (high - low):
        return None
    centre = first.centre + (low + high) / 2 * first.direction
    return replace(first, centre=centre, length=high - low, area=area)


@dataclass(frozen=True, slots=True)
class AssemblyJoint:
    """Round faces of two solids that meet, and the joint that they may be.

    solids : indices, the solid with the hole first; for two bores in the assembly's order
    faces : the round face of each solid
    at : (3,) place of the joint [m]
    overlap : length along the axis that both have [m]; nan for a ball, at most 0 for bores beside each other
    hidden : for each solid whether a joint would find another bore about the same axis, as in a hollow pin
    """

    solids: tuple[int, int]
    faces: tuple[CadFace, CadFace]
    at: Float[np.ndarray, "3"]
    overlap: float
    hidden: tuple[bool, bool]

    @property
    def ball(self) -> bool:
        """Whether it is a ball in its socket."""
        return self.faces[0].kind == "sphere"

    @property
    def two_bores(self) -> bool:
        """Whether it is two bores in line, without a pin."""
        return self.faces[0].inward and self.faces[1].inward


def assembly_joints(solids: Sequence[AssemblySolid]) -> list[AssemblyJoint]:
    """All joints that an assembly suggests: one for each axis or centre that two solids have in common.

    Two bores of one radius in line suggest a joint where neither has a pin in it.
    """
    found = [each for pair in combinations(range(len(solids)), 2) for each in _of_two(solids, pair)]
    filled = {id(face) for each in found if not each.two_bores for face in each.faces}
    return [each for each in found if not each.two_bores or not any(id(face) in filled for face in each.faces)]


def _of_two(solids: Sequence[AssemblySolid], pair: tuple[int, int]) -> list[AssemblyJoint]:
    """The possible joints of two solids, one for each common axis or centre."""
    one, other = pair
    several: list[list[AssemblyJoint]] = []
    for a in solids[one].round_faces:
        for b in solids[other].round_faces:
            in_b = b.inward and not a.inward
            order, faces = ((other, one), (b, a)) if in_b else ((one, other), (a, b))
            if (met := _assembly_joint(solids, order, faces)) is None:
                continue
            same = next((group for group in several if _same_axis(group[0].faces[0], met.faces[0])), None)
            if same is None:
                several.append([met])
            else:
                same.append(met)
    return [_together(group) for group in several]


def _assembly_joint(
    solids: Sequence[AssemblySolid], pair: tuple[int, int], faces: tuple[CadFace, CadFace]
) -> AssemblyJoint | None:
    """The joint of two round faces, the first a hole; None if they do not meet."""
    hole, pin = faces
    if not hole.inward or not _fits(hole, pin):
        return None
    near = ASIDE * hole.radius + abs(hole.radius - pin.radius)
    if hole.kind == "sphere":
        met = not pin.inward and np.linalg.norm(pin.centre - hole.centre) <= near
        return AssemblyJoint(pair, faces, hole.centre, np.nan, (False, False)) if met else None
    share, middle = _overlap(hole, pin)
    least = -GAP * hole.radius if pin.inward else LEAST * min(hole.length, pin.length)
    if share < least or not _parallel(hole, pin) or _beside(hole, pin) > near:
        return None
    hidden = not pin.inward and any(each.inward and _same_axis(pin, each) for each in solids[pair[1]].round_faces)
    return AssemblyJoint(pair, faces, hole.centre + middle * hole.direction, share, (False, hidden))


def _fits(hole: CadFace, pin: CadFace) -> bool:
    """Whether a pin or ball fits a hole; two bores must have the same radius."""
    least, most = (1 - SAME, 1 + SAME) if pin.inward else (1 - PLAY, 1 + PRESS)
    return hole.kind == pin.kind and least * hole.radius <= pin.radius <= most * hole.radius


def _together(group: list[AssemblyJoint]) -> AssemblyJoint:
    """One joint for several on an axis, such as a fork's two eyes: the longest, in the middle of those of its radius."""
    longest = max(group, key=lambda each: 0.0 if each.ball else each.overlap)
    hole = longest.faces[0]
    alike = [each for each in group if abs(each.faces[0].radius - hole.radius) <= SAME * hole.radius]
    if longest.ball or len(alike) == 1:
        return longest
    along = np.array([(each.at - hole.centre) @ hole.direction for each in alike])
    half = np.array([max(each.overlap, 0) / 2 for each in alike])
    middle = ((along - half).min() + (along + half).max()) / 2
    return replace(longest, at=hole.centre + middle * hole.direction)


def _same_axis(a: CadFace, b: CadFace) -> bool:
    """Whether two cylinders have the same axis, or two balls the same centre."""
    if a.kind != b.kind:
        return False
    near = ASIDE * max(a.radius, b.radius)
    if a.kind == "sphere":
        return bool(np.linalg.norm(a.centre - b.centre) <= near)
    return _parallel(a, b) and _beside(a, b) <= near


def _parallel(a: CadFace, b: CadFace) -> bool:
    return bool(np.linalg.norm(np.cross(a.direction, b.direction)) <= SKEW)


def _beside(a: CadFace, b: CadFace) -> float:
    """Distance of the middle of one cylinder from the axis of another [m]."""
    return float(np.linalg.norm(np.cross(b.centre - a.centre, a.direction)))


def _overlap(a: CadFace, b: CadFace) -> tuple[float, float]:
    """Overlap of two cylinders on one axis, negative for a gap, and its middle from the centre of `a` [m]."""
    x = float((b.centre - a.centre) @ a.direction)
    low, high = max(-a.length, 2 * x - b.length) / 2, min(a.length, 2 * x + b.length) / 2
    return high - low, (low + high) / 2
