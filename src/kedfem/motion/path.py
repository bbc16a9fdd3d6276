"""Continuation along the drives: poses on a grid of τ, so that the assembly branch never jumps.

τ is the drive's turn or travel; with several drives it is the time.
"""

import pickle
from dataclasses import dataclass, replace
from hashlib import sha256

import numpy as np
from jaxtyping import Float, Int

from kedfem.errors import MotionError
from kedfem.motion.batch import independent
from kedfem.motion.constraints import ANGLE
from kedfem.motion.linkage import Linkage
from kedfem.motion.messages import stopped
from kedfem.motion.newton import (
    OPEN,
    SETTLED,
    BlockFactor,
    Factor,
    Target,
    agree,
    closed,
    cross_matrix,
    derivatives,
    factored,
    moved,
    orthonormal,
    target,
)
from kedfem.motion.values import Poses, Twists, features, turning

JUMP = 0.02  # of the size [-, rad]: a prediction that far off may lead to another branch
CONTRACTION = 0.1  # Newton's second step against its first: well within the branch's own basin
SMALLEST_STEP = 1e-6  # of a usual step
FARTHEST = 0.8  # turn of a body between grid points [rad]
ROUNDING = 1e-12  # of τ against a usual step
WEAK, SINGULAR = 0.05, 1e-7  # relative singular values: worth a closer look; a dead point
MOST_TURNS = 60  # that a linkage may take to return to its pose
RETURNED = 1e-9  # of the size [-, rad]: as closely gears must return
FINE = 3e-14  # of the size: error of a prediction from which rates can be taken
NEAR = 1e-8  # of large linkages: one more sweep of Newton costs less than a finer grid
REFINEMENTS, MOST_POINTS = 4, 20_000
MOST_KEPT = 4  # paths of a process


@dataclass(frozen=True, slots=True)
class Path:
    """Poses on a grid of τ, with derivatives by τ.

    phi : (G,) τ, increasing [rad or m; s with several drives]
    R, p : (G, B, 3, 3), (G, B, 3) poses of all bodies, ground first
    first, second : twists (v, ω) and their derivatives by τ, each a pair of (G, B, 3)
    near : (G, A) turns of the angle rows, counted on from the start [rad]
    period : τ after which the linkage returns to its pose; infinite if it does not
    over : (m,) what the rows gather over a period: gears whose ratio is not quite that of whole turns
    weakest : smallest singular value met on the way, relative, and τ there
    rows : numbers of rows that hold all motions, well conditioned all along
    curve : (G - 1, 6, 12 B) coefficients of the quintics between grid points, of R and p
    """

    phi: Float[np.ndarray, " G"]
    R: Float[np.ndarray, "G B 3 3"]
    p: Float[np.ndarray, "G B 3"]
    first: Twists
    second: Twists
    near: Float[np.ndarray, "G A"]
    period: float
    over: Float[np.ndarray, " m"]
    weakest: tuple[float, float]
    rows: Int[np.ndarray, " k"]
    curve: Float[np.ndarray, "I 6 C"]

    @property
    def periodic(self) -> bool:
        """Whether the linkage returns to its pose."""
        return bool(np.isfinite(self.period))

    def holds(self, low: float, high: float) -> bool:
        """Whether it reaches so far, up to rounding."""
        slack = ROUNDING * (1 + self.phi[-1] - self.phi[0])
        return self.periodic or bool(self.phi[0] - slack <= low and high <= self.phi[-1] + slack)


def path(link: Linkage, low: float, high: float) -> Path:
    """Follow the linkage from its reference position over low ≤ 0 ≤ high of τ; undriven it rests there.

    The last ones are kept: a drive's speed does not change the path over whole periods.

    Raises
    ------
    MotionError
        Naming the joint and the place where the linkage locks or cannot be assembled.
    """
    if link.drive is None:
        none, A = np.zeros((1, len(link.bodies), 3)), len(link.rows.angles)
        return Path(
            np.zeros(1), *link.start, (none, none), (none, none), np.zeros((1, A)), np.inf,
            np.zeros(link.rows.count), (1.0, 0.0), np.arange(link.rows.count), np.zeros((0, 6, 12)),
        )  # fmt: skip
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
    step = link.drives.step(low, high)
    start = _Stand(link, 0.0, *_started(link))
    ahead, behind = [start], [start]
    if high > period or low < -period:
        forwards = high > period
        once = _turns(start, step, period, high if forwards else low)
        turns = round(abs(once[-1].tau) / period)
        if _returned(start, once[-1]) and abs(abs(once[-1].tau) - turns * period) < ROUNDING * period:
            return _checked(once if forwards else once[::-1], turns * period)
        ahead, behind = (once, behind) if forwards else (ahead, once)
    ahead = _branch(ahead, step, high)
    behind = _branch(behind, step, low)
    return _checked(behind[:0:-1] + ahead, np.inf)


def _started(link: Linkage) -> tuple[Poses, Float[np.ndarray, "1 A"]]:
    """Poses and turns of angle rows at the start."""
    near = np.zeros((1, len(link.rows.angles)))
    f = features(link.rows, link.start, near)
    return link.start, f.value[link.rows.angles].T


def _turns(start: "_Stand", step: float, period: float, end: float) -> list["_Stand"]:
    """Turn by turn, until the linkage is back or the end reached; at most so many turns."""
    out = [start]
    for turn in range(1, MOST_TURNS + 1):
        to = np.sign(end) * min(turn * period, abs(end))
        out = _branch(out, step, to)
        if abs(to) == abs(end) or _returned(start, out[-1]):
            break
    return out


def _returned(start: "_Stand", here: "_Stand") -> bool:
    """Whether a linkage is in its first pose again."""
    link = start.link
    one = len(link.drives) == 1 and not link.rows.plus
    return _distance(link, start.poses, here.poses) < (OPEN if one else RETURNED)


def place_on(along: Path, tau: Float[np.ndarray, " T"]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Interval of the grid (T,), place in it from 0 to 1 (T,), and number of periods before (T,)."""
    turns = np.zeros_like(tau)
    if along.periodic:
        turns = np.floor((tau - along.phi[0]) / along.period)
        tau = np.clip(tau - turns * along.period, along.phi[0], along.phi[-1])
    last = len(along.phi) - 1
    k = np.clip(np.searchsorted(along.phi, tau) - 1, 0, max(last - 1, 0))
    h = along.phi[np.minimum(k + 1, last)] - along.phi[k]
    return k, (tau - along.phi[k]) / np.where(h > 0, h, 1.0), turns


def predicted(along: Path, tau: Float[np.ndarray, " T"]) -> Poses:
    """Poses between grid points: quintic Hermite interpolation of R and p, R made a rotation again."""
    k, s, _ = place_on(along, tau)
    B = along.p.shape[1]
    if not len(along.curve):
        return np.tile(along.R, (len(tau), 1, 1, 1)), np.tile(along.p, (len(tau), 1, 1))
    x, s = along.curve[k, 5], s[:, None]
    for power in range(4, -1, -1):
        x *= s
        x += along.curve[k, power]
    return orthonormal(x[:, : 9 * B].reshape(-1, B, 3, 3)), x[:, 9 * B :].reshape(-1, B, 3)


def aimed(link: Linkage, along: Path, tau: Float[np.ndarray, " T"]) -> Target:
    """What the rows shall be: values of the drives, and turns of couplings from those on the grid."""
    k, s, turns = place_on(along, tau)
    there = np.minimum(k + 1, len(along.phi) - 1)
    near = along.near[k] + s[:, None] * (along.near[there] - along.near[k])
    aim = target(link, tau, near)
    return replace(aim, over=turns[:, None] * along.over) if along.over.any() else aim


def _curve(phi: np.ndarray, R: np.ndarray, p: np.ndarray, first: Twists, second: Twists) -> np.ndarray:
    """Quintics in 0 ≤ s ≤ 1 through values and two derivatives at both ends of each interval."""
    W, A = cross_matrix(first[1]), cross_matrix(second[1])
    parts = ((R, p), (W @ R, first[0]), ((A + W @ W) @ R, second[0]))
    x, x1, x2 = (np.concatenate([r.reshape(len(p), -1), q.reshape(len(p), -1)], axis=1) for r, q in parts)
    h = np.diff(phi)[:, None]
    c0, c1, c2 = x[:-1], x1[:-1] * h, x2[:-1] * h**2 / 2
    D, E, F = x[1:] - c0 - c1 - c2, x1[1:] * h - c1 - 2 * c2, x2[1:] * h**2 - 2 * c2
    c3, c4, c5 = 10 * D - 4 * E + F / 2, -15 * D + 7 * E - F, 6 * D - 3 * E + F / 2
    return np.stack([c0, c1, c2, c3, c4, c5], axis=1)


def _checked(grid: list["_Stand"], period: float) -> Path:
    """The path through grid points, refused if it passes a dead point, on the grid or between."""
    link = grid[0].link
    phi = np.array([g.tau for g in grid])
    R, p = (np.concatenate([g.poses[k] for g in grid]) for k in (0, 1))
    near = np.concatenate([g.near for g in grid])
    first, second, factor = derivatives(link, (R, p), phi, target(link, phi, near))
    weakness, singular = _weakness(factor)
    least = int(weakness.argmin())
    along = Path(
        phi, R, p, first, second, near, period, _gathered(link, near, period),
        (float(weakness[least]), float(phi[least])), _solving(link, factor, singular),
        _curve(phi, R, p, first, second),
    )  # fmt: skip
    beside = np.pad(weakness, 1, constant_values=np.inf)
    dips = np.flatnonzero((weakness <= beside[:-2]) & (weakness <= beside[2:]) & (weakness < WEAK))
    for k in dips[np.argsort(np.abs(phi[dips]), kind="stable")]:  # the first met is named
        along = _closer(link, along, float(phi[max(k - 1, 0)]), float(phi[min(k + 1, len(phi) - 1)]))
        if along.weakest[0] < SINGULAR:
            at = np.array([along.weakest[1]])
            raise MotionError(stopped(link, predicted(along, at), float(at[0]), aimed(link, along, at)))
    return _refined(link, along)


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


def _refined(link: Linkage, along: Path) -> Path:
    """Grid points added where the middle between two is not predicted to rounding."""
    fresh = np.ones(len(along.phi) - 1, bool)
    for _ in range(REFINEMENTS):
        middle = (along.phi[:-1] + along.phi[1:])[fresh] / 2
        if not len(middle) or len(along.phi) + len(middle) > MOST_POINTS:
            break
        aim, guess = aimed(link, along, middle), predicted(along, middle)
        poses, gap = closed(link, guess, aim)
        off = np.isfinite(gap) & (_distances(link, poses, guess) > (FINE if link.blocks is None else NEAR))
        if not off.any():
            break
        poses, aim = (orthonormal(poses[0][off]), poses[1][off]), aim.at(off)
        along, fresh = _inserted(link, along, (middle[off], *poses, aim.near))
    return along


def _inserted(
    link: Linkage, along: Path, new: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
) -> tuple[Path, np.ndarray]:
    """The path with further grid points, and which of its intervals end or begin at one of these."""
    tau, R, p, near = new
    at = np.searchsorted(along.phi, tau)
    first, second, factor = derivatives(link, (R, p), tau, target(link, tau, near))
    near = factor.f.value[link.rows.angles].T

    def both(old: np.ndarray, more: np.ndarray) -> np.ndarray:
        return np.insert(old, at, more, axis=0)

    phi, R, p = both(along.phi, tau), both(along.R, R), both(along.p, p)
    first, second = (
        (both(old[0], more[0]), both(old[1], more[1]))
        for old, more in ((along.first, first), (along.second, second))
    )
    added = np.insert(np.zeros(len(along.phi), bool), at, True)
    curve = _curve(phi, R, p, first, second)
    return (
        replace(
            along, phi=phi, R=R, p=p, first=first, second=second, near=both(along.near, near), curve=curve
        ),
        added[:-1] | added[1:],
    )


def _closer(link: Linkage, along: Path, low: float, high: float) -> Path:
    """A closer look at the weakest position between two values of τ: the interval narrowed seven times."""
    for _ in range(7):
        tau = np.linspace(low, high, 33)
        aim = aimed(link, along, tau)
        poses, _ = closed(link, predicted(along, tau), aim, sweeps=2)
        weakness, _ = _weakness(factored(link, features(link.rows, poses, aim.near)))
        k = int(weakness.argmin())
        low, high = tau[max(k - 1, 0)], tau[min(k + 1, 32)]
        if weakness[k] < along.weakest[0]:
            along = replace(along, weakest=(float(weakness[k]), float(tau[k])))
    return along


def _weakness(factor: Factor | BlockFactor) -> tuple[Float[np.ndarray, " T"], Float[np.ndarray, " T"]]:
    """Least singular values of the scaled rows, 0 at a dead point: relative to the greatest, and absolute."""
    greatest, least = factor.extremes().T
    return least / greatest, least


def _solving(
    link: Linkage, factor: Factor | BlockFactor, least: Float[np.ndarray, " G"]
) -> Int[np.ndarray, " k"]:
    """Rows that are solved for: of a small linkage as many as motions, else all in the least squares."""
    if isinstance(factor, Factor):
        return independent(factor.J, least)
    return np.arange(link.rows.count)


class _Stand:
    """One grid point with its factored rows and the rates of the motion."""

    def __init__(self, link: Linkage, tau: float, poses: Poses, near: Float[np.ndarray, "1 A"]) -> None:
        self.link, self.tau, self.poses = link, tau, poses
        at = np.array([tau])
        self.first, self.second, factor = derivatives(link, poses, at, target(link, at, near))
        self.near = factor.f.value[link.rows.angles].T
        self.turning = turning(link.rows, factor.f, self.first)
        self.factor = factor

    def predicted(self, step: float) -> Poses:
        """Second-order Taylor."""
        v, omega = (a * step + b * step**2 / 2 for a, b in zip(self.first, self.second, strict=True))
        return moved(self.poses, (v, omega))

    def farthest(self) -> float:
        """The largest step in which no body turns far."""
        fastest = float(np.abs(self.first[1]).max())
        return FARTHEST / fastest if fastest > 0 else np.inf


def _branch(grid: list[_Stand], usual: float, end: float) -> list[_Stand]:
    """Grid points continued to `end`, step halved where the linkage comes near a dead point."""
    here, out, step = grid[-1], list(grid), usual
    while abs(end - here.tau) > ROUNDING * usual:
        before = here
        step = min(step, usual, here.farthest())
        here = _next(before, float(np.sign(end - here.tau)) * min(step, abs(end - here.tau)), usual)
        step = 1.5 * abs(here.tau - before.tau)
        out.append(here)
    return out


def _next(here: _Stand, step: float, usual: float) -> _Stand:
    """The next grid point, the step halved until Newton converges fast and the orientation stays."""
    least = min(SMALLEST_STEP * usual, abs(step))
    link = here.link
    while abs(step) >= least:
        tau, guess = here.tau + step, here.predicted(step)
        aim = target(link, np.array([tau]), here.near + step * here.turning)
        step = step / 2
        once, _ = closed(link, guess, aim, sweeps=1)
        (R, p), gap = closed(link, once, aim)
        jump = _distance(link, once, guess)
        if gap[0] > OPEN or jump > JUMP or _distance(link, (R, p), once) > CONTRACTION * jump + SETTLED:
            continue
        try:
            there = _Stand(link, tau, (orthonormal(R), p), aim.near)
        except np.linalg.LinAlgError:
            continue
        if agree(here.factor, there.factor):  # else a singular position lies between
            return there
    at = np.array([here.tau])
    raise MotionError(stopped(link, here.poses, here.tau, target(link, at, here.near)))


def _distance(link: Linkage, a: Poses, b: Poses) -> float:
    return float(_distances(link, a, b).max())


def _distances(link: Linkage, a: Poses, b: Poses) -> Float[np.ndarray, " T"]:
    """How far poses are apart, in the linkage's size and radians."""
    apart = np.abs(a[0] - b[0]).max(axis=(1, 2, 3)), np.abs(a[1] - b[1]).max(axis=(1, 2)) / link.size
    return np.asarray(np.maximum(*apart))
