"""Commands that run scenes: `kedfem run`, `check`, `kinematics`, `accuracy`, `sweep`."""

from contextlib import nullcontext
from pathlib import Path
from typing import Annotated, Any

import typer

from kedfem.cli.options import UNRELIABLE, Quick, ScenePath, Within, flag, goes_to, option
from kedfem.cli.screen import interruptible, progress, say, say_written, show, stages, warn
from kedfem.errors import SceneError

PAGE = "the run in one page, for any browser"
FILES = {
    "results.h5": "time series", "results.csv": "the same as a table",
    "results.parquet": "the same for pandas", "animation.pvd": "animation, open in ParaView",
    "paraview.py": "state for ParaView that opens all of it", "animation.vtkhdf": "the same in one file",
    "plots": "plots", "envelope.vtu": "highest stresses over all steps, for ParaView",
    "peaks.csv": "top ten of each link", "worst.png": "picture of the highest stress",
    "fatigue.vtu": "damage and utilisation, for ParaView",
    "fatigue.csv": "life at the worst places of each link",
    "mesh_error.vtu": "where the mesh is coarse, for ParaView", "report.html": PAGE,
}  # fmt: skip

NOTHING = "nothing was computed yet, as the first step had not begun, and nothing was written"


def run(
    scene: ScenePath,
    quick: Quick = False,
    within: Within = False,
    resume: Annotated[
        bool, flag("--resume", "Go on from the last state that an interrupted or killed run stored.")
    ] = False,
    states: Annotated[float, option("Time between stored states.", "SECONDS")] = 10.0,
) -> None:
    """Analyse a scene: time series, animation, plots, a picture."""
    from kedfem.analysis import analyse
    from kedfem.results import abandoned_rows, run_status
    from kedfem.resume import has_state
    from kedfem.scene import read_scene
    from kedfem.tables import run_tables, size_line

    loaded = read_scene(scene, within=within)
    loaded = with_plain_defaults(loaded) if quick else loaded
    file = loaded.results_folder / "results.h5"
    before = _version(file)
    if not resume and (rows := abandoned_rows(file)) is not None:
        message = f"{file}: an earlier run was killed after {rows} rows, kept until the first of this run replaces them"
        warn(f"warning: {message}" + "; --resume would go on with it" * has_state(file.parent))

    def kept() -> str:
        begun = _version(file) != before
        readable = f"what was computed is readable in {file} (status: {run_status(file)})" if begun else ""
        going_on = "; kedfem run --resume goes on with it" * has_state(file.parent)
        return (readable or NOTHING) + going_on

    with interruptible(kept), progress() as watch:
        done = analyse(loaded, watch, resume, states)
    if done.sizes:
        say(size_line(done.sizes))
    show(run_tables(loaded, done), done.warnings)
    say_written(done.folder, FILES)
    if done.results.status == "unreliable":
        warn(f"unreliable: {done.results.reason}; these results mean nothing", "red")
        raise typer.Exit(UNRELIABLE)


def with_plain_defaults(scene: Any) -> Any:
    """The scene with plain defaults for what it leaves open; the step is stated where no turns of a drive show it."""
    from kedfem.scene import time_grid
    from kedfem.scene.questions.timing import scene_speed

    analysis = scene.analysis.model_copy(update={"accuracy": "quick"})
    quick = scene.model_copy(update={"analysis": analysis})
    if not scene.driven_joints or scene_speed(scene) or analysis.step is not None:
        return quick
    step = {"step": time_grid(quick).step}
    return quick.model_copy(update={"analysis": analysis.model_copy(update=step)})


def _version(file: Path) -> tuple[int, int] | None:
    """Something that changes with a file; None where there is none."""
    return (file.stat().st_ino, file.stat().st_mtime_ns) if file.exists() else None


def check(scene: ScenePath, quick: Quick = False, within: Within = False) -> None:
    """Show what would be modelled and its cost; of the solution a few steps are tried."""
    from kedfem.accuracy.damping import mass_damping_warning
    from kedfem.accuracy.plan import ready_to_step
    from kedfem.accuracy.sizes import size_warnings, sizes
    from kedfem.motion.assembly import assembled
    from kedfem.scene import read_scene
    from kedfem.tables import assembly_table, check_tables, forecast, size_line

    read = read_scene(scene, within=within)
    loaded, assembly = assembled(with_plain_defaults(read) if quick else read)
    with stages() as stage:
        plan, ready, reduction = ready_to_step(loaded, stage)
    found = sizes(loaded, ready.model)
    say(size_line(found))
    warnings = (*size_warnings(loaded, found), *mass_damping_warning(ready))
    with stages() as stage:
        stage("trial steps")
        tried = forecast(ready)
    show([assembly_table(assembly), *check_tables(ready, reduction, plan, tried)], warnings)
    if tried[1] is not None:
        raise tried[1]


def kinematics(
    scene: ScenePath,
    folder: Annotated[Path | None, goes_to("SCENE-kinematics beside the scene")] = None,
    within: Within = False,
) -> None:
    """Move a scene's links as rigid bodies: motion, transmission, forces."""
    from kedfem.kinematics import kinematics as moved_by
    from kedfem.scene import read_scene
    from kedfem.tables import kinematics_tables

    loaded = read_scene(scene, sketch=True, within=within)
    with progress() as watch:
        done = moved_by(loaded, folder, watch)
    show(kinematics_tables(loaded, done), done.warnings)
    say_written(done.folder, FILES)


def accuracy(
    scene: ScenePath,
    folder: Annotated[Path | None, goes_to("SCENE-accuracy beside the scene", "table and plot go")] = None,
    repeats: Annotated[int, option("Runs of short variants; medians are shown.")] = 3,
    most: Annotated[float, option("What the whole study may take.", "SECONDS")] = 60.0,
    quick: Annotated[bool, flag("--quick", "A small reference and few variants.")] = False,
) -> None:
    """Run a scene in many variants: how fast, how near to the finest."""
    from kedfem.accuracy.study.files import write_study, write_study_plot
    from kedfem.accuracy.study.measuring import studied
    from kedfem.processes import machine
    from kedfem.results import ready_folder
    from kedfem.scene import read_scene
    from kedfem.tables import study_tables

    if repeats < 1:
        raise SceneError(f"--repeats: must be at least 1, got {repeats}")
    if not 0.0 < most < float("inf"):
        raise SceneError(f"--most: must be positive [s], got {most:g}")
    loaded = read_scene(scene)
    target = ready_folder(folder or scene.with_name(f"{scene.stem}-accuracy"))
    with interruptible(lambda: "nothing was written"), progress() as watch:
        study = studied(loaded, most, repeats, quick, watch)
    show(study_tables(study, machine()))
    for name, write in (("accuracy.csv", write_study), ("accuracy.png", write_study_plot)):
        write(study, target / name, machine())
        say(target / name)


def sweep(
    scene: ScenePath,
    over: Annotated[list[str], option("A key or parameter, and a,b,c or from:to:count; several: a grid.", "KEY=VALUES")],
    samples: Annotated[int | None, option("Points of a Latin hypercube instead of a grid; each KEY=from:to.")] = None,
    last: Annotated[float, option("Whose extremes count, the last ones.", "REVOLUTIONS")] = 1.0,
    workers: Annotated[int | None, option("Processes; as many as there are cores.")] = None,
    cluster: Annotated[
        str | None, option("A Dask scheduler whose workers run the points, as tcp://host:8786.", "ADDRESS")
    ] = None,
    quick: Quick = False,
    keep: Annotated[bool, flag("--keep", "Leave a folder of results for each point.")] = False,
    edges: Annotated[
        float | None,
        option("Find edges of unstable bands along the first key to this relative width, as 0.001.", "WIDTH"),
    ] = None,
    follow: Annotated[
        bool,
        flag(
            "--follow",
            "Look for each steady motion where that of the point before was found, in the order of the first key.",
        ),
    ] = False,
    folder: Annotated[Path | None, goes_to("SCENE-sweep beside the scene")] = None,
    within: Within = False,
) -> None:
    """Run a scene at many values of its keys: peak stresses, joint forces, torque over them. Started again it goes on."""
    from kedfem.scene import read_keys
    from kedfem.sweep import BaseScene, SweepOptions, axes_of, sweep_folder
    from kedfem.sweep import sweep as swept_by
    from kedfem.sweep.cluster import cluster as on_cluster
    from kedfem.tables import sweep_tables

    raw, _ = read_keys(scene, within=within)
    base = BaseScene(raw, scene.parent, scene.stem)
    axes, asked = axes_of(over, raw, samples), SweepOptions(last, workers, quick, keep, edges, follow)
    if follow and samples is not None:
        raise SceneError("--follow: must be without --samples, whose points have no order along a key")
    if cluster is not None and workers is not None:
        wanted = "cannot be combined with --cluster, whose workers are as many as there are"
        raise SceneError(f"--workers: {wanted}")
    target = folder or sweep_folder(base)
    kept = f"finished points are in {target}; the same command goes on with the others"
    with interruptible(lambda: kept):
        executor = None if cluster is None else on_cluster(cluster, base.folder)
        with executor or nullcontext(), progress() as watch:
            done = swept_by(base, axes, asked, folder, watch, executor)
    show(*sweep_tables(done))
    say_written(done.folder, dict.fromkeys(("sweep.h5", "sweep.csv", "edges.csv", "sweep.png"), ""))
