"""The plots of a run as PNG files: an overview of all curves, and every picture on its own."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from kedfem.output.abscissa import Abscissa, draw_abscissa
from kedfem.output.plots.drawing import (
    MARK,
    draw_curves,
    draw_drive,
    draw_panels,
    drawn_over,
    figure_saved,
    heading,
    worth_drawing,
)
from kedfem.output.plots.groups import ALL, CURVES, FAINT, STIFF, Panel, Picture, largest
from kedfem.results import Results, ready_folder

COLUMNS, MOST = 2, 14  # columns of panels on a page, and most panels
WIDTH, HEIGHT = 7.2, 2.0  # inches of a panel with labels and legend
# inches left and right of the axes of a panel, above the first, between two, below the last
LEFT, RIGHT, ABOVE, BETWEEN, BELOW = 0.85, 1.45, 0.85, 0.42, 0.5
FONT = 7.5  # points


def write_plots(results: Results, folder: Path, each: bool = False) -> list[Path]:
    """Plot all channels on one page, ``overview.png``, or on several pages; returns the files.

    Nothing is written without rows. Channels that the table of a run reports as ≈ 0 are left out. Curves of rigid links
    are dashed. Angles are in degrees.

    Curves are over the drive angle. If the drive rests or reverses they are over time, with the drive angle below; if it
    slides, or there are several drives, over time alone. Plots of an earlier run in the folder are removed.

    Parameters
    ----------
    each : whether every channel is also plotted on its own: ``probes-rocker_mid-stress.png``, …, ``energies.png``, and
        ``joint_forces.png`` for all joints
    """
    remove_plots(ready_folder(Path(folder)))
    if not len(results.time):
        return []
    along, drawn = drawn_over(results), list(worth_drawing(results))
    written = _overview(results, along, drawn, folder)
    for picture in drawn if each else []:
        path = Path(folder) / f"{picture.name}.png"
        with figure_saved(path, heading(picture.title, picture.channel, results)) as figure:
            draw_panels(figure, along, picture.panels)
        written.append(path)
    return written


def remove_plots(folder: Path) -> None:
    """Delete the plots that kedfem wrote into a folder earlier, and nothing else."""
    for path in folder.glob("*.png"):
        from PIL import Image, UnidentifiedImageError

        try:
            with Image.open(path) as image:
                own = image.info.get("Software") == MARK
        except (OSError, UnidentifiedImageError):
            continue
        if own:
            path.unlink()


def _overview(results: Results, along: Abscissa, pictures: Sequence[Picture], folder: Path) -> list[Path]:
    """Write ``overview.png``, ``overview-2.png``, …: the first panel of each picture, in two columns on one abscissa.

    Pictures of channels that another one compares, such as joint forces, are left out.
    """
    from matplotlib import rc_context

    title = json.loads(results.scene_json).get("title") or ""
    name = f"{title}: " if title else ""
    together = {path for each in pictures for path in each.together}
    chosen = [x for x in pictures if not (x.channel and x.channel.name in together)]
    most = MOST - (along.degrees is not None)
    pages = [chosen[k : k + most] for k in range(0, len(chosen), most)]
    written = []
    for number, page in enumerate(pages, 1):
        path = Path(folder) / ("overview.png" if number == 1 else f"overview-{number}.png")
        of = f", page {number} of {len(pages)}" if len(pages) > 1 else ""
        rows = -(-(len(page) + (along.degrees is not None)) // COLUMNS)
        size = (COLUMNS * WIDTH, ABOVE + rows * HEIGHT + BELOW)
        with (
            rc_context({"font.size": FONT}),
            figure_saved(path, heading(f"{name}all curves{of}", None, results), size, None) as figure,
        ):
            _draw_page(figure, along, page, rows)
        written.append(path)
    return written


def _draw_page(figure: Any, along: Abscissa, page: Sequence[Picture], rows: int) -> None:
    panels: list[tuple[str, Panel | None]] = [shown(each) for each in page]
    if along.degrees is not None:
        panels.append(("drive", None))
    width, height = figure.get_size_inches()
    first: Any = None
    for column in range(COLUMNS):
        axes = []
        for row, (title, panel) in enumerate(panels[column * rows : (column + 1) * rows]):
            top = height - ABOVE - row * HEIGHT
            place = (column * WIDTH + LEFT, top - HEIGHT + BETWEEN, WIDTH - LEFT - RIGHT, HEIGHT - BETWEEN)
            ax = figure.add_axes(np.divide(place, (width, height, width, height)), sharex=first)
            first = first or ax
            _draw_panel(ax, along, title, panel)
            axes.append(ax)
        if axes:
            draw_abscissa(axes[0], axes[-1], along)
        for ax in axes[:-1]:
            ax.tick_params(labelbottom=False)


def _draw_panel(ax: Any, along: Abscissa, title: str, panel: Panel | None) -> None:
    if panel is None:
        draw_drive(ax, along)
    else:
        draw_curves(ax, along, panel)
    ax.set_title(title, loc="left", fontsize=FONT + 1, pad=3)


def shown(picture: Picture) -> tuple[str, Panel]:
    """Short title of a panel, and the panel with at most as many curves as its legend can hold."""
    title = picture.channel.name if picture.channel else picture.title
    panel = picture.panels[0]
    for first, words in ALL.items() if len(picture.panels) > 1 else ():
        title = first + title.removeprefix(words) if title.startswith(words) else title
    every = {name: largest(y) for name, y in panel.curves.items() if not name.endswith(STIFF)}
    peaks = {name: peak for name, peak in every.items() if peak > FAINT * max(every.values())}
    if len(peaks) <= CURVES:
        return title, panel
    chosen = sorted(peaks, key=lambda name: -peaks[name])[:CURVES]
    kept = {name: y for name, y in panel.curves.items() if name.removesuffix(STIFF) in chosen}
    return f"{title}: the largest {CURVES} of {len(peaks)}", replace(panel, curves=kept)
