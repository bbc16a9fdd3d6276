"""Co-rotational frames, on the source's four-bar from rest: error against time, linear, stiffened and co-rotational."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.corotational_run import BLOCKS, POINTS, Curve, Ran, cost, four_bar, run
from benchmarks.corotational_whole import whole_runs
from benchmarks.pages import script, table, write_page

STEPS = 3000  # usual number
FINEST: dict[str, Any] = {"model": "beam", "element": "beam5", "mesh": {"elements": 16}}
REFERENCE = {"damped": (12000, 24000), "undamped": (48000, 96000)}  # steps, extrapolated
QUICK = (3000, 6000)
BEAMS = (("beam3", 4), ("beam3", 8), ("beam3", 16), ("beam5", 1), ("beam5", 2), ("beam5", 3), ("beam5", 4))
COUNTS = (1800, 3000, 4200, 6000, 12000)
SLICES = (((16, 1, 1), 4), ((16, 1, 1), 8), ((16, 1, 1), 16), ((16, 2, 1), 8), ((32, 2, 1), 16))
COSTS = (((16, 1, 1), (1, 4, 8)), ((32, 2, 2), (1, 4, 8)), ((48, 4, 2), (1, 4, 8)), ((64, 6, 4), (1, 4, 8)))
REDUCED = ((4, 0.01), (6, 0.01), (8, 0.01))  # segments, error asked of the modes
EQUATIONS: dict[str, dict[str, Any]] = {
    "linear": {}, "stiffened": {"stiffening": True}, "co-rotational": {"frames": "co-rotational"},
}  # fmt: skip


@dataclass
class _Study:
    """Runs that are asked for once."""

    repeats: int
    done: dict[str, Ran] = field(default_factory=dict)

    def ran(self, link: Mapping[str, Any], steps: int, damped: str, equation: str, repeats: int = 0) -> Ran:
        """A run of a scene, from memory if it was asked for before."""
        key = repr((link, steps, damped, equation))
        repeats = (repeats or self.repeats) * (damped == "damped")
        if key not in self.done:
            scene = four_bar(link, steps, damped, **EQUATIONS[equation])
            self.done[key] = run(scene, repeats)
        return self.done[key]


def bench_corotational(folder: Path, quick: bool) -> None:
    """Convergence, errors against time, solids and reduced solids; tables and a plot go to the folder."""
    study = _Study(1 if quick else 7)
    kinds = ["damped"] if quick else ["damped", "undamped"]
    references = {kind: reference(study, kind, quick) for kind in kinds}
    rows = [
        _equation_row(study, references, element, count, equation)
        for element, count in (BEAMS[4:5] if quick else BEAMS[1:6])
        for equation in EQUATIONS
    ]
    header = ("mesh of a link", "equation", *(f"worst error, {kind}" for kind in kinds),
              *(f"rms, {kind}" for kind in kinds), "iterations", "factorisations", "3,000 steps [ms]",
              "of linear")  # fmt: skip
    exact = references["damped"]
    tables = [whole_runs(quick), table(header, rows), _space(study, kinds, quick), _time(study, references, quick)]
    if not quick:
        tables += [_solids(study, exact), _reduced(study, exact), _costs()]
    peaks = [(kind, f"{np.abs(y).max() / 1e6:.0f}") for kind, y in references.items()]
    write_page(folder, "performance/corotational", [*tables, table(("case", "peak [MPa]"), peaks)])
    _plot(folder / "corotational.png", study, exact)


def reference(study: _Study, kind: str, quick: bool = False) -> Curve:
    """The converged curve: the finest mesh with two steps, extrapolated."""
    steps = QUICK if quick else REFERENCE[kind]
    coarse, fine = (study.ran(FINEST, n, kind, "co-rotational", 1).curve for n in steps)
    return np.asarray((4 * fine - coarse) / 3)


def worst(curve: Curve, other: Curve) -> float:
    """Largest difference, of the second's peak."""
    return float(np.abs(curve - other).max() / np.abs(other).max())


def rms(curve: Curve, other: Curve) -> float:
    """Its square mean, of the second's peak."""
    return float(np.sqrt(np.mean((curve - other) ** 2)) / np.abs(other).max())


def _beam(element: str, count: int) -> dict[str, Any]:
    return {"model": "beam", "element": element, "mesh": {"elements": count}}


def _equation_row(
    study: _Study, references: Mapping[str, Curve], element: str, count: int, equation: str
) -> Sequence[str]:
    found = {kind: study.ran(_beam(element, count), STEPS, kind, equation) for kind in references}
    linear = study.ran(_beam(element, count), STEPS, "damped", "linear").seconds
    of = found["damped"]
    return (
        f"{count} {element}", equation, *(_percent(worst(found[kind].curve, y)) for kind, y in references.items()),
        *(_percent(rms(found[kind].curve, y)) for kind, y in references.items()),
        f"{of.iterations:.2f}" if of.iterations else "-", str(of.factorised), f"{1e3 * of.seconds:.0f}",
        f"{of.seconds / linear:.1f}",
    )  # fmt: skip


def _space(study: _Study, kinds: Sequence[str], quick: bool) -> list[str]:
    """Against the finest mesh with the same step."""
    rows = []
    for element, count in BEAMS[4:5] if quick else BEAMS:
        found = [study.ran(_beam(element, count), STEPS, kind, "co-rotational") for kind in kinds]
        finest = [study.ran(FINEST, STEPS, kind, "co-rotational", 1) for kind in kinds]
        errors = [_percent(worst(a.curve, b.curve)) for a, b in zip(found, finest, strict=True)]
        rows.append((f"{count} {element}", str(found[0].unknowns), *errors, f"{1e3 * found[0].seconds:.0f}"))
    header = ("mesh of a link", "unknowns", *(f"error in space, {kind}" for kind in kinds), "3,000 steps [ms]")
    return table(header, rows)


def _time(study: _Study, references: Mapping[str, Curve], quick: bool) -> list[str]:
    rows = []
    for steps in COUNTS[1:2] if quick else COUNTS:
        found = {kind: study.ran(_beam("beam5", 3), steps, kind, "co-rotational") for kind in references}
        linear = study.ran(_beam("beam5", 3), steps, "damped", "linear")
        of = found["damped"]
        errors = (_percent(worst(found[kind].curve, y)) for kind, y in references.items())
        rows.append((f"{steps:,}", *errors, f"{of.iterations:.2f}", f"{1e3 * of.seconds:.0f}",
                     f"{1e3 * linear.seconds:.0f}", f"{of.seconds / linear.seconds:.1f}"))  # fmt: skip
    header = (
        "steps",
        *(f"error, {kind}" for kind in references),
        "iterations",
        "co-rotational [ms]",
        "linear [ms]",
        "ratio",
    )
    return table(header, rows)


def _solids(study: _Study, exact: Curve) -> list[str]:
    """Solids against beams, of either equation, with the same step."""
    finest = {name: study.ran(FINEST, STEPS, "damped", name, 1).curve for name in ("linear", "co-rotational")}
    rows = []
    for elements, segments in SLICES:
        link = {"model": "solid", "element": "hex20", "mesh": {"elements": list(elements)}}
        linear = study.ran(link, STEPS, "damped", "linear", 1)
        found = study.ran({**link, "segments": segments}, STEPS, "damped", "co-rotational", 1)
        rows.append((
            " × ".join(map(str, elements)), str(segments), f"{found.unknowns:,}",
            _percent(worst(linear.curve, finest["linear"])), _percent(worst(found.curve, finest["co-rotational"])),
            _percent(worst(found.curve, exact)), f"{found.iterations:.2f}", f"{1e3 * found.seconds:,.0f}",
            f"{found.seconds / linear.seconds:.1f}",
        ))  # fmt: skip
    header = ("hex20 of a link", "segments", "unknowns", "from beams, both linear", "from beams, both co-rotational",
              "worst error", "iterations", "3,000 steps [ms]", "of linear")  # fmt: skip
    return table(header, rows)


def _reduced(study: _Study, exact: Curve) -> list[str]:
    """Segments of reduced solids."""
    rows = []
    finest = study.ran(FINEST, STEPS, "damped", "co-rotational", 1).curve
    for segments, tolerance in REDUCED:
        link = {"model": "solid", "mesh": {"elements": [24, 2, 1]}, "reduction": "modal", "segments": segments}
        ran = run(four_bar(link, STEPS, "damped", frames="co-rotational", reduction_tolerance=tolerance), study.repeats)
        study.done[f"reduced, {segments} segments, {tolerance}"] = ran
        rows.append((
            str(segments), _percent(tolerance), str(ran.unknowns), _percent(worst(ran.curve, finest)),
            _percent(worst(ran.curve, exact)), f"{ran.iterations:.2f}", f"{1e3 * ran.seconds:.0f}",
        ))  # fmt: skip
    header = ("segments", "modes for", "unknowns", "from co-rotational beams", "worst error", "iterations",
              "3,000 steps [ms]")  # fmt: skip
    return table(header, rows)


def _costs() -> list[str]:
    """A step of solids, co-rotational against linear on the same mesh."""
    rows: list[Sequence[str]] = []
    for elements, segments in COSTS:
        link = {"model": "solid", "element": "hex20", "mesh": {"elements": list(elements)}}
        linear, _ = cost(four_bar(link, STEPS))
        for count in segments:
            step, solver = cost(four_bar({**link, "segments": count}, STEPS, frames="co-rotational"))
            unknowns = sum(each.unknowns for each in solver.links)
            iterations = solver.iterations / (BLOCKS * POINTS)
            rows.append((
                " × ".join(map(str, elements)), str(count), f"{unknowns:,}", f"{1e3 * linear:.2f}", f"{1e3 * step:.2f}",
                f"{step / linear:.1f}", f"{iterations:.2f}", str(solver.factorisations),
            ))  # fmt: skip
    header = ("hex20 of a link", "segments", "unknowns", "linear step [ms]", "co-rotational step [ms]", "ratio",
              "iterations", "factorisations")  # fmt: skip
    return table(header, rows)


def _percent(share: float) -> str:
    return f"{100 * share:.2g} %"


def _plot(path: Path, study: _Study, exact: Curve) -> None:
    """Error against time, a series for each equation and mesh."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 5.6), layout="constrained")
    axes = figure.add_subplot()
    for (label, points), marker in zip(_series(study, exact).items(), "osd^vx*P", strict=False):
        x, y = zip(*sorted(points), strict=True)
        axes.loglog(x, y, marker=marker, linestyle="-" if len(points) > 1 else "none", label=label)
    axes.set_xlabel("processor time of the steps [s]")
    axes.set_ylabel("worst error, of the peak stress [%]")
    axes.grid(visible=True, which="both", alpha=0.3)
    figure.legend(loc="outside lower center", ncols=2, frameon=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=130)


def _series(study: _Study, exact: Curve) -> dict[str, list[tuple[float, float]]]:
    """Points of the plot: seconds and worst error in percent."""
    found: dict[str, list[tuple[float, float]]] = {}

    def add(label: str, ran: Ran) -> None:
        found.setdefault(label, []).append((ran.seconds, 100 * worst(ran.curve, exact)))

    for element, count in BEAMS[1:6]:
        for equation in EQUATIONS:
            key = repr((_beam(element, count), STEPS, "damped", equation))
            name = f"{equation}, beams" if equation != "co-rotational" else f"co-rotational, {element}"
            if key in study.done:
                add(f"{name}, step 0.1 ms", study.done[key])
    for steps in COUNTS:
        key = repr((_beam("beam5", 3), steps, "damped", "co-rotational"))
        if key in study.done:
            add("co-rotational, 3 beam5, steps of 0.17 to 0.025 ms", study.done[key])
    for key, ran in study.done.items():
        if key.startswith("reduced"):
            add("co-rotational, reduced solids", ran)
    return found


if __name__ == "__main__":
    script(bench_corotational)
