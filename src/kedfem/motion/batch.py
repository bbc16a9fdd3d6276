"""Positions at all time points at once: from a close prediction, by one or two small linear systems each.

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
    driven_rows,
    factored,
    moved,
    remainder,
    scaled,
    stride,
    twists,
)
from kedfem.motion.values import Features, Poses, Twists, convective, features

EXACT = 1e-13  # a Newton step, of the linkage's size: rates at the poses before it are those after it
QUADRATIC = 1e-7  # after such a step the next one would be rounding
ITERATIONS = 12
SPREAD = 30.0  # how much worse a square set of rows may be conditioned than all rows
TRIES = 4  # places on a path whose own best rows are tried for all of it
POINTS, USUAL = (250, 12)  # time points solved together, as many as stay in the cache, of linkages of so many bodies

Rates = tuple[Float[np.ndarray, "T D"], Float[np.ndarray, "T D"]]


@dataclass(frozen=True, slots=True)
class Choice:
    """Rows to be solved, all or some of a linkage, with numbers of their constraints and angles; rest : to be checked."""

    rows: Rows
    which: Int[np.ndarray, " k"] | slice = field(default_factory=lambda: slice(None))
    angles: Int[np.ndarray, " a"] | slice = field(default_factory=lambda: slice(None))
    rest: "Choice | None" = None

    def target(self, aim: Target) -> Target:
        """What these rows shall be."""
        over = None if aim.over is None else aim.over[:, self.which]
        return Target(aim.q, aim.near[:, self.angles], over)


def choice(rows: Rows, which: Int[np.ndarray, " k"]) -> Choice:
    """Constraints picked by their numbers, all others to be checked."""
    others = np.setdiff1d(np.arange(rows.count), which)
    (chosen, angles), (left, their) = rows.part(which), rows.part(others)
    return Choice(chosen, which, angles, Choice(left, others, their) if len(others) else None)


def independent(J: Float[np.ndarray, "G m k"], least: Float[np.ndarray, " G"]) -> Int[np.ndarray, " i"]:
    """Numbers of k rows about as well conditioned as all of them at and between G places; all rows where none are.

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
class Moving:
    """Poses and rates of all bodies at T time points.

    poses : R (T, B, 3, 3), p (T, B, 3)
    first, second : twists (v, ω) and their time derivatives, each a pair of (T, B, 3)
    gap : (T,) largest gap left, in units of size; infinite where Newton has not settled
    steps : (T,) each: of points that were solved together the Newton steps, in units of size and radians
    factor : of these, rows at the poses
    """

    poses: Poses
    first: Twists
    second: Twists
    gap: Float[np.ndarray, " T"]
    steps: Sequence[Float[np.ndarray, " T"]] = ()
    factor: Factor | BlockFactor | None = None


def moving(link: Linkage, chosen: Choice, guess: Poses, aim: Target, rates: Rates) -> Moving:
    """Poses that close all joints next to a guess, and the bodies' rates at given speeds and accelerations of the drives.

    chosen : constraints to solve, square or in least squares
    """
    few = max(POINTS * USUAL // max(USUAL, len(link.bodies)), 1)
    return _in_parts(link, chosen, guess, aim, rates, few)


def settled(
    link: Linkage, chosen: Choice, guess: Poses, aim: Target, rates: Rates, limits: tuple[float, float] = (EXACT, np.inf)
) -> Moving:
    """The same of all points together, with the factored rows.

    limits : the least step of Newton to take; a first one that is farther is not followed up
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
                return _in_parts(link, chosen, poses, aim, rates, 1)
            none = np.zeros_like(poses[1]), np.zeros_like(poses[1])
            return Moving(poses, none, none, np.full(1, np.inf))
        change = twists(link, x[..., 0])
        before, step = step, stride(link, change)
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
    return Moving(poses, first, second, gap, steps, factor)


def _gaps(link: Linkage, chosen: Choice, poses: Poses, aim: Target) -> tuple[Features, Float[np.ndarray, "T m"]]:
    """How far rows are from what they shall be, in units of size, and what they are made of."""
    own = chosen.target(aim)
    f = features(chosen.rows, poses, own.near)
    return f, scaled(link, chosen.rows, remainder(chosen.rows, f, own))


def _in_parts(link: Linkage, chosen: Choice, guess: Poses, aim: Target, rates: Rates, few: int) -> Moving:
    """A few points at a time."""
    blocks = [slice(k, k + few) for k in range(0, max(len(aim), 1), few)]
    parts = [settled(link, chosen, (guess[0][b], guess[1][b]), aim.at(b), (rates[0][b], rates[1][b])) for b in blocks]
    return parts[0] if len(parts) == 1 else _joined(parts)


def _joined(parts: list[Moving]) -> Moving:
    """Successive time points, one after the other."""

    def pair(name: str) -> tuple[np.ndarray, np.ndarray]:
        one, other = ([getattr(x, name)[k] for x in parts] for k in (0, 1))
        return np.concatenate(one), np.concatenate(other)

    gap = np.concatenate([x.gap for x in parts])
    return Moving(pair("poses"), pair("first"), pair("second"), gap)
