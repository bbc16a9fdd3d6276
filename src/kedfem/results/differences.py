"""Differences of runs from the first one in their common channels, over time or the drive's position."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from kedfem.arrays import Float
from kedfem.results.channels import NOTHING, Channel, largest_by_unit
from kedfem.results.records import Results

Over = Literal["time", "drive"]
SAME = 1e-9  # of a range: tolerance within which grids, and motions of drives, are equal
CUBIC = 3
FAINT = 3e-3  # of the largest force times the linkage's size, or of the largest value of the same kind: zero if below
SMALL = 0.1  # of the largest value of the same kind: a channel below it is zero if its error is larger than itself
MOMENT = "moments of joints"
WHOLE = {"position", "travel", "total_velocity", "total_acceleration"}  # quantities of which deflections are little


@dataclass(frozen=True, slots=True)
class Difference:
    """A channel of several runs at those rows of one run that lie within all runs.

    values : runs × (T, c) [unit of the channel]
    peaks : (runs,) largest magnitude; of stress channels of the von Mises stress
    largest, rms : (runs,) of the difference from the first run [relative to `scale`]
    at : (runs,) time or position of the largest difference [s], or [rad], [m] over the drive
    scale : (runs,) the first run's peak, or of a channel that is zero beside others its highest one of the same kind
    """

    channel: Channel
    values: tuple[Float[np.ndarray, "T c"], ...]
    peaks: Float[np.ndarray, " runs"]
    largest: Float[np.ndarray, " runs"]
    rms: Float[np.ndarray, " runs"]
    at: Float[np.ndarray, " runs"]
    scale: Float[np.ndarray, " runs"]

    @property
    def zero(self) -> bool:
        """Whether the channel is zero beside others in the first run."""
        return bool((self.scale != self.peaks[0]).any())


def comparable(channel: Channel) -> str:
    """The kind of values beside which a channel may be zero: of one unit, elastic motion apart from that of the links,
    moments of joints from torques, each energy by itself.

    >>> comparable(Channel("probes/tip/position", ("x", "y", "z"), "m", "world", ""))
    'm of links'
    """
    quantity = channel.name.rsplit("/", 1)[-1]
    if channel.name.startswith("energy/"):
        return channel.name
    return MOMENT if quantity == "moment" else f"{channel.unit} of links" if quantity in WHOLE else channel.unit


def scales(
    errors: Mapping[str, float], sizes: Mapping[str, tuple[str, float]], zeros: set[str] | None = None
) -> dict[str, float]:
    """Value to which each channel's error is relative: its largest, or the largest of its kind if the channel is zero.

    A channel is zero if its largest value is below FAINT of the largest of its kind, or below SMALL of it and below its
    own error. Torques keep their own scale: that of a wrist is small beside that of a shoulder, and matters.

    Parameters
    ----------
    errors : in the channel's unit
    sizes : kind, as `comparable` has it, and largest value of each channel
    zeros : set to which the names of channels that are zero are added
    """
    largest: dict[str, float] = {}
    for kind, size in sizes.values():
        largest[kind] = max(largest.get(kind, 0.0), size)
    out = {}
    for name, error in errors.items():
        kind, size = sizes[name]
        most = largest[kind]
        zero = kind != "N m" and (size <= FAINT * most or error > size <= SMALL * most)
        out[name] = most if zero else size
        if zero and zeros is not None:
            zeros.add(name)
    return out


def sparsest(runs: Sequence[Results]) -> int:
    """The run at whose rows all are compared: the first one, or with thinned runs the one with the longest gaps."""
    gaps = [float(np.ptp(run.time)) / max(len(run.time) - 1, 1) if run.every > 1 else 0.0 for run in runs]
    return int(np.argmax(gaps))


def common_abscissa(runs: Sequence[Results], over: Over | None) -> tuple[Over, Float[np.ndarray, " T"]]:
    """The common abscissa of runs, and the rows of one run, `sparsest`, that lie within all of them.

    Over the drive where it keeps on in one direction in every run, and moves otherwise over time in some; else over time.

    Raises
    ------
    ValueError
        They have no stretch in common; or over the drive, where it stands still, turns back or is of another kind.
    """
    drives = all(_rising(run.angle) and run.drive == runs[0].drive for run in runs)
    if over == "drive" and not drives:
        raise ValueError("a drive that keeps on in one direction, the same in all runs")
    if over is None:
        over = "drive" if drives and not _moved_alike(runs) else "time"
    every = [_along(run, over) for run in runs]
    low, high = max(x.min() for x in every), min(x.max() for x in every)
    slack = SAME * (high - low)
    at = np.sort(every[sparsest(runs)])
    inside = at[(at >= low - slack) & (at <= high + slack)]
    if not high > low or len(inside) <= CUBIC:
        raise ValueError(f"runs that share a stretch of {'the drive' if over == 'drive' else 'time'}")
    return over, np.clip(inside, low, high)


def _along(run: Results, over: Over) -> Float[np.ndarray, " n"]:
    return run.time if over == "time" else run.angle


def _rising(x: Float[np.ndarray, " n"]) -> bool:
    """Whether the values are monotonic."""
    steps = np.diff(x)
    return len(x) > CUBIC and bool((steps > 0).all() or (steps < 0).all())


def _moved_alike(runs: Sequence[Results]) -> bool:
    """Whether the drives of all runs have the same positions at the same times, over their common time."""
    first = runs[sparsest(runs)]
    size = float(np.ptp(first.angle)) or 1.0
    for run in (run for run in runs if run is not first):
        t = first.time[(first.time >= run.time[0]) & (first.time <= run.time[-1])]
        if not len(t):
            return False
        there = _smooth(run.time, run.angle[:, None], t)[:, 0]
        if np.abs(there - np.interp(t, first.time, first.angle)).max() > 1e-3 * size:
            return False
    return True


def _smooth(x: Float[np.ndarray, " n"], y: Float[np.ndarray, "n c"], at: Float[np.ndarray, " T"]) -> np.ndarray:
    """Values at given points: the rows themselves where they coincide, else the cubic spline through them."""
    order = np.argsort(x)
    x, y = x[order], y[order]
    near = np.clip(np.searchsorted(x, at), 1, len(x) - 1)
    near -= at - x[near - 1] < x[near] - at
    if (np.abs(x[near] - at) <= SAME * np.ptp(x)).all():
        return np.asarray(y[near])
    if len(x) <= CUBIC or not np.isfinite(y).all():
        return np.stack([np.interp(at, x, each) for each in y.T], axis=1)
    from scipy.interpolate import make_interp_spline

    return np.asarray(make_interp_spline(x, y, k=CUBIC)(at))


def differences(runs: Sequence[Results], over: Over, at: Float[np.ndarray, " T"]) -> list[Difference]:
    """Differences in all common channels, in the first run's order; channels that are rounding are left out."""
    out, highest = [], largest_by_unit(runs[0].channels.values())
    thinned = any(run.every > 1 for run in runs)
    for name in common_channels(runs):
        channel, _ = runs[0].channels[name]
        values = tuple(_smooth(_along(run, over), run.channels[name][1], at) for run in runs)
        sizes = [magnitude(channel, x) for x in values]
        between = [_largest(run, channel, over, at) if thinned else 0.0 for run in runs]
        peaks = np.array([float(np.max(x, initial=most)) for x, most in zip(sizes, between, strict=True)])
        if peaks.max() > NOTHING * highest.get(channel.unit, 0.0):
            off = [magnitude(channel, x - values[0]) for x in values]
            most, rms = np.array([x.max() for x in off]), np.array([np.sqrt(np.mean(x**2)) for x in off])
            where = np.array([at[x.argmax()] for x in off])
            out.append(Difference(channel, values, peaks, most, rms, where, np.ones(len(runs))))
    return _relative(out)


def _relative(found: Sequence[Difference]) -> list[Difference]:
    """Differences [unit of the channel] relative to the first run's values, as `scales` has it run by run.

    Where the first run has nothing of a kind they are relative to the other run's peak.
    """
    sizes = {each.channel.name: (comparable(each.channel), float(each.peaks[0])) for each in found}
    runs = range(len(found[0].peaks) if found else 0)
    every = [scales({each.channel.name: float(each.largest[k]) for each in found}, sizes) for k in runs]
    out = []
    for each in found:
        scale = np.array([by[each.channel.name] for by in every])
        scale = np.where(scale > 0, scale, np.where(each.peaks > 0, each.peaks, 1.0))
        out.append(replace(each, largest=each.largest / scale, rms=each.rms / scale, scale=scale))
    return out


def _largest(run: Results, channel: Channel, over: Over, at: Float[np.ndarray, " T"]) -> float:
    """The largest value of all time points of a run in an interval, also of those that are not rows."""
    time, angle, values = run.largest_rows(channel.name)
    x = time if over == "time" else angle
    sizes = magnitude(channel, values)[(x >= at[0]) & (x <= at[-1])]
    return float(np.max(sizes, initial=0.0))


def common_channels(runs: Sequence[Results]) -> list[str]:
    """The common channels of all runs: those with the same columns, unit and frame."""

    def described(run: Results, name: str) -> tuple[object, ...]:
        channel, _ = run.channels[name]
        return channel.columns, channel.unit, channel.frame

    first, *others = runs
    return [
        name for name in first.channels
        if all(name in run.channels and described(run, name) == described(first, name) for run in others)
    ]  # fmt: skip


def magnitude(channel: Channel, values: Float[np.ndarray, "T c"]) -> Float[np.ndarray, " T"]:
    """Length of a vector, von Mises stress of a tensor, else the largest of the columns."""
    if "von_mises" in channel.columns:
        return np.asarray(np.abs(values[:, channel.columns.index("von_mises")]))
    if channel.vector:
        return np.asarray(np.linalg.norm(values, axis=1))
    return np.asarray(np.abs(values).max(axis=1))


def differing_keys(runs: Sequence[Results]) -> dict[str, tuple[Any, ...]]:
    """Dotted keys of the scenes that differ between runs, with their values; None if a key is missing."""
    scenes = [flat(json.loads(run.scene_json)) for run in runs]
    keys = dict.fromkeys(key for scene in scenes for key in scene)
    every = {key: tuple(scene.get(key) for scene in scenes) for key in keys}
    return {key: values for key, values in every.items() if any(x != values[0] for x in values[1:])}


def flat(x: Any, name: str = "") -> dict[str, Any]:
    """Nested tables as one table with dotted keys."""
    if not isinstance(x, dict) or not x:
        return {name: x}
    out: dict[str, Any] = {}
    for key, value in x.items():
        out |= flat(value, f"{name}.{key}" if name else key)
    return out
