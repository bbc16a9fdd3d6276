"""Relaxation of plane meshes: the inner nodes move until the elements are as square as they can be."""

import numpy as np
from jaxtyping import Float, Int

from kedfem.mesh.elements.shape_functions import QUAD9, shape_gradients
from kedfem.mesh.planar.areas import PlaneQuads, Quads, quadratic_quads

_GRADIENTS = shape_gradients(QUAD9, QUAD9.astype(float))
_POWER = 4  # the higher, the more the worst element counts
_FLOOR = 0.01  # of the median det J: below it the distortion is bent over, so that inverted elements unfold


def relaxed(mesh: PlaneQuads, iterations: int) -> Quads:
    """quad9 mesh with the same boundary and its inner corners where the distortion is least.

    Parameters
    ----------
    mesh : may hold inverted cells
    iterations : at most so many steps of the minimiser (L-BFGS)

    Returns
    -------
    (m, 2) [m] and (e, 9): plane nodes; cells in VTK order
    """
    start = quadratic_quads(mesh)
    if len(start.free) == 0:
        return start.points, start.cells
    fixed = start.points - start.follow @ start.points[start.free]
    floor = _FLOOR * float(np.median(abs(np.linalg.det(_jacobians(start.points[start.cells])))))

    def cost(x: Float[np.ndarray, " v"]) -> tuple[float, Float[np.ndarray, " v"]]:
        value, slope = distortion(fixed + start.follow @ x.reshape(-1, 2), start.cells, floor)
        return value, (start.follow.T @ slope).ravel()

    from scipy.optimize import minimize

    options = {"maxiter": iterations, "maxcor": 20}
    least = minimize(cost, start.points[start.free].ravel(), jac=True, method="L-BFGS-B", options=options)
    return fixed + start.follow @ least.x.reshape(-1, 2), start.cells


def distortion(
    points: Float[np.ndarray, "m 2"], cells: Int[np.ndarray, "e 9"], floor: float
) -> tuple[float, Float[np.ndarray, "m 2"]]:
    """Sum of f⁴ over the nodes of all cells, f = |J|² / (2 h), and its gradient by the nodes.

    f is the inverse mean ratio: 1 for a square, infinite for an element without area. h = det J where that is
    well above `floor`, and positive where it is not.

    Parameters
    ----------
    points : (m, 2) nodes [m]
    cells : (e, 9) quad9 cells in VTK order
    floor : scale of det J below which h departs from it [m²]

    Returns
    -------
    value : float [-]
    gradient : (m, 2) [1/m]
    """
    J = _jacobians(points[cells])
    det = J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0]
    root = np.sqrt(det**2 + floor**2)
    h = np.where(det > 0, det + root, floor**2 / (root + abs(det))) / 2
    f = (J**2).sum(axis=(2, 3)) / (2 * h)
    slope = _POWER * f ** (_POWER - 1)
    by_J = (slope / h)[..., None, None] * J
    by_det = -slope * f / root
    by_J[..., 0, 0] += by_det * J[..., 1, 1]
    by_J[..., 1, 1] += by_det * J[..., 0, 0]
    by_J[..., 0, 1] -= by_det * J[..., 1, 0]
    by_J[..., 1, 0] -= by_det * J[..., 0, 1]
    by_node = np.tensordot(by_J, _GRADIENTS, axes=((1, 3), (0, 2)))
    flat = cells.ravel()
    gradient = [np.bincount(flat, by_node[:, i].ravel(), len(points)) for i in (0, 1)]
    return float((f**_POWER).sum()), np.stack(gradient, axis=1)


def _jacobians(corners: Float[np.ndarray, "e 9 2"]) -> Float[np.ndarray, "e 9 2 2"]:
    """J_ij = ∂x_i/∂ξ_j at the nodes of each cell."""
    return np.swapaxes(np.tensordot(corners, _GRADIENTS, axes=(1, 1)), 1, 2)
