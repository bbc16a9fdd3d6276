"""Any solid by hexahedra: gmsh's tetrahedra, each cut into four, relaxed where they are bad."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from types import ModuleType

import numpy as np
from jaxtyping import Int

from kedfem.mesh.bounds import valid_everywhere
from kedfem.mesh.cad.solids import OtherWayError, Sizing, Solid
from kedfem.mesh.cut.cad_surface import CadSurface
from kedfem.mesh.cut.centring import centred
from kedfem.mesh.cut.tetrahedra import Subdivision, Tetrahedra, subdivision
from kedfem.mesh.cut.unfolding import unfolded
from kedfem.mesh.hexahedra import HexMesh
from kedfem.mesh.quality import mesh_quality, scaled_jacobian
from kedfem.mesh.session import gmsh_options, numbered_nodes

_REGULAR = 1 / (6 * np.sqrt(2))  # volume of a regular tetrahedron over the cube of its edge
_COUNT = 1000  # regular tetrahedra that fill a part with no small features, at two hexahedra across

_BUDGET = 2000  # tetrahedra from which a part without a given size is meshed coarser, at two hexahedra across
_MOST = 30_000  # tetrahedra, about a million nodes: beyond it a given size is refused
_TURN = np.pi / 4  # most that a tetrahedron's edge turns, where the least size lets it
_FINEST = 2.5  # the size over the least size that curvature asks for
_WANTED = 0.15  # scaled Jacobian below which elements are relaxed
_OTHERWISE = (0.2, 0.11, 0.17)  # what else is wanted in turn, where single elements are stuck
_GOOD = 0.1  # scaled Jacobian that is good enough: no other setting is tried
_HOPELESS = (
    60  # elements below _GOOD before relaxation, or _SHARE of all, from which another setting is tried first
)
_SHARE = 0.002


@dataclass(frozen=True, slots=True)
class Setting:
    """One way to let gmsh make tetrahedra: 2-D and 3-D algorithm, optimisation by Netgen; relative size and turn."""

    name: str
    plane: int
    solid: int
    netgen: bool
    size: float = 1.0
    turn: float = 1.0


SETTINGS = (
    Setting("Delaunay", 6, 1, True),
    Setting("HXT", 6, 10, False),
    Setting("Delaunay, finer", 6, 1, True, 0.8, 0.75),
    Setting("Delaunay on a Delaunay surface, finer", 5, 1, True, 0.8, 0.75),
    Setting("Delaunay, much finer", 6, 1, True, 0.65, 0.6),
)


def tetrahedron_size(solid: Solid, sizing: Sizing) -> float:
    """Edge length [m] of the tetrahedra: two edges of hexahedra.

    Without a size in `sizing`: `across` hexahedra across 2 V/A, which is the thickness of a plate, the radius of a
    rod and the wall of a tube; but not more than fill the solid's volume with 1,000 regular tetrahedra (for across
    2; in proportion to its cube).
    """
    if sizing.size is not None:
        return 2 * sizing.size
    width = max(2 * solid.volume / solid.area, (solid.volume / (_COUNT * _REGULAR)) ** (1 / 3))
    return float(2 * width / sizing.across)


def subdivided_mesh(gmsh: ModuleType, solid: Solid, sizing: Sizing) -> HexMesh:
    """hex27 mesh of a solid of any form, boundary nodes on the CAD model's faces and curves.

    Curved faces have edges of hexahedra that turn at most `sizing.turn` and 22.5°, but not shorter than
    0.4 of the size; a circle has at least 14.

    Parameters
    ----------
    gmsh : module
        With the solid in its model, which stays there.
    solid : Solid
        The solid.
    sizing : Sizing
        How fine; see :func:`tetrahedron_size`. Without a size, a part with many small features is made coarser, up to
        one and a half times, until 2,000 tetrahedra do (for across 2), unless single elements stay bad.

    Returns
    -------
    HexMesh
        Of the meshes tried the one with the best worst element; elements are valid everywhere.

    Raises
    ------
    OtherWayError
        gmsh makes no tetrahedra of the solid, or too many, or elements stay inverted; what it said, where.
    """
    said: list[str] = []
    best: tuple[float, HexMesh] | None = None
    aside: list[tuple[int, Attempt]] = []
    for attempt in _attempts(gmsh, solid, sizing, said):
        mesh = attempt.hexahedra.mesh
        bad = int((scaled_jacobian(mesh.points, mesh.cells) < _GOOD).sum())
        if bad > max(_HOPELESS, _SHARE * len(mesh.cells)):
            aside.append((bad, attempt))
            continue
        found = _hexahedra(gmsh, attempt)
        best = found if best is None else max(best, found, key=lambda mesh: mesh[0])
        if best[0] >= _GOOD:
            break
    else:
        if aside and (best is None or best[0] <= 0):
            best = _hexahedra(gmsh, min(aside, key=lambda each: each[0])[1])
    gmsh.model.mesh.clear()
    if best is None:
        raise OtherWayError(
            f"gmsh makes no tetrahedra of it: {'; '.join(dict.fromkeys(said)) or 'none at all'}"
        )
    return _valid(*best)


@dataclass(frozen=True, slots=True)
class Attempt:
    """What gmsh made under a setting, of that size [m], as it is cut."""

    setting: Setting
    size: float
    hexahedra: Subdivision


def _attempts(gmsh: ModuleType, solid: Solid, sizing: Sizing, said: list[str]) -> Iterator[Attempt]:
    """gmsh's tetrahedra under one setting after the other, where it makes any."""
    size = tetrahedron_size(solid, sizing)
    _require_few(int(solid.volume / (_REGULAR * size**3)))
    tetrahedra, coarse = _affordable(gmsh, solid, sizing, said)
    if tetrahedra is not None:
        _require_few(len(tetrahedra.cells))
        yield Attempt(SETTINGS[0], coarse, subdivision(tetrahedra))
    for setting in SETTINGS[int(coarse == size) :]:
        tetrahedra = _tetrahedra(gmsh, solid, sizing, size * setting.size, setting, said)
        if tetrahedra is not None:
            _require_few(len(tetrahedra.cells))
            yield Attempt(setting, size, subdivision(tetrahedra))


def _valid(least: float, mesh: HexMesh) -> HexMesh:
    """The mesh itself, if no element is inverted anywhere."""
    if least <= 0:
        x, y, z = mesh_quality(mesh).centre
        raise OtherWayError(
            f"elements stay inverted: scaled Jacobian {least:.3g} at ({x:.6g}, {y:.6g}, {z:.6g}) at best"
        )
    return mesh


def _affordable(
    gmsh: ModuleType, solid: Solid, sizing: Sizing, said: list[str]
) -> tuple[Tetrahedra | None, float]:
    """gmsh's tetrahedra under the first setting, coarser if they are too many and no size is given; their size."""
    size = tetrahedron_size(solid, sizing)
    largest = 1.5 * size
    budget = _BUDGET * (sizing.across / 2) ** 3
    while True:
        tetrahedra = _tetrahedra(gmsh, solid, sizing, size, SETTINGS[0], said)
        count = 0 if tetrahedra is None else len(tetrahedra.cells)
        if sizing.size is not None or count <= 1.15 * budget or size >= 0.999 * largest:
            return tetrahedra, size
        size = min(largest, size * max(1.1, (count / budget) ** (1 / 3)))


def _require_few(count: int) -> None:
    """Refusal of a mesh that cannot be afforded."""
    if count > _MOST:
        raise OtherWayError(
            f"it takes {count} tetrahedra, at most {_MOST} are affordable; a larger size is needed"
        )


def _hexahedra(gmsh: ModuleType, attempt: Attempt) -> tuple[float, HexMesh]:
    """The hexahedra of tetrahedra, relaxed, and the worst scaled Jacobian."""
    mesh = attempt.hexahedra.mesh
    surface = CadSurface(gmsh, attempt.hexahedra, reach=0.3 * attempt.size)
    points, _ = surface.settled(np.arange(len(mesh.points)), mesh.points)
    with np.errstate(over="ignore", invalid="ignore"):  # trial steps may go far astray; they are not taken
        for wanted in (_WANTED, *_OTHERWISE):
            points = unfolded(points, mesh.cells, surface.settled, wanted)
            if scaled_jacobian(points, mesh.cells).min() >= _GOOD:
                break
    points = centred(points, mesh.cells, surface.settled, _WANTED)
    way = (
        f"each of {len(mesh.cells) // 4} tetrahedra in four hexahedra; gmsh {attempt.setting.name}, optimised"
    )
    mesh = replace(mesh, points=points, way=way)
    least = mesh_quality(mesh).least
    return least if valid_everywhere(mesh.points, mesh.cells).all() else min(least, 0.0), mesh


def _tetrahedra(
    gmsh: ModuleType, solid: Solid, sizing: Sizing, size: float, setting: Setting, said: list[str]
) -> Tetrahedra | None:
    """gmsh's second-order tetrahedra under one setting, or None; its errors go to `said`."""
    numbers = {
        "Mesh.MeshSizeMax": size,
        "Mesh.MeshSizeMin": size / _FINEST,
        "Mesh.MeshSizeFromCurvature": np.ceil(
            2 * np.pi / (setting.turn * min(2 * sizing.turn, _TURN)) - 1e-9
        ),
        "Mesh.MeshSizeFromPoints": 0,
        "Mesh.MeshSizeExtendFromBoundary": 1,
        "Mesh.Algorithm": setting.plane,
        "Mesh.Algorithm3D": setting.solid,
        "Mesh.Optimize": 1,
        "Mesh.OptimizeNetgen": int(setting.netgen),
        "Mesh.RecombineAll": 0,
        "Mesh.SubdivisionAlgorithm": 0,
        "Mesh.ElementOrder": 1,
    }
    gmsh.model.mesh.clear()
    gmsh.logger.start()
    try:
        with gmsh_options(gmsh, numbers):
            gmsh.model.mesh.generate(3)
            gmsh.model.mesh.setOrder(2)
            return _read(gmsh, solid.tag)
    except Exception as error:  # noqa: BLE001  (gmsh raises nothing more special)
        said += [
            line.partition(":")[2].strip() for line in gmsh.logger.get() if line.startswith("Error")
        ] or [str(error)]
        return None
    finally:
        gmsh.logger.stop()


def _read(gmsh: ModuleType, solid: int) -> Tetrahedra | None:
    """The second-order tetrahedra in gmsh's model; None if there are none, or others."""
    points, ranked = numbered_nodes(gmsh)

    def corners(dim: int, tag: int, nodes: int, used: int) -> Int[np.ndarray, "_ k"]:
        _, _, found = gmsh.model.mesh.getElements(dim, tag)
        flat = np.searchsorted(ranked, found[0]) if len(found) == 1 else np.zeros(0, dtype=np.int64)
        return np.asarray(flat.reshape(-1, nodes)[:, :used], dtype=np.int64)

    cells = corners(3, solid, 10, 10)
    if len(cells) == 0:
        return None
    faces = [tag for _, tag in gmsh.model.getBoundary([(3, solid)], oriented=False)]
    sides = {tag: corners(2, tag, 6, 3) for tag in faces}
    bounds = gmsh.model.getBoundary([(2, tag) for tag in faces], combined=False, oriented=False)
    rims = {tag: corners(1, tag, 3, 2) for tag in dict.fromkeys(tag for _, tag in bounds)}
    return Tetrahedra(points, cells, sides, {tag: edges for tag, edges in rims.items() if len(edges)})
