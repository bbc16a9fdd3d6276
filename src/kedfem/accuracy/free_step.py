"""The step of a scene without a drive, from runs in successively halved steps whose differences show the error.

How fast such a scene moves is not known beforehand, so that neither frequencies nor a coarse forecast are used. The step
is chosen among those with which the whole analysis was run; the last halvings show its error.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from kedfem.accuracy.error_budget import percent
from kedfem.accuracy.histories import Histories, counted, histories, relative_errors
from kedfem.accuracy.prepared import meshed
from kedfem.accuracy.step_estimate import LEAST_ORDER, SURE
from kedfem.accuracy.trials import Trials
from kedfem.accuracy.variants import with_analysis, with_steps
from kedfem.errors import KedfemError
from kedfem.scene import Scene, percentage

FIRST = 200  # steps of the first run
MOST = 51_200  # most steps of the last run
WORK = 2e7  # most product of its steps and the model's unknowns: about a minute
PAIRS = 3  # least number of compared pairs of runs: they give two ratios, which reveal a chance agreement


@dataclass(frozen=True, slots=True)
class _Halved:
    """The two runs in the shortest steps so far, and the differences of successive runs relative to a channel's peak."""

    steps: int
    coarse: Histories
    fine: Histories
    pairs: tuple[Mapping[str, float], ...]

    @property
    def errors(self) -> dict[str, float]:
        """Error of each channel in the run with the shortest steps."""
        return {name: finest_error([pair.get(name, 1.0) for pair in self.pairs]) for name in counted(self.fine)}


def free_step(search: Trials, scene: Scene, allowed: float) -> tuple[Scene, float]:
    """The scene in the longest step of a single level whose error is allowed, and that error.

    If no run reaches it, as in chaotic motion, the step is the shortest one tried, and a note says until when runs agree.

    Raises
    ------
    SolveError
        No run ends.
    """
    single = with_analysis(scene, extrapolation_levels=scene.analysis.extrapolation_levels or 1)
    unknowns = max(1, meshed(with_steps(single, FIRST)).model.unknowns)
    most = max(FIRST * 2**PAIRS, min(MOST, int(WORK / unknowns)))
    steps, found, before = FIRST, None, None
    pairs: list[Mapping[str, float]] = []
    error = 1.0
    while steps <= most:
        try:
            now = histories(meshed(with_steps(single, steps)))  # the step limits the stiffness of rigid links
        except KedfemError:  # the step is too long for its iterations
            if 2 * steps > most:
                raise
            before, pairs = None, []
        else:
            if before is not None:
                pairs.append(relative_errors(before, now))
                found = _Halved(steps, before, now, tuple(pairs[-PAIRS:]))
                error = max(found.errors.values(), default=0.0)
            if len(pairs) >= PAIRS and error <= SURE * allowed:
                longer = max(0.5, math.sqrt(error / (SURE * allowed)))  # between two steps that were run
                return with_steps(single, math.ceil(steps * longer)), error / longer**2
            before = now
        steps *= 2
    if found is None:
        return with_steps(single, steps // 2), 1.0
    until = _agree_until(found, search.asked)
    if until < found.coarse.time[-1]:  # the order of convergence means nothing there
        error = min(1.0, max(max(pair.values(), default=0.0) for pair in found.pairs))
    search.notes.append(_unreached(found, search.asked, until, error))
    return with_steps(single, found.steps), error


def finest_error(differences: Sequence[float]) -> float:
    """Error of the finest run, from the differences of successive runs and their order, at most 2."""
    D = np.maximum(differences, 1e-300)
    if len(D) < PAIRS or not np.isfinite(D).all():
        return 1.0
    orders = np.log2(D[:-1] / D[1:])
    falls = orders.min() >= LEAST_ORDER
    left = D[-1] / (2 ** min(2.0, float(orders.mean())) - 1) if falls else D.max()
    return min(1.0, float(left))


def _unreached(found: _Halved, asked: float, until: float, error: float) -> str:
    errors = found.errors
    name = max(errors, key=errors.__getitem__)
    most = f"{found.steps:,} steps, the most that are tried"
    message = f"the step's error stays at {percent(error)} in {name} with {most}"
    if until >= found.coarse.time[-1]:
        return message
    return (
        f"{message}: {found.steps // 2:,} and {found.steps:,} steps agree within {percentage(asked, 3)} until t = "
        f"{until:.3g} s only. The motion is sensitive to the smallest differences (chaotic), or "
        "has vibration that these steps do not resolve: damping, a smoother start or a shorter analysis would help"
    )


def _agree_until(found: _Halved, asked: float) -> float:
    """Time until which the two finest runs agree in every judged channel [s]."""
    time, until = found.coarse.time, math.inf
    for name, size in counted(found.fine).items():
        coarse, fine = found.coarse.channels[name][1], found.fine.channels[name][1][::2]
        apart = np.linalg.norm(coarse - fine[: len(coarse)], axis=1) > asked * size
        if apart.any():
            until = min(until, float(time[max(int(apart.argmax()) - 1, 0)]))
    return until if until < math.inf else float(time[-1])
