"""The rigid mechanism on its own: motion, coordinates of joints, transmission angles, rigid inverse dynamics."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path as FilePath

import numpy as np

from kedfem.accuracy.prepared import moving
from kedfem.accuracy.variants import moved
from kedfem.arrays import Float
from kedfem.dynamics.inertias import Inertias, inertias_of_links
from kedfem.dynamics.rigid_body import all_motions
from kedfem.errors import MeshError
from kedfem.links.build import bare_link, part_meshes
from kedfem.links.record import Link
from kedfem.motion.assembly import assembled, assembly_warning
from kedfem.motion.counted_revolutions import require_counted
from kedfem.motion.linkage import Linkage
from kedfem.motion.path import Path
from kedfem.motion.transmission import LEAST
from kedfem.output.animation import AnimationWriter, remove_animation
from kedfem.output.attached import rigid_springs
from kedfem.output.derived import PLOTS, STEM, TABLE
from kedfem.output.frames import drawn_bodies, rigid_fields
from kedfem.output.plots import write_plots
from kedfem.results import Results, ResultsWriter, claimed, read_results, write_csv
from kedfem.results.additions import add_account
from kedfem.results.files import beside
from kedfem.results.forces.rigid import RigidForces, rigid_forces
from kedfem.results.kinematic import Kinematics, kinematics_of, transmission_key
from kedfem.results.recorded import drive_channel
from kedfem.results.table import drive_heading
from kedfem.scene import Bar, Cad, LinkScene, MeshFile, Meshing, Scene, masses_alone, time_grid
from kedfem.stepping import Clock, Watch, frame_steps


@dataclass(frozen=True, slots=True)
class KinematicsRun:
    """The outcome of the kinematics of a scene: results, files, what was recorded, seconds per stage, warnings."""

    folder: FilePath
    results: Results
    recorded: Kinematics
    seconds: dict[str, float]
    warnings: tuple[str, ...]


def kinematics_folder(scene: Scene) -> FilePath:
    """Where they go: beside the results of a run, which they leave alone."""
    return beside(scene.results_folder, "kinematics")


def kinematics(
    scene: Scene, folder: FilePath | None = None, watch: Watch = lambda stage, done, total: None
) -> KinematicsRun:
    """Move a scene's links as rigid bodies and write positions, velocities, accelerations, forces, an animation, plots.

    Parameters
    ----------
    scene : it may be a sketch, with links that have no shape or no material
    folder : where all goes; `kinematics_folder` if not given

    Raises
    ------
    KedfemError
        With a message for the user.
    """
    scene = moved(scene)
    with claimed(folder or kinematics_folder(scene)) as target:
        return _moved(scene, target, watch)


def _moved(scene: Scene, target: FilePath, watch: Watch) -> KinematicsRun:
    """The stages, in a folder of their own."""
    clock = Clock(watch)
    scene, assembly = assembled(scene)
    linked, along = clock.timed("motion", lambda: moving(scene))
    require_counted(scene, linked, along)
    links = clock.timed("masses", lambda: rigid_links(scene))
    masses = inertias_of_links(scene, linked, links)
    forces = rigid_forces(scene, linked, masses, along)
    recorded = kinematics_of(scene, linked, along, masses)
    clock.timed("steps", lambda: _stepped(scene, linked, along, (recorded, forces, links), target))
    results = read_results(target / "results.h5")
    clock.timed("table", lambda: write_csv(results, target / TABLE))
    if scene.output.plots:
        clock.timed("plots", lambda: write_plots(results, target / PLOTS, scene.output.plots == "each"))
    warnings = (*assembly_warning(assembly), *_missing(scene, linked, masses), *_transmission(results, recorded))
    add_account(target / "results.h5", warnings, clock.seconds)
    results = replace(results, warnings=warnings, seconds=dict(clock.seconds))
    return KinematicsRun(target, results, recorded, clock.seconds, warnings)


def rigid_links(scene: Scene) -> dict[str, Link]:
    """Records of the links that have shape and material, meshed as coarsely as their mass allows; of CAD as given.

    Raises
    ------
    MeshError
        If a link cannot be meshed.
    """
    every = scene.links.items()
    named = {name: link for name, link in every if link.shape is not None and link.material is not None}
    out, meshes = {}, part_meshes(scene, named)
    for name, link in named.items():
        simple = scene.model_copy(update={"links": {name: coarse(link)}})
        try:
            out[name] = bare_link(simple, name, mesh=meshes.get(name))
        except MeshError:
            out[name] = bare_link(scene, name)
    return out


def coarse(link: LinkScene) -> LinkScene:
    """A link with the fewest elements that hold its mass: bars, and beams, are exact with one."""
    if link.family == "beam" or isinstance(link.shape, Cad | MeshFile):
        return link
    if isinstance(link.shape, Bar):
        mesh = Meshing(elements=(1, 1) if link.family == "plane" else (1, 1, 1))
    else:
        mesh = Meshing(elements_across=1)
    return link.model_copy(update={"mesh": mesh})


def _stepped(
    scene: Scene, linked: Linkage, along: Path, what: tuple[Kinematics, RigidForces, dict[str, Link]],
    folder: FilePath,
) -> None:  # fmt: skip
    """All time points to the results file, frames to the animation."""
    recorded, forces, links = what
    channels = [channel for channel, _ in recorded.every] + [each.channel for each in forces.every]
    drive, wanted = drive_channel(scene), set(frame_steps(scene).tolist())
    frames = AnimationWriter(folder, STEM, drive_heading(drive))
    seen = drawn_bodies(scene, linked, links)
    places = {each.name: each.points for each in seen if not each.label}
    notes: dict[str, str | float] = {"kind": "kinematics", "step [s]": time_grid(scene).step}
    with ResultsWriter(
        folder / "results.h5", channels, scene.model_dump_json(), scene.source, notes, drive_channel(scene)
    ) as writer:
        if not wanted:
            remove_animation(folder, STEM)
        for first, motion in all_motions(scene, linked, along):
            rows = recorded.rows(motion) | forces.rows(motion, first)
            writer.append(motion.t, motion.phi, rows)
            for k in sorted(wanted & set(range(first, first + len(motion.t)))):
                frames.add(
                    float(motion.t[k - first]),
                    rigid_fields(seen, motion, k - first) + rigid_springs(scene, linked, motion, k - first, places),
                    float(motion.phi[k - first]),
                )


def _missing(scene: Scene, linked: Linkage, masses: Inertias) -> Iterator[str]:
    """What rigid forces do not hold."""
    bare = [name for name in scene.links if not masses.mass[linked.bodies.index(name)] > 0]
    if bare:
        sliders = masses_alone(scene)
        got = ", ".join(f"{name} (a slider without mass)" if name in sliders else name for name in bare)
        yield f"rigid forces: links without shape and material are taken to have no mass: {got}"
    if linked.mobility:
        yield f"free motions ({linked.mobility}) are held in the reference position; forces of joints are left out"


def _transmission(results: Results, recorded: Kinematics) -> Iterator[str]:
    """Couplers that come too near to where they jam."""
    for each in recorded.transmissions:
        angle, at = worst_angle(results.channels[transmission_key(each.coupler)][1][:, 0], results.angle)
        if min(angle, np.pi - angle) < LEAST:
            yield (
                f"links.{each.coupler}: transmission angle {np.degrees(angle):.1f}° at drive angle "
                f"{np.degrees(at):.1f}°, beyond the usual 40° to 140°: {each.driven} may jam or be driven roughly there"
            )


def worst_angle(angle: Float[np.ndarray, " T"], drive: Float[np.ndarray, " T"]) -> tuple[float, float]:
    """The transmission angle furthest from a right angle, and the drive angle where it is first so [rad]."""
    k = first_largest(np.abs(angle - np.pi / 2))
    return float(angle[k]), float(drive[k])


def first_largest(size: Float[np.ndarray, " T"]) -> int:
    """Number of the first of the largest values, up to rounding: each turn has them again."""
    return int(np.argmax(size >= (1 - 1e-9) * size.max()))
