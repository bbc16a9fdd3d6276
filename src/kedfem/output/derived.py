"""Files that follow from a finished run: stress envelope, table, plots, and the picture of the highest stress."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from kedfem.dynamics.history import Snapshot
from kedfem.dynamics.model import Model
from kedfem.dynamics.vibration import Vibration
from kedfem.errors import OutputError, PictureError
from kedfem.links.indicator import Indicator
from kedfem.links.recovery import StressRecovery
from kedfem.output.animation import remove_animation
from kedfem.output.fields import LinkField
from kedfem.output.frames import link_fields
from kedfem.output.paraview import STATE, write_state
from kedfem.output.picture import write_picture
from kedfem.output.plots import remove_plots, write_plots
from kedfem.output.shapes import GROWING, write_growing
from kedfem.output.stress_files import (
    DAMAGE,
    DAMAGE_POINTS,
    ENVELOPE,
    POINTS,
    SPOTS,
    TOP,
    Extremes,
    write_envelope,
    write_fatigue,
    write_top,
)
from kedfem.output.vtu import write_cells, write_frame
from kedfem.output.words import clock, moment, place_of, stress_at, with_prefix
from kedfem.results import Fatigue, Peak, Results, write_csv, write_parquet
from kedfem.results.additions import add_fatigue
from kedfem.results.fatigue.damage import fatigue_of
from kedfem.results.reader import foreign
from kedfem.results.stresses.envelope import Envelope
from kedfem.results.stresses.peaks import hot_spots
from kedfem.results.stresses.singular_stress import AWAY, reason
from kedfem.scene import Scene

STEM, TABLE, PICTURE, PLOTS, MESH = "animation", "results.csv", "worst.png", "plots", "mesh_error.vtu"
WORST, PARQUET, ONE_FILE = "worst.vtu", "results.parquet", "animation.vtkhdf"
REPORT, GROWN = "report.html", f"{GROWING}.png"
WHOLE = (
    GROWN, TABLE, ONE_FILE, PARQUET, PICTURE, MESH, WORST, ENVELOPE, POINTS, TOP, REPORT, DAMAGE, SPOTS, DAMAGE_POINTS,
    STATE,
)  # fmt: skip
"""Files of a run that the next run replaces."""


def peak_warning(peak: Peak | None, since: float) -> tuple[str, ...]:
    """Warnings if the highest stress is at a singular place, or is not that of all steps.

    Parameters
    ----------
    since : time before which stresses are not counted [s]
    """
    if peak is None:
        return ()
    which = "highest stresses, here and in all files, are those of the revolutions that the sweep counts"
    late = (f"{which}, after {since:.4g} s",) if since > 0 else ()
    if not peak.near:
        return late
    message = f"the highest stress, {stress_at(peak)}, is at {peak.near}: {reason(peak.near)}"
    away = f"; away from {AWAY} it is {stress_at(peak.away)}" if peak.away else ""
    return (message + away, *late)


def yield_warning(peaks: Mapping[str, Peak]) -> tuple[str, ...]:
    """A warning if links are stressed beyond their yield strengths away from singular places."""
    beyond = [x for peak in peaks.values() if (x := peak.sound) is not None and x.stress > x.strength]
    if not beyond:
        return ()
    every = "; ".join(f"{stress_at(x)}, is above its yield strength, {with_prefix(x.strength, 'Pa')}" for x in beyond)
    instead = "the model stays elastic there, so stresses and deflections are not those of a real part"
    return (f"the highest stress, {every}: {instead}",)


def fatigue_warning(found: Fatigue | None) -> tuple[str, ...]:
    """Warnings if damage is unreliable, incomplete, or larger than allowed."""
    if found is None:
        return ()
    out = [f"fatigue: {found.unreliable}"] if found.unreliable else []
    if found.without:
        out.append(f"fatigue: no data of {', '.join(found.without)}, which were left out")
    if left := found.left_out_words:
        points = f"points of the surface near {AWAY} were left out, {left}"
        out.append(f"fatigue: {points}: fatigue.near_joints includes them")
    worst = found.worst
    if worst is not None and worst.utilisation > 1:
        life = f"{found.hours(worst):.3g} h at a safety factor of 1"
        where = f"link {worst.link} at {place_of(worst.place)} in the reference position"
        loaded = f"is loaded to {worst.utilisation:.3g} times what is allowed"
        out.append(f"fatigue: {where} {loaded}; life {life}")
    return tuple(out)


def fields(scene: Scene, model: Model, recoveries: Sequence[StressRecovery], snapshot: Snapshot) -> list[LinkField]:
    """Fields of all links for a frame, with the animation's deformation scale."""
    return link_fields(model, recoveries, snapshot, _scale(scene), scene)


def _scale(scene: Scene) -> float:
    return scene.output.animation.deformation_scale if scene.output.animation else 1.0


def refuse_foreign(folder: Path) -> None:
    """Raise an OutputError if a folder has files with names that a run replaces, but no results of kedfem."""
    file = folder / "results.h5"
    names = [*WHOLE, f"{STEM}.pvd"]
    found = [] if file.exists() else [name for name in names if (folder / name).exists()]
    if found or foreign(file):
        wanted = f"output.folder: must be a folder of kedfem's results or one without {', '.join(found) or file.name}"
        got = f"{folder}, where it is not known to be kedfem's"
        raise OutputError(f"{wanted}, got {got}: move it away, or name another folder")


def remove_derived(folder: Path) -> None:
    """Delete pictures and tables of an earlier run, which do not belong to the new results."""
    for name in WHOLE:
        (folder / name).unlink(missing_ok=True)
    remove_plots(folder / PLOTS)
    remove_animation(folder, STEM)
    remove_animation(folder, GROWING)


def write_stresses(
    scene: Scene, model: Model, envelope: Envelope, singular: Sequence[Sequence[str]], drive: str, folder: Path
) -> None:
    """Write the envelope of stresses, the ten highest of each link, and the frame of the highest of all.

    Parameters
    ----------
    singular : for each point of each link a description of the singular place that it is near to, or empty
    drive : name of the drive's position with its unit
    """
    extremes = Extremes(envelope.links(), singular, drive)
    write_envelope(folder, extremes, scene.output.csv)
    write_top(folder, hot_spots(extremes.found, singular), drive)
    if (worst := envelope.worst) is not None:
        write_frame(folder / WORST, worst.t, fields(scene, model, envelope.recoveries, worst))


def write_damage(
    scene: Scene, model: Model, envelope: Envelope, singular: Sequence[Sequence[str]], period: float, folder: Path
) -> Fatigue:
    """Write the damage over the last period into its files and the results; parameters as of `write_stresses`."""
    found, points = fatigue_of(scene, model, envelope, singular, period)
    write_fatigue(folder, found, points, scene.output.csv)
    add_fatigue(folder / "results.h5", found)
    return found


def write_mesh_errors(model: Model, indicators: Mapping[int, Indicator], folder: Path) -> None:
    """Write the error indicator of each element of solid and plane links for ParaView."""
    parts = [((link.full or link), each.elements) for link, each in ((model.links[k], x) for k, x in indicators.items())]
    if parts:
        cells = [(link.X, (link.cell_type, link.cells)) for link, _ in parts]
        write_cells(folder / MESH, cells, "mesh_error", [values for _, values in parts])


def write_vibration(
    scene: Scene, model: Model, recoveries: Sequence[StressRecovery], found: Vibration, folder: Path
) -> tuple[str, ...]:
    """Write a growing vibration as animation and picture if the scene asks for them; returns failures to draw."""
    if scene.output.animation is None and not scene.output.picture:
        return ()

    def sized(snapshot: Snapshot, factor: float, exaggeration: float) -> list[LinkField]:
        states = [replace(x, u=factor * x.u, g=factor * x.g) for x in snapshot.states]
        return link_fields(model, recoveries, replace(snapshot, states=states), exaggeration, scene)

    frames = [(float(each.motion.t[each.k]), partial(sized, each)) for each in found.snapshots]
    try:
        write_growing(folder, f"The vibration that grows, {found.words}", frames, scene.gravity)
    except PictureError as err:
        return (str(err),)
    return ()


def write_derived(scene: Scene, results: Results, peak: Peak | None, folder: Path) -> tuple[str, ...]:
    """Write table, plots and picture; returns a warning if the picture cannot be drawn."""
    if scene.output.csv:
        write_csv(results, folder / TABLE)
    if scene.output.parquet:
        write_parquet(results, folder / PARQUET)
    if (folder / f"{STEM}.pvd").exists():
        write_state(scene, results, peak, folder)

    def plots() -> None:
        if scene.output.plots:
            write_plots(results, folder / PLOTS, each=scene.output.plots == "each")

    if not (scene.output.picture and peak):
        plots()
        return ()
    title = f"{scene.title or 'kedfem'}: highest stress {stress_at(peak)}, t = {peak.time:.4g} s"
    if clock(scene) != "time":
        title += f", drive {moment(scene, peak.time, peak.angle)}"
    try:
        write_picture(folder / WORST, folder / PICTURE, title, _scale(scene), scene.gravity, plots)
    except PictureError as err:
        return (str(err),)
    return ()
