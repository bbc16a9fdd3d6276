"""Continuation along the drive: poses on a grid of drive angles, so that the assembly branch never jumps."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from kedfem.errors import MotionError
from kedfem.motion.linkage import Linkage
from kedfem.motion.messages import stopped
from kedfem.motion.newton import (
    OPEN,
    SETTLED,
    Factor,
    closed,
    cross_matrix,
    derivatives,
    moved,
    orthonormal,
)
from kedfem.motion.rows import Poses, Twists, features

GRID_STEP = np.radians(3.0)
JUMP = 0.02  # of the size [-, rad]: a prediction that far off may lead to another branch
CONTRACTION = 0.1  # Newton's second step against its first: well within the branch's own basin
SMALLEST_STEP = 1e-7
ROUNDING = 1e-12  # of an angle [rad]
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

    def holds(self, low: float, high: float) -> bool:
        """Whether it reaches so far, up to rounding."""
        return self.periodic or bool(self.phi[0] - ROUNDING <= low and high <= self.phi[-1] + ROUNDING)


def path(link: Linkage, low: float, high: float) -> Path:
    """Follow the linkage from its drawn position over the drive angles low ≤ 0 ≤ high [rad]; undriven it rests there.

    Raises
    ------
    MotionError
        Naming the joint and the drive angle where the linkage locks or cannot be assembled.
    """
    start = (np.tile(np.eye(3), (1, len(link.bodies), 1, 1)), np.zeros((1, len(link.bodies), 3)))
    if link.drive is None:
        zero = (np.zeros_like(start[1]), np.zeros_like(start[1]))
        return Path(np.zeros(1), *start, zero, zero, periodic=False, weakest=(1.0, 0.0))
    turn = 2 * np.pi
    if high > turn or low < -turn:
        once = _first_turn(link, start, turn, needed=high > turn)
        if (
            once
            and np.abs(once[-1][1] - start[0]).max() < OPEN
            and np.abs(once[-1][2]).max() < OPEN * link.size
        ):
            return _checked(link, once, periodic=True)
    return _checked(link, _branch(link, start, low)[:0:-1] + _branch(link, start, high), periodic=False)


def _first_turn(
    link: Linkage, start: Poses, turn: float, needed: bool
) -> list[tuple[float, np.ndarray, np.ndarray]]:
    """A whole turn forwards; none if it cannot be made and is not needed, as where the drive turns backwards."""
    try:
        return _branch(link, start, turn)
    except MotionError:
        if needed:
            raise
        return []


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
    return orthonormal(orthonormal(poses[..., :3])), poses[..., 3]


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
            raise MotionError(stopped(link, predicted(along, np.array([at])), at))
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
    """Grid points (φ, R, p) from 0 to `end`, step halved where the linkage comes near a dead point."""
    here = _Stand(link, 0.0, start)
    out, step = [(0.0, *start)], GRID_STEP
    while abs(end - here.phi) > 1e-12:
        before = here
        here = _next(before, np.sign(end) * min(step, abs(end - here.phi)))
        step = min(1.5 * abs(here.phi - before.phi), GRID_STEP)
        out.append((here.phi, *here.poses))
    return out


class _Stand:
    """One grid point with its rows' derivatives J and the rates of the motion."""

    def __init__(self, link: Linkage, phi: float, poses: Poses) -> None:
        self.link, self.phi, self.poses = link, phi, poses
        self.first, self.second, factor = derivatives(link, poses, np.array([phi]))
        self.J = factor.J[0]

    def predicted(self, step: float) -> Poses:
        """Second-order Taylor."""
        v, omega = (a * step + b * step**2 / 2 for a, b in zip(self.first, self.second, strict=True))
        return moved(self.poses, (v, omega))


def _next(here: _Stand, step: float) -> _Stand:
    """The next grid point, the step halved until Newton converges fast and the orientation stays."""
    least = min(SMALLEST_STEP, abs(step))
    while abs(step) >= least:
        phi = here.phi + step
        step, guess, link = step / 2, here.predicted(step), here.link
        once, _ = closed(link, guess, np.array([phi]), sweeps=1)
        (R, p), gap = closed(link, once, np.array([phi]))
        jump = _distance(link, once, guess)
        if gap[0] > OPEN or jump > JUMP or _distance(link, (R, p), once) > CONTRACTION * jump + SETTLED:
            continue
        try:
            there = _Stand(link, phi, (orthonormal(R), p))
        except np.linalg.LinAlgError:
            continue
        if np.linalg.slogdet(here.J.T @ there.J)[0] > 0:  # else a singular position lies between
            return there
    raise MotionError(stopped(here.link, here.poses, here.phi))


def _distance(link: Linkage, a: Poses, b: Poses) -> float:
    return float(max(np.abs(a[0] - b[0]).max(), np.abs(a[1] - b[1]).max() / link.size))
