"""Plane links against solids on the same quadrilaterals, in one run: unknowns, times, differences."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np

from benchmarks.pages import script, table, write_page
from benchmarks.scenes import plate_four_bar
from kedfem.dynamics.elastic_model import elastic_model
from kedfem.dynamics.rigid_body import drive_range
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.motion.linkage import linkage
from kedfem.motion.path import path
from kedfem.results.recording import recording
from kedfem.scene import Scene, time_grid

CASES = ((1, 0.0254), (2, 0.0254), (2, 0.006), (4, 0.0254))  # elements across, thickness [m]
CHANNELS = ("probes/stress/stress", "probes/displacement/displacement", "drive/torque")


@dataclass(frozen=True, slots=True)
class _Measured:
    """Unknowns, seconds to mesh and assemble, to factor, and for a step, its share of the start included; channels."""

    unknowns: int
    assemble: float
    factor: float
    step: float
    channels: list[np.ndarray]


def bench_plane(folder: Path, quick: bool) -> None:
    """Both models at several sizes; a table goes to the folder."""
    rows: list[Sequence[str]] = []
    cases = CASES[:1] if quick else CASES
    for across, thickness in cases:
        flat, solid = (_measured(plate_four_bar(kind, across, thickness)) for kind in ("plane", "solid"))
        apart = [_difference(*pair) for pair in zip(flat.channels, solid.channels, strict=True)]
        rows.append((
            f"{across}, {1e3 * thickness:g} mm", f"{flat.unknowns:,} / {solid.unknowns:,}",
            _compared(flat.assemble, solid.assemble), _compared(flat.factor, solid.factor),
            _compared(flat.step, solid.step), *(f"{100 * each:.2g} %" for each in apart),
        ))  # fmt: skip
    header = ("elements across, thickness", "unknowns", "mesh, assemble [ms]", "factor [ms]", "step [ms]",
              "stress", "displacement", "torque")  # fmt: skip
    write_page(folder, "performance/plane", [table(header, rows)])


def _measured(scene: Scene) -> _Measured:
    """A whole run of a scene, without files."""
    joined = linkage(scene)
    along = path(joined, *drive_range(scene))
    since = perf_counter()
    model = elastic_model(scene, joined)
    assembled = perf_counter()
    solver = steps_of(scene, model)
    factored = perf_counter()
    rows = {each.channel.name: each.rows for each in recording(scene, model)}
    values, begun = [], perf_counter()
    for block in transient(scene, joined, along, model, solver):
        values.append([rows[name](block) for name in CHANNELS])
    step = (perf_counter() - begun) / time_grid(scene).steps
    channels = [np.concatenate(column) for column in zip(*values, strict=True)]
    return _Measured(model.unknowns, assembled - since, factored - assembled, step, channels)


def _difference(flat: np.ndarray, solid: np.ndarray) -> float:
    """Largest difference over time, of the second's peak; components that both have."""
    return float(np.abs(flat - solid[:, : flat.shape[1]]).max() / np.abs(solid).max())


def _compared(flat: float, solid: float) -> str:
    """Two times in milliseconds and their ratio."""
    return f"{1e3 * flat:.3g} / {1e3 * solid:.3g} = 1 : {solid / flat:.0f}"


if __name__ == "__main__":
    script(bench_plane)
