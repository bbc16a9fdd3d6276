"""Distortion of hexahedra of 27 nodes and its gradient, compiled by numba."""

import numpy as np

from kedfem.compiled import compiled
from kedfem.mesh.hexahedra import HEX27

#: LINES[q, j]: the three nodes of the line through node q in direction j; SLOPES[c + 1]: ∂/∂ξ at ξ = c from them.
LINES = np.array(
    [
        [[_rows.index((*q[:j], x, *q[j + 1 :])) for x in (-1, 0, 1)] for j in range(3)]
        for _rows in [[tuple(row) for row in HEX27.tolist()]]
        for q in _rows
    ]
)
SLOPES = np.array([[-1.5, 2.0, -0.5], [-0.5, 0.0, 0.5], [0.5, -2.0, 1.5]])
_AT = HEX27 + 1


@compiled
def distortion(points, cells, floor, gradient):  # type: ignore[no-untyped-def]
    """Sum of f³ over the nodes of all cells, f = (|J|²/3)^(3/2) / h; its gradient is added to `gradient`.

    f is the inverse mean ratio: 1 for a cube, infinite for an element without volume, and never less than the
    inverse of the scaled Jacobian. h = det J where that is well above `floor`, and positive where it is not.
    """
    total = 0.0
    J = np.empty((3, 3))
    C = np.empty((3, 3))
    for e in range(len(cells)):
        cell = cells[e]
        for q in range(27):
            _jacobian(points, cell, q, J)
            det = _cofactors(J, C)
            root = np.sqrt(det * det + floor * floor)
            h = (det + root) / 2 if det > 0 else floor * floor / (root - det) / 2
            norm = _square(J)
            f = norm / 3 * np.sqrt(norm / 3) / h
            value = f * f * f
            total += value
            by_norm, by_det = 9 * value / norm, 3 * value / root
            for j in range(3):
                for k in range(3):
                    weight = SLOPES[_AT[q, j], k]
                    node = cell[LINES[q, j, k]]
                    for i in range(3):
                        gradient[node, i] += weight * (by_norm * J[i, j] - by_det * C[i, j])
    return total


@compiled
def _square(J):  # type: ignore[no-untyped-def]
    """|J|²."""
    total = 0.0
    for i in range(3):
        total += J[i, 0] * J[i, 0] + J[i, 1] * J[i, 1] + J[i, 2] * J[i, 2]
    return total


@compiled
def _jacobian(points, cell, q, J):  # type: ignore[no-untyped-def]
    """J_ij = ∂x_i/∂ξ_j at node q of a cell."""
    for j in range(3):
        a, b, c = cell[LINES[q, j, 0]], cell[LINES[q, j, 1]], cell[LINES[q, j, 2]]
        slope = SLOPES[_AT[q, j]]
        for i in range(3):
            J[i, j] = slope[0] * points[a, i] + slope[1] * points[b, i] + slope[2] * points[c, i]


@compiled
def _cofactors(J, C):  # type: ignore[no-untyped-def]
    """∂ det J / ∂J into C; det J."""
    for j in range(3):
        a, b = (j + 1) % 3, (j + 2) % 3
        for i in range(3):
            k, m = (i + 1) % 3, (i + 2) % 3
            C[i, j] = J[k, a] * J[m, b] - J[m, a] * J[k, b]
    return J[0, 0] * C[0, 0] + J[1, 0] * C[1, 0] + J[2, 0] * C[2, 0]
