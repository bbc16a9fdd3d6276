"""Hexahedral meshes: the record, the tensor-product shape functions, extrusion of plane quadrilaterals."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

_SQUARE = ((-1, -1), (1, -1), (1, 1), (-1, 1))
_SIDES = ((0, -1), (1, 0), (0, 1), (-1, 0))

#: Nodes of quad9 in reference coordinates, VTK order: corners, sides, centre.
QUAD9: Int[np.ndarray, "9 2"] = np.array([*_SQUARE, *_SIDES, (0, 0)])

#: Nodes of hex27 in reference coordinates, VTK order: corners; edges below, above, upright; faces; centre.
HEX27: Int[np.ndarray, "27 3"] = np.array(
    [(*corner, z) for z in (-1, 1) for corner in _SQUARE]
    + [(*side, z) for z in (-1, 1) for side in _SIDES]
    + [(*corner, 0) for corner in _SQUARE]
    + [(-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0), (0, 0, -1), (0, 0, 1), (0, 0, 0)]
)
HEX8: Int[np.ndarray, "8 3"] = HEX27[:8]


@dataclass(frozen=True, slots=True)
class HexMesh:
    """A mesh of hexahedra alone, every node used; the arrays are read-only copies.

    Attributes
    ----------
    points : (n, 3) [m]
        Nodes in the global reference position.
    cells : (e, 8) or (e, 27)
        Node numbers in VTK order (meshio: hexahedron, hexahedron27).
    """

    points: Float[np.ndarray, "n 3"]
    cells: Int[np.ndarray, "e k"]

    def __post_init__(self) -> None:
        for name, kind in (("points", np.float64), ("cells", np.int64)):
            array = np.array(getattr(self, name), dtype=kind, order="C")
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def cell_type(self) -> str:
        """The cells' name in meshio: hexahedron or hexahedron27."""
        return "hexahedron27" if self.cells.shape[1] == len(HEX27) else "hexahedron"


def shape_gradients(
    nodes: Int[np.ndarray, "k d"], at: Float[np.ndarray, "q d"]
) -> Float[np.ndarray, "q k d"]:
    """∂N_a/∂ξ_j of tensor-product Lagrange elements, quadratic where the nodes have a middle, else linear.

    Parameters
    ----------
    nodes : (k, d) in {-1, 0, 1}
        Reference coordinates of the element's nodes (HEX27, HEX8, QUAD9).
    at : (q, d) [-]
        Where the gradients are wanted, reference coordinates.

    Returns
    -------
    (q, k, d) [-]
        One gradient per place and shape function.
    """
    x = np.asarray(at, dtype=float)
    if (nodes == 0).any():
        line = np.stack([x * (x - 1) / 2, 1 - x**2, x * (x + 1) / 2])
        slope = np.stack([x - 0.5, -2 * x, x + 0.5])
    else:
        line = np.stack([(1 - x) / 2, 0 * x, (1 + x) / 2])
        slope = np.stack([0 * x - 0.5, 0 * x, 0 * x + 0.5])
    axes = range(nodes.shape[1])
    factors = [[line[nodes[:, i] + 1, :, i].T, slope[nodes[:, i] + 1, :, i].T] for i in axes]
    columns = [np.prod([factors[i][int(i == j)] for i in axes], axis=0) for j in axes]
    return np.stack(columns, axis=-1)


def rectangle_quads(
    length: float, width: float, along: int, across: int
) -> tuple[Float[np.ndarray, "n 2"], Int[np.ndarray, "e 9"]]:
    """Nodes and quad9 cells of the rectangle 0 ≤ x ≤ length, |y| ≤ width/2, in equal elements.

    Parameters
    ----------
    length, width : float [m]
        Sides along x and y.
    along, across : int
        Numbers of elements along x and y.

    Returns
    -------
    (n, 2) [m] and (e, 9)
        Plane nodes; cells in VTK order.
    """
    x, y = np.linspace(0, length, 2 * along + 1), np.linspace(-width / 2, width / 2, 2 * across + 1)
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    i, j = np.meshgrid(2 * np.arange(along) + 1, 2 * np.arange(across) + 1, indexing="ij")
    cells = (i.ravel()[:, None] + QUAD9[:, 0]) * len(y) + (j.ravel()[:, None] + QUAD9[:, 1])
    return points, cells


def extruded(
    points: Float[np.ndarray, "n 2"], quads: Int[np.ndarray, "e 9"], thickness: float, layers: int
) -> HexMesh:
    """hex27 mesh of a plate: plane quad9 cells swept over -thickness/2 ≤ z ≤ thickness/2.

    Parameters
    ----------
    points : (n, 2) [m]
        Plane nodes, all used.
    quads : (e, 9)
        Cells in VTK order, counter-clockwise.
    thickness : float [m]
        Extent along z.
    layers : int
        Elements through the thickness.

    Returns
    -------
    HexMesh
        e · layers elements; nodes level by level from below.
    """
    heights = np.linspace(-thickness / 2, thickness / 2, 2 * layers + 1)
    swept = np.column_stack([np.tile(points, (len(heights), 1)), np.repeat(heights, len(points))])
    below = [int(np.flatnonzero((node[:2] == QUAD9).all(axis=1))[0]) for node in HEX27]
    levels = 2 * np.arange(layers)[:, None, None] + 1 + HEX27[:, 2]
    cells = quads[None, :, below] + len(points) * levels
    return HexMesh(swept, cells.reshape(-1, len(HEX27)))


def quadratic(mesh: HexMesh) -> HexMesh:
    """The 27-node hexahedra with the same corners and straight edges; meshes of 27-node ones as they are."""
    if mesh.cells.shape[1] == len(HEX27):
        return mesh
    e, spans = len(mesh.cells), HEX27[:, None] * HEX8[None]
    on = (spans >= 0).all(axis=2)  # which corners span the edge, face or cell that a node is the middle of
    corners = np.where(on, mesh.cells[:, None, :], -1)
    keys, cells = np.unique(np.sort(corners, axis=2).reshape(e * len(HEX27), -1), axis=0, return_inverse=True)
    inside = keys >= 0
    points = (mesh.points[keys] * inside[:, :, None]).sum(axis=1) / inside.sum(axis=1, keepdims=True)
    return HexMesh(points, cells.reshape(e, len(HEX27)))


def linear(mesh: HexMesh) -> HexMesh:
    """The 8-node hexahedra with the same corners, other nodes dropped."""
    return without_spare_nodes(mesh.points, mesh.cells[:, : len(HEX8)])


def without_spare_nodes(points: Float[np.ndarray, "n 3"], cells: Int[np.ndarray, "e k"]) -> HexMesh:
    """The mesh with nodes that no cell uses left out, the others kept in their order."""
    used, renumbered = np.unique(cells, return_inverse=True)
    return HexMesh(points[used], renumbered.reshape(cells.shape))


def placed(mesh: HexMesh, origin: Float[np.ndarray, "3"], axes: Float[np.ndarray, "3 3"]) -> HexMesh:
    """The mesh moved rigidly: its x, y, z run along the rows of `axes` from `origin` [m]."""
    return HexMesh(origin + mesh.points @ axes, mesh.cells)


def frame_along(line: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """Rows x, y, z of the frame of a link drawn along `line`: x along it, z as near to global z as can be.

    A line along global z has the frame's z along global x.
    """
    x = line / np.linalg.norm(line)
    normal = np.array([0.0, 0.0, 1.0]) if np.hypot(x[0], x[1]) > 1e-9 else np.array([1.0, 0.0, 0.0])
    z = normal - (normal @ x) * x
    z /= np.linalg.norm(z)
    return np.stack([x, np.cross(z, x), z])
