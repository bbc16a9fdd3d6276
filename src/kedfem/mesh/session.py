"""The session with gmsh: models, options, and what is read from them."""

import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import combinations
from pathlib import Path
from types import ModuleType

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from kedfem.arrays import Float, Int
from kedfem.errors import MeshError

#: Debian packages that hold the shared libraries that gmsh's wheel links to.
SYSTEM_PACKAGES = {
    "libGLU.so.1": "libglu1-mesa", "libGL.so.1": "libgl1", "libXrender.so.1": "libxrender1",
    "libXcursor.so.1": "libxcursor1", "libXfixes.so.3": "libxfixes3", "libXext.so.6": "libxext6",
    "libXft.so.2": "libxft2", "libfontconfig.so.1": "libfontconfig1", "libXinerama.so.1": "libxinerama1",
    "libX11.so.6": "libx11-6", "libgomp.so.1": "libgomp1",
}  # fmt: skip
QUAD4, GMSH_HEX27 = 3, 12  # gmsh's numbers of the 4-node quadrilateral and of the 27-node hexahedron
_one_at_a_time = threading.RLock()


@contextmanager
def gmsh_model() -> Iterator[ModuleType]:
    """gmsh with an empty model: silent, deterministic, on one thread, independent of the user's gmsh settings.

    The model is removed at the end; gmsh is closed if it was opened here. Python handles Ctrl-C; any thread may call,
    one at a time.

    Raises
    ------
    MeshError
        gmsh or one of its system libraries is missing.
    """
    gmsh = _gmsh()
    with _one_at_a_time:
        opened_here = not gmsh.isInitialized()
        if opened_here:
            gmsh.initialize(readConfigFiles=False, interruptible=False)
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("General.NumThreads", 1)
        gmsh.model.add("kedfem")
        try:
            yield gmsh
        finally:
            gmsh.model.remove()
            if opened_here:
                gmsh.finalize()


@contextmanager
def gmsh_copy(gmsh: ModuleType, factor: float) -> Iterator[ModuleType]:
    """gmsh with a copy of the current model's shapes in another model, all lengths times a factor.

    Planes stay planes and circles circles; OpenCASCADE's tolerances are absolute, so shapes should be of size 1.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = str(Path(folder) / "shapes.brep")
        gmsh.write(file)
        with gmsh_model() as other:
            with gmsh_options(other, {"Geometry.OCCScaling": factor}):
                other.model.occ.importShapes(file)
            other.model.occ.synchronize()
            yield other


@contextmanager
def gmsh_options(gmsh: ModuleType, options: dict[str, float]) -> Iterator[None]:
    """Set options of gmsh within the context; they apply to all models of a session."""
    before = {name: gmsh.option.getNumber(name) for name in options}
    try:
        for name, value in options.items():
            gmsh.option.setNumber(name, value)
        yield
    finally:
        for name, value in before.items():
            gmsh.option.setNumber(name, value)


class GmshError(Exception):
    """Errors that gmsh reported while it made a mesh, line by line."""

    def __init__(self, lines: Sequence[str]) -> None:
        super().__init__("; ".join(lines))
        self.lines = tuple(lines)


@contextmanager
def gmsh_errors_at_end(gmsh: ModuleType) -> Iterator[None]:
    """gmsh goes on after errors in the block, in which it makes a mesh; they are raised at its end.

    Else gmsh would stay locked by the first one: it would make no other mesh in this process, without a word.

    Raises
    ------
    GmshError
        gmsh reported errors.
    """
    gmsh.logger.start()
    other: list[str] = []
    try:
        with gmsh_options(gmsh, {"General.AbortOnError": 0}):
            yield
    except Exception as error:
        if type(error) is not Exception:  # gmsh raises nothing more special
            raise
        other = [str(error)]
    finally:
        lines = [line.partition(":")[2].strip() for line in gmsh.logger.get() if line.startswith("Error")]
        gmsh.logger.stop()
    if lines or other:
        raise GmshError(lines or other)


def boundary(gmsh: ModuleType, dimension: int, *tags: int) -> set[int]:
    """Tags of the entities that bound some others: faces of solids, edges of faces, ends of edges."""
    entities = [(dimension, tag) for tag in tags]
    return {abs(int(tag)) for _, tag in gmsh.model.getBoundary(entities, combined=False, oriented=False)}


def connected_groups(
    bounds: Sequence[set[int]], alike: Callable[[int, int], bool] = lambda one, other: True
) -> list[list[int]]:
    """Connected groups of entities: neighbours share a part of their boundaries and are `alike`."""
    owners: dict[int, list[int]] = {}
    for i, own in enumerate(bounds):
        for tag in own:
            owners.setdefault(tag, []).append(i)
    pairs = {pair for several in owners.values() for pair in combinations(several, 2)}
    ends = np.array([pair for pair in pairs if alike(*pair)], int).reshape(-1, 2).T
    graph = sp.coo_array((np.ones(ends.shape[1]), tuple(ends)), shape=(len(bounds), len(bounds)))
    label = connected_components(graph, directed=False)[1]
    return [np.flatnonzero(label == k).tolist() for k in range(label.max(initial=-1) + 1)]


def quadrilaterals(gmsh: ModuleType) -> tuple[Float[np.ndarray, "n 2"], Int[np.ndarray, "e 4"]] | None:
    """Nodes and cells of the plane mesh in gmsh's model; None if it has triangles."""
    kinds, _, nodes = gmsh.model.mesh.getElements(2)
    if list(kinds) != [QUAD4]:
        return None
    points, tags = numbered_nodes(gmsh)
    used, cells = np.unique(nodes[0], return_inverse=True)
    return points[np.searchsorted(tags, used), :2], cells.reshape(-1, 4)


def numbered_nodes(gmsh: ModuleType) -> tuple[Float[np.ndarray, "n 3"], Int[np.ndarray, " n"]]:
    """Nodes of the mesh in gmsh's model in the order of gmsh's numbers [m], and these numbers."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    order = np.argsort(tags)
    return coordinates.reshape(-1, 3)[order], tags[order].astype(np.int64)


def _gmsh() -> ModuleType:
    """The module gmsh; a MeshError that says what to install if it does not load."""
    try:
        import gmsh
    except ModuleNotFoundError as error:
        raise MeshError("gmsh: must be installed to mesh this shape (pip install gmsh), got none") from error
    except OSError as error:
        raise MeshError(_missing_library(str(error))) from error
    return gmsh  # type: ignore[no-any-return]


def _missing_library(message: str) -> str:
    """The message if gmsh's shared library does not load: what to install."""
    missing = [package for library, package in SYSTEM_PACKAGES.items() if library in message]
    others = sorted(set(SYSTEM_PACKAGES.values()) - set(missing))
    return (
        f"gmsh: must find its system libraries, got: {message}; "
        f"on Debian or Ubuntu: apt-get install {' '.join(missing + others)}"
    )
