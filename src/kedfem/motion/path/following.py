"""Paths of linkages over the range of their drives, with period and nearest singularity; the last ones are cached."""

import pickle
from dataclasses import replace
from hashlib import sha256

import numpy as np

from kedfem.arrays import Float
from kedfem.motion.batch import RowSelection, SolvedMotion
from kedfem.motion.constraints import ANGLE
from kedfem.motion.linkage import Linkage, resting_poses
from kedfem.motion.newton import OPEN
from kedfem.motion.path.conditioning import checked
from kedfem.motion.path.continuation import ROUNDING, GridPoint, continued, quintics, reference_point, shapes, split
from kedfem.motion.path.record import Path
from kedfem.motion.path.refinement import bisected, refined

FINER = 0.25  # of a usual step: where a position between two grid points cannot be closed
MOST_TURNS = 60  # revolutions in which a linkage may return to its pose
RETURNED = 1e-9  # of the size [-, rad]: tolerance of the return of gears
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
        shape = shapes(SolvedMotion(rest, none, none, np.zeros(1)))
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
    """A digest of all on which a path depends: not the law of a single drive, whose position τ is."""
    drives = replace(link.drives, laws=()) if len(link.drives) == 1 else link.drives
    return sha256(pickle.dumps((replace(link, drives=drives), low, high))).digest()


def _on_periods(tau: float, period: float) -> float:
    """τ, made a whole number of periods if it is one but for rounding."""
    if not np.isfinite(period):
        return tau
    whole = period * round(tau / period)
    return whole if abs(tau - whole) <= ROUNDING * abs(whole) else tau


def _followed(link: Linkage, low: float, high: float, period: float) -> Path:
    """The path by usual steps, or by finer ones where a position between two of these cannot be closed."""
    usual = link.drives.step(low, high)
    for step in (usual, FINER * usual):
        grid, period = _grid(link, low, high, period, step)
        phi, shape, near = (np.stack([getattr(g, x) for g in grid]) for x in ("tau", "shape", "near"))
        along, closes, factor = bisected(link, _through(link, phi, shape.transpose(1, 0, 2), near, period))
        if closes:
            break
    return refined(link, checked(link, along, factor))


def _grid(link: Linkage, low: float, high: float, period: float, step: float) -> tuple[list[GridPoint], float]:
    """Grid points over a range, or over a period if the linkage returns after it, and that period."""
    start = reference_point(link)
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
    """Grid points revolution by revolution, until the linkage returns or the end is reached; at most MOST_TURNS."""
    out = [start]
    for turn in range(1, MOST_TURNS + 1):
        to = np.sign(end) * min(turn * period, abs(end))
        out = continued(link, out, step, to)
        if abs(to) == abs(end) or _returned(link, start, out[-1]):
            break
    return out


def _returned(link: Linkage, start: GridPoint, here: GridPoint) -> bool:
    """Whether a linkage has returned to its first pose."""
    one = len(link.drives) == 1 and not link.rows.plus
    pairs = zip(split(start.shape[:1]), split(here.shape[:1]), (1.0, link.size), strict=True)
    apart = (np.abs(one - other).max() / unit for one, other, unit in pairs)
    return bool(max(apart) < (OPEN if one else RETURNED))


def _through(
    link: Linkage, phi: Float[np.ndarray, " G"], shape: Float[np.ndarray, "3 G C"], near: Float[np.ndarray, "G A"],
    period: float,
) -> Path:  # fmt: skip
    """The path through grid points, not yet checked for singularities."""
    return Path(
        phi, shape, near, period, _gathered(link, near, period), (1.0, float(phi[0])),
        RowSelection(link.rows), quintics(shape, np.diff(phi)),
    )  # fmt: skip


def _gathered(link: Linkage, near: Float[np.ndarray, "G A"], period: float) -> Float[np.ndarray, " m"]:
    """Change of couplings over a period: their angles change by whole revolutions, whatever the ratio."""
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
