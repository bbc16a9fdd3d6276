"""What was chosen for an accuracy, and what it is expected to cost."""

import numpy as np
from rich.table import Table
from rich.text import Text

from kedfem.accuracy.plan import Plan
from kedfem.accuracy.reduction import Reduction
from kedfem.scene import LinkScene, Scene, time_grid


def plan_tables(plan: Plan) -> list[Table]:
    """Where the error of a run with `analysis.accuracy` comes from, what was chosen, and what was not."""
    budget = Table(title=f"Accuracy asked for: {100 * plan.asked:.3g} %")
    for column in ("part of the error", "expected", "allowed"):
        budget.add_column(column, justify="left" if column.startswith("part") else "right")
    for share in plan.shares:
        budget.add_row(share.what, f"{100 * share.error:.2g} %", f"{100 * share.allowed:.2g} %")
    budget.add_row("together", f"{100 * plan.error:.2g} %", f"{100 * plan.asked:.2g} %")
    return [budget, chosen_table(plan)]


def chosen_table(plan: Plan) -> Table:
    """What was chosen, and what was tried for it."""
    chosen = Table(title=f"Chosen for {100 * plan.asked:.3g} %", show_header=False)
    chosen.add_row("frames", str(plan.scene.analysis.frames))
    chosen.add_row("step", _step(plan.scene))
    for name, link in plan.scene.links.items():
        chosen.add_row(name, _chosen(link))
    for note in plan.notes:
        chosen.add_row("note", Text(note))
    return chosen


def _step(scene: Scene) -> str:
    """Step and levels in words."""
    grid, levels = time_grid(scene), scene.analysis.extrapolation_levels or 1
    halved = f", combined with {', '.join(f'1/{2**k}' for k in range(1, levels))} of it" if levels > 1 else ""
    return f"{grid.step:.4g} s, {grid.steps} steps{halved}"


def _chosen(link: LinkScene) -> str:
    """Fidelity and mesh in words."""
    sizes = ((key, value) for key, value in link.mesh if value is not None)
    mesh = ", ".join(f"{key} {_size(key, value)}" for key, value in sizes) if link.shape else ""
    segments = "" if link.segments is None else f", {link.segments} segments"
    kind = f"{link.element} " if link.element and link.model != "rigid" else ""
    return (
        f"{'reduced ' if link.reduced else ''}{kind}{link.model}" + (f" ({mesh})" if mesh else "") + segments
    )


def _size(key: str, value: object) -> object:
    return f"{np.degrees(value):.3g}°" if key == "fillet_angle" and isinstance(value, float) else value


def reduction_table(reduction: Reduction) -> Table:
    """Estimated error of reduced links, channel by channel."""
    table = Table(title="Error of the reduction (estimated)")
    table.add_column("channel", overflow="fold")
    table.add_column("of its peak", justify="right")
    for name, error in reduction.estimate.items():
        table.add_row(name, f"{100 * error:.2g} %")
    table.caption = f"asked for: {100 * reduction.tolerance:.2g} %; against the same links unreduced"
    return table
