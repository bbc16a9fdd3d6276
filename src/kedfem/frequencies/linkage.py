"""Natural frequencies of a scene's linkage frozen at positions over a revolution of its drive: table and plots."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path as FilePath

import numpy as np

from kedfem.accuracy.frequencies import error_words, frozen
from kedfem.arrays import Float
from kedfem.dynamics.history import Snapshot, bent
from kedfem.dynamics.modes.frozen import Frozen, Modes, UnstableError, released, require_drive, tangent_warning
from kedfem.dynamics.modes.stiffened import Stiffened
from kedfem.dynamics.system.record import System
from kedfem.errors import SceneError
from kedfem.frequencies.campbell import Campbell, Crossing, crossed
from kedfem.links.recovery import stress_recovery
from kedfem.motion.assembly import assembled, assembly_warning
from kedfem.motion.rigid import RigidMotion, rigid_motion
from kedfem.output.fields import LinkField
from kedfem.output.frames import link_fields
from kedfem.output.plots.frequencies import write_campbell, write_over_drive
from kedfem.output.shapes import Shape, write_shapes
from kedfem.output.words import clock, moment
from kedfem.results import claimed
from kedfem.results.files import beside
from kedfem.results.frequencies import CAMPBELL, FREQUENCIES, OVER_TURN, Summary, write_frequencies, write_summary
from kedfem.results.recorded import drive_channel
from kedfem.results.table import drive_heading
from kedfem.scene import Scene, path_parameter, revolution_steps, time_grid
from kedfem.scene.records.units import RPM

Watch = Callable[[str, int, int], None]
#: of the drive's, at which stiffening is examined; a Campbell plot ends with the last
SPEEDS = (0.0, 0.5, 1.0, 1.5, 2.0)
POINTS = 41  # of its curves
BUCKLED = "frequencies: links buckle by the stresses of motion between {:.4g} and {:.4g} rpm; none is reported beyond"


@dataclass(frozen=True, slots=True)
class Wanted:
    """Options of an analysis of natural frequencies.

    modes : frequencies at each position
    positions : over the last revolution of a drive that rotates continuously, else over the whole time; without a drive
        one
    free : whether the drives release their joints; else they hold them
    harmonics : of the drive whose crossings are looked for
    shapes : lowest mode shapes that are drawn, at the position whose first frequency is the lowest
    """

    modes: int = 6
    positions: int = 16
    free: bool = False
    harmonics: int = 5
    shapes: int = 0


@dataclass(frozen=True, slots=True)
class Frequencies:
    """Natural frequencies of a linkage frozen at P positions.

    time : (P,) [s]
    angle : (P,) drive angle [rad] or travel [m] there, of one that rotates continuously from its first revolution
    values : (P, f) natural frequencies in rising order [Hz], NaN where there are fewer
    errors : (f,) relative, of the meshes, estimated at the first position; NaN where they are not known
    still : motions without strain, at zero frequency
    speed : of the drive, where it rotates continuously, else 0 [rad/s]
    crossings : with harmonics of the drive, over all speeds
    factorisations : of links
    """

    folder: FilePath
    time: Float[np.ndarray, " P"]
    angle: Float[np.ndarray, " P"]
    values: Float[np.ndarray, "P f"]
    errors: Float[np.ndarray, " e"]
    still: int
    speed: float
    crossings: tuple[Crossing, ...]
    factorisations: int
    warnings: tuple[str, ...]


def frequencies_folder(scene: Scene) -> FilePath:
    """Where they go: beside the results of a run, which they leave alone."""
    return beside(scene.results_folder, FREQUENCIES)


def frequencies(
    scene: Scene, wanted: Wanted, folder: FilePath | None = None, watch: Watch = lambda stage, done, total: None
) -> Frequencies:
    """Natural frequencies of a scene's linkage over a revolution, or over the whole run; all links unreduced.

    Parameters
    ----------
    folder : `frequencies_folder` if not given
    """
    for name in ("modes", "positions", "harmonics"):
        if (value := getattr(wanted, name)) < 1:
            raise SceneError(f"--{name}: must be at least 1, got {value}")
    if not 0 <= wanted.shapes <= wanted.modes:
        raise SceneError(f"--shapes: must be between 0 and --modes ({wanted.modes}), got {wanted.shapes}")
    require_drive(scene, wanted.free)
    scene, assembly = assembled(scene)
    watch("mesh and matrices", 0, 0)
    t = _positions(scene, wanted.positions)
    made, errors, meshes = frozen(scene, wanted.modes, t[0], released if wanted.free else None)
    scene, system, solver = made.scene, made.system, made.solver
    turn = revolution_steps(scene)
    speed = 2 * np.pi / (turn * time_grid(scene).step) if turn else 0.0
    phi, rate, change = path_parameter(scene, t)
    if speed:  # a ramp may reach it later
        rate, change = np.copysign(speed, rate), np.zeros_like(change)
    shares = SPEEDS if speed and scene.analysis.stiffening else (1.0,)
    motions = {x: rigid_motion(made.linkage, made.along, t, (phi, x * rate, x**2 * change)) for x in shares}
    found, buckled = _at_speeds(solver, motions, speed, watch)
    motion, every = motions[1.0], found[1.0]
    still = max(each.still for each in every)
    tables = {x: _table(each, wanted.modes) for x, each in found.items()}
    values = tables[1.0]
    over = Campbell(speed * np.array(list(tables)), np.array(list(tables.values())), len(shares) > 1)
    angle = motion.phi - (2 * np.pi * np.floor(motion.phi.min() / (2 * np.pi) + 1e-9) if speed else 0.0)
    crossings = tuple(crossed(over, wanted.harmonics)) if speed else ()
    warnings = (*assembly_warning(assembly), *tangent_warning(system, "frequencies"), *meshes, *buckled)
    with claimed(FilePath(folder or frequencies_folder(scene))) as target:
        done = Frequencies(target, t, angle, values, errors, still, speed, crossings, solver.factorisations, warnings)
        _write_files(target, scene, wanted, done, over, max(found) * speed)
        if wanted.shapes:
            watch("mode shapes", 0, 0)
            where = [
                f" at {clock(scene, frozen=True)} {moment(scene, *x, frozen=True)}" if scene.driven else ""
                for x in zip(t, angle, strict=True)
            ]
            write_shapes(target, _shapes(scene, system, motion, every, where, wanted.shapes), scene.gravity)
    return done


def _write_files(
    target: FilePath, scene: Scene, wanted: Wanted, done: Frequencies, over: Campbell, fastest: float
) -> None:
    """The table, what a report shows, and the plots; those of an earlier command go.

    Parameters
    ----------
    fastest : speed of the drive up to which frequencies were found [rad/s]
    """
    t, angle, values, speed = done.time, done.angle, done.values, done.speed
    write_frequencies(target / "frequencies.csv", t, angle, values, drive_heading(drive_channel(scene)))
    write_summary(target, _summary(done, scene.source, wanted))
    for name in (OVER_TURN, CAMPBELL):
        (target / name).unlink(missing_ok=True)
    if len(t) > 1:
        write_over_drive(target / OVER_TURN, t, angle, values, bool(speed))
    if speed:
        x = np.linspace(0.0, fastest if over.varies else SPEEDS[-1] * speed, POINTS)
        write_campbell(target / CAMPBELL, x, *over.bands(x), speed, wanted.harmonics)


def _summary(done: Frequencies, source: str | None, wanted: Wanted) -> Summary:
    """What a report shows of them."""
    every = done.values[:, ~np.isnan(done.values).any(axis=0)]
    met = [(x.mode, x.harmonic, RPM * x.slowest, RPM * x.fastest) for x in done.crossings]
    lowest, highest = (f(every, axis=0).tolist() for f in (np.min, np.max))
    notes = [*filter(None, [error_words(done.errors)]), *done.warnings]
    return Summary(source, len(done.time), wanted.free, done.still, lowest, highest, RPM * done.speed, met, notes)


def _at_speeds(
    solver: Frozen | Stiffened, motions: Mapping[float, RigidMotion], speed: float, watch: Watch
) -> tuple[dict[float, list[Modes]], tuple[str, ...]]:
    """Modes at each share of the drive's speed, as far as links do not buckle, and a warning if they do beyond it."""
    found: dict[float, list[Modes]] = {}
    for share, motion in motions.items():
        done, total = len(found) * len(motion.t), len(motions) * len(motion.t)
        try:
            found[share] = _over(solver, motion, watch, done, total)
        except UnstableError:
            if share <= 1.0:
                raise
            between = (RPM * speed * x for x in (max(found), share))
            return found, (BUCKLED.format(*between),)
    return found, ()


def _over(solver: Frozen | Stiffened, motion: RigidMotion, watch: Watch, since: int, total: int) -> list[Modes]:
    """Modes at each position; shapes of the first vibration's lowest frequency so far alone."""
    out: list[Modes] = []
    lowest = np.inf
    for k in range(len(motion.t)):
        watch("positions", since + k, total)
        found = solver.at(motion.part(k, k + 1))
        first = float(found.frequencies[0]) if len(found.frequencies) else np.inf
        out.append(found if first < lowest else replace(found, shapes=()))
        lowest = min(lowest, first)
    return out


def _table(every: Sequence[Modes], count: int) -> Float[np.ndarray, "P f"]:
    """Frequencies at positions [Hz], NaN where there are fewer."""
    values = np.full((len(every), count), np.nan)
    for k, found in enumerate(every):
        values[k, : len(found.frequencies)] = found.frequencies
    return values


def _shapes(
    scene: Scene, system: System, motion: RigidMotion, every: list[Modes], where: Sequence[str], count: int
) -> list[Shape]:
    """The lowest mode shapes where the first frequency is the lowest."""
    firsts = [found.frequencies[0] if len(found.frequencies) else np.inf for found in every]
    k = int(np.argmin(firsts))
    modes, model = every[k], system.model
    recoveries = [stress_recovery(link) for link in (*model.links, *(x.link for x in model.prescribed))]

    def fields(mode: int, factor: float, exaggeration: float) -> Sequence[LinkField]:
        states = []
        for link, body, shapes in zip(model.links, model.bodies, modes.shapes, strict=True):
            u = factor * shapes[modes.still + mode]
            states.append(bent(u, motion.R[k, body][: link.d, : link.d]))
        return link_fields(model, recoveries, Snapshot(0, motion, k, states), exaggeration, scene)

    return [
        Shape(f, f"Mode {m + 1}: {f:.4g} Hz{where[k]}", partial(fields, m))
        for m, f in enumerate(modes.frequencies[:count].tolist())
    ]


def _positions(scene: Scene, count: int) -> Float[np.ndarray, " P"]:
    """Times at which the linkage is frozen."""
    if scene.driven is None:
        return np.zeros(1)
    grid, turn = time_grid(scene), revolution_steps(scene)
    span = min(turn * grid.step, grid.end) if turn else grid.end
    return np.asarray(grid.end - span + span * np.arange(count) / count)
