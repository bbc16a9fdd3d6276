"""Tables of several runs: comparisons, variants of a scene by speed and error, points of a sweep."""

import numpy as np
from rich.table import Table
from rich.text import Text

from kedfem.accuracy.study.measuring import MeasuredVariant, Study
from kedfem.compare import Comparison
from kedfem.output.words import NOTHING, with_prefix
from kedfem.scene import percentage
from kedfem.sweep import SweepResult
from kedfem.sweep.files import column_units, largest, plain_quantities
from kedfem.tables.layout import facts, left, listed, right

MOST_KEYS = 20  # of scenes that are listed
SHOWN = 10  # failed points in words
REFERENCE = "reference"
STUDY_COLUMNS = ("model", "mesh", "steps", "red.", "size", "prep.", "step", "whole", "error")  # fmt: skip


def compare_tables(found: Comparison) -> list[Table]:
    """Differing keys of the scenes; peaks and differences of all channels; highest stresses."""
    return [_keys(found), *(_differences(found, k) for k in range(1, len(found.names))), _peaks(found)]


def _differences(found: Comparison, k: int) -> Table:
    """Run k compared with the first one."""
    low, high = (with_prefix(x, found.unit) for x in found.range)
    title = f"{found.names[k]} compared with {found.names[0]}, over {found.over}, {low} to {high}"
    columns = [*left("channel"), *right("peak", f"of {found.names[0]}", "differs by", "at", "rms")]
    caption = "largest difference and its rms, of the first peak; of vectors the difference's length"
    caption += "\n* zero beside others: of the highest of them" if any(each.zero for each in found.found) else ""
    table = listed(Text(title), columns, caption=caption)
    for each in found.found:
        peak, first = (with_prefix(float(each.peaks[m]), each.channel.unit) for m in (k, 0))
        at = with_prefix(float(each.at[k]), found.unit)
        table.add_row(each.channel.name + " *" * each.zero, peak, first, _off(each.largest[k]), at, _off(each.rms[k]))
    return table


def _off(x: float) -> str:
    return percentage(x, 3) if x >= 1e-8 else "≈ 0"


def _keys(found: Comparison) -> Table:
    rows = (
        (Text(key), *(Text("–" if x is None else str(x)) for x in values))
        for key, values in list(found.keys.items())[:MOST_KEYS]
    )
    more = len(found.keys) - MOST_KEYS
    caption = f"and {more} more" if more > 0 else None
    return listed(Text("What differs in the scenes"), left("key", *found.names), rows, caption=caption)


def _peaks(found: Comparison) -> Table:
    table = listed(Text("Highest von Mises stress"), [*left("link"), *right(*found.names)])
    for link, stresses in found.peaks.items():
        off = stresses / stresses[0] - 1 if stresses[0] else np.full(len(stresses), np.nan)
        others = zip(stresses[1:], off[1:], strict=True)
        words = (f"{with_prefix(x, 'Pa')} ({100 * d:+.3g} %)" for x, d in others)
        table.add_row(link, with_prefix(stresses[0], "Pa"), *words)
    return table


def study_tables(study: Study, machine: str) -> list[Table]:
    """Variants by time with their errors, and the shares of the reference's own error; variants not run, with reasons."""
    first, *others, last = STUDY_COLUMNS
    columns = [*left(first, min_width=11), *right(*others, no_wrap=True)]
    columns += right(last, no_wrap=True, min_width=len(REFERENCE))
    shares = ", ".join(f"{name} {percentage(share)}" for name, share in study.shares.items())
    unknown = "" if "mesh" in study.shares else "; its mesh could not be compared with a coarser one"
    caption = Text(
        f"bold: no other is both faster and nearer. mesh, steps: times as fine as the scene's. Errors are against "
        f"{study.reference.variant.name}, whose own is about {percentage(study.floor)} ({shares or 'not known'}{unknown}"
        f"): ≤ is below that. red.: error that the reduction may cause; size: unknowns; preparation, steps, whole run: "
        f"seconds, medians; worst channels: see the CSV. {machine}"
    )
    table = listed(Text(f"Speed against error: {study.title}"), columns, pad_edge=False, caption=caption)
    ran = [row for row in study.rows if row.seconds]
    for row in sorted(ran, key=lambda row: row.seconds.whole if row.seconds else 0.0):
        table.add_row(*_study_row(row, study), style="bold" if row.front else None)
    left_out = ((row.variant.name, Text(row.note)) for row in study.rows if row.seconds is None)
    return [table, facts("Not run", left_out)]


def _study_row(row: MeasuredVariant, study: Study) -> tuple[str, ...]:
    if row.seconds is None:
        raise ValueError(f"{row.variant.name} was not run")
    v, s = row.variant, row.seconds
    tolerance = f"{v.tolerance:.0e}".replace("e-0", "e-") if v.tolerance else "-"
    model = v.model_kind.name, f"{v.fineness:g}", f"{v.steps}", tolerance
    times = (_seconds(s.preparation), _seconds(s.stepping), _seconds(s.whole))
    below = row.error <= study.floor
    found = f"≤ {percentage(study.floor)}" if below else percentage(row.error)
    return (*model, str(row.unknowns), *times, REFERENCE if v == study.reference.variant else found)


def _seconds(s: float) -> str:
    """In five characters, so that nine columns fit a terminal of 80."""
    return f"{s:.0f}" if s >= 10 else f"{s:.2g}" if s >= 0.01 else "<0.01"


def sweep_tables(done: SweepResult) -> tuple[list[Table], list[str]]:
    """The largest magnitudes over all points, and their points; and warnings."""
    failed = [k for k, row in enumerate(done.rows) if row.status == "failed"]
    fresh = len(done.rows) - done.before
    title = f"Sweep: {len(done.rows)} points, {len(failed)} failed, {fresh} run now"
    how = done.planned is not None and f"steps and meshes of all as planned at {_place(done, done.planned)}"
    columns = [*left("quantity"), *right("largest"), *left("at")]
    table = listed(Text(title), columns, caption=Text(how or ""))
    units = column_units(done.rows)
    sizes = {name: _largest(done, name) for name in plain_quantities(list(units))}
    least: dict[str, float] = {}
    for name, (_, size) in sizes.items():
        least[units[name]] = max(NOTHING * size, least.get(units[name], 0.0))
    for name, (at, size) in sizes.items():
        nothing = size <= least[units[name]]
        value = f"{size:.4g}" if units[name] == "1" else with_prefix(size, units[name])
        words = "≈ 0" if nothing else value
        table.add_row(Text(name), words, Text("" if nothing else _place(done, at)))
    return [table], [*_failures(done, failed), *_warnings(done)]


def _largest(done: SweepResult, name: str) -> tuple[int, float]:
    """The point at which a quantity is largest, and its value there."""
    sizes = {k: largest(row, name) for k, row in enumerate(done.rows) if name in row.extremes}
    at = max(sizes, key=sizes.__getitem__)
    return at, sizes[at]


def _place(done: SweepResult, k: int) -> str:
    return ", ".join(f"{axis.key} = {_said(axis.values[k])}" for axis in done.axes)


def _said(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    number, _, unit = str(value).partition(" ")
    try:
        return f"{float(number):.6g} {unit}".strip()
    except ValueError:
        return str(value)


def _failures(done: SweepResult, failed: list[int]) -> list[str]:
    lines = [f"{_place(done, k)}: failed: {done.rows[k].message}" for k in failed[:SHOWN]]
    more = len(failed) - SHOWN
    return [*lines, f"{more} more points failed; sweep.csv has their messages"] if more > 0 else lines


def _warnings(done: SweepResult) -> list[str]:
    loose = [k for k, row in enumerate(done.rows) if row.settled == "no"]
    lines = []
    if loose:
        worst = max(loose, key=lambda k: done.rows[k].change)
        lines.append(
            f"{len(loose)} of {len(done.rows)} points have not settled: their last two revolutions differ by more than "
            f"1 %, by {percentage(done.rows[worst].change)} at {_place(done, worst)}; raise analysis.revolutions"
        )
    if unreliable := sum(row.status == "unreliable" for row in done.rows):
        lines.append(f"{unreliable} points are unreliable: their results mean nothing; sweep.csv says why")
    return lines
