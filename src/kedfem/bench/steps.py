"""The condensed step against the literal one, in one run: time per step, share of the triangular solves, agreement."""

from functools import partial
from itertools import islice
from pathlib import Path
from statistics import median
from time import perf_counter

import numpy as np

from kedfem.bench.machine import Watch, markdown, seconds, write_loglog, write_page
from kedfem.bench.scenes import bar_four_bar
from kedfem.dynamics.condensed import CondensedSteps
from kedfem.dynamics.model import Model, elastic_model
from kedfem.dynamics.state import LinkState
from kedfem.dynamics.transient import Steps, drive_range, steps_of, transient
from kedfem.motion.linkage import linkage
from kedfem.motion.path import path
from kedfem.scene import Scene

SIZES = ((6, 2, 1), (18, 3, 2), (36, 6, 4))
LITERAL_STEPS, CONDENSED_STEPS = 5, 100


def bench_steps(folder: Path, quick: bool, watch: Watch) -> str:
    """Median time of a step of both solvers at several sizes; table and plot go to the folder."""
    sizes = SIZES[:2] if quick else SIZES
    rows, unknowns, condensed_times, literal_times = [], [], [], []
    for number, size in enumerate(sizes):
        watch("steps", number, len(sizes))
        model, solver, condensed, fast = _stepped(bar_four_bar(size), CONDENSED_STEPS)
        _, _, literal, slow = _stepped(bar_four_bar(size, "literal"), LITERAL_STEPS)
        share = _solve_seconds(solver, fast) / condensed
        unknowns.append(model.unknowns)
        condensed_times.append(condensed)
        literal_times.append(literal)
        rows.append((
            f"{model.unknowns:,}", f"{1e3 * literal:.1f}", f"{1e3 * condensed:.2f}", f"{literal / condensed:.0f}",
            f"{100 * share:.0f} %", str(solver.factorisations), f"{_difference(fast[: len(slow)], slow):.1e}",
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


def _stepped(scene: Scene, steps: int) -> tuple[Model, Steps, float, list[list[LinkState]]]:
    """Model, solver, median seconds of a step, states of the first steps."""
    joined = linkage(scene)
    along = path(joined, *drive_range(scene))
    model = elastic_model(scene, joined)
    solver = steps_of(scene, model)
    run = transient(scene, joined, along, model, solver)
    next(run)
    times, states, since = [], [], perf_counter()
    for snapshot in islice(run, steps):
        times.append(perf_counter() - since)
        states.append(snapshot.states)
        states[:-LITERAL_STEPS] = [] if len(states) <= LITERAL_STEPS else states[:-LITERAL_STEPS]
        since = perf_counter()
    return model, solver, median(times), states


def _solve_seconds(solver: Steps, states: list[list[LinkState]]) -> float:
    """Seconds of one solve with every link's factor."""
    if not isinstance(solver, CondensedSteps):
        raise TypeError("only the condensed solver has constant factors")
    pairs = zip(solver.parts, states[-1], strict=True)
    return sum(seconds(partial(part.solve, state.g), 15) for part, state in pairs)


def _difference(fast: list[list[LinkState]], slow: list[list[LinkState]]) -> float:
    """Largest difference of displacements after the same steps, of the largest displacement."""
    a, b = fast[len(slow) - 1], slow[-1]
    peak = max(float(np.abs(s.u).max()) for s in b)
    return max(float(np.abs(x.u - y.u).max()) for x, y in zip(a, b, strict=True)) / peak
