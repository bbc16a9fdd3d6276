"""The surfaces of all links over the frames of an animation."""

import logging
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from kedfem.errors import OutputError
from kedfem.output.derived import STEM, WORST
from kedfem.output.rendering import view
from kedfem.output.stress_files import ENVELOPE
from kedfem.report.surfaces import Surface, sources_of

FRAMES = 120


@dataclass(frozen=True, slots=True)
class Animated:
    """What the frames of a run show.

    times : (f,) of the frames [s]
    surfaces : of all links
    seen_from : (3,) unit vector towards an eye that sees the highest stress; None where it is not known
    thinned : what was left out to keep the page small, in words; empty if nothing was
    """

    times: Float[np.ndarray, " f"]
    surfaces: list[Surface]
    seen_from: Float[np.ndarray, "3"] | None
    thinned: tuple[str, ...]


def animated(folder: Path, deformation_scale: float) -> Animated | None:
    """The surfaces of a run's links in all its frames; of a run without animation as drawn; None without either.

    Parameters
    ----------
    folder : of the results
    deformation_scale : by which the frames exaggerate the elastic displacement [-]

    Raises
    ------
    OutputError
        A file is not one that kedfem wrote.
    """
    files = _frames(folder)
    count = min(len(files), FRAMES)
    shown = [files[k] for k in np.linspace(0, len(files) - 1, count).round().astype(int)]
    drawn = folder / ENVELOPE
    pattern = shown[0] if shown else folder / WORST if (folder / WORST).exists() else drawn
    if not pattern.exists():
        return None
    first = _read(pattern)
    reference = _read(drawn) if drawn.exists() else None
    sources, thinned = sources_of(first, reference)
    times = []
    for path in shown:
        grid = _read(path)
        if grid.n_points != first.n_points:
            raise OutputError(
                f"{path}: must have the mesh of {pattern.name}, got another one: run the scene again"
            )
        times.append(float(grid.field_data["TimeValue"][0]))
        for source in sources:
            source.frame(grid, deformation_scale)
    if len(shown) < len(files):
        thinned += (f"{len(shown)} of {len(files)} frames are shown",)
    if not sources:
        return None
    worst = folder / WORST
    eye = view(_read(worst), np.zeros(3)).direction if worst.exists() else None
    return Animated(np.array(times), [source.surface for source in sources], eye, thinned)


def _frames(folder: Path) -> list[Path]:
    """Frames that the animation's list names, in its order."""
    import xml.etree.ElementTree as ET

    listed = folder / f"{STEM}.pvd"
    if not listed.exists():
        return []
    try:
        names = [each.attrib["file"] for each in ET.parse(listed).iter("DataSet")]
    except (ET.ParseError, KeyError, OSError) as error:
        raise OutputError(f"{listed}: must be a list of frames, got a damaged file") from error
    return [path for path in (folder / Path(name).name for name in names) if path.exists()]


def _read(path: Path) -> Any:
    """A VTU file.

    Raises
    ------
    OutputError
        It is not one of kedfem's, or damaged.
    """
    import pyvista

    wanted = f"{path}: must be a file of kedfem's"
    with _quiet():
        try:
            grid = pyvista.read(path)
            known = "link" in grid.cell_data and np.isfinite(grid.points).all()
        except Exception as error:
            raise OutputError(f"{wanted}, got one that cannot be read") from error
    if not grid.n_points or not known:
        raise OutputError(f"{wanted}, got one that is damaged or has no links")
    return grid


@contextmanager
def _quiet() -> Iterator[None]:
    """VTK, and those who tell its messages again, say nothing on the terminal."""
    import pyvista

    with pyvista.vtk_verbosity("off"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        logging.disable()
        try:
            yield
        finally:
            logging.disable(logging.NOTSET)


def extent(surfaces: Sequence[Surface]) -> Float[np.ndarray, "3"]:
    """What all links take up along x, y and z, as drawn and in all frames [m]."""
    low, high = bounds(surfaces, np.eye(3))
    return np.asarray(high - low)


def bounds(
    surfaces: Sequence[Surface], axes: Float[np.ndarray, "3 3"]
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Lowest and highest coordinates of all links along axes, the rows, as drawn and in all frames [m]."""
    every = [points @ axes.T for each in surfaces for points in each.world()]
    low, high = [x.min(axis=0) for x in every], [x.max(axis=0) for x in every]
    return np.asarray(np.min(low, axis=0)), np.asarray(np.max(high, axis=0))
