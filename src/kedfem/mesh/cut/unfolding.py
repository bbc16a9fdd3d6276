"""Relaxation of hexahedra: where elements are bad, the nodes near them move until they are as cubic as can be."""

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from scipy.sparse.csgraph import connected_components

from kedfem.mesh.hexahedra import HEX27, shape_gradients
from kedfem.mesh.quality import scaled_jacobian

#: Puts nodes (their numbers) back where they must be (their places) and says how each may move from there: projectors.
Places = Float[np.ndarray, "m 3"]
Settle = Callable[[Int[np.ndarray, " m"], Places], tuple[Places, Float[np.ndarray, "m 3 3"]]]

_FLOOR = 0.02  # of the median det J: below it the distortion is bent over, so that inverted elements unfold
_WORK = 250  # evaluations per cell of the mesh after which what is not mended stays as it is
_ROUNDS = ((0, 30), (0, 10), (1, 30), (1, 60), (0, 30), (2, 60))  # rings of cells around bad ones; iterations


def unfolded(
    points: Float[np.ndarray, "n 3"],
    cells: Int[np.ndarray, "e 27"],
    settle: Settle,
    wanted: float,
) -> Float[np.ndarray, "n 3"]:
    """Nodes moved near the elements whose scaled Jacobian is less than `wanted`, as long as that helps.

    Parameters
    ----------
    points : (n, 3) [m]
        May hold inverted elements.
    cells : (e, 27)
        hex27 in VTK order.
    settle : function
        Holds the boundary: see `Settle`.
    wanted : float [-]
        Scaled Jacobian that is good enough.

    Returns
    -------
    (n, 3) [m]
        A new array; the worst scaled Jacobian is no worse than before.
    """
    points, quality = points.copy(), scaled_jacobian(points, cells)
    around = _Neighbours(cells, len(points))
    work = 0
    for rings, iterations in _ROUNDS:
        for bad in around.clusters(np.flatnonzero(quality < wanted)):
            if work > _WORK * len(cells):
                return points
            inner = around.grown(bad, rings)
            patch = around.grown(inner, 1)
            work += iterations * len(patch)
            moved = _relaxed(points, cells[patch], np.unique(cells[inner]), settle, iterations)
            changed = scaled_jacobian(moved, cells[patch])
            better = _deficit(changed, wanted) < _deficit(quality[patch], wanted)
            if better and changed.min() >= min(quality[patch].min(), wanted):
                points, quality[patch] = moved, changed
    return points


def _deficit(quality: Float[np.ndarray, " e"], wanted: float) -> float:
    """What is missing to the wanted quality: sum of squares."""
    return float((np.maximum(wanted - quality, 0) ** 2).sum())


class _Neighbours:
    """Which cells share nodes."""

    def __init__(self, cells: Int[np.ndarray, "e 27"], n: int) -> None:
        e, k = cells.shape
        ends = np.arange(0, e * k + 1, k)
        self._nodes = sp.csr_array((np.ones(e * k, dtype=np.int32), cells.ravel(), ends), shape=(e, n))
        self._cells = self._nodes.T.tocsr()

    def grown(self, chosen: Int[np.ndarray, " c"], rings: int) -> Int[np.ndarray, " d"]:
        """The chosen cells and those around them, so many rings."""
        for _ in range(rings):
            nodes = np.unique(self._nodes[chosen].indices)
            chosen = np.unique(self._cells[nodes].indices)
        return chosen

    def clusters(self, chosen: Int[np.ndarray, " c"]) -> list[Int[np.ndarray, " d"]]:
        """The chosen cells, those together that share nodes."""
        nodes = self._nodes[chosen]
        count, label = connected_components(nodes @ nodes.T, directed=False)
        return [chosen[label == i] for i in range(count)]


def _relaxed(
    points: Float[np.ndarray, "n 3"],
    cells: Int[np.ndarray, "p 27"],
    free: Int[np.ndarray, " m"],
    settle: Settle,
    iterations: int,
) -> Float[np.ndarray, "n 3"]:
    """All nodes, the `free` ones where the distortion of the cells is least, and settled there."""
    from scipy.optimize import minimize

    from kedfem.mesh.cut.unfolding_kernel import distortion

    used, local = np.unique(cells, return_inverse=True)
    local, mine = local.reshape(cells.shape), np.searchsorted(used, free)
    _, freedom = settle(free, points[free])
    determinants = np.linalg.det(_jacobians(points[cells]))
    unit = float(np.median(abs(determinants))) ** (1 / 3)
    start = (points[used] - points[used].mean(axis=0)) / unit

    def placed(x: Float[np.ndarray, " v"]) -> Float[np.ndarray, "u 3"]:
        X = start.copy()
        X[mine] += np.einsum("mij,mj->mi", freedom, x.reshape(-1, 3))
        return np.asarray(X)

    def cost(x: Float[np.ndarray, " v"]) -> tuple[float, Float[np.ndarray, " v"]]:
        gradient = np.zeros_like(start)
        value = distortion(placed(x), local, _FLOOR, gradient)
        return value, np.einsum("mij,mi->mj", freedom, gradient[mine]).ravel()

    options = {"maxiter": iterations, "maxcor": 20}
    least = minimize(cost, np.zeros(3 * len(mine)), jac=True, method="L-BFGS-B", options=options)
    moved = points.copy()
    moved[free] += unit * (placed(least.x) - start)[mine]
    moved[free], _ = settle(free, moved[free])
    return moved


def _jacobians(corners: Float[np.ndarray, "e 27 3"]) -> Float[np.ndarray, "e 27 3 3"]:
    """J_ij = ∂x_i/∂ξ_j at the nodes of each cell."""
    return np.asarray(
        np.swapaxes(np.tensordot(corners, shape_gradients(HEX27, 1.0 * HEX27), axes=(1, 1)), 1, 2)
    )
