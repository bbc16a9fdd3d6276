"""The plots of a run as PNG files."""

from pathlib import Path

from kedfem.output.plots.drawing import MARK, draw_panels, drawn_over, figure_saved, heading, worth_drawing
from kedfem.output.plots.overview import write_overview
from kedfem.results import Results, ready_folder


def write_plots(results: Results, folder: Path, each: bool = False) -> list[Path]:
    """Plot all channels on one page, ``overview.png``, several pages where there are many.

    What the table of a run calls ≈ 0 is left out.
    What there is of rigid links too is drawn with it, dashed. Angles are in degrees.

    Curves are over the drive angle in degrees; where the drive stands still or turns back they are over time,
    with the drive angle below; over time alone where the drive slides, or there are several. Plots that an earlier run
    left in the folder are removed.

    Parameters
    ----------
    results : what was read; without rows nothing is drawn
    folder : made where missing
    each : whether every channel is also plotted on its own: ``probes-rocker_mid-stress.png``, …, ``energies.png``, and
        ``joint_forces.png`` for all joints

    Returns
    -------
    The files written.

    Raises
    ------
    OutputError
        The folder or a file cannot be written.
    """
    remove_plots(ready_folder(Path(folder)))
    if not len(results.time):
        return []
    along, drawn = drawn_over(results), list(worth_drawing(results))
    written = write_overview(results, along, drawn, folder)
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
