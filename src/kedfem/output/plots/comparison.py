"""Comparison of runs: the same curves in one picture, as PNG, and their differences as CSV."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from kedfem.arrays import Float
from kedfem.output.plots.drawing import draw_legend, envelope, figure_saved
from kedfem.output.plots.files import remove_plots
from kedfem.output.words import prefixed
from kedfem.results import ready_folder
from kedfem.results.channels import Channel
from kedfem.results.differences import Difference, Over, magnitude
from kedfem.results.table import write_rows

LOOKS = ("-", "--", ":", "-.")


def write_comparison(
    found: Sequence[Difference], names: Sequence[str], over: Over, along: Float[np.ndarray, " T"], drive: Channel,
    folder: Path,
) -> None:  # fmt: skip
    """Write a picture of each channel with all runs and their difference from the first, and `differences.csv`.

    Parameters
    ----------
    along : (T,) time [s], or position of the drive [rad or m]
    """
    remove_plots(ready_folder(folder))
    factor, label = 1.0, "time (s)" if over == "time" else "drive travel (m)"
    if over == "drive" and drive.unit == "rad":
        factor, label = 180 / np.pi, "drive angle (°)"
    for each in found:
        _write_picture(each, names, factor * along, label, folder)
    header = ["channel", "unit", "run", "peak", "largest difference [%]", "at", "rms difference [%]", "% of"]
    every = ((x, k, name) for x in found for k, name in enumerate(names))
    rows = (
        [x.channel.name, x.channel.unit, name, x.peaks[k], 100 * x.largest[k], x.at[k], 100 * x.rms[k], x.scale[k]]
        for x, k, name in every
    )
    write_rows(folder / "differences.csv", header, rows)


def _write_picture(
    each: Difference, names: Sequence[str], along: Float[np.ndarray, " T"], label: str, folder: Path
) -> None:
    """Write the picture of a channel: curves above, differences from the first run below."""
    channel = each.channel
    scale, unit = prefixed(float(each.peaks.max()), channel.unit)
    if unit == "rad":
        scale, unit = np.pi / 180, "°"
    title = channel.description or channel.name
    title = f"{title[:1].upper()}{title[1:]}\n{channel.name}".replace("$", r"\$")
    with figure_saved(folder / f"{channel.name.replace('/', '-')}.png", title) as figure:
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=[3, 1])
        for k, (name, values) in enumerate(zip(names, each.values, strict=True)):
            shown = values[:, 0] if values.shape[1] == 1 else magnitude(channel, values)
            kept = envelope(shown)
            look = {"color": f"C{k % 10}", "linestyle": LOOKS[k % len(LOOKS)], "linewidth": 1.3}
            above.plot(along[kept], shown[kept] / scale, label=name.replace("$", r"\$"), **look)
            if k:
                off = 100 * magnitude(channel, values - each.values[0]) / each.scale[k]
                kept = envelope(off)
                below.plot(along[kept], off[kept], **look)
        what = channel.name.rsplit("/", 1)[-1].replace("_", " ")
        if each.values[0].shape[1] > 1:
            what = f"{what}, {'von Mises' if 'von_mises' in channel.columns else 'magnitude'}"
        above.set_ylabel(f"{what} ({unit})" if unit else what)
        below.set_ylabel("difference\n(% of others)" if each.zero else "difference\n(% of peak)")
        below.set_xlabel(label)
        below.set_xlim(along[0], along[-1])
        draw_legend(above)
        for ax in (above, below):
            ax.grid(alpha=0.3)
            ax.ticklabel_format(useOffset=False)
