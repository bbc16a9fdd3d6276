"""The error of the time step in every channel, from the differences between levels in time."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import ClassVar

import numpy as np

from kedfem.accuracy.error_budget import kind_of_name
from kedfem.accuracy.histories import Histories, counted
from kedfem.accuracy.prepared import Prepared
from kedfem.accuracy.resolution import StepError
from kedfem.arrays import Float
from kedfem.dynamics.history import Block
from kedfem.results.differences import comparable, scales
from kedfem.results.recorded import Recorded
from kedfem.results.stresses.envelope import largest_row
from kedfem.scene import time_grid

IN_STEP = 0.3  # largest disagreement about the fastest motion at which orders 4 and 6 are reached
ALIKE = 1e-6  # relative difference within which work is the same
LEAST_ORDER = 0.7  # least order with which an error must fall for a step to be predicted
SLOW = 1e-3  # |D''|/|D| up to which a difference D has no vibration: that of 200 steps in a period
SURE = 0.7  # of the required accuracy: the error for which a step is chosen
SINGLE = 2.0  # error of a channel over that of displacements: fast motion, which is less exact, has more weight
TWO, THREE = 0.8, 1.2  # factors of the estimates, compared with true errors in docs/performance/levels.md
Rows = Float[np.ndarray, "T c"]


@dataclass(frozen=True, slots=True)
class StepEstimate:
    """The estimated error of the time step of a run.

    h : step of the coarsest level, which is that of the analysis [s]
    levels : 1, 2 or 3
    errors : estimated error of each channel at the worst time, relative to its peak [-]
    differences : largest differences of successive levels in each channel, relative to its peak, coarsest pair first [-];
        none for a single level
    fast : relative disagreement of the finest pair of levels about the fastest motion in each channel, by second
        differences in time: small where the order of convergence shows, 1 where that motion is out of phase
    running : sum of the local errors of the steps, relative to the largest displacement [-]. A single level takes twice
        of it for the error of every channel while it runs; another run in steps twice as long shows more
        (`single_errors`)
    """

    h: float
    levels: int
    errors: Mapping[str, float]
    differences: Mapping[str, tuple[float, ...]]
    fast: Mapping[str, float]
    running: float

    @property
    def notes(self) -> dict[str, str | float]:
        """The attributes of a results file."""
        errors = {f"step error of {name}": error for name, error in self.errors.items()}
        return {"levels in time": self.levels, "step error, running": self.running, **errors}

    @property
    def worst(self) -> float:
        """The largest error of all channels."""
        return max(self.errors.values(), default=self.running)


@dataclass(frozen=True, slots=True)
class StepChoice:
    """A step [s], a number of levels, the expected error [-], and the work: steps of all levels per second of motion."""

    h: float
    levels: int
    error: float
    work: float


def cheapest(
    found: StepEstimate, wanted: float, channels: Collection[str] | None = None,
    levels: Collection[int] = (1, 2, 3), longest: float = math.inf,
) -> StepChoice:  # fmt: skip
    """The step and the levels that reach an error in every channel with the least work, from a trial's differences.

    D and q are the difference and the disagreement `fast` of the trial's finest pair of levels. D falls with h²; the
    error of two levels, about q D, with h⁴; that of three, q² D, with h⁶. This holds as long as the fastest motion stays
    in phase, q ≤ IN_STEP; q itself falls with h². If q is larger in the trial, levels gain nothing, and the error of the
    finest one falls as D did in the trial, which predicts the next trial. The error of a single level is estimated from
    another run in steps twice as long, whose work is included.

    Parameters
    ----------
    found : estimate of a trial with two or three levels
    wanted : relative error [-]
    channels : judged channels; default: all with an estimate
    levels : possible numbers of levels
    longest : largest step [s]

    Raises
    ------
    ValueError
        The trial has a single level.
    """
    names = [x for x in found.differences if channels is None or x in channels]
    if found.levels < 2:
        raise ValueError("the trial must have two or three levels, got one")
    if not names:
        h, fewest = min(found.h, longest), min(levels)
        return StepChoice(h, fewest, 0.0, _work(fewest) / h)
    out = []
    D = np.array([found.differences[name][-1] for name in names])
    fast = np.array([found.fast[name] for name in names])
    left, order = np.array([single_level(each)[0] for each in fast]) * D, _orders(found, names)
    up = 4.0 ** (found.levels - 2)  # from the finest pair to the coarsest
    whole, q, known = up * D, up * fast, fast <= IN_STEP
    for count in sorted(levels):
        of = {1: 4 / 3 * whole, 2: TWO * q * whole, 3: q * q * whole}[count]
        error = np.where(known, of, left * 2.0 ** (order * (found.levels - count)))
        power = np.where(known, 2 * count, order)
        factor = float(((SURE * wanted / np.maximum(error, 1e-300)) ** (1 / power)).min())
        if count > 1:
            seen = q[known & (wanted < whole)]
            factor = min(factor, float(np.sqrt(IN_STEP / np.maximum(seen, 1e-300)).min(initial=np.inf)))
        factor = min(factor, longest / found.h)
        h = found.h * factor
        out.append(StepChoice(h, count, float((error * factor**power).max()), _work(count) / h))
    least = min(choice.work for choice in out)
    return next(choice for choice in out if choice.work <= (1 + ALIKE) * least)  # the fewest levels of those


def _orders(found: StepEstimate, names: Sequence[str]) -> Float[np.ndarray, " c"]:
    """Powers of the step with which the differences of three levels fall, at most 2 and at least LEAST_ORDER."""
    pairs = np.array([found.differences[name] for name in names])
    if found.levels == 2:
        return np.full(len(names), 2.0)
    ratio = np.maximum(pairs[:, 0], 1e-300) / np.maximum(pairs[:, 1], 1e-300)
    return np.asarray(np.clip(np.log2(ratio), LEAST_ORDER, 2.0))


def _work(levels: int) -> float:
    """Steps of all levels, and of a run for comparison, per step of the coarsest level."""
    return 1.5 if levels == 1 else 2.0**levels - 1


def has_step_error(name: str) -> bool:
    """Whether a channel's step error is estimated: that of judged channels and of joint moments."""
    return kind_of_name(name) is not None or (name.startswith("joints/") and name.endswith("/moment"))


@dataclass
class _Sizes:
    """Largest norms of one channel so far.

    peak : of the values
    differences : of the differences of successive levels
    next : of the difference of successive combinations of two levels
    curved : of the second differences in time of the finest pair's difference, and of the values
    """

    peak: float = 0.0
    differences: Float[np.ndarray, " l"] = field(default_factory=lambda: np.zeros(0))
    next: float = 0.0
    curved: Float[np.ndarray, "2"] = field(default_factory=lambda: np.zeros(2))
    _tail: list[Rows] = field(default_factory=list)

    @property
    def fast(self) -> float:
        """|D''|/|x''| for the finest pair's difference D, at most 1.

        If D changes slowly, as the compliance of rigid links under steady loads, both are rounding; then it is |D|/|x|.
        """
        q = min(1.0, float(self.curved[0] / self.curved[1])) if self.curved[1] else 0.0
        slow = len(self.differences) and self.curved[0] < SLOW * self.differences[-1]
        return min(q, float(self.differences[-1]) / self.peak) if slow and self.peak else q

    def add(self, values: Rows, levels: Sequence[Rows]) -> None:
        """Include time points: the combined values, and those of each level."""
        self.peak = max(self.peak, largest_row(values))
        steps = [b - a for a, b in pairwise(levels)]
        if not len(self.differences):
            self.differences = np.zeros(len(steps))
        self.differences = np.maximum(self.differences, [largest_row(d) for d in steps])
        if len(steps) == 2:
            self.next = max(self.next, largest_row((4 * steps[1] - steps[0]) / 3))
        seen = [steps[-1], values] if steps else []
        if self._tail:
            seen = [np.concatenate(each) for each in zip(self._tail, seen, strict=True)]
        self.curved = np.maximum(self.curved, [largest_row(np.diff(x, 2, axis=0)) for x in seen] or 0.0)
        self._tail = [x[-2:] for x in seen]


@dataclass
class StepErrorMonitor:
    """Monitor of a run's step error, block after block.

    recorded : the run's channels
    running : the monitor of local errors of the steps
    """

    ready: Prepared
    recorded: Sequence[Recorded]
    running: StepError
    sizes: dict[str, _Sizes] = field(default_factory=dict)
    REMEMBERED: ClassVar = ("sizes",)

    def __post_init__(self) -> None:
        self.recorded = [each for each in self.recorded if has_step_error(each.channel.name)]

    def add(self, block: Block, values: Mapping[str, Rows]) -> None:
        """Evaluate the time points of a block and their values."""
        for each in self.recorded:
            name = each.channel.name
            if block.levels:
                of = each.channel.columns
                which = [k for k, column in enumerate(of) if column != "von_mises"]  # its zeros are kinks
                every = [values[name], *(each.rows(level) for level in block.levels)]
                now, *levels = (x[:, which] for x in every)
                self.sizes.setdefault(name, _Sizes()).add(now, levels)

    @property
    def estimate(self) -> StepEstimate:
        """The estimate from the time points so far."""
        analysis = self.ready.scene.analysis
        running, h = self.running.total, time_grid(self.ready.scene).step
        if (analysis.extrapolation_levels or 1) == 1:
            errors = {each.channel.name: min(1.0, SINGLE * running) for each in self.recorded}
            return StepEstimate(h, 1, errors, {}, {}, running)
        sizes = {name: x for name, x in self.sizes.items() if x.peak}
        kinds = {each.channel.name: comparable(each.channel) for each in self.recorded}
        found = {name: _error(x) for name, x in sizes.items()}
        scale = scales(found, {name: (kinds[name], x.peak) for name, x in sizes.items()})
        return StepEstimate(
            h, analysis.extrapolation_levels or 1, {name: error / scale[name] for name, error in found.items()},
            {name: tuple((x.differences / scale[name]).tolist()) for name, x in sizes.items()},
            {name: x.fast for name, x in sizes.items()}, running,
        )  # fmt: skip


def _error(x: _Sizes) -> float:
    """Error of the combined values, in their unit.

    With two levels D = x_{h/2} − x_h. Fast motion errs first, and has the most weight in second differences in time, of
    which the share q = |D''|/|x''| differs between the levels. The combination leaves about q D, or D itself if q is
    near 1. With three levels the difference δ of the combinations of both pairs takes the place of D, and δ/D that of q.
    """
    q = x.fast
    if len(x.differences) == 1:
        return float(x.differences[0]) * min(1.0, TWO * q)
    s = x.next / float(x.differences[0]) if x.differences[0] else 0.0
    return x.next * min(1.0, THREE * float(np.sqrt(q * min(1.0, s))))


def single_level(fast: float) -> tuple[float, float]:
    """Factors on D for the errors of two single runs, the finer one and that in steps twice as long.

    The error of the finer one is D/3 as long as the order of convergence shows, and that of two levels if the fastest
    motion is out of phase. The other one errs by D more.
    """
    finer = max(1 / 3, min(1.0, TWO * fast))
    return finer, 1 + finer


def single_errors(
    fine: Histories, coarse: Histories, stops: bool, zeros: set[str] | None = None
) -> tuple[dict[str, float], dict[str, float]]:
    """Errors of two single runs in each channel: of the finer one, and of that in steps twice as long.

    Parameters
    ----------
    fine, coarse : runs from the same time on, with all time points
    stops : whether there are joint limits, which may be met between two times of the coarse one. Jumps of other values
        are those of loads and drives.
    zeros : set to which the names of channels that are zero beside others are added
    """
    errors: list[dict[str, float]] = [{}, {}]
    peaks: dict[str, tuple[str, float]] = {}
    for name in counted(fine):
        channel, every = fine.channels[name]
        which = [k for k, column in enumerate(channel.columns) if column != "von_mises"]
        other = coarse.channels[name][1][:, which]
        own = every[::2, which][: len(other)]
        sizes = _Sizes()
        sizes.add((4 * own - other[: len(own)]) / 3, [other[: len(own)], own])
        if sizes.peak:
            peaks[name] = comparable(channel), largest_row(every[:, which])
            D, jolt = float(sizes.differences[0]), _jolt(every[:, which]) if stops else 0.0
            for found, factor in zip(errors, single_level(sizes.fast), strict=True):
                found[name] = max(D * factor, jolt)
    scale = [scales(found, peaks, zeros) for found in errors]
    finer, coarser = ({n: x / by[n] for n, x in found.items()} for found, by in zip(errors, scale, strict=True))
    return finer, coarser


def _jolt(x: Rows) -> float:
    """Largest distance of values from cubics through their neighbours: large where a limit is met within a step.

    For a vibration at ω in steps of h it is (3/8) (ω h)⁴ of the amplitude.
    """
    beside = (9 * (x[2:-4] + x[4:-2]) - x[:-6] - x[6:]) / 16
    return largest_row(x[3:-3] - beside)
