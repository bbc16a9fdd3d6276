"""Files of a study: a table for spreadsheets, and a plot of time against error."""

import csv
from collections.abc import Sequence
from itertools import cycle
from pathlib import Path
from typing import Any

from kedfem.accuracy.study.measuring import MeasuredVariant, Study
from kedfem.results.files import replacing
from kedfem.results.table import text_file

COLUMNS = (
    "model", "fineness", "times the steps", "reduction", "steps", "unknowns", "preparation [s]", "stepping [s]",
    "whole [s]", "runs", "error", "worst channel", "on the front", "note",
)  # fmt: skip
MARKERS = "osD^vP*X<>"


def written(row: MeasuredVariant) -> tuple[str, ...]:
    """One variant as texts; numbers have all digits of the float."""
    v, s = row.variant, row.seconds
    tolerance = "" if v.tolerance is None else repr(v.tolerance)
    model = (v.model_kind.name, repr(v.fineness), str(v.steps), tolerance)
    if s is None:
        return (*model, *[""] * 9, row.note)
    times = (repr(s.preparation), repr(s.stepping), repr(s.whole), str(s.runs))
    found = (repr(row.error), row.worst_channel, "yes" if row.front else "no", row.note)
    return (*model, str(row.steps), str(row.unknowns), *times, *found)


def write_study(study: Study, path: Path, machine: str) -> None:
    """Write all variants as comma-separated values, after the machine's name and the reference's own error."""
    with text_file(path) as file:
        file.write(f"# measured on: {machine}\n")
        file.write(f"# reference: {study.reference.variant.name}; its own error about {study.floor!r}\n")
        table = csv.writer(file, lineterminator="\n")
        table.writerow(COLUMNS)
        table.writerows(map(written, study.rows))


def write_study_plot(study: Study, path: Path, machine: str) -> None:
    """Write a plot of time against error, with a marker for each kind of model and names on the Pareto front."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 7.0), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    ran = [row for row in study.rows if row.seconds]
    least = _least(study, ran)
    names = dict.fromkeys(row.variant.model_kind.name for row in ran)
    for marker, name in zip(cycle(MARKERS), names, strict=False):
        points = [_point(row, least) for row in ran if row.variant.model_kind.name == name]
        axes.plot(*zip(*points, strict=True), marker, label=name, markersize=7, alpha=0.75)
    front = sorted(((_point(row, least), row) for row in ran if row.front), key=lambda pair: pair[0])
    axes.plot(*zip(*(point for point, _ in front), strict=True), color="0.2", linewidth=1.0, zorder=1)
    axes.set(xscale="log", yscale="log")
    _name_points(axes, front)
    axes.axhline(least, color="0.5", linestyle="--", linewidth=0.8)
    axes.set_xlabel("seconds of the whole run: preparation and all steps")
    axes.set_ylabel("largest relative error of probes, joint forces and drive torque")
    axes.grid(visible=True, which="major", alpha=0.3)
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), frameon=False)
    below = f"dashed: error of the reference itself, {study.reference.variant.name}"
    title = study.title.replace("$", r"\$")
    axes.set_title(f"{title}\n{below}\n{machine}", loc="left", fontsize=9)
    with replacing(path) as part:
        figure.savefig(part, format="png")


def _least(study: Study, ran: Sequence[MeasuredVariant]) -> float:
    """The error at which unknown errors are drawn."""
    known = [row.error for row in ran if row.error > 0.0]
    return study.floor or (0.5 * min(known) if known else 1e-6)


def _point(row: MeasuredVariant, least: float) -> tuple[float, float]:
    if row.seconds is None:
        raise ValueError(f"{row.variant.name} was not run")
    return row.seconds.whole, max(row.error, least)


def _name_points(axes: Any, front: Sequence[tuple[tuple[float, float], MeasuredVariant]]) -> None:
    """Number the points of the front, and list their names beside the axes."""
    lines = []
    for number, (point, row) in enumerate(front, start=1):
        beside = {"xytext": (-6, -6), "textcoords": "offset points", "ha": "right", "va": "top"}
        axes.annotate(str(number), point, weight="bold", **beside)
        lines.append(f"{number}  " + row.variant.name.replace(", mesh", ",\n    mesh", 1))
    axes.text(1.02, 0.0, "\n".join(lines), transform=axes.transAxes, va="bottom", fontsize=8)
