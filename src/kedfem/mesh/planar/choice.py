"""The best of several plane meshes of one area, each relaxed until its elements are nearly square."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.mesh.elements.quality import scaled_jacobian
from kedfem.mesh.elements.shape_functions import QUAD9, shape_gradients
from kedfem.mesh.planar.areas import PlaneQuads, Quads, pillowed, quadratic_quads

_GRADIENTS = shape_gradients(QUAD9, QUAD9.astype(float))
_POWER = 4  # of the distortion in its sum: a higher one gives the worst element more weight
_FLOOR = 0.01  # of the median det J: below it the distortion is finite, so that inverted elements unfold
GOOD = 0.5  # scaled Jacobian from which no other mesh is tried
LARGE = 2000  # quadrilaterals from which time is more important than quality
ITERATIONS = 150, 40  # most of a relaxation, and of a large one
FAIR = 0.3  # scaled Jacobian below which subdivision, with four times the elements, is tried too


@dataclass(frozen=True, slots=True)
class Setting:
    """gmsh's settings for quadrilaterals: its 2-D algorithm, recombination and subdivision."""

    algorithm: int
    recombination: int
    subdivision: int


#: Tried in turn; the last, which leaves no triangles, only if no other is fair. Algorithm 11 can hang.
SETTINGS = (*(Setting(plane, blossom, 0) for blossom in (3, 1) for plane in (6, 5, 8)), Setting(6, 1, 1))


@dataclass(frozen=True, slots=True)
class Candidate:
    """A relaxed mesh with its worst scaled Jacobian, the mesh from which it started, and the index of its setting."""

    quality: float
    quads: Quads
    start: PlaneQuads
    tried: int

    @property
    def corners(self) -> PlaneQuads:
        """The relaxed mesh with straight sides."""
        points, cells = self.quads
        count = len(self.start.points)
        return PlaneQuads(points[:count], cells[:, :4], self.start.rim, self.start.middles)


def best_quads(meshes: Iterable[PlaneQuads | None]) -> Candidate | None:
    """The first good mesh; without one, of those within a tenth of the best quality the one with the fewest elements.

    None if there is no mesh at all.

    Parameters
    ----------
    meshes : in the order of SETTINGS, None where a setting fails; consumed only as far as needed
    """
    found: list[Candidate] = []
    for tried, mesh in enumerate(meshes):
        if mesh is not None:
            found += _relaxed_meshes(mesh, tried)
        best = max((candidate.quality for candidate in found), default=-1.0)
        if best >= GOOD or (tried == len(SETTINGS) - 2 and best >= FAIR):
            break
    enough = min(GOOD, best - 0.1 * abs(best)) if found else np.inf
    good = [candidate for candidate in found if candidate.quality >= enough]
    return min(good, key=lambda candidate: len(candidate.quads[1]), default=None)


def _relaxed_meshes(mesh: PlaneQuads, tried: int) -> list[Candidate]:
    """The mesh relaxed and, unless that is good, the mesh with a boundary layer relaxed."""
    found: list[Candidate] = []
    for start in (mesh, pillowed(mesh)):
        points, cells = relaxed(start, ITERATIONS[len(mesh.cells) > LARGE])
        quality = float(scaled_jacobian(points, cells).min())
        found.append(Candidate(quality, (points, cells), start, tried))
        if quality >= GOOD:
            break
    return found


def relaxed(mesh: PlaneQuads, iterations: int) -> Quads:
    """quad9 mesh with the same boundary, its inner corners moved to where the distortion is least.

    Parameters
    ----------
    mesh : may have inverted cells
    iterations : most iterations of the minimiser (L-BFGS)
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
    """Sum of f⁴ over the nodes of all cells, f = |J|² / (2 h), and its gradient with respect to the nodes.

    f is the inverse mean ratio: 1 for a square, infinite for an element without area. h = det J where that is
    well above `floor`, and positive elsewhere.

    Parameters
    ----------
    points : (m, 2) nodes [m]
    cells : (e, 9) quad9 cells in VTK order
    floor : det J below which h departs from it [m²]

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
