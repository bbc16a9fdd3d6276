"""What a run found: largest values, balance, seconds."""

from collections.abc import Mapping
from functools import partial

import numpy as np
from rich.table import Table
from rich.text import Text

from kedfem.accuracy.error_budget import Budget, percent
from kedfem.accuracy.steady import Steady
from kedfem.analysis import Run
from kedfem.output.words import NOTHING, clock, moment, place_of, with_prefix
from kedfem.report.facts import peak_rows
from kedfem.report.fatigue_facts import ENDLESS, fatigue_notes
from kedfem.results import Fatigue, Peak
from kedfem.results.balance import Balance
from kedfem.scene import Scene, without_vibration
from kedfem.tables.plan import chosen_table


def run_tables(scene: Scene, done: Run) -> list[Table]:
    """Largest values of every channel, the highest stress of every link, and the seconds spent."""
    before = [] if done.plan is None else [chosen_table(done.plan)]
    table = Table(title=Text(scene.title or "Largest values"))
    for column in ("channel", "component", "largest", clock(scene)):
        left = column in ("channel", "component")
        table.add_column(column, justify="left" if left else "right", overflow="fold", no_wrap=not left)
    channels = done.results.channels.values()
    highest: dict[str, float] = {}
    peaks = []
    for channel, values in channels:
        k, c = np.unravel_index(np.abs(values).argmax(), values.shape)
        peaks.append((channel, k, c, float(values[k, c])))
        highest[channel.unit] = max(highest.get(channel.unit, 0.0), abs(peaks[-1][-1]))
    for channel, k, c, value in peaks:
        if abs(value) <= NOTHING * highest[channel.unit]:
            table.add_row(channel.name, "", "≈ 0", "")
            continue
        at = moment(scene, float(done.results.time[k]), float(done.results.angle[k]))
        table.add_row(channel.name, channel.columns[c], with_prefix(value, channel.unit), at)
    balance = [] if done.balance is None else [balance_table(done.balance)]
    count = len(done.results.time)
    taken = f"{count} positions" if without_vibration(scene) else f"{count - 1} steps"
    spent = Table(title=f"{taken}; seconds", show_header=False)
    for stage, seconds in done.seconds.items():
        spent.add_row(stage, f"{seconds:.2f}")
    errors = [budget_table(done.budget)] if done.budget and done.budget.kinds else []
    stress = [stress_table(scene, done.peaks)] if done.peaks else []
    damaged = [fatigue_table(done.results.fatigue)] if done.results.fatigue else []
    steady = [] if done.steady is None else [steady_table(done.steady)]
    return [*before, table, *stress, *damaged, *steady, *errors, *balance, spent]


def steady_table(found: Steady) -> Table:
    """Period, and how vibrations about a steady motion die away."""
    table = Table(title="Steady motion", show_header=False)
    n = f"{found.revolutions:.6g}"
    turns = f", {n} revolution{'s' * (n != '1')} of the drive" if found.revolutions else ""
    table.add_row("period", f"{with_prefix(found.period, 's')}{turns}")
    table.add_row("found in", f"{found.marches} marches over a period; the last leaves {found.residual:.1g}")
    if found.growth is not None:
        left = f"{100 * found.growth:.4g} % is left after a period"
        settles = f", 1 % after {found.periods:,} of them" if found.periods and found.periods > 1 else ""
        table.add_row("least damped vibration", f"{left}{settles}{': unstable' * found.unstable}")
    if found.vibration:
        table.add_row("vibration that grows", found.vibration)
    return table


def stress_table(scene: Scene, peaks: Mapping[str, Peak]) -> Table:
    """The highest stress of each link over all steps, and away from where it is not what it seems."""
    table = Table(title="Highest von Mises stress, over all steps")
    for column in ("link", "stress", "reference position", clock(scene), "near"):
        table.add_column(column, justify="right" if column == "stress" else "left", overflow="fold")
    for row in peak_rows(peaks, partial(moment, scene)):
        table.add_row(*row)
    return table


def fatigue_table(found: Fatigue) -> Table:
    """Life and utilisation at the place of the highest damage of each link."""
    table = Table(title="Fatigue, by the last period")
    turns = "revolutions" if found.revolutions else "periods"
    for column in (
        "link",
        "life, h",
        turns,
        "utilisation",
        "mean ± amplitude",
        "reference position",
    ):
        table.add_column(
            column,
            overflow="fold",
            justify="left" if column in {"link", "reference position"} else "right",
        )
    for name, (worst, *_) in ((name, spots) for name, spots in found.spots.items() if spots):
        lives = [f"{x:.3g}" if x < ENDLESS else "endless" for x in (found.hours(worst), found.turns(worst))]
        cycle = f"{worst.mean / 1e6:.3g} ± {worst.amplitude / 1e6:.3g} MPa"
        table.add_row(name, *lives, percent(worst.utilisation), cycle, place_of(worst.place))
    table.caption = Text("\n".join(fatigue_notes(found)))
    return table


def budget_table(found: Budget) -> Table:
    """Estimated errors: a line for each source, a column for each kind of channel."""
    table = Table(title="Estimated error, of each channel's largest value")
    table.add_column("from")
    for kind in found.kinds:
        table.add_column(kind, justify="right")
    for share in found.shares:
        table.add_row(share.source, *(_cell(share.errors.get(kind)) for kind in found.kinds))
    table.add_row("together", *(_cell(found.together[kind]) for kind in found.kinds), style="bold")
    lines = [f"mesh of {name}: {percent(eta)} in the energy norm" for name, eta in found.links.items()]
    lines += [f"no estimate of {text}" for text in found.limits]
    table.caption = Text("\n".join(lines))
    return table


def _cell(error: float | None) -> str:
    return "-" if error is None else percent(error)


def balance_table(found: Balance) -> Table:
    """The residual of energy over the steps, and what energy rigid-body frames make."""
    table = Table(title="Balance", show_header=False)
    table.add_row("energy, residual of the steps", f"{100 * found.energy:.2g} % of the largest exchanged")
    if found.neglected:
        table.add_row(
            "energy made by rigid-body frames", f"{100 * found.neglected:.3g} % of the largest exchanged"
        )
    return table
