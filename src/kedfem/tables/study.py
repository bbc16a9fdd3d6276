"""Variants of a scene by speed and error."""

from rich.table import Table
from rich.text import Text

from kedfem.accuracy.study.measuring import Measured, Study
from kedfem.output.words import percent

REFERENCE = "reference"
STUDY_COLUMNS = ("model", "mesh", "steps", "red.", "size", "prep.", "step", "whole", "error")  # fmt: skip


def study_tables(study: Study, machine: str) -> list[Table]:
    """Variants by time with their errors, and what the reference's own error is made of."""
    table = Table(title=Text(f"Speed against error: {study.title}"), pad_edge=False)
    for column in STUDY_COLUMNS:
        left = column == "model"
        table.add_column(
            column,
            justify="left" if left else "right",
            overflow="fold",
            no_wrap=not left,
            min_width={"model": 11, "error": len(REFERENCE)}.get(column),
        )
    ran = [row for row in study.rows if row.seconds]
    for row in sorted(ran, key=lambda row: row.seconds.whole if row.seconds else 0.0):
        table.add_row(*_study_row(row, study), style="bold" if row.front else None)
    shares = ", ".join(f"{name} {percent(share)}" for name, share in study.shares.items())
    unknown = "" if "mesh" in study.shares else "; its mesh could not be compared with a coarser one"
    table.caption = Text(
        f"bold: no other is both faster and nearer. mesh, steps: times as fine as the scene's. Errors are against "
        f"{study.reference.variant.name}, whose own is about {percent(study.floor)} ({shares or 'not known'}{unknown}): "
        f"≤ is below that. red.: error that the reduction may cause; size: unknowns; preparation, steps, whole run: "
        f"seconds, medians; worst channels: see the CSV. {machine}"
    )
    return [table, _not_run(study)] if len(ran) < len(study.rows) else [table]


def _study_row(row: Measured, study: Study) -> tuple[str, ...]:
    if row.seconds is None:
        raise ValueError(f"{row.variant.name} was not run")
    v, s = row.variant, row.seconds
    model = (
        v.fidelity.name,
        f"{v.fineness:g}",
        f"{v.steps}",
        f"{v.tolerance:.0e}".replace("e-0", "e-") if v.tolerance else "-",
    )
    times = (_seconds(s.preparation), _seconds(s.stepping), _seconds(s.whole))
    below = row.error <= study.floor
    found = f"≤ {percent(study.floor)}" if below else percent(row.error)
    return (*model, str(row.unknowns), *times, REFERENCE if v == study.reference.variant else found)


def _seconds(s: float) -> str:
    """In five characters, so that nine columns fit a terminal of 80."""
    return f"{s:.0f}" if s >= 10 else f"{s:.2g}" if s >= 0.01 else "<0.01"


def _not_run(study: Study) -> Table:
    """Variants that were not run, by reason."""
    table = Table(title="Not run", show_header=False)
    for row in study.rows:
        if row.seconds is None:
            table.add_row(row.variant.name, Text(row.note))
    return table
