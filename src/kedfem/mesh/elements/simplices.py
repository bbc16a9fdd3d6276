"""Shape functions of the 10-node tetrahedron and of its side, the 6-node triangle, on reference simplices."""

import numpy as np
from jaxtyping import Float, Int

#: Edges of a tetrahedron in VTK's order of its nodes 4 to 9, their middles; the first three are those of a triangle.
EDGES: Int[np.ndarray, "6 2"] = np.array([(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)])
_CORNERS = np.concatenate([np.zeros((1, 3)), np.eye(3)])

#: Nodes of tet10 and tri6 in reference coordinates, VTK order: corners, middles of edges.
TET10: Float[np.ndarray, "10 3"] = np.concatenate([_CORNERS, _CORNERS[EDGES].mean(axis=1)])
TRI6: Float[np.ndarray, "6 2"] = TET10[[0, 1, 2, 4, 5, 6], :2]

#: Nodes of each side of a tet10 at the places of a tri6: corners counter-clockwise seen from outside, middles.
TET_SIDES: Int[np.ndarray, "4 6"] = np.array(
    [(0, 2, 1, 6, 5, 4), (0, 1, 3, 4, 8, 7), (1, 2, 3, 5, 9, 8), (0, 3, 2, 7, 9, 6)]
)


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
