"""The resonance plot: largest stresses, joint forces and torques over a swept key, as PNG."""

from collections.abc import Sequence
from pathlib import Path as FilePath

import numpy as np

from kedfem.output.plots import figure_saved
from kedfem.sweep.axes import Axis
from kedfem.sweep.files import column_units, largest, plain_quantities
from kedfem.sweep.points import Row

PANELS = (
    ("stress/", "Pa", "peak stress (MPa)", 1e-6),
    ("joints/", "N", "joint force (N)", 1.0),
    ("drive/", "N m", "drive torque (N m)", 1.0),
    ("drive/", "N", "drive force (N)", 1.0),
    ("steady/", "1", "vibrations:\nleft after a period", 1.0),
)


def write_plot(path: FilePath, axes: Sequence[Axis], rows: Sequence[Row]) -> None:
    """Largest magnitudes over the only key that is swept; of points that have not settled as open rings.

    Nothing is drawn of several keys, of words, nor of fewer than two points; a plot of an earlier sweep goes.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    path.unlink(missing_ok=True)
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
    title = f"Largest over the last turns of each run, over {axes[0].key}"
    with figure_saved(path, title + ("; rings: not settled" if loose.any() else "")) as figure:
        panes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
        for ax, (label, scale, names) in zip(panes, panels, strict=True):
            for name in names:
                values = np.array([scale * largest(rows[k], name) for k in order])
                (line,) = ax.plot(numbers[order], values, marker=".", label=name.split("/")[1])
                ax.plot(
                    numbers[order][loose],
                    values[loose],
                    "o",
                    markersize=7,
                    fillstyle="none",
                    color=line.get_color(),
                )
            ax.set_ylabel(label)
            ax.set_ylim(0.0, 1.05 * ax.get_ylim()[1])
            ax.grid(alpha=0.3)
            ax.legend(loc="upper left", bbox_to_anchor=(1.005, 1.02), frameon=False)
        panes[-1].set_xlabel(axes[0].key + (f" ({axes[0].unit})" if axes[0].unit else ""))
