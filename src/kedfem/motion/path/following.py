"""Paths of linkages over the range of their drives, with period and weakest position; the last ones are cached."""

import pickle
from dataclasses import replace
from hashlib import sha256

import numpy as np

from kedfem.arrays import Float
from kedfem.motion.batch import Choice, Moving
from kedfem.motion.constraints import ANGLE
from kedfem.motion.linkage import Linkage, resting_poses
from kedfem.motion.newton import OPEN
from kedfem.motion.path.continuation import ROUNDING, GridPoint, continued, quintics, shapes, split, started
from kedfem.motion.path.record import Path
from kedfem.motion.path.refinement import halved, refined
from kedfem.motion.path.weakest import checked

FINER = 0.25  # of a usual step: where one between two grid points cannot be closed
MOST_TURNS = 60  # that a linkage may take to return to its pose
RETURNED = 1e-9  # of the size [-, rad]: as closely gears must return
MOST_KEPT = 4  # paths of a process


def path(link: Linkage, low: float, high: float) -> Path:
    """Follow the linkage from its reference position over low ≤ 0 ≤ high of τ; undriven it rests there.

    The last ones are kept: a drive's speed does not change the path over whole periods.

    Raises
    ------
    MotionError
        Naming the joint and the place where the linkage locks or cannot be assembled.
    """
    if link.drive is None:
        rest = resting_poses(len(link.bodies))
        none = np.zeros_like(rest[1]), np.zeros_like(rest[1])
        shape = shapes(Moving(rest, none, none, np.zeros(1)))
        return _through(link, np.zeros(1), shape, np.zeros((1, len(link.rows.angles))), np.inf)
    period = link.drives.period()
    low, high = _on_periods(low, period), _on_periods(high, period)
    name = _named(link, low, high)
    found = _KEPT.pop(name, None) or _followed(link, low, high, period)
    _KEPT[name] = found
    if len(_KEPT) > MOST_KEPT:
        del _KEPT[next(iter(_KEPT))]
    return found


_KEPT: dict[bytes, Path] = {}
"""The last paths of this process, by linkage and range."""


def _named(link: Linkage, low: float, high: float) -> bytes:
    """A digest of all that a path depends on: of a single drive τ is its turn, whatever its law."""
    drives = replace(link.drives, laws=()) if len(link.drives) == 1 else link.drives
    return sha256(pickle.dumps((replace(link, drives=drives), low, high))).digest()


def _on_periods(tau: float, period: float) -> float:
    """A place that is whole periods off, but for rounding, at these."""
    if not np.isfinite(period):
        return tau
    whole = period * round(tau / period)
    return whole if abs(tau - whole) <= ROUNDING * abs(whole) else tau


def _followed(link: Linkage, low: float, high: float, period: float) -> Path:
    """By usual steps, or by finer ones where a position between two of these cannot be closed."""
    usual = link.drives.step(low, high)
    for step in (usual, FINER * usual):
        grid, period = _grid(link, low, high, period, step)
        phi, shape, near = (np.stack([getattr(g, x) for g in grid]) for x in ("tau", "shape", "near"))
        along, closes, factor = halved(link, _through(link, phi, shape.transpose(1, 0, 2), near, period))
        if closes:
            break
    return refined(link, checked(link, along, factor))


def _grid(link: Linkage, low: float, high: float, period: float, step: float) -> tuple[list[GridPoint], float]:
    """Grid points over a range, or over a period if the linkage is back after it, and that period."""
    start = started(link)
    ahead, behind = [start], [start]
    if high > period or low < -period:
        forwards = high > period
        once = _revolutions(link, start, step, period, high if forwards else low)
        turns = round(abs(once[-1].tau) / period)
        if _returned(link, start, once[-1]) and abs(abs(once[-1].tau) - turns * period) < ROUNDING * period:
            return once if forwards else once[::-1], turns * period
        ahead, behind = (once, behind) if forwards else (ahead, once)
    ahead = continued(link, ahead, step, high)
    behind = continued(link, behind, step, low)
    return behind[:0:-1] + ahead, np.inf


def _revolutions(link: Linkage, start: GridPoint, step: float, period: float, end: float) -> list[GridPoint]:
    """Turn by turn, until the linkage is back or the end reached; at most so many revolutions."""
    out = [start]
    for turn in range(1, MOST_TURNS + 1):
        to = np.sign(end) * min(turn * period, abs(end))
        out = continued(link, out, step, to)
        if abs(to) == abs(end) or _returned(link, start, out[-1]):
            break
    return out


def _returned(link: Linkage, start: GridPoint, here: GridPoint) -> bool:
    """Whether a linkage is in its first pose again."""
    one = len(link.drives) == 1 and not link.rows.plus
    pairs = zip(split(start.shape[:1]), split(here.shape[:1]), (1.0, link.size), strict=True)
    apart = (np.abs(one - other).max() / unit for one, other, unit in pairs)
    return bool(max(apart) < (OPEN if one else RETURNED))


def _through(
    link: Linkage, phi: Float[np.ndarray, " G"], shape: Float[np.ndarray, "3 G C"], near: Float[np.ndarray, "G A"],
    period: float,
) -> Path:  # fmt: skip
    """The path through grid points, not examined yet."""
    return Path(
        phi, shape, near, period, _gathered(link, near, period), (1.0, float(phi[0])),
        Choice(link.rows), quintics(shape, np.diff(phi)),
    )  # fmt: skip


def _gathered(link: Linkage, near: Float[np.ndarray, "G A"], period: float) -> Float[np.ndarray, " m"]:
    """What couplings gather over a period: turns of their angles are whole ones, their ratio need not be."""
    rows, out = link.rows, np.zeros(link.rows.count)
    if not np.isfinite(period):
        return out
    turns = np.zeros(len(rows.kind))
    turns[rows.angles] = np.round((near[-1] - near[0]) / (2 * np.pi))
    for k, other, c in rows.plus:
        out[k] += 2 * np.pi * c * turns[other]
    for k in {k for k, _, _ in rows.plus if rows.kind[k] == ANGLE}:
        out[k] += 2 * np.pi * turns[k]
    return out
