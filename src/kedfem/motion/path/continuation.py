"""Continuation along the drives: grid points one after the other, each predicted from those before and closed by Newton.

A step is halved until Newton converges at once and no singular position lies between both points, so that the assembly
branch never jumps.
"""

from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import MotionError
from kedfem.motion.batch import settled
from kedfem.motion.linkage import Linkage
from kedfem.motion.messages import stopped
from kedfem.motion.newton import (
    OPEN,
    SETTLED,
    BlockFactor,
    Factor,
    agree,
    cross_matrix,
    moved,
    orthonormal,
    target,
)
from kedfem.motion.values import Poses, Twists, features, turning

JUMP = 0.02  # of the size [-, rad]: a prediction that far off may lead to another branch
CONTRACTION = 0.1  # Newton's second step against its first: well within the branch's own basin
SMALLEST_STEP = 1e-6  # of a usual step
FIRST_STEP, GROWTH, AHEAD = (
    0.25,
    1.5,
    2.5,
)  # of a usual step; of the last one; farthest extrapolation, of the last one
FARTHEST = 0.8  # turn of a body between grid points [rad]
ROUNDING = 1e-12  # of τ against a usual step


@dataclass(frozen=True, slots=True)
class Stand:
    """One grid point: τ, poses and turns of angle rows (1, A) there, the rates of both by τ, the factored rows.

    shape : (3, 12 B) R and p of all bodies, and their two derivatives by τ
    """

    tau: float
    poses: Poses
    near: Float[np.ndarray, "1 A"]
    first: Twists
    second: Twists
    factor: Factor | BlockFactor
    turning: Float[np.ndarray, "1 A"]
    shape: Float[np.ndarray, "3 C"]

    def farthest(self) -> float:
        """The largest step in which no body turns far."""
        fastest = float(np.abs(self.first[1]).max())
        return FARTHEST / fastest if fastest > 0 else np.inf


def started(link: Linkage) -> Stand:
    """The grid point at the reference position."""
    f = features(link.rows, link.start, np.zeros((1, len(link.rows.angles))))
    found = _settled(link, 0.0, link.start, f.value[link.rows.angles].T)
    if found is None:
        raise MotionError(
            stopped(link, link.start, 0.0, target(link, np.zeros(1), f.value[link.rows.angles].T))
        )
    return found


def continued(link: Linkage, grid: list[Stand], usual: float, end: float) -> list[Stand]:
    """Grid points led on to `end`, by usual steps, smaller ones where the linkage comes near a dead point.

    Raises
    ------
    MotionError
        Naming the joint and the place where the linkage locks or cannot be assembled.
    """
    out, step = list(grid), usual if len(grid) > 1 else FIRST_STEP * usual
    while abs(end - out[-1].tau) > ROUNDING * usual:
        left = end - out[-1].tau
        out.append(
            _next(link, out, float(np.sign(left)) * min(step, usual, out[-1].farthest(), abs(left)), usual)
        )
        step = GROWTH * abs(out[-1].tau - out[-2].tau)
    return out


def _next(link: Linkage, grid: list[Stand], step: float, usual: float) -> Stand:
    """The next grid point, the step halved until Newton converges fast and the orientation stays."""
    here, least = grid[-1], min(SMALLEST_STEP * usual, abs(step))
    while abs(step) >= least:
        near = here.near + step * here.turning
        there = _settled(link, here.tau + step, _predicted(grid, step), near, JUMP)
        if there is not None and agree(here.factor, there.factor):  # else a singular position lies between
            return there
        step /= 2
    at = np.array([here.tau])
    raise MotionError(stopped(link, here.poses, here.tau, target(link, at, here.near)))


def _settled(
    link: Linkage, tau: float, guess: Poses, near: Float[np.ndarray, "1 A"], jump: float = np.inf
) -> Stand | None:
    """The grid point next to a guess; None if that is too far off, or Newton converges slowly."""
    at = np.array([tau])
    _, q1, q2 = link.drives.at(at)
    got = settled(link, guess, target(link, at, near), (q1, q2))
    steps, factor = got.steps, got.factor
    if factor is None or not got.gap[0] <= OPEN or steps[0][0] > jump:
        return None
    if len(steps) > 1 and steps[1][0] > CONTRACTION * steps[0][0] + SETTLED:
        return None
    R, p = orthonormal(got.poses[0]), got.poses[1]
    rates = turning(link.rows, factor.f, got.first)
    shape = shapes(R, p, got.first, got.second)[:, 0]
    return Stand(tau, (R, p), factor.f.value[link.rows.angles].T, got.first, got.second, factor, rates, shape)


def _predicted(grid: list[Stand], step: float) -> Poses:
    """Poses a step on: by the quintic through the last two grid points, of the first one by Taylor."""
    here = grid[-1]
    h = here.tau - grid[-2].tau if len(grid) > 1 else 0.0
    if h * step <= 0.0 or step / h > AHEAD:
        v, omega = (a * step + b * step**2 / 2 for a, b in zip(here.first, here.second, strict=True))
        return moved(here.poses, (v, omega))
    c, s = quintics(np.stack([grid[-2].shape, here.shape], axis=1), np.array([h]))[0], 1 + step / h
    x = c[5]
    for power in range(4, -1, -1):
        x = x * s + c[power]
    B = here.poses[1].shape[1]
    return orthonormal(x[: 9 * B].reshape(1, B, 3, 3)), x[9 * B :].reshape(1, B, 3)


def shapes(
    R: Float[np.ndarray, "G B 3 3"], p: Float[np.ndarray, "G B 3"], first: Twists, second: Twists
) -> Float[np.ndarray, "3 G C"]:
    """R and p of all bodies (C = 12 B numbers), and their two derivatives by τ."""
    W, A = cross_matrix(first[1]), cross_matrix(second[1])
    parts = ((R, p), (W @ R, first[0]), ((A + W @ W) @ R, second[0]))
    return np.stack([
        np.concatenate([r.reshape(len(p), -1), q.reshape(len(p), -1)], axis=1) for r, q in parts
    ])  # fmt: skip


def quintics(x: Float[np.ndarray, "3 G C"], h: Float[np.ndarray, " I"]) -> Float[np.ndarray, "I 6 C"]:
    """Coefficients in 0 ≤ s ≤ 1 through values and two derivatives at both ends of each interval of length h."""
    h = h[:, None]
    c0, c1, c2 = x[0, :-1], x[1, :-1] * h, x[2, :-1] * h**2 / 2
    D, E, F = x[0, 1:] - c0 - c1 - c2, x[1, 1:] * h - c1 - 2 * c2, x[2, 1:] * h**2 - 2 * c2
    c3, c4, c5 = 10 * D - 4 * E + F / 2, -15 * D + 7 * E - F, 6 * D - 3 * E + F / 2
    return np.stack([c0, c1, c2, c3, c4, c5], axis=1)
