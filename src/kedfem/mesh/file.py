"""Meshes of hexahedra or tetrahedra from files, through meshio."""

import contextlib
import io
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from jaxtyping import Int
from scipy.sparse.csgraph import connected_components

from kedfem.errors import MeshError
from kedfem.mesh.groups import named_faces
from kedfem.mesh.hexahedra import CELL_TYPES, SolidMesh, without_spare_nodes

_ACCEPTED = tuple(CELL_TYPES.values())


def mesh_from_file(where: str, path: Path, scale: float) -> SolidMesh:
    """The hexahedra or tetrahedra of a mesh file, nodes that none of them uses left out.

    Parameters
    ----------
    where : str
        What the file is for, for messages.
    path : Path
        Any format that meshio reads. Points and lines in it are passed over; groups of quadrilaterals or triangles on
        the outside (physical groups of gmsh, sets of cells) become the mesh's `faces`.
    scale : float [m]
        Length of the file's unit.

    Raises
    ------
    MeshError
        No such file, not readable, other cells than hexahedra or tetrahedra of one kind, coordinates that are not finite,
        nodes that do not exist, several pieces that share no nodes.
    """
    raw = _read(where, path)
    cells = _solid_cells(where, path, raw)
    points = np.asarray(raw.points, dtype=float)
    if points.ndim != 2 or points.shape[1] != 3:
        raise MeshError(f"{where}: nodes must have three coordinates, got shape {points.shape} in {path}")
    if cells.size and (cells.min() < 0 or cells.max() >= len(points)):
        raise MeshError(
            f"{where}: elements must use nodes 0 to {len(points) - 1}, got node "
            f"{cells.min() if cells.min() < 0 else cells.max()} in {path}"
        )
    used = np.unique(cells)
    if not np.isfinite(points[used]).all():
        bad = used[~np.isfinite(points[used]).all(axis=1)][0]
        raise MeshError(
            f"{where}: coordinates must be finite, got {points[bad].tolist()} at node {bad} of {path}"
        )
    faces = named_faces(raw, scale * points, cells)
    mesh = without_spare_nodes(SolidMesh(scale * points, cells, faces))
    pieces = _pieces(mesh)
    if pieces > 1:
        raise MeshError(
            f"{where}: must be one piece, got {pieces} pieces that share no nodes in {path}; "
            "merge nodes that lie on each other, or make each piece a link"
        )
    return mesh


def _read(where: str, path: Path) -> Any:
    """What meshio makes of the file; whatever it raises, prints or exits with becomes a MeshError."""
    if not path.is_file():
        raise MeshError(
            f"{where}: must be a mesh file, got {'a folder' if path.is_dir() else 'nothing'} at {path}"
        )
    import meshio

    spoken = io.StringIO()
    try:
        with (
            warnings.catch_warnings(),
            contextlib.redirect_stdout(spoken),
            contextlib.redirect_stderr(spoken),
        ):
            warnings.simplefilter("ignore")
            return meshio.read(path)
    except (Exception, SystemExit) as error:  # each of its readers fails in its own way
        reason = " ".join((str(error) if not isinstance(error, SystemExit) else spoken.getvalue()).split())
        raise MeshError(
            f"{where}: must be a mesh file that meshio can read, got {path}: {reason or type(error).__name__}"
        ) from error


def _solid_cells(where: str, path: Path, raw: Any) -> Int[np.ndarray, "e k"]:
    """The cells of the one kind of hexahedra or tetrahedra in a file."""
    found: dict[str, int] = {}
    for block in raw.cells:
        if block.dim == 3:
            found[block.type] = found.get(block.type, 0) + len(block.data)
    if len(found) == 1 and (kind := next(iter(found))) in _ACCEPTED and found[kind]:
        try:
            return np.concatenate([block.data for block in raw.cells if block.type == kind]).astype(np.int64)
        except (OverflowError, ValueError, TypeError):
            wanted = "must number its nodes with whole numbers of at most 18 digits"
            raise MeshError(f"{where}: {wanted}, got others in {path}") from None
    got = ", ".join(f"{count} {kind}" for kind, count in sorted(found.items())) or "no solid elements"
    raise MeshError(f"{where}: must hold elements of one kind ({', '.join(_ACCEPTED)}), got {got} in {path}")


def _pieces(mesh: SolidMesh) -> int:
    """Number of groups of elements that share no nodes."""
    n, (e, k) = len(mesh.points), mesh.cells.shape
    incidence = sp.csr_array((np.ones(e * k), mesh.cells.ravel(), np.arange(0, e * k + 1, k)), shape=(e, n))
    graph = sp.block_array([[None, incidence], [incidence.T, None]])
    return int(connected_components(graph, directed=False)[0])
