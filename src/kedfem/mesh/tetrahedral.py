"""Meshes of 10-node tetrahedra, curved onto the CAD model's faces, for solids that cannot be swept."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from types import ModuleType

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.mesh.cad.faces import joined_faces
from kedfem.mesh.cad.solids import MANY_UNKNOWNS, USUAL_ANGLE, CadFace, OtherMethodError, Sizing, Solid
from kedfem.mesh.cad.words import with_faces_in_words
from kedfem.mesh.concave_faces import finer_concave_faces, free_concave_faces
from kedfem.mesh.elements.hexahedra import SolidMesh
from kedfem.mesh.elements.quality import scaled_jacobian
from kedfem.mesh.elements.shape_functions import TET10, node_numbers
from kedfem.mesh.elements.tetrahedra import edge_middles, unfolded
from kedfem.mesh.session import GMSH_HEX27, GmshError, gmsh_errors_at_end, gmsh_options, numbered_nodes
from kedfem.mesh.swept.blocks import gmsh_hexahedra

_TET10 = 11  # gmsh's number of the 10-node tetrahedron
_REGULAR = 1 / (6 * np.sqrt(2))  # volume of a regular tetrahedron over the cube of its edge
# number of regular tetrahedra that fill a compact part without small features, with two elements across
_COUNT = 1200
_TURN = np.pi / 6  # angle of an element along a curved face, unless that makes it smaller than the least size
_FINEST = 4.0  # ratio of the size to the least size due to curvature
MOST_UNKNOWNS = 90_000  # above them concave faces are meshed coarser than asked for
_STEPS = 5  # most attempts with coarser elements
_COARSEST = 4.0  # largest factor by which elements become coarser, also those at curved faces
_BAD = 0.03  # scaled Jacobian below which curved elements are optimised or straightened, and other settings tried
_FEW = 0.02  # largest share of bad elements that optimisation can mend
#: gmsh's optimisation of curved elements takes minutes where it does not succeed.
_BRIEF: dict[str, float] = {"Mesh.HighOrderIterMax": 25, "Mesh.HighOrderPassMax": 5}


@dataclass(frozen=True, slots=True)
class Setting:
    """gmsh's settings for tetrahedra: its 2-D and its 3-D algorithm."""

    plane: int
    solid: int


#: Tried in turn: the usual setting, then others where gmsh fails or leaves flat elements.
SETTINGS = (Setting(6, 1), Setting(6, 10), Setting(5, 1), Setting(1, 4))


def tetrahedral_mesh(gmsh: ModuleType, solid: Solid, sizing: Sizing) -> SolidMesh:
    """tet10 mesh of any solid, a `Method`; it has the solid's faces, and det J > 0 is proven everywhere.

    Without a size there are `across` elements in twice the mean wall 2 V/A, which is the thickness of a plate, the
    radius of a rod or the wall of a tube, but at least about a thousand elements, and 12 to a circle as long as they
    are not finer than a quarter of the size. A part of more than 45,000 unknowns is then meshed coarser, step by step.
    Concave faces always have the fineness that `concave_angle` asks for.

    Raises
    ------
    OtherMethodError
        gmsh makes no valid tetrahedra under any setting.
    """
    failures: list[str] = []
    found: SolidMesh | None = None
    plain, taken, coarser = replace(sizing, concave_angle=USUAL_ANGLE), 1.0, 1.0
    for _ in range(_STEPS):
        mesh = _best_of_settings(gmsh, solid, plain, coarser, failures)
        if mesh is not None and (found is None or len(mesh.points) < len(found.points)):
            found, taken = mesh, coarser
        if sizing.size is not None or found is None or coarser >= _COARSEST:
            break
        ratio = (3 * len(found.points) / MANY_UNKNOWNS) ** 0.5
        if ratio <= 1:
            break
        coarser = min(coarser * np.clip(1.05 * ratio, 1.15, 2.0), _COARSEST)
    if found is not None:
        found = _with_concave_faces(gmsh, solid, sizing, (taken, found), failures)
    gmsh.model.mesh.clear()
    if found is None:
        reasons = "; ".join(dict.fromkeys(failures)) or "none at all"
        raise OtherMethodError(f"{solid.name}: gmsh makes no tetrahedra of it: {reasons}")
    return found


def _with_concave_faces(
    gmsh: ModuleType, solid: Solid, sizing: Sizing, usual: tuple[float, SolidMesh], failures: list[str]
) -> SolidMesh:
    """The mesh with concave faces as fine as asked for, and elsewhere as fine as the usual mesh.

    They are coarser where elements would be bad or, without a size, unknowns more than 90,000; `method` says so then.

    Parameters
    ----------
    usual : the factor by which the usual mesh is coarser than asked for, and that mesh
    """
    coarser, found = usual
    if not free_concave_faces(solid, sizing):
        return found
    least, angle = min(_BAD, _least_jacobian(found)), sizing.concave_angle
    while angle < USUAL_ANGLE:
        mesh = _best_of_settings(gmsh, solid, replace(sizing, concave_angle=angle), coarser, failures, MOST_UNKNOWNS)
        ratio = 1.0 if mesh is None or sizing.size is not None else 3 * len(mesh.points) / MOST_UNKNOWNS
        if mesh is not None and ratio <= 1 and _least_jacobian(mesh) >= least:
            found = mesh
            break
        angle *= max(1.2, ratio**0.5)
    if angle == sizing.concave_angle:
        return found
    words = "no finer" if angle >= USUAL_ANGLE else f"by {np.degrees(angle):.3g}° an element"
    return replace(found, method=f"{found.method}; fillets and free bores {words}, as others would be bad or too many")


def subdivided_mesh(gmsh: ModuleType, solid: Solid, sizing: Sizing) -> SolidMesh:
    """hex27 mesh of any solid, a `Method`: gmsh divides each tetrahedron into four hexahedra of poor quality."""
    size = 2 * tetrahedron_size(solid, sizing)
    numbers = _options(size, min(2 * _TURN, np.pi / 3), size / _FINEST, SETTINGS[0])
    gmsh.model.mesh.clear()
    try:
        with gmsh_options(gmsh, numbers | {"Mesh.SubdivisionAlgorithm": 2}), gmsh_errors_at_end(gmsh):
            gmsh.model.mesh.generate(3)
            gmsh.model.mesh.setOrder(2)
            gmsh.model.mesh.optimize("HighOrder")
    except GmshError as error:
        failures = "; ".join(_in_words(gmsh, error, solid.faces))
        raise OtherMethodError(f"{solid.name}: gmsh's subdivision gives no hexahedra: {failures}") from error
    kinds, _, nodes = gmsh.model.mesh.getElements(3, solid.tag)
    if list(kinds) != [GMSH_HEX27]:
        raise OtherMethodError(f"{solid.name}: gmsh's subdivision gives other elements than hexahedra")
    points, tags = numbered_nodes(gmsh)
    mesh = gmsh_hexahedra(gmsh, points, np.searchsorted(tags, nodes[0]).reshape(-1, 27))
    return replace(mesh, method=f"gmsh's subdivision of {len(mesh.cells) // 4:,} tetrahedra into four hexahedra each")


def tetrahedron_size(solid: Solid, sizing: Sizing) -> float:
    """Edge length [m] of the tetrahedra; see :func:`tetrahedral_mesh`."""
    if sizing.size is not None:
        return sizing.size
    width = max(2 * solid.volume / solid.area, (solid.volume / (_COUNT * _REGULAR)) ** (1 / 3))
    return float(2 * width / sizing.across)


def _best_of_settings(
    gmsh: ModuleType, solid: Solid, sizing: Sizing, coarser: float, failures: list[str], most: int = MANY_UNKNOWNS
) -> SolidMesh | None:
    """The first mesh that is good enough or has more than `most` unknowns, else the best one."""
    best: tuple[float, SolidMesh] | None = None
    for mesh in _tried(gmsh, solid, sizing, coarser, failures):
        least = _least_jacobian(mesh)
        if best is None or least > best[0]:
            best = least, mesh
        if best[0] >= _BAD or (sizing.size is None and 3 * len(mesh.points) > most):
            break
    return best and best[1]


def _least_jacobian(mesh: SolidMesh) -> float:
    return float(scaled_jacobian(mesh.points, mesh.cells).min())


def _tried(gmsh: ModuleType, solid: Solid, sizing: Sizing, coarser: float, failures: list[str]) -> Iterator[SolidMesh]:
    """The valid meshes of gmsh's tetrahedra, under one setting after the other."""
    size = coarser * tetrahedron_size(solid, sizing)
    turn = min(_TURN * coarser, np.pi / 3) * min(1.0, sizing.angle / USUAL_ANGLE)
    finest = size * min(1.0, coarser / _FINEST)
    for setting in SETTINGS:
        numbers = _options(size, turn, finest, setting)
        with gmsh_options(gmsh, numbers), finer_concave_faces(gmsh, solid, sizing, turn, finest):
            mesh = _generated(gmsh, solid, failures)
        if mesh is not None:
            yield mesh


def _options(size: float, turn: float, finest: float, setting: Setting) -> dict[str, float]:
    """gmsh's options for tetrahedra of a size; `turn` is their angle along a curved face, `finest` their least size."""
    return {
        "Mesh.MeshSizeMax": size, "Mesh.MeshSizeMin": finest,
        "Mesh.MeshSizeFromCurvature": float(np.ceil(2 * np.pi / turn - 1e-9)), "Mesh.MeshSizeFromPoints": 0,
        "Mesh.MeshSizeExtendFromBoundary": 1, "Mesh.Algorithm": setting.plane,
        "Mesh.Algorithm3D": setting.solid, "Mesh.Optimize": 1, "Mesh.OptimizeNetgen": int(setting.solid == 1),
        "Mesh.RecombineAll": 0, "Mesh.SubdivisionAlgorithm": 0, "Mesh.ElementOrder": 1,
        "Mesh.SecondOrderLinear": 0, "Mesh.SecondOrderIncomplete": 0, "Mesh.HighOrderOptimize": 0,
    }  # fmt: skip


def _in_words(gmsh: ModuleType, error: GmshError, faces: Sequence[CadFace]) -> list[str]:
    """gmsh's errors, with descriptions of faces."""
    failed = [tag for dim, tag in gmsh.model.mesh.getLastEntityError() if dim == 2]
    return [with_faces_in_words(line, faces, failed) for line in error.lines]


def _generated(gmsh: ModuleType, solid: Solid, failures: list[str]) -> SolidMesh | None:
    """A mesh under gmsh's present settings, or None; its errors are appended to `failures`."""
    gmsh.model.mesh.clear()
    try:
        with gmsh_errors_at_end(gmsh):
            gmsh.model.mesh.generate(3)
        with gmsh_errors_at_end(gmsh):
            gmsh.model.mesh.setOrder(2)
        points, cells = _tetrahedra(gmsh, solid)
        if _worth_optimising(points, cells):
            with gmsh_options(gmsh, _BRIEF), gmsh_errors_at_end(gmsh):
                gmsh.model.mesh.optimize("HighOrder")
            points, cells = _tetrahedra(gmsh, solid)
    except GmshError as error:
        failures += _in_words(gmsh, error, solid.faces)
        return None
    _, ranked = numbered_nodes(gmsh)
    sides = {face.tag: _sides(gmsh, face.tag, ranked) for face in solid.faces}
    if not len(cells) or not sides:
        return None
    straightened = unfolded(points, cells, _BAD)
    if straightened is None:
        failures.append("flat elements")
        return None
    used, numbers = np.unique(cells, return_inverse=True)
    faces = joined_faces(gmsh, solid, {tag: np.searchsorted(used, each) for tag, each in sides.items()})
    method = f"{len(cells):,} tetrahedra of 10 nodes"
    return SolidMesh(straightened[used], numbers.reshape(cells.shape), faces, method)


def _worth_optimising(points: Float[np.ndarray, "n 3"], cells: Int[np.ndarray, "e 10"]) -> bool:
    """Whether a few elements are bad, and only because they are curved."""
    bad = cells[scaled_jacobian(points, cells) < _BAD]
    if not len(bad) or len(bad) > _FEW * len(cells):
        return False
    straight = points.copy()
    straight[bad[:, 4:]] = edge_middles(points, bad)
    return bool(scaled_jacobian(straight, bad).min() > _BAD)


def _tetrahedra(gmsh: ModuleType, solid: Solid) -> tuple[Float[np.ndarray, "n 3"], Int[np.ndarray, "e 10"]]:
    """Nodes and cells of the second-order tetrahedra in gmsh's model, in VTK's order."""
    points, ranked = numbered_nodes(gmsh)
    kinds, _, nodes = gmsh.model.mesh.getElements(3, solid.tag)
    if list(kinds) != [_TET10]:
        return points, np.zeros((0, 10), dtype=np.int64)
    theirs = np.reshape(gmsh.model.mesh.getElementProperties(_TET10)[4], (-1, 3))
    order = node_numbers(np.round(theirs, 6), TET10)
    return points, np.searchsorted(ranked, nodes[0]).reshape(-1, 10)[:, order]


def _sides(gmsh: ModuleType, face: int, ranked: Int[np.ndarray, " n"]) -> Int[np.ndarray, "f 3"]:
    """Corners of the triangles on a face, among gmsh's numbers of nodes in rising order."""
    kinds, _, nodes = gmsh.model.mesh.getElements(2, face)
    if not len(kinds):
        return np.zeros((0, 3), dtype=np.int64)
    return np.asarray(np.searchsorted(ranked, nodes[0]).reshape(-1, 6)[:, :3])
