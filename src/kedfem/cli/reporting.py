"""`kedfem report` and `kedfem view`."""

from pathlib import Path
from typing import Annotated

import typer

from kedfem.cli.options import Within
from kedfem.cli.screen import err, out, progress
from kedfem.errors import OutputError, SceneError

Given = Annotated[
    Path, typer.Argument(metavar="SCENE|RESULTS", help="A scene, results.h5, or the folder that has it.")
]
WRITTEN = "the run in one page, for any browser"


def report(
    given: Given,
    file: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Where it goes; default: report.html beside the results."),
    ] = None,
    within: Within = False,
) -> None:
    """One page about a run for any browser, without network: motion in three dimensions, curves, loads, warnings.

    Of a scene without results the analysis is run first.
    """
    out.print(f"{_written(given, file, within)}  {WRITTEN}", markup=False, soft_wrap=True)


def view(given: Given, within: Within = False) -> None:
    """Write the same page, and open it."""
    path = _written(given, None, within)
    out.print(f"{path}  {WRITTEN}", markup=False, soft_wrap=True)
    if typer.launch(path.resolve().as_uri()) != 0:
        err.print("warning: no browser could be opened here; open the page by hand", style="yellow")


def _written(given: Path, file: Path | None, within: bool) -> Path:
    """The page of results that are there, or of a scene that is run now."""
    from kedfem.report import require_report, write_report

    require_report("kedfem report")
    if within and given.suffix != ".toml":
        raise SceneError("--within: must be combined with a scene, got results, which are read alone")
    folder = _of_scene(given, within) if given.suffix == ".toml" else given
    with progress() as watch:
        watch("report", 0, 0)
        done = write_report(folder, file)
    for text in done.warnings:
        err.print(f"warning: {text}", style="yellow", markup=False, soft_wrap=True)
    return done.path


def _of_scene(file: Path, within: bool) -> Path:
    """The results of a scene, found now where there are none.

    Raises
    ------
    OutputError
        There are results of the scene as it was before.
    """
    from kedfem.analysis import analyse
    from kedfem.results import read_results
    from kedfem.scene import read_scene

    scene = read_scene(file, within=within)
    results = scene.results_folder / "results.h5"
    if not results.exists():
        with progress() as watch:
            return analyse(scene, watch).folder
    found = read_results(results)
    if found.scene_toml != scene.source:
        raise OutputError(
            f"{results}: must be of {file.name} as it is now, got those of an earlier text; run it again "
            f"(kedfem run {file}), or give the folder to see the earlier ones"
        )
    return scene.results_folder


def say_where(folder: Path) -> None:
    """What a command has written into a folder."""
    for name, what in (
        ("results.h5", "time series"),
        ("results.csv", "the same as a table"),
        ("results.parquet", "the same for pandas"),
        ("animation.pvd", "animation, open in ParaView"),
        ("paraview.py", "state for ParaView that opens all of it"),
        ("animation.vtkhdf", "the same in one file"),
        ("plots", "plots"),
        ("envelope.vtu", "highest stresses over all steps, for ParaView"),
        ("peaks.csv", "top ten of each link"),
        ("worst.png", "picture of the highest stress"),
        ("fatigue.vtu", "damage and utilisation, for ParaView"),
        ("fatigue.csv", "life at the worst places of each link"),
        ("mesh_error.vtu", "where the mesh is coarse, for ParaView"),
        ("report.html", WRITTEN),
    ):
        if (folder / name).exists():
            out.print(f"{folder / name}  {what}", markup=False, soft_wrap=True)
