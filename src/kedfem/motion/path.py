"""Continuation along the drive: poses on a grid of drive angles, so that the assembly branch never jumps."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from kedfem.errors import MotionError
from kedfem.motion.linkage import Linkage, scaled
from kedfem.motion.messages import stopped, undecided
from kedfem.motion.rows import (
    Features,
    Poses,
    Twists,
    convective,
    drive_derivative,
    features,
    jacobian,
    residuals,
)

GRID_STEP = np.radians(3.0)
JUMP = 0.02  # of the size [-, rad]: a prediction that far off may lead to another branch
SMALLEST_STEP = 1e-7
SETTLED = 1e-9  # a Newton step, of the linkage's size [-, rad]: the next one would be rounding
OPEN = 1e-6  # of the size: what joints of a redundant linkage may be out of true, far below any bearing's clearance
WEAK, SINGULAR = 0.05, 1e-7  # relative singular values: worth a closer look; a dead point


@dataclass(frozen=True, slots=True)
class Path:
    """Poses on a grid of drive angles, with derivatives by the angle.

    phi : (G,) increasing [rad]
    R, p : (G, B, 3, 3), (G, B, 3) poses of all bodies, ground first
    first, second : twists (v, ω) and their derivatives by φ, each a pair of (G, B, 3)
    periodic : the linkage returns to its pose after one turn of the drive
    weakest : smallest singular value met on the way, relative, and the angle there [-, rad]
    """

    phi: Float[np.ndarray, " G"]
    R: Float[np.ndarray, "G B 3 3"]
    p: Float[np.ndarray, "G B 3"]
    first: Twists
    second: Twists
    periodic: bool
    weakest: tuple[float, float]


def rotation(theta: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3 3"]:
    """exp([θ]×), Rodrigues' formula, for stacks of rotation vectors [rad]."""
    angle2 = np.einsum("...k,...k->...", theta, theta)[..., None, None]
    angle = np.sqrt(angle2)
    W = cross_matrix(theta)
    small = angle2 < 1e-8
    safe = np.where(small, 1.0, angle)
    s = np.where(small, 1 - angle2 / 6, np.sin(safe) / safe)
    c = np.where(small, 0.5 - angle2 / 24, (1 - np.cos(safe)) / safe**2)
    return np.asarray(np.eye(3) + s * W + c * (W @ W))


def cross_matrix(w: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3 3"]:
    """[w]×, so that [w]× x = w × x."""
    out = np.zeros((*w.shape, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -w[..., 2], w[..., 1], -w[..., 0]
    return out - np.swapaxes(out, -1, -2)


class Factor:
    """QR of the scaled rows at T poses; least squares over all rows, so redundant ones need no choice."""

    def __init__(self, link: Linkage, f: Features) -> None:
        self.link, self.f, self.bodies = link, f, len(link.bodies)
        self.row = np.where(link.rows.kind == 0, 1 / link.size, 1.0)
        self.Q, self.U = np.linalg.qr(scaled(jacobian(link.rows, f, self.bodies), link.rows, link.size))

    def twists(self, rhs: Float[np.ndarray, "T m"]) -> Twists:
        """Least-squares solution of J (v, ω) = rhs; the ground's are zero."""
        projected = np.swapaxes(self.Q, 1, 2) @ (rhs * self.row)[..., None]
        x = np.linalg.solve(self.U, projected)[..., 0].reshape(len(rhs), -1, 6)
        full = np.zeros((len(rhs), self.bodies, 6))
        full[:, 1:] = x
        return full[..., :3] * self.link.size, full[..., 3:]


def moved(poses: Poses, change: Twists) -> Poses:
    """Poses after small finite twists (v, θ)."""
    R, p = poses
    return rotation(change[1]) @ R, p + change[0]


def orthonormal(R: Float[np.ndarray, "... 3 3"]) -> Float[np.ndarray, "... 3 3"]:
    """The rotation next to a matrix that almost is one: one Newton step R (3 − Rᵀ R)/2 of the polar decomposition."""
    return np.asarray(R @ (1.5 * np.eye(3) - 0.5 * np.swapaxes(R, -1, -2) @ R))


def closed(
    link: Linkage, poses: Poses, phi: Float[np.ndarray, " T"], sweeps: int = 12
) -> tuple[Poses, Float[np.ndarray, " T"]]:
    """Newton: poses at which all rows vanish (redundant ones in the least squares), from poses close by.

    Parameters
    ----------
    poses : R (T, B, 3, 3), p (T, B, 3) first guess
    phi : (T,) drive angles [rad]

    Returns
    -------
    poses, and (T,) the largest gap left, in units of size; infinite where Newton has not settled
    """
    step = np.full(len(phi), np.inf)
    for _ in range(sweeps):
        f = features(link.rows, poses, phi)
        try:
            change = Factor(link, f).twists(-residuals(f))
        except np.linalg.LinAlgError:
            return poses, np.full(len(phi), np.inf)
        poses = moved(poses, change)
        step = np.maximum(np.abs(change[0]).max(axis=(1, 2)) / link.size, np.abs(change[1]).max(axis=(1, 2)))
        if (step <= SETTLED).all() or not (step < 1).any():
            break
    unit = np.where(link.rows.kind == 0, 1 / link.size, 1.0)
    gap = np.abs(residuals(features(link.rows, poses, phi)) * unit)
    return poses, np.where(step <= SETTLED, gap.max(axis=1), np.inf)


def derivatives(link: Linkage, poses: Poses, phi: Float[np.ndarray, " T"]) -> tuple[Twists, Twists, Factor]:
    """First and second derivatives of the motion by the drive angle, as twists: differentiated constraints."""
    f = features(link.rows, poses, phi)
    factor = Factor(link, f)
    first = factor.twists(-drive_derivative(f))
    second = factor.twists(-convective(link.rows, f, first, np.ones_like(phi)))
    return first, second, factor


def path(link: Linkage, low: float, high: float) -> Path:
    """Follow the linkage from its drawn position over the drive angles low ≤ 0 ≤ high [rad].

    Raises
    ------
    MotionError
        Naming the joint and the drive angle where the linkage locks or cannot be assembled.
    """
    start = (np.tile(np.eye(3), (1, len(link.bodies), 1, 1)), np.zeros((1, len(link.bodies), 3)))
    turn = 2 * np.pi
    if high > turn or low < -turn:
        once = _branch(link, start, turn)
        if np.abs(once[-1][1] - start[0]).max() < OPEN and np.abs(once[-1][2]).max() < OPEN * link.size:
            return _checked(link, once, periodic=True)
    return _checked(link, _branch(link, start, low)[:0:-1] + _branch(link, start, high), periodic=False)


def predicted(along: Path, phi: Float[np.ndarray, " T"]) -> Poses:
    """Poses between grid points: quintic Hermite interpolation of R and p, R made a rotation again."""
    angle = np.mod(phi, 2 * np.pi) if along.periodic else phi
    last = len(along.phi) - 1
    k = np.clip(np.searchsorted(along.phi, angle) - 1, 0, max(last - 1, 0))
    here, there = (_with_derivatives(along, np.minimum(i, last)) for i in (k, k + 1))
    h = (along.phi[np.minimum(k + 1, last)] - along.phi[k])[:, None, None, None]
    s = (angle - along.phi[k])[:, None, None, None] / np.where(h > 0, h, 1.0)
    c0, c1, c2 = here[0], here[1] * h, here[2] * h**2 / 2
    D, E, F = there[0] - c0 - c1 - c2, there[1] * h - c1 - 2 * c2, there[2] * h**2 - 2 * c2
    c3, c4, c5 = 10 * D - 4 * E + F / 2, -15 * D + 7 * E - F, 6 * D - 3 * E + F / 2
    poses = c0 + s * (c1 + s * (c2 + s * (c3 + s * (c4 + s * c5))))
    return orthonormal(poses[..., :3]), poses[..., 3]


def _with_derivatives(along: Path, k: np.ndarray) -> list[Float[np.ndarray, "T B 3 4"]]:
    """(R, p) at grid points and its two derivatives by the drive angle."""
    R, W, A = along.R[k], cross_matrix(along.first[1][k]), cross_matrix(along.second[1][k])
    parts = ((R, along.p[k]), (W @ R, along.first[0][k]), ((A + W @ W) @ R, along.second[0][k]))
    return [np.concatenate([r, p[..., None]], axis=-1) for r, p in parts]


def _checked(link: Linkage, grid: list[tuple[float, np.ndarray, np.ndarray]], periodic: bool) -> Path:
    """The path through grid points, refused if it passes a dead point, on the grid or between."""
    phi = np.array([g[0] for g in grid])
    R, p = np.concatenate([g[1] for g in grid]), np.concatenate([g[2] for g in grid])
    first, second, factor = derivatives(link, (R, p), phi)
    weakness = _weakness(factor)
    least = int(weakness.argmin())
    along = Path(phi, R, p, first, second, periodic, (float(weakness[least]), float(phi[least])))
    beside = np.pad(weakness, 1, constant_values=np.inf)
    dips = np.flatnonzero((weakness <= beside[:-2]) & (weakness <= beside[2:]) & (weakness < WEAK))
    for k in dips[np.argsort(np.abs(phi[dips]), kind="stable")]:  # the first met is named
        along = _closer(link, along, float(phi[max(k - 1, 0)]), float(phi[min(k + 1, len(phi) - 1)]))
        if along.weakest[0] < SINGULAR:
            at = along.weakest[1]
            raise MotionError(undecided(link, predicted(along, np.array([at])), at))
    return along


def _closer(link: Linkage, along: Path, low: float, high: float) -> Path:
    """A closer look at the weakest position between two drive angles: the interval narrowed seven times."""
    for _ in range(7):
        angles = np.linspace(low, high, 33)
        poses, _ = closed(link, predicted(along, angles), angles, sweeps=2)
        weakness = _weakness(Factor(link, features(link.rows, poses, angles)))
        k = int(weakness.argmin())
        low, high = angles[max(k - 1, 0)], angles[min(k + 1, 32)]
        if weakness[k] < along.weakest[0]:
            along = replace(along, weakest=(float(weakness[k]), float(angles[k])))
    return along


def _weakness(factor: Factor) -> Float[np.ndarray, " T"]:
    """Smallest singular value of the scaled rows, relative to the largest; 0 at a dead point."""
    if not factor.U.shape[-1]:
        return np.ones(len(factor.U))
    s = np.linalg.svd(factor.U, compute_uv=False)
    return np.asarray(s[:, -1] / s[:, 0])


def _branch(link: Linkage, start: Poses, end: float) -> list[tuple[float, np.ndarray, np.ndarray]]:
    """Grid points (φ, R, p) from 0 to `end`, step halved where Newton has trouble."""
    out = [(0.0, *start)]
    poses, phi, step = start, 0.0, np.sign(end) * GRID_STEP
    while abs(end - phi) > 1e-12:
        try:
            first, second, _ = derivatives(link, poses, np.array([phi]))
        except np.linalg.LinAlgError as error:
            raise MotionError(stopped(link, poses, phi)) from error
        poses, phi = _next(link, poses, phi, np.sign(end) * min(abs(step), abs(end - phi)), (first, second))
        step = 1.5 * (phi - out[-1][0])
        step = np.sign(end) * min(abs(step), GRID_STEP)
        out.append((phi, *poses))
    return out


def _next(
    link: Linkage, poses: Poses, phi: float, step: float, rates: tuple[Twists, Twists]
) -> tuple[Poses, float]:
    """The next grid point: a step halved until Newton stays close to the prediction."""
    while abs(step) >= SMALLEST_STEP:
        guess = moved(poses, _taylor(*rates, step))
        (R, p), gap = closed(link, guess, np.array([phi + step]))
        if gap[0] <= OPEN and _distance(link, (R, p), guess) <= JUMP:
            return (orthonormal(R), p), phi + step
        step /= 2
    raise MotionError(stopped(link, poses, phi))


def _taylor(first: Twists, second: Twists, step: float) -> Twists:
    return first[0] * step + second[0] * step**2 / 2, first[1] * step + second[1] * step**2 / 2


def _distance(link: Linkage, a: Poses, b: Poses) -> float:
    return float(max(np.abs(a[0] - b[0]).max(), np.abs(a[1] - b[1]).max() / link.size))
