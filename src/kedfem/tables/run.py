"""Tables of a run: choices, largest values, stresses, errors, energy balance, seconds."""

from collections.abc import Mapping
from functools import partial

import numpy as np
from rich.table import Table
from rich.text import Text

from kedfem.accuracy.error_budget import ROUNDING, Budget, percent
from kedfem.accuracy.plan import Plan
from kedfem.accuracy.reduction import Reduction
from kedfem.accuracy.steady import Steady
from kedfem.analysis import Run
from kedfem.arrays import Float
from kedfem.output.plots.groups import ALONE, SIGNED
from kedfem.output.words import clock, moment, place_of, with_prefix
from kedfem.report.facts import ENDLESS, fatigue_notes, of_yield, peak_rows
from kedfem.results import Channel, Fatigue, Peak
from kedfem.results.balance import Balance
from kedfem.results.records import rounding
from kedfem.scene import Cad, LinkScene, MeshFile, Scene, percentage, time_grid, without_vibration
from kedfem.tables.layout import facts, left, listed, right
from kedfem.tables.mechanism import seconds_table


def plan_tables(plan: Plan) -> list[Table]:
    """Sources of the error of a run with `analysis.accuracy`, and its choices."""
    budget = listed(
        f"Accuracy asked for: {percentage(plan.asked, 3)}",
        [*left("part of the error"), *right("expected", "allowed")],
        ((share.what, percent(share.error), percent(share.allowed)) for share in plan.shares),
        caption="each part by itself may take what is allowed; simpler links may take what the mesh leaves, too",
    )
    budget.add_row("together", percent(plan.error), percent(plan.asked))
    return [budget, chosen_table(plan)]


def chosen_table(plan: Plan) -> Table:
    """Choices, and notes on their trials."""
    scene = plan.scene
    return facts(f"Chosen for {percentage(plan.asked, 3)}", [
        ("frames", str(scene.analysis.frames)),
        ("step", _step(scene)),
        *((name, _chosen(link)) for name, link in scene.links.items()),
        *(("note", Text(note)) for note in plan.notes),
    ])  # fmt: skip


def _step(scene: Scene) -> str:
    """Step and levels in words."""
    grid, levels = time_grid(scene), scene.analysis.extrapolation_levels or 1
    halved = f", combined with {', '.join(f'1/{2**k}' for k in range(1, levels))} of it" if levels > 1 else ""
    return f"{grid.step:.4g} s, {grid.steps} steps{halved}"


def _chosen(link: LinkScene) -> str:
    """Model and mesh in words."""
    flat = link.category in {"beam", "plane"}  # without layers
    sizes = ((key, value) for key, value in link.mesh if value is not None and not (flat and key == "layers"))
    if link.model == "rigid":
        return "rigid"
    mesh = ", ".join(f"{key} {_size(key, value)}" for key, value in sizes) if link.shape else ""
    segments = "" if link.segments is None else f", {link.segments} segments"
    open_kind = isinstance(link.shape, Cad | MeshFile) and "element" not in link.model_fields_set
    kind = f"{link.element} " if link.element and not open_kind else ""  # of a file's part its mesh has them
    return f"{'reduced ' * link.reduced}{kind}{link.model}" + (f" ({mesh})" if mesh else "") + segments


def _size(key: str, value: object) -> object:
    return f"{np.degrees(value):.3g}°" if key == "fillet_angle" and isinstance(value, float) else value


def reduction_table(reduction: Reduction) -> Table:
    """Estimated error of reduced links, channel by channel."""
    columns, caption = [*left("channel"), *right("of its peak")], f"asked for: {percent(reduction.tolerance)}"
    rows = ((name, percent(error)) for name, error in reduction.estimate.items())
    caption += "; against the same links unreduced"
    return listed("Error of the reduction (estimated)", columns, rows, caption=caption)


def run_tables(scene: Scene, done: Run) -> list[Table]:
    """Largest values of every channel, the highest stress of every link, and the seconds spent."""
    count = len(done.results.instants)
    taken = f"{count} positions" if without_vibration(scene) else f"{count - 1} steps"
    return [
        *([chosen_table(done.plan)] if done.plan else []),
        channel_table(scene, done),
        stress_table(scene, done.peaks),
        *([fatigue_table(done.results.fatigue)] if done.results.fatigue else []),
        *([steady_table(done.steady)] if done.steady else []),
        *([budget_table(done.budget)] if done.budget and done.budget.kinds else []),
        *([balance_table(done.balance)] if done.balance else []),
        seconds_table(taken, done.seconds),
    ]


def channel_table(scene: Scene, done: Run) -> Table:
    """The largest value of every channel, and its instant."""
    columns = [*left("channel", "component"), *right("largest", clock(scene), no_wrap=True)]
    table = listed(Text(scene.title or "Largest values"), columns)
    least = rounding(done.results)
    for name, (channel, _) in done.results.channels.items():
        time, angle, values = done.results.largest_rows(name)
        k, component, value = largest_of(channel, values)
        if abs(value) <= least[channel.unit]:
            table.add_row(channel.name, "", "≈ 0", "")
            continue
        at = moment(scene, float(time[k]), float(angle[k]))
        table.add_row(channel.name, component, with_prefix(value, channel.unit), at)
    return table


def largest_of(channel: Channel, values: Float[np.ndarray, "n c"]) -> tuple[int, str, float]:
    """Row, component and value of the largest one; of vectors the magnitude if it is clearly larger, as in plots."""
    k, c = (int(x) for x in np.unravel_index(np.abs(values).argmax(), values.shape))
    value = float(values[k, c])
    if channel.vector and channel.name.rsplit("/", 1)[-1] not in SIGNED:
        size = np.linalg.norm(values, axis=1)
        if (longest := float(size.max())) > ALONE * abs(value):
            return int(size.argmax()), "magnitude", longest
    return k, channel.columns[c], value


def steady_table(found: Steady) -> Table:
    """Period of a steady motion, and decay of vibrations about it."""
    n = f"{found.revolutions:.6g}"
    turns = f", {n} revolution{'s' * (n != '1')} of the drive" if found.revolutions else ""
    table = facts("Steady motion", [
        ("period", f"{with_prefix(found.period, 's')}{turns}"),
        ("found in", f"{found.marches} marches over a period; the last leaves {found.residual:.1g}"),
    ])  # fmt: skip
    if found.growth is not None:
        share = f"{100 * found.growth:.4g} % is left after a period"
        settles = f", 1 % after {found.periods:,} of them" if found.periods and found.periods > 1 else ""
        table.add_row("least damped vibration", f"{share}{settles}{': unstable' * found.unstable}")
    if found.vibration:
        table.add_row("vibration that grows", found.vibration)
    return table


def stress_table(scene: Scene, peaks: Mapping[str, Peak]) -> Table:
    """The highest stress of each link over all steps, and away from singular places."""
    columns = [*left("link"), *right("stress", *of_yield(peaks)), *left("reference position", clock(scene), "near")]
    rows = peak_rows(peaks, partial(moment, scene))
    return listed("Highest von Mises stress, over all steps", columns, rows)


def fatigue_table(found: Fatigue) -> Table:
    """Life and utilisation at the place of the highest damage of each link."""
    turns = "revolutions" if found.revolutions else "periods"
    numbers = right("life, h", turns, "utilisation", "mean ± amplitude")
    columns = [*left("link"), *numbers, *left("reference position")]
    caption = Text("\n".join(fatigue_notes(found)))
    table = listed("Fatigue, by the last period", columns, caption=caption)
    for name, (worst, *_) in ((name, spots) for name, spots in found.spots.items() if spots):
        lives = [f"{x:.3g}" if x < ENDLESS else "endless" for x in (found.hours(worst), found.cycles(worst))]
        cycle = f"{worst.mean / 1e6:.3g} ± {worst.amplitude / 1e6:.3g} MPa"
        table.add_row(name, *lives, percent(worst.utilisation), cycle, place_of(worst.place))
    return table


def budget_table(found: Budget) -> Table:
    """Estimated errors: a line for each source, a column for each kind of channel."""
    rows = ((x.source, *(_cell(x.errors.get(kind)) for kind in found.kinds)) for x in found.shares)
    columns = [*left("from"), *right(*found.kinds)]
    table = listed("Estimated error, of each channel's largest value", columns, rows)
    table.add_row("together", *(_cell(found.together[kind]) for kind in found.kinds), style="bold")
    lines = [f"mesh of {name}: {percent(eta)} in the energy norm" for name, eta in found.links.items()]
    lines += [f"no estimate of {text}" for text in found.limits]
    table.caption = Text("\n".join(lines))
    return table


def _cell(error: float | None) -> str:
    return "-" if error is None else percent(error)


def balance_table(found: Balance) -> Table:
    """The residual of energy over the steps, and the energy that rigid-body frames create."""
    shares = {"energy, residual of the steps": percentage(found.energy)}
    if found.neglected > ROUNDING:
        shares["energy made by rigid-body frames"] = percentage(found.neglected, 3)
    return facts("Balance", ((what, f"{share} of the largest exchanged") for what, share in shares.items()))
