"""Frames of an animation as one grid each, as ParaView's blocks together."""

from pathlib import Path
from typing import Any

import numpy as np

from kedfem.output.animation import read_collection
from kedfem.output.fields import JOINTS


def frames(folder: Path, stem: str = "animation") -> list[Any]:
    """The links of all frames."""
    return [
        merged([x for x in files if not x.name.startswith(JOINTS)])
        for _, files in read_collection(folder / f"{stem}.pvd")
    ]


def merged(files: list[Path]) -> Any:
    """The links of one frame, with their names."""
    import pyvista

    grids = [pyvista.read(path) for path in files]
    whole = pyvista.merge(grids, merge_points=False) if len(grids) > 1 else grids[0]
    for grid in grids:
        for name in grid.field_data.keys():  # noqa: SIM118
            whole.field_data[name] = np.asarray(grid.field_data[name])
    return whole
