"""`kedfem run`."""

from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer

from kedfem.cli.options import DOUBTFUL, INTERRUPTED, Quick, ScenePath, Within
from kedfem.cli.reporting import say_where
from kedfem.cli.screen import err, out, progress, show


def run(
    scene: ScenePath,
    quick: Quick = False,
    within: Within = False,
    resume: Annotated[
        bool,
        typer.Option("--resume", help="Go on from the last state that an interrupted or killed run stored."),
    ] = False,
    states: Annotated[float, typer.Option(metavar="SECONDS", help="Time between stored states.")] = 10.0,
) -> None:
    """Analyse a scene: time series, animation, plots, a picture."""
    from kedfem.analysis import analyse
    from kedfem.results import abandoned_rows
    from kedfem.resume import has_state
    from kedfem.scene import read_scene
    from kedfem.tables import run_tables, size_line

    loaded = read_scene(scene, within=within)
    loaded = with_plain_defaults(loaded) if quick else loaded
    file = loaded.results_folder / "results.h5"
    before = _version(file)
    if not resume and (rows := abandoned_rows(file)) is not None:
        message = f"{file}: an earlier run was killed after {rows} rows, kept until the first of this run replaces them"
        message += "; --resume would go on with it" * has_state(file.parent)
        err.print(f"warning: {message}", style="yellow", markup=False, soft_wrap=True)
    try:
        with progress() as watch:
            done = analyse(loaded, watch, resume, states)
    except KeyboardInterrupt:
        _interrupted(file, _version(file) != before)
    if done.sizes:
        out.print(size_line(done.sizes), markup=False, soft_wrap=True)
    show(run_tables(loaded, done), done.warnings)
    say_where(done.folder)
    if done.results.status == "doubtful":
        message = f"doubtful: {done.results.reason}; these results mean nothing"
        err.print(message, style="red", markup=False, soft_wrap=True)
        raise typer.Exit(DOUBTFUL)


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


def _interrupted(file: Path, begun: bool) -> NoReturn:
    from kedfem.results import run_status
    from kedfem.resume import has_state

    kept = (
        f"what was computed is readable in {file} (status: {run_status(file)})"
        if begun
        else "nothing was written"
    )
    kept += "; kedfem run --resume goes on with it" * has_state(file.parent)
    err.print(f"interrupted; {kept}", style="yellow", markup=False, soft_wrap=True)
    raise typer.Exit(INTERRUPTED)
