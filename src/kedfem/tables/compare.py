"""Runs beside each other as tables."""

import numpy as np
from rich.table import Table
from rich.text import Text

from kedfem.compare import Comparison
from kedfem.output.words import with_prefix

MOST_KEYS = 20  # of scenes that are listed


def compare_tables(found: Comparison) -> list[Table]:
    """What differs in the scenes; peaks of all channels with what the others are off by; highest stresses."""
    out = [_keys(found)] if found.keys else []
    out += [_differences(found, k) for k in range(1, len(found.names))]
    return [*out, _peaks(found)] if found.peaks else out


def _differences(found: Comparison, k: int) -> Table:
    """Run k beside the first one."""
    low, high = (with_prefix(x, found.unit) for x in found.range)
    table = Table(
        title=Text(f"{found.names[k]} compared with {found.names[0]}, over {found.over}, {low} to {high}")
    )
    table.add_column("channel", overflow="fold")
    for name in ("peak", f"of {found.names[0]}", "differs by", "at", "rms"):
        table.add_column(name, justify="right", overflow="fold")
    for each in found.found:
        peak, first = (with_prefix(float(each.peaks[m]), each.channel.unit) for m in (k, 0))
        at = with_prefix(float(each.at[k]), found.unit)
        table.add_row(each.channel.name, peak, first, _percent(each.largest[k]), at, _percent(each.rms[k]))
    table.caption = "largest difference and its rms, of the first peak; of vectors the difference's length"
    return table


def _percent(x: float) -> str:
    return f"{100 * x:.3g} %" if x >= 1e-8 else "≈ 0"


def _keys(found: Comparison) -> Table:
    table = Table(title=Text("What differs in the scenes"))
    table.add_column("key", overflow="fold")
    for name in found.names:
        table.add_column(name, overflow="fold")
    for key, values in list(found.keys.items())[:MOST_KEYS]:
        table.add_row(Text(key), *(Text("–" if x is None else str(x)) for x in values))
    if len(found.keys) > MOST_KEYS:
        table.caption = f"and {len(found.keys) - MOST_KEYS} more"
    return table


def _peaks(found: Comparison) -> Table:
    table = Table(title=Text("Highest von Mises stress"))
    table.add_column("link", overflow="fold")
    for name in found.names:
        table.add_column(name, justify="right", overflow="fold")
    for link, stresses in found.peaks.items():
        off = stresses / stresses[0] - 1 if stresses[0] else np.full(len(stresses), np.nan)
        table.add_row(
            link, with_prefix(stresses[0], "Pa"),
            *(f"{with_prefix(x, 'Pa')} ({100 * d:+.3g} %)" for x, d in zip(stresses[1:], off[1:], strict=True)),
        )  # fmt: skip
    return table
