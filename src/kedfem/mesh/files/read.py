"""Meshes of tetrahedra and hexahedra from files, with their named sets of sides and nodes as faces."""

from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from kedfem.arrays import Float, Int
from kedfem.errors import MeshError
from kedfem.mesh.cad.forms import Sample, fitted_form
from kedfem.mesh.cad.sides import boundary_sides, side_corners, side_normals
from kedfem.mesh.elements.hexahedra import CELL_TYPES, Face, SolidMesh, without_unused_nodes
from kedfem.mesh.elements.mixed import one_kind, triangles
from kedfem.mesh.files.raw import CORNERS, RawMesh, read_mesh
from kedfem.mesh.isolated import MESH_FILE, READING, in_own_process
from kedfem.scene.questions.geometry_files import with_named
from kedfem.scene.records.shapes import MESH_ENDINGS
from kedfem.store import contents, itself, kept

#: Number of nodes of the solid cells that are accepted.
_ACCEPTED = {name: nodes for nodes, name in CELL_TYPES.items()} | {
    "wedge": 6, "wedge15": 15, "wedge18": 18, "pyramid": 5, "pyramid13": 13, "pyramid14": 14,
}  # fmt: skip
# of nodes, in sizes of the group: files may have few digits, and chords are not a circle
_ACCURACY = 2e-3
_SKEW = 0.05  # of the sides' normals: a sine


def mesh_from_file(where: str, path: Path, scale: float) -> SolidMesh:
    """The tetrahedra or hexahedra of a mesh file, without nodes that none of them uses.

    Parameters
    ----------
    where : the key that names the file, for messages
    path : of one of MESH_ENDINGS. Points and lines in it are ignored; sets of sides on the surface (physical groups,
        sets of elements and surfaces) and sets of nodes become the mesh's `faces`. Cells of several kinds become
        10-node tetrahedra, hexahedra of several orders 20-node ones.
    scale : length of the file's unit [m]

    Raises
    ------
    MeshError
        No such file, not readable, other cells, coordinates that are not finite, nodes that do not exist, several
        pieces that share no nodes.
    """
    raw = raw_of_file(where, path)
    points = np.asarray(raw.points, dtype=float)
    if points.ndim != 2 or points.shape[1] != 3:
        raise MeshError(f"{where}: must have nodes of three coordinates, got shape {points.shape} in {path}")
    _check_cells(where, path, raw, points)
    points, cells = _cells(where, path, raw, scale * points)
    mesh = without_unused_nodes(SolidMesh(points, cells, named_faces(raw, points, cells)))
    pieces = _pieces(mesh)
    if pieces > 1:
        raise MeshError(
            f"{where}: must be one piece, got {pieces} pieces that share no nodes in {path}; "
            "merge nodes that lie on each other, or make each piece a link"
        )
    return mesh


def raw_of_file(where: str, path: Path) -> RawMesh:
    """The contents of a file, read in a process of its own and kept between runs."""
    wanted = f"must be a mesh file ({', '.join(MESH_ENDINGS)})"
    if not path.is_file():
        raise MeshError(f"{where}: {wanted}, got {'a folder' if path.is_dir() else 'nothing'} at {path}")
    if path.suffix.lower() not in MESH_ENDINGS:
        raise MeshError(f"{where}: {wanted}, got {path}")
    key = sha256(path.suffix.lower().encode() + contents(with_named(path))).hexdigest()

    def read() -> RawMesh:
        try:
            return in_own_process(f"{where}: {path}", MESH_FILE, READING, read_mesh, path)
        except MeshError as error:
            if str(error).startswith(where):
                raise
            raise MeshError(f"{where}: must be a mesh file that can be read, got {path}: {error}") from None

    raw: RawMesh = kept("mesh file", key, read, itself, itself)
    return raw


def _check_cells(where: str, path: Path, raw: RawMesh, points: np.ndarray) -> None:
    """Refuse cells that are not solid, nodes that do not exist, and coordinates that are not finite."""
    found = {kind: len(cells) for kind, cells in raw.cells.items() if len(cells)} | raw.others
    wrong = [kind for kind in found if kind not in _ACCEPTED or raw.cells[kind].shape[1] != _ACCEPTED[kind]]
    if wrong or not found:
        got = ", ".join(f"{count} {kind}" for kind, count in sorted(found.items())) or "no solid elements"
        wanted = "must hold tetrahedra, hexahedra, wedges or pyramids of order 1 or 2"
        raise MeshError(f"{where}: {wanted}, got {got} in {path}")
    for cells in raw.cells.values():
        if cells.size and (cells.min() < 0 or cells.max() >= len(points)):
            got = f"got node {cells.min() if cells.min() < 0 else cells.max()} in {path}"
            raise MeshError(f"{where}: elements must use nodes 0 to {len(points) - 1}, {got}")
        used = np.unique(cells)
        if not np.isfinite(points[used]).all():
            bad = used[~np.isfinite(points[used]).all(axis=1)][0]
            got = f"got {points[bad].tolist()} at node {bad} of {path}"
            raise MeshError(f"{where}: coordinates must be finite, {got}")


def _cells(where: str, path: Path, raw: RawMesh, points: np.ndarray) -> tuple[np.ndarray, Int[np.ndarray, "e k"]]:
    """The nodes, and the cells converted to one kind."""
    blocks = {kind: cells for kind, cells in raw.cells.items() if len(cells)}
    if len(blocks) == 1 and (kind := next(iter(blocks))) in CELL_TYPES.values():
        return points, blocks[kind]
    by_corners: dict[int, list[np.ndarray]] = {}
    for kind, cells in blocks.items():
        by_corners.setdefault(CORNERS[kind.rstrip("0123456789")], []).append(cells)
    try:
        return one_kind(points, by_corners)
    except MeshError as error:
        raise MeshError(f"{where}: {error}, in {path}") from None


def _pieces(mesh: SolidMesh) -> int:
    """Number of groups of elements that share no nodes."""
    n, (e, k) = len(mesh.points), mesh.cells.shape
    incidence = sp.csr_array((np.ones(e * k), mesh.cells.ravel(), np.arange(0, e * k + 1, k)), shape=(e, n))
    graph = sp.block_array([[None, incidence], [incidence.T, None]])
    return int(connected_components(graph, directed=False)[0])


def named_faces(raw: RawMesh, points: Float[np.ndarray, "n 3"], cells: Int[np.ndarray, "e k"]) -> tuple[Face, ...]:
    """The sets of sides and nodes of a mesh file as faces on the surface of its elements, in the order of their names.

    A set of nodes has the sides all of whose corners are in it. Sets without a side on the surface are left out.

    Parameters
    ----------
    points : (n, 3) all nodes, those of the file first [m]
    cells : (e, 8), (e, 20), (e, 27), (e, 4) or (e, 10) the elements; their corners have the file's numbers
    """
    sides = boundary_sides(cells)
    corners = np.sort(sides[:, : side_corners(sides.shape[1])], axis=1)
    keys = {tuple(each): i for i, each in enumerate(corners.tolist())}
    faces = []
    for name, found in _sets(raw, corners):
        on = {keys.get(tuple(each), -1) for each in np.sort(found, axis=1).tolist()} - {-1}
        if on:
            faces.append(group_face(name, points, sides[sorted(on)]))
    return tuple(faces)


def group_face(name: str, points: Float[np.ndarray, "n 3"], sides: Int[np.ndarray, "f m"]) -> Face:
    """The face that some element sides form; its geometry is fitted to their nodes and normals.

    Parameters
    ----------
    sides : (f, 4), (f, 8), (f, 9), (f, 3) or (f, 6) nodes of the sides, in the order of quad9 or tri6, seen from
        outside
    """
    places, normals, areas = side_normals(points, sides)
    form = fitted_form(Sample(points[np.unique(sides)], places, normals), _ACCURACY, _SKEW)
    centroid = areas @ places / areas.sum()
    centre = centroid if form.kind in ("plane", "other") else form.centre
    return Face(
        name, form.kind, centre, form.direction, form.radius, form.inward,
        sides[:, : side_corners(sides.shape[1])],
    )  # fmt: skip


def _sets(raw: RawMesh, corners: Int[np.ndarray, "f c"]) -> Iterator[tuple[str, Int[np.ndarray, "q c"]]]:
    """Name of each set and corners of its sides, as triangles where the elements are tetrahedra."""
    count = corners.shape[1]
    for name in sorted(raw.sides.keys() | raw.nodes.keys()):
        if name in raw.sides:
            each = [triangles(x) if (count, x.shape[1]) == (3, 4) else x for x in raw.sides[name]]
            fitting = [x for x in each if x.shape[1] == count]
            if fitting:
                yield name, np.concatenate(fitting)
        else:
            yield name, corners[np.isin(corners, raw.nodes[name]).all(axis=1)]
