"""The files of a run beside its rows and frames: stress envelope, table, plots and the picture of the highest stress."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from kedfem.dynamics.history import Snapshot
from kedfem.dynamics.model import Model
from kedfem.errors import OutputError
from kedfem.links.recovery import StressRecovery
from kedfem.output.frames import link_fields
from kedfem.output.picture import write_picture
from kedfem.output.plots import remove_plots, write_plots
from kedfem.output.vtu import LinkField, remove_animation, write_points
from kedfem.output.words import clock, moment, stress_at
from kedfem.results import Peak, Results, write_csv, write_parquet
from kedfem.results.envelope import Envelope
from kedfem.results.reader import foreign
from kedfem.results.singular_stress import AWAY, reason
from kedfem.scene import Scene

STEM, TABLE, PICTURE, PLOTS, MESH = "animation", "results.csv", "worst.png", "plots", "mesh_error.vtu"
WORST, ENVELOPE, PARQUET = "worst.vtu", "envelope.vtu", "results.parquet"


def peak_warning(peak: Peak | None) -> tuple[str, ...]:
    """A warning where the highest stress is not what it seems, with the highest one elsewhere."""
    if peak is None or not peak.near:
        return ()
    said = f"the highest stress, {stress_at(peak)}, is at {peak.near}: {reason(peak.near)}"
    away = f"; away from {AWAY} it is {stress_at(peak.away)}" if peak.away else ""
    return (said + away,)


def write_envelope(folder: Path, envelope: Envelope, doubts: list[list[str]]) -> None:
    """Highest stresses at every point and when they occur, on the links as drawn, for ParaView."""
    every = envelope.links()
    time = envelope.when()[0]
    drawn = [each.recovery.at_points((each.recovery.link.full or each.recovery.link).X) for each in every]
    parts = [
        (each.link, points, each.recovery.cells, each.recovery.cell_type)
        for each, points in zip(every, drawn, strict=True)
    ]
    stress = np.concatenate([each.stress for each in every], axis=1)
    when = np.where(np.isnan(stress), np.nan, time[np.concatenate([each.step for each in every], axis=1)])
    values: dict[str, np.ndarray] = {}
    for k, name in enumerate(("highest von Mises", "largest principal", "smallest principal")):
        values |= {f"{name} stress [Pa]": stress[k], f"time of {name} stress [s]": when[k]}
    values["depends on mesh or joint"] = np.array([float(bool(x)) for each in doubts for x in each])
    write_points(folder / ENVELOPE, parts, values)


def fields(
    scene: Scene, model: Model, recoveries: Sequence[StressRecovery], snapshot: Snapshot
) -> list[LinkField]:
    """What a frame shows of each link, deformed as the animation exaggerates it."""
    animation = scene.output.animation
    return link_fields(model, recoveries, snapshot, animation.deformation_scale if animation else 1.0)


def refuse_foreign(folder: Path) -> None:
    """A folder with files of the names that a run replaces, but without results of kedfem, holds somebody's own files.

    Raises
    ------
    OutputError
    """
    file = folder / "results.h5"
    names = [TABLE, PARQUET, PICTURE, MESH, WORST, ENVELOPE, f"{STEM}.pvd", f"{STEM}_0000.vtu"]
    found = [] if file.exists() else [name for name in names if (folder / name).exists()]
    if found or foreign(file):
        wanted = f"output.folder: must be a folder of kedfem's results or one without {', '.join(found) or file.name}"
        got = f"{folder}, where it is not known to be kedfem's"
        raise OutputError(f"{wanted}, got {got}: move it away, or name another folder")


def remove_derived(folder: Path) -> None:
    """Delete what an earlier run drew and tabulated: it does not belong to the new results."""
    for name in (TABLE, PARQUET, PICTURE, MESH, WORST, ENVELOPE):
        (folder / name).unlink(missing_ok=True)
    remove_plots(folder / PLOTS)
    remove_animation(folder, STEM)


def write_derived(scene: Scene, results: Results, peak: Peak | None, folder: Path) -> tuple[str, ...]:
    """Table, plots and picture; a picture that cannot be drawn is a warning."""
    if scene.output.csv:
        write_csv(results, folder / TABLE)
    if scene.output.parquet:
        write_parquet(results, folder / PARQUET)
    if scene.output.plots:
        write_plots(results, folder / PLOTS)
    if not (scene.output.picture and peak):
        return ()
    title = f"{scene.title or 'kedfem'}: highest stress {stress_at(peak)}, t = {peak.time:.4g} s"
    if clock(scene) != "time":
        title += f", drive {moment(scene, peak.time, peak.angle)}"
    animation = scene.output.animation
    scale = animation.deformation_scale if animation else 1.0
    try:
        write_picture(folder / WORST, folder / PICTURE, title, scale, scene.gravity)
    except OutputError as err:
        return (str(err),)
    return ()
