"""Continuation along the drives: a few grid points at once, predicted from earlier ones and corrected by Newton's method.

A step is halved until Newton's method converges at once and no singular position lies between two points, so that the
solution stays on its assembly branch.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import MotionError
from kedfem.motion.batch import RowSelection, SolvedMotion, newton_solution
from kedfem.motion.linkage import Linkage, resting_poses
from kedfem.motion.messages import locking_message
from kedfem.motion.newton import OPEN, SETTLED, TINY, cross_matrix, orthonormal, same_branch, target
from kedfem.motion.values import Poses, angle_rates, features

JUMP = 0.02  # of the size [-, rad]: a larger error of a prediction may lead to another branch
CONTRACTION = 0.1  # ratio of Newton's second step to its first: well within the basin of the branch
SMALLEST_STEP = 1e-6  # of a usual step
FIRST_STEP, GROWTH = 0.25, 1.5  # of a usual step; of the last one
AHEAD = 6  # most grid points that are predicted together
SAFE = 0.5  # of JUMP: largest expected error of the last of them
FARTHEST, QUARTER = 0.8, np.pi / 2  # rotation of a body between grid points, and in a prediction [rad]
ROUNDING = 1e-12  # of τ against a usual step


@dataclass(frozen=True, slots=True)
class GridPoint:
    """One grid point.

    tau : its τ
    shape : (3, 12 B) R and p of all bodies, and their two derivatives by τ
    near, turning : (A,) angles of angle rows, and their rates by τ
    fastest : rate by τ of the fastest rotation of a body
    missed : error of its prediction, in units of size and radians
    J : scaled rows
    """

    tau: float
    shape: Float[np.ndarray, "3 C"]
    near: Float[np.ndarray, " A"]
    turning: Float[np.ndarray, " A"]
    fastest: float
    missed: float
    J: Float[np.ndarray, "m k"]


def reference_point(link: Linkage) -> GridPoint:
    """The grid point at the reference position."""
    rest = resting_poses(len(link.bodies))
    near = features(link.rows, rest).value[link.rows.angles].T
    found = _settled(link, np.zeros(1), rest, near)
    if not found:
        raise MotionError(locking_message(link, rest, 0.0, target(link, np.zeros(1), near)))
    return found[0]


def continued(link: Linkage, grid: list[GridPoint], usual: float, end: float) -> list[GridPoint]:
    """Grid points continued to `end` by usual steps, and smaller ones near dead points.

    Raises
    ------
    MotionError
        Naming the joint and the place where the linkage locks or cannot be assembled.
    """
    out, step, ahead = list(grid), usual if len(grid) > 1 else FIRST_STEP * usual, 3
    while abs(end - out[-1].tau) > ROUNDING * usual:
        found = _next(link, out, step, ahead, usual, end)
        out, missed = out + found, max(found[-1].missed, TINY)
        ahead = int(np.clip(len(found) * min((SAFE * JUMP / missed) ** (1 / 6), 2), 1, AHEAD))
        step = GROWTH * abs(out[-1].tau - out[-2].tau)
    return out


def _next(link: Linkage, grid: list[GridPoint], step: float, ahead: int, usual: float, end: float) -> list[GridPoint]:
    """The next grid points, the step halved until Newton's method converges fast on the same branch."""
    here = grid[-1]
    left = abs(end - here.tau)
    step = min(step, usual, left, FARTHEST / max(here.fastest, TINY))
    least = min(SMALLEST_STEP * usual, step)
    while step >= least:
        to = np.minimum(step * GROWTH ** np.arange(ahead), usual).cumsum()
        to = np.unique(np.where(to > left - ROUNDING * usual, left, to))
        to = np.sign(end - here.tau) * to[: max(int((here.fastest * to <= QUARTER).sum()), 1)]
        near = here.near + to[:, None] * here.turning
        if found := _settled(link, here.tau + to, _predicted(grid, to), near, here):
            return found
        step, ahead = step / 2, 1
    poses, at = split(here.shape[:1]), np.array([here.tau])
    raise MotionError(locking_message(link, poses, here.tau, target(link, at, here.near[None])))


def _settled(
    link: Linkage,
    tau: Float[np.ndarray, " T"],
    guess: Poses,
    near: Float[np.ndarray, "T A"],
    before: GridPoint | None = None,
) -> list[GridPoint]:
    """Grid points from guesses, up to one that is too far, converges slowly or lies beyond a singular position."""
    rates, jump = link.drives.at(tau)[1:], np.inf if before is None else JUMP
    got = newton_solution(link, RowSelection(link.rows), guess, target(link, tau, near), rates, (SETTLED, jump))
    steps, factor = got.steps, got.factor
    if factor is None:
        return []
    good, fastest = (got.gap <= OPEN) & (steps[0] <= jump), np.abs(got.first[1]).max(axis=(1, 2))
    if before is not None:
        good &= same_branch(link, np.concatenate([before.J[None], factor.J]))
        good[1:] &= np.abs(np.diff(tau)) * fastest[:-1] <= FARTHEST
    if len(steps) > 1:
        good &= steps[1] <= CONTRACTION * steps[0] + SETTLED
    shape, near = shapes(got), factor.f.value[link.rows.angles].T
    turns = angle_rates(link.rows, factor.f, got.first)
    return [
        GridPoint(float(tau[k]), shape[:, k], near[k], turns[k], fastest[k], steps[0][k], factor.J[k])
        for k in range(len(tau) if good.all() else int(good.argmin()))
    ]


def _predicted(grid: list[GridPoint], step: Float[np.ndarray, " T"]) -> Poses:
    """Extrapolated poses: by the quintic through the last two grid points, or the first one's Taylor series."""
    here = grid[-1]
    if len(grid) == 1:
        return on_curves(iter(here.shape[::-1] / np.array([[2.0], [1.0], [1.0]])), step)
    h = here.tau - grid[-2].tau
    c = quintics(np.stack([grid[-2].shape, here.shape], axis=1), np.array([h]))[0]
    return on_curves(iter(c[::-1]), 1 + step / h)


def on_curves(c: Iterator[Float[np.ndarray, "... C"]], s: Float[np.ndarray, " T"]) -> Poses:
    """Poses by polynomials of R and p at places s, highest coefficients first, with R orthonormalised."""
    x = next(c) + 0 * s[:, None]
    for each in c:
        x *= s[:, None]
        x += each
    R, p = split(x)
    return orthonormal(R), p


def split(x: Float[np.ndarray, "T C"]) -> Poses:
    """R and p of all bodies, from C = 12 B numbers."""
    B = x.shape[1] // 12
    return x[:, : 9 * B].reshape(-1, B, 3, 3), x[:, 9 * B :].reshape(-1, B, 3)


def shapes(got: SolvedMotion) -> Float[np.ndarray, "3 G C"]:
    """R and p of all bodies (C = 12 B numbers), and their two derivatives."""
    (R, p), W, A = got.poses, cross_matrix(got.first[1]), cross_matrix(got.second[1])
    R = orthonormal(R)
    parts = ((R, p), (W @ R, got.first[0]), ((A + W @ W) @ R, got.second[0]))
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
