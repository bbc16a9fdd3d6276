"""Meshes of solids: their records, extrusion of plane quadrilaterals, hexahedra of 8, 20 or 27 nodes, placing."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.mesh.elements.shape_functions import HEX8, HEX20, HEX27, QUAD9, node_numbers, shape_functions

CELL_TYPES = {  # meshio's names
    4: "tetra", 8: "hexahedron", 10: "tetra10", 20: "hexahedron20", 27: "hexahedron27",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Face:
    """A named face of a part: its geometry, and the element sides on it.

    name : from the CAD file, the physical group of a mesh file, or "face 7"
    kind : its geometry; "other" for a cone, a free form or several faces in one group
    centre : (3,) centroid of its area [m]; for a cylinder the middle of its axis, for a sphere the sphere's centre
    direction : (3,) unit vector, the outward normal of a plane or the axis of a cylinder [-]; else nan
    radius : of a cylinder or sphere [m]; else nan
    inward : whether the material is outside of a cylinder or sphere: a bore or a ball seat, not a journal or a
        ball
    sides : (f, 4), for tetrahedra (f, 3)
        Corner nodes of the element sides on the face, in any order.
    chosen : whether a joint selected it by its geometry; then `name` describes the selection
    words : a designer's term for a face from CAD: ``fillet of radius 2 mm``
    """

    name: str
    kind: Literal["plane", "cylinder", "sphere", "other"]
    centre: Float[np.ndarray, "3"]
    direction: Float[np.ndarray, "3"]
    radius: float
    inward: bool
    sides: Int[np.ndarray, "f c"]
    chosen: bool = False
    words: str = ""


def freeze_arrays(mesh: object) -> None:
    """Replace points and cells of a mesh by read-only copies."""
    for name, kind in (("points", np.float64), ("cells", np.int64)):
        array = np.array(getattr(mesh, name), dtype=kind, order="C")
        array.setflags(write=False)
        object.__setattr__(mesh, name, array)


@dataclass(frozen=True, slots=True)
class SolidMesh:
    """A mesh of hexahedra alone or of tetrahedra alone, every node used; the arrays are read-only copies.

    points : (n, 3) nodes in the global reference position [m]
    cells : (e, 8), (e, 20), (e, 27), (e, 10) or (e, 4) node numbers in VTK order (meshio: hexahedron, hexahedron20,
        hexahedron27, tetra10, tetra)
    faces : the named faces, where they are known
    method : how the mesh was made and why, in words; empty where there is no choice
    """

    points: Float[np.ndarray, "n 3"]
    cells: Int[np.ndarray, "e k"]
    faces: tuple[Face, ...] = ()
    method: str = ""

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def cell_type(self) -> str:
        """The cells' name in meshio."""
        return CELL_TYPES[self.cells.shape[1]]

    @property
    def tetrahedra(self) -> bool:
        """Whether the elements are tetrahedra."""
        return self.cells.shape[1] in {4, 10}


def rectangle_quads(
    length: float, width: float, along: int, across: int
) -> tuple[Float[np.ndarray, "n 2"], Int[np.ndarray, "e 9"]]:
    """Nodes and quad9 cells of the rectangle 0 ≤ x ≤ length, |y| ≤ width/2 [m], `along` × `across` equal elements."""
    x, y = np.linspace(0, length, 2 * along + 1), np.linspace(-width / 2, width / 2, 2 * across + 1)
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    i, j = np.meshgrid(2 * np.arange(along) + 1, 2 * np.arange(across) + 1, indexing="ij")
    cells = (i.ravel()[:, None] + QUAD9[:, 0]) * len(y) + (j.ravel()[:, None] + QUAD9[:, 1])
    return points, cells


def extruded(points: Float[np.ndarray, "n 2"], quads: Int[np.ndarray, "e 9"], thickness: float, layers: int) -> SolidMesh:
    """hex27 mesh of a plate: plane quad9 cells, counter-clockwise, swept over -thickness/2 ≤ z ≤ thickness/2 [m].

    Nodes are numbered level by level from below.
    """
    return in_layers(points, np.linspace(-thickness / 2, thickness / 2, 2 * layers + 1), quads)


def in_layers(
    points: Float[np.ndarray, "n 2"], heights: Float[np.ndarray, " v"], quads: Int[np.ndarray, "e 9"]
) -> SolidMesh:
    """`stacked` with all cells in every layer."""
    layers = len(heights) // 2
    return stacked(points, heights, np.tile(quads, (layers, 1)), np.repeat(np.arange(layers), len(quads)))


def stacked(
    points: Float[np.ndarray, "n 2"], heights: Float[np.ndarray, " v"], quads: Int[np.ndarray, "e 9"],
    layer: Int[np.ndarray, " e"],
) -> SolidMesh:  # fmt: skip
    """hex27 elements on plane quad9 cells, each in one layer; nodes level by level, some perhaps unused.

    Parameters
    ----------
    points : (n, 2) plane nodes [m]
    heights : (v,) of the levels of nodes, two for each layer and one more [m]
    quads : (e, 9) the plane cell of each element, in VTK order, counter-clockwise
    layer : (e,) the layer of each element, from 0
    """
    nodes = np.column_stack([np.tile(points, (len(heights), 1)), np.repeat(heights, len(points))])
    levels = 2 * layer[:, None] + 1 + HEX27[:, 2]
    return SolidMesh(nodes, quads[:, node_numbers(QUAD9, HEX27[:, :2])] + len(points) * levels)


def quadratic(mesh: SolidMesh) -> SolidMesh:
    """The 27-node hexahedra of the same geometry; the element's shape functions place the nodes that are added."""
    e, k = mesh.cells.shape
    if k == len(HEX27):
        return mesh
    added = HEX27[k:]
    on = (added[:, None] * HEX8 >= 0).all(axis=2)  # the corners of the edge, face or cell that a node is in
    corners = np.sort(np.where(on, mesh.cells[:, None, : len(HEX8)], -1), axis=2).reshape(-1, len(HEX8))
    _, first, number = np.unique(corners, axis=0, return_index=True, return_inverse=True)
    places = (shape_functions(HEX27[:k], 1.0 * added) @ mesh.points[mesh.cells]).reshape(-1, 3)
    cells = np.column_stack([mesh.cells, len(mesh.points) + number.reshape(e, -1)])
    return replace(mesh, points=np.concatenate([mesh.points, places[first]]), cells=cells)


def serendipity(mesh: SolidMesh) -> SolidMesh:
    """The 20-node hexahedra with the same corners and edges, without the nodes within faces and cells."""
    if mesh.cells.shape[1] == len(HEX20):
        return mesh
    full = quadratic(mesh)
    return without_unused_nodes(replace(full, cells=full.cells[:, : len(HEX20)]))


def linear(mesh: SolidMesh) -> SolidMesh:
    """The 8-node hexahedra with the same corners, without all other nodes."""
    return without_unused_nodes(replace(mesh, cells=mesh.cells[:, : len(HEX8)]))


def without_unused_nodes(mesh: SolidMesh) -> SolidMesh:
    """The mesh without the nodes that no cell uses; the others keep their order."""
    used, renumbered = np.unique(mesh.cells, return_inverse=True)
    faces = tuple(replace(face, sides=np.searchsorted(used, face.sides)) for face in mesh.faces)
    return replace(mesh, points=mesh.points[used], cells=renumbered.reshape(mesh.cells.shape), faces=faces)


def placed(mesh: SolidMesh, origin: Float[np.ndarray, "3"], axes: Float[np.ndarray, "3 3"]) -> SolidMesh:
    """The mesh moved rigidly: its x, y, z axes become the rows of `axes`, its origin `origin` [m]."""
    faces = tuple(
        replace(face, centre=origin + face.centre @ axes, direction=face.direction @ axes) for face in mesh.faces
    )
    return replace(mesh, points=origin + mesh.points @ axes, faces=faces)


def frame_along(line: Float[np.ndarray, "3"], up: Float[np.ndarray, "3"] | None = None) -> Float[np.ndarray, "3 3"]:
    """Axes (3, 3), as rows, of the frame of a link along `line`: x along it, z as near to `up` as possible.

    Without `up`, z is as near as possible to global z. For a line along `up` z is nearest to global x, or, if the line
    is along that too, along global z.
    """
    x = line / np.linalg.norm(line)
    global_x, _, global_z = np.eye(3)
    wanted = (global_z, global_x) if up is None else (up, global_x, global_z)
    across = (each - (each @ x) * x for each in wanted)
    z = next(each for each in across if np.linalg.norm(each) > 1e-9)
    z = z / np.linalg.norm(z)
    return np.stack([x, np.cross(z, x), z])
