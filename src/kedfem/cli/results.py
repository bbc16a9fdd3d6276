"""Commands that read results: `kedfem loads`, `compare`, `report`, `view`."""

from pathlib import Path
from typing import Annotated

import typer

from kedfem.cli.options import Within, goes_to, option
from kedfem.cli.running import PAGE
from kedfem.cli.screen import progress, say, say_written, show, warn
from kedfem.errors import OutputError, SceneError

Given = Annotated[Path, typer.Argument(metavar="SCENE|RESULTS", help="A scene, results.h5, or the folder that has it.")]


def loads(
    results: Annotated[Path, typer.Argument(metavar="RESULTS", help="results.h5, or the folder that has it.")],
    last: Annotated[float | None, option("Of the drive, at the end, that count; default: all.", "REVOLUTIONS")] = None,
    link: Annotated[str | None, option("Load cases of this link instead, for a static analysis of it.", "NAME")] = None,
    at: Annotated[
        list[float] | None,
        option("Instant of a load case; several: given again. Default: that of the link's highest stress.", "SECONDS"),
    ] = None,
    folder: Annotated[Path | None, goes_to("loads beside the results")] = None,
) -> None:
    """Loads of joints and drives for suppliers: link axes, polar diagrams, equivalent bearing loads, torque, power.

    With --link NAME load cases of one link: a deck for Abaqus and CalculiX, VTU, and a table of forces.
    """
    if link is not None:
        if last is not None:
            wanted = "must be left out with --link, which takes instants (--at)"
            raise SceneError(f"--last: {wanted}, got {last:g}")
        _cases(results, link, at or [], folder)
        return
    if at:
        raise SceneError(f"--at: must be combined with --link NAME, got {at[0]:g} alone")
    from kedfem.loads import loads as written
    from kedfem.tables import loads_tables

    found = written(results, last, folder)
    show(loads_tables(found), found.warnings)
    say(found.folder, "tables and polar diagrams")


def _cases(results: Path, link: str, at: list[float], folder: Path | None) -> None:
    from kedfem.load_cases import load_cases
    from kedfem.tables import case_tables

    with progress() as watch:
        found = load_cases(results, link, at, folder, watch)
    show(case_tables(found), found.warnings)
    elements = f"{found.elements:,} {found.element}"  # no deck of 27-node hexahedra
    say_written(found.folder, {
        f"{link}.inp": f"deck for Abaqus and CalculiX: {elements}, a step an instant",
        f"{link}.pvd": "the same for ParaView, with the run's stresses",
        f"{link}.csv": "forces and moments of joints, loads and inertia",
    })  # fmt: skip


def compare(
    results: Annotated[
        list[Path], typer.Argument(metavar="RESULTS...", help="results.h5 of each run, or the folders that have them.")
    ],
    over: Annotated[
        str | None,
        option("time or drive, what curves are over; default: the drive's position where runs have other speeds."),
    ] = None,
    folder: Annotated[Path | None, goes_to("compare beside the first results")] = None,
) -> None:
    """Runs beside each other: what differs in their scenes, curves over each other, differences as a table."""
    from kedfem.compare import compare as compared
    from kedfem.tables import compare_tables

    if over not in {None, "time", "drive"}:
        raise OutputError(f"--over: must be time or drive, got {over}")
    found = compared(results, None if over is None else "drive" if over == "drive" else "time", folder)
    show(compare_tables(found), found.warnings)
    say(found.folder, "curves over each other, differences.csv")


def report(
    given: Given,
    file: Annotated[Path | None, option("Where it goes; default: report.html beside the results.", "FILE")] = None,
    within: Within = False,
) -> None:
    """One page about a run for any browser, without network: motion in three dimensions, curves, loads, warnings.

    Of a scene without results the analysis is run first.
    """
    say(written_page(given, file, within), PAGE)


def view(given: Given, within: Within = False) -> None:
    """Write the same page, and open it."""
    path = written_page(given, None, within)
    say(path, PAGE)
    if typer.launch(path.resolve().as_uri()) != 0:
        warn("warning: no browser could be opened here; open the page by hand")


def written_page(given: Path, file: Path | None, within: bool) -> Path:
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
        warn(f"warning: {text}")
    return done.path


def _of_scene(file: Path, within: bool) -> Path:
    """The results of a scene, found now where there are none; those of the scene as it was before are refused."""
    from kedfem.analysis import analyse
    from kedfem.results import read_results
    from kedfem.scene import read_scene

    scene = read_scene(file, within=within)
    results = scene.results_folder / "results.h5"
    if not results.exists():
        with progress() as watch:
            return analyse(scene, watch).folder
    if read_results(results).scene_toml != scene.source:
        raise OutputError(
            f"{results}: must be of {file.name} as it is now, got those of an earlier text; run it again "
            f"(kedfem run {file}), or give the folder to see the earlier ones"
        )
    return scene.results_folder
