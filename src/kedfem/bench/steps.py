"""The condensed step against the literal one, in one run: time per step, share of the triangular solves, agreement."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from statistics import median
from time import perf_counter

import numpy as np

from kedfem.bench.machine import Watch, markdown, write_loglog, write_page
from kedfem.bench.scenes import bar_four_bar
from kedfem.dynamics.condensed import CondensedSteps
from kedfem.dynamics.history import LinkMoment
from kedfem.dynamics.literal import LiteralSteps
from kedfem.dynamics.model import elastic_model
from kedfem.dynamics.nominal import drive_range
from kedfem.dynamics.scheme import generalised_alpha
from kedfem.dynamics.state import LinkState, Nominal
from kedfem.dynamics.transient import Steps, snapshots
from kedfem.motion.linkage import linkage
from kedfem.motion.path import path
from kedfem.scene import time_grid

SIZES = ((6, 2, 1), (18, 3, 2), (36, 6, 4))
LITERAL_STEPS, CONDENSED_STEPS = 5, 100
STEPS_PER_REVOLUTION = 720

Step = Callable[[Sequence[LinkState], Sequence[Nominal]], list[LinkState]]


@dataclass(frozen=True, slots=True)
class _Measured:
    """Unknowns, factorisations, median seconds of a step, share of the solves in it, states after the first steps."""

    unknowns: int
    factorisations: int
    step: float
    share: float
    states: list[list[LinkMoment]]


def bench_steps(folder: Path, quick: bool, watch: Watch) -> str:
    """Median time of a step of both solvers at several sizes; table and plot go to the folder."""
    sizes = SIZES[:2] if quick else SIZES
    rows, unknowns, condensed_times, literal_times = [], [], [], []
    for number, size in enumerate(sizes):
        watch("steps", number, len(sizes))
        fast = _stepped(size, "condensed", CONDENSED_STEPS)
        slow = _stepped(size, "monolithic", LITERAL_STEPS)
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
    text = markdown("Condensed step against monolithic step", "kedfem bench steps", header, rows, note)
    write_page(folder, "steps", text)
    curves = {
        "literal (assemble, sparse LU)": (unknowns, literal_times),
        "condensed": (unknowns, condensed_times),
    }
    write_loglog(folder, "steps", curves, ("unknowns", "seconds per step"))
    return text


def _stepped(size: tuple[int, int, int], solver: str, steps: int) -> "_Measured":
    """Take some steps of a scene and measure them."""
    scene = bar_four_bar(size, solver, revolutions=steps / STEPS_PER_REVOLUTION)
    joined = linkage(scene)
    along = path(joined, *drive_range(scene))
    model = elastic_model(scene, joined)
    scheme = generalised_alpha(time_grid(scene).step, scene.analysis.rho_inf)
    kind = LiteralSteps if solver == "monolithic" else CondensedSteps
    taken = kind(model.links, model.joints, scheme, model.damping)
    watch = _Stopwatch(taken)
    run = snapshots(scene, joined, along, model, taken)
    states = [snapshot.states for snapshot in islice(run, 1, None)][:LITERAL_STEPS]
    share = watch.solves / sum(watch.steps)
    return _Measured(model.unknowns, taken.factorisations, median(watch.steps), share, states)


class _Stopwatch:
    """Notes the seconds of each step, and adds up those of the triangular solves within."""

    def __init__(self, solver: Steps) -> None:
        self.solves = 0.0
        self.steps: list[float] = []
        if isinstance(solver, CondensedSteps):
            solver.parts = [replace(part, solve=self._timed_solve(part.solve)) for part in solver.parts]
        if isinstance(solver, CondensedSteps | LiteralSteps):
            solver.step = self._timed_step(solver.step)  # type: ignore[method-assign, assignment]

    def _timed_solve(self, solve: Callable[[np.ndarray], np.ndarray]) -> Callable[[np.ndarray], np.ndarray]:
        def timed(r: np.ndarray) -> np.ndarray:
            since = perf_counter()
            out = solve(r)
            self.solves += perf_counter() - since
            return out

        return timed

    def _timed_step(self, step: Step) -> Step:
        def timed(states: Sequence[LinkState], at: Sequence[Nominal]) -> list[LinkState]:
            since = perf_counter()
            out = step(states, at)
            self.steps.append(perf_counter() - since)
            return out

        return timed


def _difference(fast: list[list[LinkMoment]], slow: list[list[LinkMoment]]) -> float:
    """Largest difference of displacements after the same steps, of the largest displacement."""
    a, b = fast[len(slow) - 1], slow[-1]
    peak = max(float(np.abs(s.u).max()) for s in b)
    return max(float(np.abs(x.u - y.u).max()) for x, y in zip(a, b, strict=True)) / peak
