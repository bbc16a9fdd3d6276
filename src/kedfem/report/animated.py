"""The surfaces of all links in the frames of an animation."""

import logging
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import OutputError
from kedfem.output.animation import read_collection
from kedfem.output.derived import STEM, WORST
from kedfem.output.fields import BODY, LINK, SPRING
from kedfem.output.stress_files import ENVELOPE
from kedfem.output.views import View, view
from kedfem.report.surfaces import Surface, sources_of

FRAMES = 120


@dataclass(frozen=True, slots=True)
class Animated:
    """The surfaces of all links in the frames of a run.

    times : (f,) times of the frames [s]
    surfaces : surfaces of all links
    seen_from : the view of the picture of the highest stress; None if there is none
    thinned : descriptions of what was left out to keep the page small
    """

    times: Float[np.ndarray, " f"]
    surfaces: list[Surface]
    seen_from: View | None
    thinned: tuple[str, ...]


def animated(
    folder: Path, deformation_scale: float, gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> Animated | None:
    """The surfaces of a run's links in all frames, or only undeformed without an animation; None without links.

    Parameters
    ----------
    folder : folder of the results
    deformation_scale : factor on the elastic displacement in the frames [-]
    gravity : (3,) gravity, from which the view follows [m/s²]

    Raises
    ------
    OutputError
        A file was not written by kedfem, or is damaged.
    """
    listed = folder / f"{STEM}.pvd"
    frames = read_collection(listed) if listed.exists() else []
    count = min(len(frames), FRAMES)
    shown = [frames[k] for k in np.linspace(0, len(frames) - 1, count).round().astype(int)]
    drawn, worst = folder / ENVELOPE, folder / WORST
    pattern = shown[0][1] if shown else [worst if worst.exists() else drawn]
    if not pattern[0].exists():
        return None
    first = _read(pattern)
    reference = _read([drawn]) if drawn.exists() else None
    sources, thinned = sources_of(first, reference)
    times = []
    for time, files in shown:
        grid = _read(files)
        if grid.n_points != first.n_points:
            wanted = f"must have the mesh of {pattern[0].name}, got another one: run the scene again"
            raise OutputError(f"{files[0]}: {wanted}")
        times.append(time)
        for source in sources:
            source.frame(grid, deformation_scale)
    if len(shown) < len(frames):
        thinned += (f"{len(shown)} of {len(frames)} frames are shown",)
    if not sources:
        return None
    eye = view(_read([worst]), np.array(gravity)) if worst.exists() else None
    return Animated(np.array(times), [source.surface for source in sources], eye, thinned)


def _read(paths: Sequence[Path]) -> Any:
    """The links of some VTU files as one grid; an OutputError if one is damaged or not kedfem's."""
    import pyvista

    grids = []
    for path in paths:
        wanted = f"{path}: must be a file of kedfem's"
        with _quiet():
            try:
                grid = pyvista.read(path)
                known = "link" in grid.cell_data and np.isfinite(grid.points).all()
            except Exception as error:
                raise OutputError(f"{wanted}, got one that cannot be read") from error
        if not grid.n_points or not known:
            raise OutputError(f"{wanted}, got one that is damaged or has no links")
        if any(name.startswith((LINK, BODY, SPRING)) for name in grid.field_data.keys()):  # noqa: SIM118
            grids.append(grid)
    if not grids:
        raise OutputError(f"{paths[0]}: must be a file of kedfem's with links, got none")
    if len(grids) == 1:
        return grids[0]
    whole = pyvista.merge(grids, merge_points=False)
    for grid in grids:
        for name in grid.field_data.keys():  # noqa: SIM118
            whole.field_data[name] = grid.field_data[name]
    return whole


@contextmanager
def _quiet() -> Iterator[None]:
    """Suppress messages of VTK on the terminal, and of libraries that forward them."""
    import pyvista

    with pyvista.vtk_verbosity("off"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        logging.disable()
        try:
            yield
        finally:
            logging.disable(logging.NOTSET)


def extent(surfaces: Sequence[Surface]) -> Float[np.ndarray, "3"]:
    """Extent of all links along x, y and z, in the reference position and in all frames [m]."""
    low, high = bounds(surfaces, np.eye(3))
    return np.asarray(high - low)


def bounds(
    surfaces: Sequence[Surface], axes: Float[np.ndarray, "3 3"]
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Lowest and highest coordinates of all links along axes (rows), in the reference position and in all frames [m]."""
    every = [points @ axes.T for each in surfaces for points in each.world()]
    low, high = [x.min(axis=0) for x in every], [x.max(axis=0) for x in every]
    return np.asarray(np.min(low, axis=0)), np.asarray(np.max(high, axis=0))
