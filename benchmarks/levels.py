"""Levels in time on the source's four-bar at 600 rpm: true error, estimated error, and processor time."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from jaxtyping import Float

from benchmarks.pages import script, table, write_page
from benchmarks.scenes import DAMPED, EYE, four_bar_of
from kedfem.accuracy.prepared import Prepared
from kedfem.accuracy.reduction import prepared
from kedfem.accuracy.resolution import step_error
from kedfem.accuracy.step_estimate import StepErrorMonitor, StepEstimate
from kedfem.dynamics.stepping.levels import level_steps, leveled
from kedfem.results.recording import recording, rows
from kedfem.scene import scene_from

TURN = 0.1  # s
SHOWN = {"stress": "probes/stress/stress", "torque": "drive/torque"}
MARCHES = ((500, 1), (1000, 1), (2000, 1), (4000, 1), (250, 2), (500, 2), (1000, 2), (250, 3), (500, 3))
BEAMS, PLATES = {"model": "beam", "mesh": {"elements": 1}}, {"reduction": 8}
HEADER = ("levels, steps a revolution", "stress", "estimated", "torque", "estimated", "seconds", "order 2 needs")


@dataclass(frozen=True, slots=True)
class Case:
    """One start, damping, kind of frames and of links, headed in the page; steps of the reference, in three levels."""

    link: Mapping[str, Any]
    damped: bool = True
    truth: int = 2000
    analysis: Mapping[str, Any] | None = None


STILL, REST = {"initial": "quasi-static"}, {"initial": "rest"}
CASES = (
    Case(BEAMS, analysis=STILL),
    Case(BEAMS, analysis=STILL | {"frames": "co-rotational"}),
    Case(PLATES, analysis=STILL),
    Case(BEAMS, analysis=REST | {"frames": "co-rotational"}),
    Case(BEAMS, False, 4000, REST),
)


@dataclass(frozen=True, slots=True)
class _Marched:
    """Channels over time, what is known of their error, processor seconds of the steps with their rows."""

    values: dict[str, Float[np.ndarray, "T c"]]
    estimate: StepEstimate
    seconds: float


def bench_levels(folder: Path, quick: bool) -> None:
    """Tables of all cases, and of members of generalised-α."""
    cases = CASES[:2] if quick else CASES
    tables = [table(HEADER, _rows(case, quick)) for case in cases]
    if not quick:
        tables.append(_numerical_damping())
    write_page(folder, "performance/levels", tables)


def _ready(case: Case, steps: int, levels: int) -> Prepared:
    shape = {"kind": "bar", "width": 0.0254, "thickness": 0.0254} if case.link is BEAMS else {"kind": "plate_link", **EYE}
    raw = four_bar_of(shape, dict(case.link))
    raw["points"]["B"]["angle"] = 0 if case.link is BEAMS else "60 deg"
    if case.damped:
        raw["damping"] = DAMPED
    raw["analysis"] = {
        "end_time": 2 * TURN,
        "step": TURN / steps,
        "extrapolation_levels": levels,
        **(case.analysis or {}),
    }
    raw["output"] = {"probes": {"stress": {"link": "rocker", "at": "M", "quantity": "stress"}}}
    return prepared(scene_from(raw))[0]


def _marched(ready: Prepared) -> _Marched:
    scene, model = ready.scene, ready.model
    solvers = level_steps(scene, model)
    recorded = [each for each in recording(scene, model) if each.channel.name in SHOWN.values()]
    running, found = step_error(ready), []
    followed = StepErrorMonitor(ready, recorded, running)
    since = process_time()
    for block in leveled(scene, ready.linkage, ready.path, model, solvers):
        values = rows(recorded, block)
        found.append(values)
        followed.add(block, values)
        running.add(block)
    spent = process_time() - since
    joined = {name: np.concatenate([x[name] for x in found]) for name in found[0]}
    return _Marched(joined, followed.estimate, spent)


def _rows(case: Case, quick: bool) -> list[tuple[str, ...]]:
    truth = _marched(_ready(case, 1000 if quick else case.truth, 3)).values
    out, second, steps_of_second = [], 0.0, 1
    for steps, levels in MARCHES[::4] if quick else MARCHES:
        now = _marched(_ready(case, steps, levels))
        stride = (len(truth[SHOWN["torque"]]) - 1) / (len(now.values[SHOWN["torque"]]) - 1)
        errors = {what: _error(now.values[name], truth[name], stride) for what, name in SHOWN.items()}
        if levels == 1:
            second, steps_of_second = errors["stress"], steps
        needs = steps_of_second * float(np.sqrt(second / errors["stress"]))
        cells = [text for what, name in SHOWN.items() for text in (errors[what], now.estimate.errors[name])]
        marches = " + ".join(f"{steps * 2**k:,}" for k in range(levels))
        last = "" if levels == 1 else f"{float(f'{needs:.2g}'):,.0f}"
        out.append((marches, *(f"{100 * x:.2g} %" for x in cells), f"{now.seconds:.2f}", last))
    return out


def _error(found: Float[np.ndarray, "T c"], truth: Float[np.ndarray, "U c"], stride: float) -> float:
    """Largest difference at the time points that both have, of the peak."""
    if stride >= 1:
        truth = truth[:: round(stride)]
    else:
        found = found[:: round(1 / stride)]
    return float(np.linalg.norm(found - truth, axis=1).max() / np.linalg.norm(truth, axis=1).max())


def _numerical_damping() -> list[str]:
    """Errors of two and three levels, and the orders that half the step shows, of members of generalised-α."""
    case, out = CASES[0], []
    for rho in (1.0, 0.95, 0.8, 0.6, 0.5, 0.3, 0.0):
        of = replace(case, analysis=STILL | {"rho_inf": rho})
        truth = _marched(_ready(of, 2000, 3)).values[SHOWN["stress"]]
        cells = [f"{rho:g}"]
        for levels in (2, 3):
            far, near = (
                _error(_marched(_ready(of, n, levels)).values[SHOWN["stress"]], truth, 2000 / n) for n in (500, 1000)
            )
            cells += [f"{100 * far:.2g} %", f"{100 * near:.2g} %", f"{np.log2(far / near):.1f}"]
        out.append(tuple(cells))
    header = ("ρ∞", "500 + 1,000", "1,000 + 2,000", "order", "500 + … + 2,000", "1,000 + … + 4,000", "order")
    return table(header, out)


if __name__ == "__main__":
    script(bench_levels)
