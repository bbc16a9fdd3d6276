"""The error of the time step in every channel, from the differences between levels in time."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import ClassVar

import numpy as np

from kedfem.accuracy.error_budget import kind_of_name
from kedfem.accuracy.histories import Histories, counted, scales
from kedfem.accuracy.prepared import Prepared
from kedfem.accuracy.resolution import StepError
from kedfem.arrays import Float
from kedfem.dynamics.history import Block
from kedfem.results.recorded import Recorded
from kedfem.results.stresses.envelope import largest_row
from kedfem.scene import time_grid

IN_STEP = 0.3  # largest disagreement about the fastest motion at which orders 4 and 6 show
ALIKE = 1e-6  # relative difference of work that means nothing
LEAST_ORDER = 0.7  # at which an error must fall with the step, or no step will do
SLOW = 1e-3  # |D''|/|D| of a difference without vibration: that of 200 steps to a period
SURE = 0.7  # of the required accuracy, for which a step is chosen
SINGLE = 2.0  # forces and stresses have more of fast motion, which is less exact, than displacements
TWO, THREE = 0.8, 1.2  # docs/performance/levels.md has estimates beside the true errors
Rows = Float[np.ndarray, "T c"]


@dataclass(frozen=True, slots=True)
class StepEstimate:
    """The estimated error of the time step of a run.

    h : step of the coarsest level, which is the analysis's own [s]
    levels : 1, 2 or 3
    errors : channel → estimated error of its values, at the worst time, relative to the channel's peak [-]
    differences : channel → what successive levels differ by, at worst in time, of the peak, coarsest pair first; none of
        a single level
    fast : channel → by which share the finest pair of levels disagrees about its fastest motion, that with the largest
        second differences in time: small where the order shows, 1 where that motion is out of step
    running : what local errors of the steps add up to, of the largest displacement [-]; all that a single level knows
        while it runs, which puts twice of it for the error of every channel; a march beside it, with steps twice as
        long, shows more (`single_errors`)
    """

    h: float
    levels: int
    errors: Mapping[str, float]
    differences: Mapping[str, tuple[float, ...]]
    fast: Mapping[str, float]
    running: float

    @property
    def notes(self) -> dict[str, str | float]:
        """As notes of a results file."""
        errors = {f"step error of {name}": error for name, error in self.errors.items()}
        return {"levels in time": self.levels, "step error, running": self.running, **errors}

    @property
    def worst(self) -> float:
        """The largest error of all channels."""
        return max(self.errors.values(), default=self.running)


@dataclass(frozen=True, slots=True)
class StepChoice:
    """A step, a number of levels, the error that is expected, and the work: all marches' steps in a second of motion."""

    h: float
    levels: int
    error: float
    work: float


def cheapest(
    found: StepEstimate, wanted: float, channels: Collection[str] | None = None,
    levels: Collection[int] = (1, 2, 3), longest: float = math.inf,
) -> StepChoice:  # fmt: skip
    """The step and the levels that reach an error in every channel with the least work, from a trial's differences.

    D falls with h², what two levels leave, about q D, with h⁴, three, q² D, with h⁶, as long as the fastest motion stays
    in step: q, which falls with h², no more than IN_STEP. Where it is more in the trial levels gain nothing: what the
    finest one leaves falls as D did in the trial, by which another trial is found. D and q are those of the trial's
    finest pair of levels. A single level has another march beside it, with steps twice as long, which shows its error.

    Parameters
    ----------
    found : of a run of two or three levels
    wanted : relative error
    channels : judged ones; all with an estimate if not given
    levels : possible numbers of them
    longest : step that may be chosen [s]
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
    """Steps of all marches in one of the coarsest level's."""
    return 1.5 if levels == 1 else 2.0**levels - 1


def watched(name: str) -> bool:
    """Whether a channel's error is estimated: those of the budget, and moments of joints."""
    return kind_of_name(name) is not None or (name.startswith("joints/") and name.endswith("/moment"))


@dataclass
class _Sizes:
    """Largest norms of one channel so far.

    differences : of successive levels
    next : of successive combinations of two levels
    curved : second differences in time of the finest pair's difference, and of the values
    """

    peak: float = 0.0
    differences: Float[np.ndarray, " l"] = field(default_factory=lambda: np.zeros(0))
    next: float = 0.0
    curved: Float[np.ndarray, "2"] = field(default_factory=lambda: np.zeros(2))
    _tail: list[Rows] = field(default_factory=list)

    @property
    def fast(self) -> float:
        """|D''|/|x''| of the finest pair's difference D, at most 1.

        Where D itself changes slowly, as what rigid links give under loads that stay, both are rounding: then |D|/|x|.
        """
        q = min(1.0, float(self.curved[0] / self.curved[1])) if self.curved[1] else 0.0
        slow = len(self.differences) and self.curved[0] < SLOW * self.differences[-1]
        return min(q, float(self.differences[-1]) / self.peak) if slow and self.peak else q

    def add(self, values: Rows, levels: Sequence[Rows]) -> None:
        """Add time points, as combined and of each level."""
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
class StepWatch:
    """Monitor of a run's step error, block after block.

    recorded : the run's channels
    running : local errors of its steps, which another monitor sums
    """

    ready: Prepared
    recorded: Sequence[Recorded]
    running: StepError
    sizes: dict[str, _Sizes] = field(default_factory=dict)
    REMEMBERED: ClassVar = ("sizes",)

    def __post_init__(self) -> None:
        self.recorded = [each for each in self.recorded if watched(each.channel.name)]

    def add(self, block: Block, values: Mapping[str, Rows]) -> None:
        """Evaluate the time points of a block and their rows."""
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
        """The estimate for the time points so far."""
        analysis = self.ready.scene.analysis
        running, h = self.running.total, time_grid(self.ready.scene).step
        if (analysis.extrapolation_levels or 1) == 1:
            errors = {each.channel.name: min(1.0, SINGLE * running) for each in self.recorded}
            return StepEstimate(h, 1, errors, {}, {}, running)
        sizes = {name: x for name, x in self.sizes.items() if x.peak}
        units = {each.channel.name: each.channel.unit for each in self.recorded}
        found = {name: _error(x) for name, x in sizes.items()}
        scale = scales(found, {name: (units[name], x.peak) for name, x in sizes.items()})
        return StepEstimate(
            h, analysis.extrapolation_levels or 1, {name: error / scale[name] for name, error in found.items()},
            {name: tuple((x.differences / scale[name]).tolist()) for name, x in sizes.items()},
            {name: x.fast for name, x in sizes.items()}, running,
        )  # fmt: skip


def _error(x: _Sizes) -> float:
    """Error of the combined values, in their unit.

    Of two levels, D = x_{h/2} − x_h: fast motion goes wrong first, and second differences in time weigh it most. By
    q = |D''|/|x''| of it the levels disagree; the next power of the step leaves about q D, and where q is near 1, D
    itself. Of three, what the two pairs' combinations differ by, δ, is such a D, and δ/D another q.
    """
    q = x.fast
    if len(x.differences) == 1:
        return float(x.differences[0]) * min(1.0, TWO * q)
    s = x.next / float(x.differences[0]) if x.differences[0] else 0.0
    return x.next * min(1.0, THREE * float(np.sqrt(q * min(1.0, s))))


def single_level(fast: float) -> tuple[float, float]:
    """Factors of D for the errors of two marches by themselves, the finer one and that with steps twice as long.

    Of the finer one D/3 as long as the order shows; where the fastest motion is out of step, what two levels leave. Of
    the other D more.
    """
    finer = max(1 / 3, min(1.0, TWO * fast))
    return finer, 1 + finer


def single_errors(
    fine: Histories, coarse: Histories, stops: bool, zeros: set[str] | None = None
) -> tuple[dict[str, float], dict[str, float]]:
    """Channel → error of two marches by themselves: of the finer one, and of that with steps twice as long.

    Parameters
    ----------
    fine, coarse : from the same time on, both with all their time points
    stops : whether there are limits, which may be met between two times of the coarse one. Elsewhere values that jump
        are those of loads and drives.
    zeros : to which the names of channels are added that are zero beside others
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
            peaks[name] = channel.unit, largest_row(every[:, which])
            D, jolt = float(sizes.differences[0]), _jolt(every[:, which]) if stops else 0.0
            for found, factor in zip(errors, single_level(sizes.fast), strict=True):
                found[name] = max(D * factor, jolt)
    scale = [scales(found, peaks, zeros) for found in errors]
    finer, coarser = ({n: x / by[n] for n, x in found.items()} for found, by in zip(errors, scale, strict=True))
    return finer, coarser


def _jolt(x: Rows) -> float:
    """How far values are from cubics through those beside them, at most: far where a stop is met within a step.

    Of a vibration at ω in steps of h, (3/8) (ω h)⁴ of its amplitude.
    """
    beside = (9 * (x[2:-4] + x[4:-2]) - x[:-6] - x[6:]) / 16
    return largest_row(x[3:-3] - beside)
