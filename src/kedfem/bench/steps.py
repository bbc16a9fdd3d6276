"""The condensed step against the literal one, in one run: time per step, share of the triangular solves, agreement."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from statistics import median
from time import perf_counter

import numpy as np

from kedfem.bench.machine import Watch, markdown, write_loglog, write_page
from kedfem.bench.scenes import bar_four_bar
from kedfem.dynamics.condensed import CondensedSteps
from kedfem.dynamics.model import elastic_model
from kedfem.dynamics.state import LinkState
from kedfem.dynamics.transient import Steps, drive_range, steps_of, transient
from kedfem.motion.linkage import linkage
from kedfem.motion.path import path
from kedfem.scene import Scene

SIZES = ((6, 2, 1), (18, 3, 2), (36, 6, 4))
LITERAL_STEPS, CONDENSED_STEPS = 5, 100


@dataclass(frozen=True, slots=True)
class _Measured:
    """Unknowns, factorisations, median seconds of a step, share of the solves in it, states after the first steps."""

    unknowns: int
    factorisations: int
    step: float
    share: float
    states: list[list[LinkState]]


def bench_steps(folder: Path, quick: bool, watch: Watch) -> str:
    """Median time of a step of both solvers at several sizes; table and plot go to the folder."""
    sizes = SIZES[:2] if quick else SIZES
    rows, unknowns, condensed_times, literal_times = [], [], [], []
    for number, size in enumerate(sizes):
        watch("steps", number, len(sizes))
        fast = _stepped(bar_four_bar(size), CONDENSED_STEPS)
        slow = _stepped(bar_four_bar(size, "literal"), LITERAL_STEPS)
        unknowns.append(fast.unknowns)
        condensed_times.append(fast.step)
        literal_times.append(slow.step)
        rows.append((
            f"{fast.unknowns:,}", f"{1e3 * slow.step:.1f}", f"{1e3 * fast.step:.2f}", f"{slow.step / fast.step:.0f}",
            f"{100 * fast.share:.0f} %", str(fast.factorisations), f"{_difference(fast.states, slow.states):.1e}",
        ))  # fmt: skip
    header = ("unknowns", "literal [ms/step]", "condensed [ms/step]", "ratio", "of it triangular solves",
              "factorisations in the run", "difference of u after 5 steps")  # fmt: skip
    note = "Four-bar of three bars of 27-node hexahedra, both solvers in one run.\n\n![steps](steps.png)"
    text = markdown("Condensed step against literal step", "kedfem bench steps", header, rows, note)
    write_page(folder, "steps", text)
    curves = {
        "literal (assemble, sparse LU)": (unknowns, literal_times),
        "condensed": (unknowns, condensed_times),
    }
    write_loglog(folder, "steps", curves, ("unknowns", "seconds per step"))
    return text


def _stepped(scene: Scene, steps: int) -> "_Measured":
    """Take some steps of a scene and measure them."""
    joined = linkage(scene)
    along = path(joined, *drive_range(scene))
    model = elastic_model(scene, joined)
    solver = steps_of(scene, model)
    run = transient(scene, joined, along, model, solver)
    next(run)
    watch = _Stopwatch(solver)
    times: list[float] = []
    states: list[list[LinkState]] = []
    since = perf_counter()
    for snapshot in islice(run, steps):
        times.append(perf_counter() - since)
        if len(states) < LITERAL_STEPS:
            states.append(snapshot.states)
        since = perf_counter()
    return _Measured(model.unknowns, solver.factorisations, median(times), watch.seconds / sum(times), states)


class _Stopwatch:
    """Adds up the seconds of the triangular solves within the steps."""

    def __init__(self, solver: Steps) -> None:
        self.seconds = 0.0
        if isinstance(solver, CondensedSteps):
            solver.parts = [replace(part, solve=self._timed(part.solve)) for part in solver.parts]

    def _timed(self, solve: Callable[[np.ndarray], np.ndarray]) -> Callable[[np.ndarray], np.ndarray]:
        def timed(r: np.ndarray) -> np.ndarray:
            since = perf_counter()
            out = solve(r)
            self.seconds += perf_counter() - since
            return out

        return timed


def _difference(fast: list[list[LinkState]], slow: list[list[LinkState]]) -> float:
    """Largest difference of displacements after the same steps, of the largest displacement."""
    a, b = fast[len(slow) - 1], slow[-1]
    peak = max(float(np.abs(s.u).max()) for s in b)
    return max(float(np.abs(x.u - y.u).max()) for x, y in zip(a, b, strict=True)) / peak
