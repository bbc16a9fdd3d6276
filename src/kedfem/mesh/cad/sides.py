"""The sides of hexahedra on the outside of a mesh."""

import numpy as np
from jaxtyping import Float, Int

from kedfem.mesh.hexahedra import HEX27, QUAD9, node_numbers, shape_functions, shape_gradients


def _side_nodes() -> Int[np.ndarray, "6 9"]:
    """Of each side the nodes at the places of a quad9, turned so that its normal is the outward one."""
    rows = []
    for axis in range(3):
        for end in (-1, 1):
            first, second = ((axis + 1) % 3, (axis + 2) % 3) if end > 0 else ((axis + 2) % 3, (axis + 1) % 3)
            places = np.empty((9, 3), dtype=int)
            places[:, axis], places[:, first], places[:, second] = end, QUAD9[:, 0], QUAD9[:, 1]
            rows.append(node_numbers(HEX27, places))
    return np.array(rows)


#: Nodes of each side of a hexahedron in VTK order, at the places of a quad9: corners, counter-clockwise seen from
#: outside, middles of the edges between them, centre.
SIDE_NODES = _side_nodes()


def boundary_sides(cells: Int[np.ndarray, "e k"]) -> Int[np.ndarray, "f m"]:
    """The sides of :func:`owned_sides`."""
    return owned_sides(cells)[0]


def owned_sides(cells: Int[np.ndarray, "e k"]) -> tuple[Int[np.ndarray, "f m"], Int[np.ndarray, " f"]]:
    """The sides that one hexahedron alone has, with their nodes in the order of quad9 as far as they have them; which.

    Parameters
    ----------
    cells : (e, 8), (e, 20) or (e, 27)
        Node numbers in VTK order.

    Returns
    -------
    (f, 4), (f, 8) or (f, 9)
        Corners counter-clockwise seen from outside, middles of edges, centre.
    (f,)
        The hexahedron of each.
    """
    count = {8: 4, 20: 8, 27: 9}[cells.shape[1]]
    sides = cells[:, SIDE_NODES[:, :count]].reshape(-1, count)
    _, first, often = np.unique(np.sort(sides[:, :4], axis=1), axis=0, return_index=True, return_counts=True)
    alone = np.sort(first[often == 1])
    return sides[alone], alone // len(SIDE_NODES)


def side_normals(
    points: Float[np.ndarray, "n 3"], sides: Int[np.ndarray, "f m"]
) -> tuple[Float[np.ndarray, "f 3"], Float[np.ndarray, "f 3"], Float[np.ndarray, "f"]]:
    """Of each side the place at its middle [m], the outward unit normal there, and its area [m²], about."""
    nodes = QUAD9[: sides.shape[1]]
    middle = np.zeros((1, 2))
    X = points[sides]
    places = np.einsum("a,fac->fc", shape_functions(nodes, middle)[0], X)
    along = np.einsum("aj,fac->fjc", shape_gradients(nodes, middle)[0], X)
    normals = np.cross(along[:, 0], along[:, 1])
    lengths = np.linalg.norm(normals, axis=1)
    return places, normals / np.maximum(lengths, 1e-300)[:, None], 4 * lengths
