"""Poses at many time points at once by Newton's method, from close predictions, and their velocities and accelerations.

A constant set of independent constraint equations, as many as unknowns, replaces least squares over all of them; the
others are only checked.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy.linalg

from kedfem.arrays import Float, Int
from kedfem.motion.constraints import Rows
from kedfem.motion.linkage import Linkage
from kedfem.motion.newton import (
    SETTLED,
    BlockFactor,
    Factor,
    Target,
    constraint_values,
    driven_rows,
    factored,
    moved,
    scaled,
    step_size,
    twists,
)
from kedfem.motion.values import Features, Poses, Twists, convective, features

EXACT = 1e-13  # a Newton step, of the linkage's size, before and after which rates are equal to rounding
QUADRATIC = 1e-7  # a Newton step after which the next one is rounding
ITERATIONS = 12
SPREAD = 30.0  # largest ratio of the condition of a square set of rows to that of all rows
TRIES = 4  # places on a path whose best rows are tried for all of it
POINTS, USUAL = (250, 12)  # time points solved together, as fit into the cache, for linkages of so many bodies

Rates = tuple[Float[np.ndarray, "T D"], Float[np.ndarray, "T D"]]


@dataclass(frozen=True, slots=True)
class RowSelection:
    """Rows to be solved, all or some of a linkage, with numbers of their constraints and angles; rest : to be checked."""

    rows: Rows
    which: Int[np.ndarray, " k"] | slice = field(default_factory=lambda: slice(None))
    angles: Int[np.ndarray, " a"] | slice = field(default_factory=lambda: slice(None))
    rest: "RowSelection | None" = None

    def target(self, aim: Target) -> Target:
        """Required values of these rows."""
        over = None if aim.over is None else aim.over[:, self.which]
        return Target(aim.q, aim.near[:, self.angles], over)


def row_selection(rows: Rows, which: Int[np.ndarray, " k"]) -> RowSelection:
    """The constraints with some numbers, all others to be checked."""
    others = np.setdiff1d(np.arange(rows.count), which)
    (chosen, angles), (left, their) = rows.part(which), rows.part(others)
    return RowSelection(chosen, which, angles, RowSelection(left, others, their) if len(others) else None)


def independent(J: Float[np.ndarray, "G m k"], least: Float[np.ndarray, " G"]) -> Int[np.ndarray, " i"]:
    """Numbers of k rows about as well conditioned as all rows at and between G places; of all rows if there are none.

    Parameters
    ----------
    J : scaled rows; least : (G,) their smallest singular values
    """
    m, k = J.shape[1:]
    at = int(least.argmin())
    for _ in range(TRIES if m > k else 0):
        _, _, pivot = scipy.linalg.qr(J[at].T, pivoting=True, mode="economic")
        which = np.sort(pivot[:k])
        try:
            worse = np.linalg.norm(np.linalg.inv(J[:, which]), axis=(1, 2)) * least
        except np.linalg.LinAlgError:
            return np.arange(m)
        sign = np.linalg.slogdet(J[:, which])[0]  # where it changes, they are singular between two places
        if worse.max() < SPREAD * np.sqrt(k) and (sign == sign[0]).all():
            return np.asarray(which)
        at = int(worse.argmax())
    return np.arange(m)


@dataclass(frozen=True, slots=True)
class SolvedMotion:
    """Poses and rates of all bodies at T time points.

    poses : R (T, B, 3, 3), p (T, B, 3)
    first, second : twists (v, ω) and their time derivatives, each a pair of (T, B, 3)
    gap : (T,) largest residual of the joints, in units of size; infinite where Newton's method has not converged
    steps : (T,) each, Newton steps of points that were solved together, in units of size and radians
    factor : factored rows of these at the poses
    """

    poses: Poses
    first: Twists
    second: Twists
    gap: Float[np.ndarray, " T"]
    steps: Sequence[Float[np.ndarray, " T"]] = ()
    factor: Factor | BlockFactor | None = None


def solved_motion(
    link: Linkage, chosen: RowSelection, guess: Poses, aim: Target, rates: Rates, few: int = 0
) -> SolvedMotion:
    """Poses that close all joints, from a guess, and the bodies' rates at given speeds and accelerations of the drives.

    Parameters
    ----------
    chosen : constraints to solve, square or in least squares
    few : time points solved together; as many as fit into the cache if not given
    """
    few = few or max(POINTS * USUAL // max(USUAL, len(link.bodies)), 1)
    blocks = [slice(k, k + few) for k in range(0, max(len(aim), 1), few)]
    parts = [
        newton_solution(link, chosen, (guess[0][b], guess[1][b]), aim.at(b), (rates[0][b], rates[1][b])) for b in blocks
    ]
    return parts[0] if len(parts) == 1 else _joined(parts)


def newton_solution(
    link: Linkage,
    chosen: RowSelection,
    guess: Poses,
    aim: Target,
    rates: Rates,
    limits: tuple[float, float] = (EXACT, np.inf),
) -> SolvedMotion:
    """`solved_motion` of all points together, with the factored rows.

    limits : Newton step at which iterations end; first step beyond which a point is not iterated
    """
    rows, poses, steps = chosen.rows, guess, []
    scale = rows.scale(link.size)[: rows.count]
    rhs = np.empty((len(aim), rows.count, 2))
    rhs[..., 1] = driven_rows(rows, rates[0]) * scale
    step = before = np.full(len(aim), np.inf)
    for _ in range(ITERATIONS):
        f, gaps = _gaps(link, chosen, poses, aim)
        rhs[..., 0] = -gaps
        try:
            factor = factored(link, f, rows)
            x = factor.solve(rhs)
        except np.linalg.LinAlgError:
            if len(aim) > 1:
                return solved_motion(link, chosen, poses, aim, rates, 1)
            none = np.zeros_like(poses[1]), np.zeros_like(poses[1])
            return SolvedMotion(poses, none, none, np.full(1, np.inf))
        change = twists(link, x[..., 0])
        before, step = step, step_size(link, change)
        steps.append(step)
        poses = moved(poses, change)
        unsettled = (step > limits[0]) & (before > QUADRATIC) & (steps[0] <= limits[1])
        if not unsettled.any() or not (step < 1).any():
            break
    first = twists(link, x[..., 1])
    bent = scale * (driven_rows(rows, rates[1]) - convective(rows, f, first))
    second = twists(link, factor.solve(bent[..., None])[..., 0])
    if chosen.rest is not None:
        gaps = np.concatenate([gaps, _gaps(link, chosen.rest, poses, aim)[1]], axis=1)
    gap = np.where(step <= SETTLED, np.abs(gaps).max(axis=1, initial=0.0), np.inf)
    return SolvedMotion(poses, first, second, gap, steps, factor)


def _gaps(link: Linkage, chosen: RowSelection, poses: Poses, aim: Target) -> tuple[Features, Float[np.ndarray, "T m"]]:
    """Features of rows, and their residuals in units of size."""
    own = chosen.target(aim)
    f = features(chosen.rows, poses, own.near)
    return f, scaled(link, chosen.rows, constraint_values(chosen.rows, f, own))


def _joined(parts: list[SolvedMotion]) -> SolvedMotion:
    """Successive time points, one after the other."""

    def pair(name: str) -> tuple[np.ndarray, np.ndarray]:
        one, other = ([getattr(x, name)[k] for x in parts] for k in (0, 1))
        return np.concatenate(one), np.concatenate(other)

    gap = np.concatenate([x.gap for x in parts])
    return SolvedMotion(pair("poses"), pair("first"), pair("second"), gap)
