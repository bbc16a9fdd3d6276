"""The system's step against the monolithic one, in one run: time per step, share of the triangular solves, agreement."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from benchmarks.pages import script, table, write_loglog, write_page
from benchmarks.scenes import bar_four_bar
from kedfem.accuracy.prepared import meshed
from kedfem.dynamics.history import LinkMoment
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.transient import snapshots
from kedfem.dynamics.system.sparse import SparsePart
from kedfem.dynamics.system.steps import SystemSteps

SIZES = ((6, 2, 1), (18, 3, 2), (36, 6, 4))
LITERAL_STEPS, CONDENSED_STEPS = 5, 100
STEPS_PER_REVOLUTION = 720


@dataclass(frozen=True, slots=True)
class _Measured:
    """Unknowns, factorisations, mean seconds of a step, share of the solves in it, states after the first steps."""

    unknowns: int
    factorisations: int
    step: float
    share: float
    states: list[list[LinkMoment]]


def bench_steps(folder: Path, quick: bool) -> None:
    """Mean time of a step of both solvers at several sizes; table and plot go to the folder."""
    sizes = SIZES[:2] if quick else SIZES
    rows, unknowns, condensed_times, monolithic_times = [], [], [], []
    for size in sizes:
        fast = _stepped(size, "condensed", CONDENSED_STEPS)
        slow = _stepped(size, "monolithic", LITERAL_STEPS)
        unknowns.append(fast.unknowns)
        condensed_times.append(fast.step)
        monolithic_times.append(slow.step)
        rows.append((
            f"{fast.unknowns:,}", f"{1e3 * slow.step:.1f}", f"{1e3 * fast.step:.2f}", f"{slow.step / fast.step:.0f}",
            f"{100 * fast.share:.0f} %", str(fast.factorisations), f"{_difference(fast.states, slow.states):.1e}",
        ))  # fmt: skip
    header = ("unknowns", "monolithic [ms/step]", "condensed [ms/step]", "ratio", "of it triangular solves",
              "factorisations in the run", "difference of u after 5 steps")  # fmt: skip
    write_page(folder, "performance/steps", [table(header, rows)])
    curves = {
        "monolithic (assemble, sparse LU)": (unknowns, monolithic_times),
        "condensed": (unknowns, condensed_times),
    }
    write_loglog(folder, "steps", curves, ("unknowns", "seconds per step"))


def _stepped(size: tuple[int, int, int], solver: str, steps: int) -> "_Measured":
    """Take some steps of a scene and measure them."""
    scene = bar_four_bar(size, solver, revolutions=steps / STEPS_PER_REVOLUTION)
    ready = meshed(scene)
    taken = steps_of(scene, ready.model)
    watch = _Stopwatch(taken)
    states = [each.states for each in snapshots(scene, ready.linkage, ready.path, ready.model, taken)][1:]
    step = watch.steps / len(states)
    return _Measured(ready.model.unknowns, taken.factorisations, step, watch.solves / watch.steps, states)


class _Stopwatch:
    """Adds up the seconds of a solver's steps, and those of the solves with sparse factors within."""

    def __init__(self, solver: Any) -> None:
        self.solves = self.steps = 0.0
        if isinstance(solver, SystemSteps):
            parts = solver.ready.parts
            parts[:] = [
                replace(part, held=self._timed(part.held, "solves")) if isinstance(part, SparsePart) else part
                for part in parts
            ]
        solver.advance = self._timed(solver.advance, "steps")

    def _timed(self, call: Callable[..., Any], name: str) -> Callable[..., Any]:
        def timed(*given: Any) -> Any:
            since = perf_counter()
            out = call(*given)
            setattr(self, name, getattr(self, name) + perf_counter() - since)
            return out

        return timed


def _difference(fast: list[list[LinkMoment]], slow: list[list[LinkMoment]]) -> float:
    """Largest difference of displacements after the same steps, of the largest displacement."""
    a, b = fast[len(slow) - 1], slow[-1]
    peak = max(float(np.abs(s.u).max()) for s in b)
    return max(float(np.abs(x.u - y.u).max()) for x, y in zip(a, b, strict=True)) / peak


if __name__ == "__main__":
    script(bench_steps)
