"""What a sweep found: the largest of each quantity and where, points that failed."""

from rich.table import Table
from rich.text import Text

from kedfem.sweep import Swept
from kedfem.sweep.files import column_units, largest, plain_quantities

SHOWN = 10  # failed points in words


def sweep_tables(done: Swept) -> tuple[list[Table], list[str]]:
    """The largest magnitudes over all points, where they are; and warnings."""
    failed = [k for k, row in enumerate(done.rows) if row.status == "failed"]
    fresh = len(done.rows) - done.before
    title = f"Sweep: {len(done.rows)} points, {len(failed)} failed, {fresh} run now"
    how = (
        "" if done.planned is None else f"steps and meshes of all as planned at {_place(done, done.planned)}"
    )
    table = Table(title=Text(title), caption=Text(how))
    for column in ("quantity", "largest", "unit", "at"):
        table.add_column(column, justify="right" if column == "largest" else "left")
    units = column_units(done.rows)
    for name in plain_quantities(list(units)):
        sizes = {k: largest(row, name) for k, row in enumerate(done.rows) if name in row.extremes}
        at = max(sizes, key=sizes.__getitem__)
        table.add_row(Text(name), f"{sizes[at]:.4g}", units[name], Text(_place(done, at)))
    return [table], [*_failures(done, failed), *_doubts(done)]


def _place(done: Swept, k: int) -> str:
    return ", ".join(f"{axis.key} = {_said(axis.values[k])}" for axis in done.axes)


def _said(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    number, _, unit = str(value).partition(" ")
    try:
        return f"{float(number):.6g} {unit}".strip()
    except ValueError:
        return str(value)


def _failures(done: Swept, failed: list[int]) -> list[str]:
    lines = [f"{_place(done, k)}: failed: {done.rows[k].message}" for k in failed[:SHOWN]]
    more = len(failed) - SHOWN
    return [*lines, f"{more} more points failed; sweep.csv has their messages"] if more > 0 else lines


def _doubts(done: Swept) -> list[str]:
    loose = [k for k, row in enumerate(done.rows) if row.settled == "no"]
    lines = []
    if loose:
        worst = max(loose, key=lambda k: done.rows[k].change)
        lines.append(
            f"{len(loose)} of {len(done.rows)} points have not settled: their last two turns differ by more than 1 %, by "
            f"{100 * done.rows[worst].change:.2g} % at {_place(done, worst)}; raise analysis.revolutions"
        )
    if doubtful := sum(row.status == "doubtful" for row in done.rows):
        lines.append(f"{doubtful} points are doubtful: their results mean nothing; sweep.csv says why")
    return lines
