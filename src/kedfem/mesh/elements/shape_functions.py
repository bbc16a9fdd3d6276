"""Shape functions and node coordinates of quadrilaterals, hexahedra and quadratic simplices."""

import numpy as np

from kedfem.arrays import Float, Int

#: Edges of a tetrahedron in VTK's order of the nodes 4 to 9 in their middles; the first three are a triangle's.
EDGES: Int[np.ndarray, "6 2"] = np.array([(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)])
_CORNERS = np.concatenate([np.zeros((1, 3)), np.eye(3)])

#: Nodes of tet10 and tri6 in reference coordinates, VTK order: corners, middles of edges.
TET10: Float[np.ndarray, "10 3"] = np.concatenate([_CORNERS, _CORNERS[EDGES].mean(axis=1)])
TRI6: Float[np.ndarray, "6 2"] = TET10[[0, 1, 2, 4, 5, 6], :2]

#: Nodes of each side of a tet10 in the order of a tri6: corners counter-clockwise seen from outside, middles.
TET_SIDES: Int[np.ndarray, "4 6"] = np.array(
    [(0, 2, 1, 6, 5, 4), (0, 1, 3, 4, 8, 7), (1, 2, 3, 5, 9, 8), (0, 3, 2, 7, 9, 6)]
)
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
#: Nodes of the serendipity hex20 and of hex8: the same order without faces and centre, and the corners alone.
HEX20: Int[np.ndarray, "20 3"] = HEX27[:20]
HEX8: Int[np.ndarray, "8 3"] = HEX27[:8]


Places = Float[np.ndarray, "_ d"] | Int[np.ndarray, "_ d"]

#: Reference coordinates of an element's nodes, by their number.
NODES: dict[int, Places] = {len(nodes): nodes for nodes in (QUAD9, HEX8, TET10, HEX20, HEX27)}


def barycentric(at: Float[np.ndarray, "*q d"]) -> Float[np.ndarray, "*q c"]:
    """Barycentric coordinates of places in reference coordinates."""
    return np.concatenate([1 - at.sum(axis=-1, keepdims=True), at], axis=-1)


def simplex_functions(at: Float[np.ndarray, "q d"]) -> Float[np.ndarray, "q k"]:
    """The quadratic N_a of tri6 (d = 2) or tet10 (d = 3) [-]."""
    b, (i, j) = barycentric(at), _edges(at).T
    return np.concatenate([b * (2 * b - 1), 4 * b[:, i] * b[:, j]], axis=1)


def simplex_gradients(at: Float[np.ndarray, "q d"]) -> Float[np.ndarray, "q k d"]:
    """∂N_a/∂ξ_j of :func:`simplex_functions` [-]."""
    b, (i, j), d = barycentric(at), _edges(at).T, at.shape[1]
    slope = np.concatenate([-np.ones((1, d)), np.eye(d)])  # of the barycentric coordinates
    corners = (4 * b - 1)[:, :, None] * slope
    middles = 4 * (b[:, i, None] * slope[j] + b[:, j, None] * slope[i])
    return np.concatenate([corners, middles], axis=1)


def _edges(at: Float[np.ndarray, "q d"]) -> Int[np.ndarray, "m 2"]:
    return EDGES[: 3 * (at.shape[1] - 1)]


def node_numbers(nodes: Places, at: Places) -> list[int]:
    """Numbers of the nodes of an element at some reference coordinates."""
    return [int(np.flatnonzero((nodes == place).all(axis=1))[0]) for place in at]


def shape_functions(nodes: Places, at: Float[np.ndarray, "q d"]) -> Float[np.ndarray, "q k"]:
    """N_a of an element [-]: tensor-product Lagrange, serendipity for HEX20, quadratic on a simplex.

    Parameters
    ----------
    nodes : (k, d) reference coordinates of the element's nodes (HEX27, HEX20, HEX8, QUAD9, TET10, TRI6)
    at : (q, d) reference coordinates of the points [-]
    """
    x = np.asarray(at, dtype=float)
    if len(nodes) in {len(TET10), len(TRI6)}:
        return simplex_functions(x)
    product = np.prod([line for line, _ in _factors(nodes, x)], axis=0)
    return np.asarray(product * _brackets(nodes, x)[0])


def shape_gradients(nodes: Places, at: Float[np.ndarray, "q d"]) -> Float[np.ndarray, "q k d"]:
    """∂N_a/∂ξ_j of the functions of :func:`shape_functions` [-]."""
    x = np.asarray(at, dtype=float)
    if len(nodes) in {len(TET10), len(TRI6)}:
        return simplex_gradients(x)
    bracket, slope = _brackets(nodes, x)
    factors = _factors(nodes, x)
    product = np.prod([line for line, _ in factors], axis=0)
    axes = range(nodes.shape[1])
    columns = [np.prod([factors[i][int(i == j)] for i in axes], axis=0) for j in axes]
    return np.asarray(np.stack(columns, axis=-1) * bracket[..., None] + product[..., None] * slope)


def _factors(
    nodes: Places, x: Float[np.ndarray, "q d"]
) -> list[tuple[Float[np.ndarray, "q k"], Float[np.ndarray, "q k"]]]:
    """The factor of every N_a in each direction, and its derivative."""
    linear_ends = (1 - x) / 2, (1 + x) / 2
    if len(nodes) == len(HEX20) or not (nodes == 0).any():
        line = np.stack([linear_ends[0], 1 - x**2, linear_ends[1]])
        slope = np.stack([0 * x - 0.5, -2 * x, 0 * x + 0.5])
    else:
        line = np.stack([x * (x - 1) / 2, 1 - x**2, x * (x + 1) / 2])
        slope = np.stack([x - 0.5, -2 * x, x + 0.5])
    return [(line[nodes[:, i] + 1, :, i].T, slope[nodes[:, i] + 1, :, i].T) for i in range(nodes.shape[1])]


def _brackets(nodes: Places, x: Float[np.ndarray, "q d"]) -> tuple[Float[np.ndarray, "q k"], Float[np.ndarray, "q k d"]]:
    """The factor (Σ ξ_j ξ_aj − 2) by which a serendipity corner vanishes at the middles of its edges; its gradient."""
    corner = (nodes != 0).all(axis=1) & (len(nodes) == len(HEX20))
    bracket = np.where(corner, x @ nodes.T - 2.0, 1.0)
    slope = 1.0 * nodes * corner[:, None]
    return bracket, np.broadcast_to(slope, (len(x), *slope.shape))
