"""The element sides that form the surface of a mesh, with their normals and areas."""

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.mesh.elements.shape_functions import (
    HEX27,
    QUAD9,
    TET_SIDES,
    TRI6,
    node_numbers,
    shape_functions,
    shape_gradients,
)


def _side_nodes() -> Int[np.ndarray, "6 9"]:
    """The nodes of each side in the order of a quad9, oriented so that its normal points outwards."""
    rows = []
    for axis in range(3):
        for end in (-1, 1):
            first, second = ((axis + 1) % 3, (axis + 2) % 3) if end > 0 else ((axis + 2) % 3, (axis + 1) % 3)
            places = np.empty((9, 3), dtype=int)
            places[:, axis], places[:, first], places[:, second] = end, QUAD9[:, 0], QUAD9[:, 1]
            rows.append(node_numbers(HEX27, places))
    return np.array(rows)


#: Nodes of each side of a hexahedron in VTK order, in the order of a quad9: corners, counter-clockwise seen from
#: outside, middles of the edges between them, centre.
SIDE_NODES = _side_nodes()


def boundary_sides(cells: Int[np.ndarray, "e k"]) -> Int[np.ndarray, "f m"]:
    """The sides of :func:`owned_sides`."""
    return owned_sides(cells)[0]


def owned_sides(cells: Int[np.ndarray, "e k"]) -> tuple[Int[np.ndarray, "f m"], Int[np.ndarray, " f"]]:
    """The sides that belong to one element only, their nodes in the order of quad9 or tri6 as far as they have them.

    Parameters
    ----------
    cells : (e, 8), (e, 20), (e, 27), (e, 4) or (e, 10) node numbers in VTK order

    Returns
    -------
    (f, 4), (f, 8) or (f, 9), for tetrahedra (f, 3) or (f, 6)
        Nodes: corners counter-clockwise seen from outside, middles of edges, centre.
    (f,)
        The element of each side.
    """
    nodes = cells.shape[1]
    of_element = TET_SIDES if nodes in {4, 10} else SIDE_NODES
    count = {4: 3, 10: 6, 8: 4, 20: 8, 27: 9}[nodes]
    sides = cells[:, of_element[:, :count]].reshape(-1, count)
    keys = np.sort(sides[:, : side_corners(count)], axis=1)
    _, first, often = np.unique(keys, axis=0, return_index=True, return_counts=True)
    alone = np.sort(first[often == 1])
    return sides[alone], alone // len(of_element)


def side_corners(nodes: int) -> int:
    """Number of corners of a side with so many nodes."""
    return 3 if nodes in {3, 6} else 4


def side_normals(
    points: Float[np.ndarray, "n 3"], sides: Int[np.ndarray, "f m"]
) -> tuple[Float[np.ndarray, "f 3"], Float[np.ndarray, "f 3"], Float[np.ndarray, "f"]]:
    """Middle [m], outward unit normal at the middle and approximate area [m²] of each side."""
    X = points[sides]
    if sides.shape[1] == 3:
        X = np.concatenate([X, (X + np.roll(X, -1, axis=1)) / 2], axis=1)
    triangles = X.shape[1] == len(TRI6)
    nodes = TRI6 if triangles else QUAD9[: sides.shape[1]]
    middle = np.full((1, 2), 1 / 3 if triangles else 0.0)
    places = np.einsum("a,fac->fc", shape_functions(nodes, middle)[0], X)
    along = np.einsum("aj,fac->fjc", shape_gradients(nodes, middle)[0], X)
    normals = np.cross(along[:, 0], along[:, 1])
    lengths = np.linalg.norm(normals, axis=1)
    return places, normals / np.maximum(lengths, 1e-300)[:, None], lengths * (0.5 if triangles else 4)
