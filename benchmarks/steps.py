"""The system's step against the monolithic one, in one run: time per step, share of the triangular solves, agreement."""

from pathlib import Path
from time import process_time

import numpy as np

from benchmarks.monolithic import marched
from benchmarks.pages import script, table, write_loglog, write_page
from benchmarks.scenes import bar_four_bar
from kedfem.accuracy.prepared import Prepared, meshed
from kedfem.dynamics.history import LinkMoment
from kedfem.dynamics.matrices.substructure import factored
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.start import motion_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.dynamics.system.sparse import SparsePart
from kedfem.dynamics.system.steps import Steps
from kedfem.scene import time_grid

REPEATED = 20
SIZES = ((6, 2, 1), (18, 3, 2), (27, 5, 3), (36, 6, 4))
MONOLITHIC_STEPS, CONDENSED_STEPS = 5, 100
STEPS_PER_REVOLUTION = 720


def bench_steps(folder: Path, quick: bool) -> None:
    """Mean time of a step of both at several sizes; table and plot go to the folder."""
    rows, unknowns, condensed_times, monolithic_times = [], [], [], []
    for size in SIZES[:2] if quick else SIZES:
        ready = meshed(bar_four_bar(size, revolutions=CONDENSED_STEPS / STEPS_PER_REVOLUTION))
        taken = steps_of(ready.scene, ready.model)
        given = ready.scene, ready.linkage, ready.path
        for _ in range(2):  # compiled code is loaded once
            found: list[list[LinkMoment]] = []
            since = process_time()
            for block in transient(*given, ready.model, taken):
                since = since if found else process_time()  # after the start
                found += [block.at(k).states for k in range(len(block))]
        step = (process_time() - since) / CONDENSED_STEPS
        motion = motion_of(*given)(time_grid(ready.scene).step * np.arange(MONOLITHIC_STEPS + 1))
        wanted, slow = marched(ready.model, taken.ready.scheme, motion)
        last = np.concatenate([each.u.ravel() for each in found[MONOLITHIC_STEPS]])
        differs = np.abs(last - wanted[-1]).max() / np.abs(wanted[-1]).max()
        unknowns.append(ready.model.unknowns)
        condensed_times.append(step)
        monolithic_times.append(slow)
        solves = _solves(ready, taken)
        rows.append((
            f"{ready.model.unknowns:,}", f"{1e3 * slow:.1f}", f"{1e3 * step:.2f}", f"{slow / step:.0f}",
            f"{1e3 * solves:.2f}", f"{step / solves:.2f}", str(taken.factorisations), f"{differs:.1e}",
        ))  # fmt: skip
    header = ("unknowns", "monolithic [ms/step]", "condensed [ms/step]", "ratio", "bare triangular solves [ms]",
              "step / bare solves", "factorisations in the run", "difference of u after 5 steps")  # fmt: skip
    write_page(folder, "performance/steps", [table(header, rows)])
    curves = {"monolithic (assemble, sparse LU)": (unknowns, monolithic_times), "condensed": (unknowns, condensed_times)}
    write_loglog(folder, "steps", curves, ("unknowns", "seconds per step"))


def _solves(ready: Prepared, solver: Steps) -> float:
    """Seconds of the triangular solves of a step, called one by one for all links with sparse factors."""
    of, spent = solver.ready, 0.0
    for part, link, joint in zip(of.parts, ready.model.links, of.system.model.joints, strict=True):
        if isinstance(part, SparsePart):
            bare, right = factored(link, joint, of.c.c_M, of.c.c_K), np.ones(link.X.shape)
            since = process_time()
            for _ in range(REPEATED):
                bare.solve(right)
            spent += (process_time() - since) / REPEATED
    return spent


if __name__ == "__main__":
    script(bench_steps)
