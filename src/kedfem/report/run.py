"""What a run found: largest values, balance, seconds."""

import numpy as np
from rich.table import Table
from rich.text import Text

from kedfem.analysis import Run
from kedfem.output.words import NOTHING, clock, moment, percent, with_prefix
from kedfem.report.plan import plan_tables
from kedfem.results.audit import Balance
from kedfem.scene import Scene


def run_tables(scene: Scene, done: Run) -> list[Table]:
    """Largest values of every channel, the highest stress of the frames, and the seconds spent."""
    before = [] if done.plan is None else plan_tables(done.plan)
    table = Table(title=Text(scene.title or "Largest values"))
    for column in ("channel", "component", "largest", clock(scene)):
        left = column in ("channel", "component")
        table.add_column(column, justify="left" if left else "right", overflow="fold", no_wrap=not left)
    channels = done.results.channels.values()
    highest: dict[str, float] = {}
    for channel, values in channels:
        highest[channel.unit] = max(highest.get(channel.unit, 0.0), float(np.abs(values).max()))
    for channel, values in channels:
        k, c = np.unravel_index(np.abs(values).argmax(), values.shape)
        value = float(values[k, c])
        if abs(value) <= NOTHING * highest[channel.unit]:
            table.add_row(channel.name, "", "≈ 0", "")
            continue
        at = moment(scene, float(done.results.time[k]), float(done.results.angle[k]))
        table.add_row(channel.name, channel.columns[c], with_prefix(value, channel.unit), at)
    if done.peak:
        p = done.peak
        at = moment(scene, p.time, p.angle)
        table.add_row(f"links/{p.link}", "von_mises", with_prefix(p.stress, "Pa"), at)
        table.caption = "links: the highest stress of all animation frames"
    balance = [] if done.balance is None else [balance_table(done.balance, done.geometric)]
    spent = Table(title=f"{len(done.results.time) - 1} steps; seconds", show_header=False)
    for stage, seconds in done.seconds.items():
        spent.add_row(stage, f"{seconds:.2f}")
    return [*before, table, *balance, spent]


def balance_table(found: Balance, geometric: float | None) -> Table:
    """What the steps leave over of energy and momentum, and how far the linear equation is off because links bend.

    Parameters
    ----------
    geometric : estimated error of the peak stress; None where frames follow, which do not err so
    """
    table = Table(title="Balance" if geometric is None else "Balance and geometric error", show_header=False)
    for what, share in (
        ("energy, left over by the steps", found.energy),
        ("momentum", found.linear),
        ("angular momentum", found.angular),
    ):
        table.add_row(what, f"{100 * share:.2g} % of the largest exchanged")
    if geometric is not None:
        table.add_row(
            "energy made by nominal frames", f"{100 * found.neglected:.3g} % of the largest exchanged"
        )
        table.add_row("geometric error, estimated", f"{percent(geometric)} of the peak stress")
    return table
