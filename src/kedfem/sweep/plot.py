"""The resonance plot: largest stresses, joint forces and torques over a swept key; or the stability map over two. PNG."""

from collections.abc import Sequence
from pathlib import Path as FilePath

import numpy as np

from kedfem.accuracy.steady import GROWS
from kedfem.output.plots.drawing import draw_legend, figure_saved
from kedfem.sweep.axes import Axis
from kedfem.sweep.edges import Edge, unstable_bands
from kedfem.sweep.files import column_units, largest, plain_quantities
from kedfem.sweep.points import GROWTH, Row

PANELS = (
    ("stress/", "Pa", "peak stress (MPa)", 1e-6),
    ("joints/", "N", "joint force (N)", 1.0),
    ("drive/", "N m", "drive torque (N m)", 1.0),
    ("drive/", "N", "drive force (N)", 1.0),
    (GROWTH, "1", "growth of vibrations\nin a period", 1.0),
)


def write_plot(path: FilePath, axes: Sequence[Axis], rows: Sequence[Row], edges: Sequence[Edge] = ()) -> None:
    """Plot largest magnitudes over the only swept key, or the stability map of two.

    A plot of an earlier sweep is removed. Points that have not settled are open rings; unstable bands with known edges
    are shaded. Keys with words, more than two keys, fewer than two points, and two keys without growth have no plot.
    """
    path.unlink(missing_ok=True)
    if len(axes) == 2:
        _write_map(path, axes, rows, edges)
        return
    numbers = axes[0].numbers
    units = column_units(rows)
    panels = [
        (label, scale, names)
        for start, unit, label, scale in PANELS
        if (names := [x for x in plain_quantities(list(units)) if x.startswith(start) and units[x] == unit])
    ]
    if len(axes) > 1 or numbers is None or len(rows) < 2 or not panels:
        return
    order = np.argsort(numbers)
    loose = np.array([rows[k].settled == "no" for k in order])
    bands = unstable_bands(numbers, rows, range(len(rows)), edges)
    title = f"Largest over the last revolutions of each run, over {axes[0].key}"
    title += ("; rings: not settled" if loose.any() else "") + ("; red: unstable" if bands else "")
    with figure_saved(path, title) as figure:
        panes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
        for ax, (label, scale, names) in zip(panes, panels, strict=True):
            for name in names:
                values = np.array([scale * largest(rows[k], name) for k in order])
                (line,) = ax.plot(numbers[order], values, marker=".", label=name.split("/")[1])
                ring = {"markersize": 7, "fillstyle": "none", "color": line.get_color()}
                ax.plot(numbers[order][loose], values[loose], "o", **ring)
            for first, last in bands:
                ax.axvspan(first, last, color="tab:red", alpha=0.12, linewidth=0)
            ax.set_ylabel(label)
            ax.set_ylim(0.0, 1.05 * ax.get_ylim()[1])
            ax.grid(alpha=0.3)
            draw_legend(ax)
        panes[-1].set_xlabel(_label(axes[0]))


def _write_map(path: FilePath, axes: Sequence[Axis], rows: Sequence[Row], edges: Sequence[Edge]) -> None:
    """Growth over two keys, unstable points apart from stable ones, and the edges between them."""
    known = [k for k, row in enumerate(rows) if GROWTH in row.extremes]
    x, y = (axis.numbers for axis in axes)
    if x is None or y is None or len(known) < 2:
        return
    growth = np.array([rows[k].extremes[GROWTH][1][0] for k in known])
    lines: dict[float, list[int]] = {}
    for k in known:
        lines.setdefault(float(y[k]), []).append(k)
    ends = {at: [each for each in edges if y[each.points[0]] == at] for at in lines}
    bands = [(at, band) for at, line in lines.items() for band in unstable_bands(x, rows, line, ends[at])]
    title = "By what vibrations are multiplied in a period"
    with figure_saved(path, title + ("; red: unstable bands" if bands else "")) as figure:
        ax = figure.subplots()
        for some, marker, label in ((growth <= 1 + GROWS, "o", "stable"), (growth > 1 + GROWS, "X", "unstable")):
            which = np.array(known)[some]
            shown = ax.scatter(
                x[which], y[which], c=growth[some], marker=marker, s=28, cmap="coolwarm",
                norm="log", vmin=1 / (far := _far(growth)), vmax=far, edgecolors="black", linewidths=0.3, label=label,
            )  # fmt: skip
        for at, band in bands:
            look = {"color": "tab:red", "alpha": 0.35, "linewidth": 7, "solid_capstyle": "butt", "zorder": 0}
            ax.plot(band, [at, at], **look)
        ax.plot([each.at for each in edges], [y[each.points[0]] for each in edges], "k|", markersize=16)
        figure.colorbar(shown, ax=ax, label="growth in a period")
        ax.set(xlabel=_label(axes[0]), ylabel=_label(axes[1]))
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3, frameon=False)
        ax.grid(alpha=0.3)


def _label(axis: Axis) -> str:
    return axis.key + (f" ({axis.unit})" if axis.unit else "")


def _far(growth: np.ndarray) -> float:
    """Ratio of the ends of the colour scale to one: the largest of growth and its inverse, of a thousandth at least."""
    return float(np.exp(max(np.abs(np.log(np.maximum(growth, 1e-3))).max(), 1e-9)))
