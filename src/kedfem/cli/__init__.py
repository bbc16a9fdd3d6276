"""The command line: the only place that prints. Heavy imports happen inside the commands."""

import gc
import os
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from kedfem.cli.comparing import compare
from kedfem.cli.exporting import export
from kedfem.cli.frequencies import frequencies
from kedfem.cli.loading import loads
from kedfem.cli.new import KINDS, new
from kedfem.cli.options import DEFECT, DOUBTFUL, INTERRUPTED, USER_ERROR, Quick, ScenePath, Within
from kedfem.cli.reporting import report, say_where, view
from kedfem.cli.running import run, with_plain_defaults
from kedfem.cli.screen import err, out, progress, show, stages
from kedfem.cli.sweeping import sweep
from kedfem.errors import KedfemError, OutputError, SceneError
from kedfem.processes import end_as_interrupted, interruption_asked, one_blas_thread

app = typer.Typer(
    name="kedfem",
    help="How much the links of a moving mechanism bend, vibrate and are stressed.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


@app.callback(invoke_without_command=True)
def _root(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Show the version and exit.")] = False,
) -> None:
    if version:
        from kedfem import __version__

        out.print(f"kedfem {__version__}")
        raise typer.Exit
    del context


app.command()(run)


@app.command()
def check(scene: ScenePath, quick: Quick = False, within: Within = False) -> None:
    """Show what would be modelled and its cost; solve nothing."""
    from kedfem.accuracy.plan import plan_for
    from kedfem.accuracy.reduction import prepared
    from kedfem.accuracy.sizes import size_warnings, sizes
    from kedfem.motion.assembly import assembled
    from kedfem.scene import read_scene
    from kedfem.tables import assembly_table, check_tables, size_line

    read = read_scene(scene, within=within)
    loaded, assembly = assembled(with_plain_defaults(read) if quick else read)
    with stages() as stage:
        plan = plan_for(loaded, stage)
        ready, reduction = prepared(plan.scene, stage, known=plan.links) if plan else prepared(loaded, stage)
    found = sizes(loaded, ready.model)
    out.print(size_line(found), markup=False, soft_wrap=True)
    show([assembly_table(assembly), *check_tables(ready, reduction, plan)], size_warnings(loaded, found))


@app.command()
def kinematics(
    scene: ScenePath,
    folder: Annotated[
        Path | None, typer.Option(help="Where all goes; default: SCENE-kinematics beside the scene.")
    ] = None,
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
    say_where(done.folder)


@app.command()
def mesh(
    part: Annotated[Path, typer.Argument(metavar="PART", help="A CAD file: STEP, IGES or BREP.")],
    solid: Annotated[str | None, typer.Option(metavar="NAME", help="Which solid of an assembly.")] = None,
    size: Annotated[
        str | None, typer.Option(metavar="LENGTH", help="Edge length of the elements, e.g. '3 mm'.")
    ] = None,
    across: Annotated[
        int | None, typer.Option(help="Elements across the smallest width; 2 if nothing else is given.")
    ] = None,
    unknowns: Annotated[int | None, typer.Option(help="About so many unknowns.")] = None,
    element: Annotated[str, typer.Option(metavar="KIND", help="hex27, hex20, hex8 or tet10.")] = "hex27",
    min_quality: Annotated[
        float | None, typer.Option(metavar="NUMBER", help="Least scaled Jacobian of the elements.")
    ] = None,
    scale: Annotated[
        float | None, typer.Option(help="Metres per unit of the file, if not its own unit.")
    ] = None,
    folder: Annotated[
        Path | None, typer.Option(help="Where mesh and picture go; default: PART-mesh beside the part.")
    ] = None,
) -> None:
    """Mesh one part from CAD: what joints can sit on, a mesh file, a picture, its quality."""
    from kedfem.links.surfaces.part_candidates import offers
    from kedfem.mesh import part_mesh
    from kedfem.output.mesh_picture import write_mesh_picture
    from kedfem.output.vtu import write_mesh
    from kedfem.results import ready_folder
    from kedfem.scene import link_from
    from kedfem.tables import mesh_tables

    shape = {"kind": "cad", "file": part.name, "solid": solid, "scale": scale}
    sizes = {"size": size, "elements_across": across, "unknowns": unknowns}
    given = {"shape": _given(shape), "mesh": _given(sizes), "element": element, "min_quality": min_quality}
    link = link_from(_given(given))
    with progress() as watch:
        watch("mesh", 0, 0)
        made = part_mesh(link, part.parent)
        found = offers(made)
    show(mesh_tables(part.name, made, found))
    stem = part.stem if solid is None else f"{part.stem}-{solid}"
    target = ready_folder(folder or part.with_name(f"{stem}-mesh"))
    write_mesh(made, target / "mesh.vtu")
    words = "the mesh, for ParaView or shape.kind = 'mesh'"
    out.print(f"{target / 'mesh.vtu'}  {words}", markup=False, soft_wrap=True)
    try:
        write_mesh_picture([(part.name, made)], target / "mesh.png", f"{part.name}: {made.method}", found)
    except OutputError as error:
        err.print(f"warning: {error}", style="yellow", markup=False)
    else:
        out.print(f"{target / 'mesh.png'}  its picture", markup=False, soft_wrap=True)


def _given(keys: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in keys.items() if value is not None}


@app.command()
def accuracy(
    scene: ScenePath,
    folder: Annotated[
        Path | None, typer.Option(help="Where table and plot go; default: SCENE-accuracy beside the scene.")
    ] = None,
    repeats: Annotated[int, typer.Option(help="Runs of short variants; medians are shown.")] = 3,
    most: Annotated[float, typer.Option(metavar="SECONDS", help="What the whole study may take.")] = 60.0,
    quick: Annotated[bool, typer.Option("--quick", help="A small reference and few variants.")] = False,
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
    try:
        with progress() as watch:
            study = studied(loaded, most, repeats, quick, watch)
    except KeyboardInterrupt:
        err.print("interrupted; nothing was written", style="yellow")
        raise typer.Exit(INTERRUPTED) from None
    show(study_tables(study, machine()))
    for name, write in (("accuracy.csv", write_study), ("accuracy.png", write_study_plot)):
        write(study, target / name, machine())
        out.print(f"{target / name}", markup=False, soft_wrap=True)


app.command()(new)


@app.command()
def cache(
    clear: Annotated[bool, typer.Option("--clear", help="Remove all that is kept.")] = False,
) -> None:
    """Show what is kept between runs, and where."""
    from kedfem.folders import cache_folder, named_cache
    from kedfem.store import clear as cleared
    from kedfem.store import entries

    named, folder = named_cache(), cache_folder()
    if named is None:
        out.print("nothing is kept: KEDFEM_CACHE switches it off")
    elif folder is None:
        raise OutputError(
            f"{named}: must be a folder that you own and that nobody else can write (entries can run code), got another "
            "one; nothing is kept until it is, or KEDFEM_CACHE names another folder"
        )
    elif clear:
        out.print(f"{folder}  {_count(cleared(folder))} removed", markup=False, soft_wrap=True)
    else:
        sizes = [path.stat().st_size for path in entries(folder)]
        out.print(f"{folder}  {_count(len(sizes))}, {sum(sizes) / 1e6:.1f} MB", markup=False, soft_wrap=True)


def _count(entries: int) -> str:
    return f"{entries} entr{'y' if entries == 1 else 'ies'}"


@app.command(name="compile")
def compile_() -> None:
    """Compile what scenes need, once for this version; otherwise the first runs do."""
    from kedfem.precompile import precompile

    with progress() as watch:
        precompile(watch)
    out.print("compiled")


app.command()(sweep)
app.command()(frequencies)
app.command()(loads)
app.command()(compare)
app.command()(report)
app.command()(export)
app.command()(view)


def main() -> None:
    """Entry point: errors of kedfem become messages and an exit code, never a traceback."""
    end_as_interrupted()
    one_blas_thread()
    try:
        app()
    except KedfemError as error:
        err.print(
            f"error: {error}" if "\n" not in str(error) else f"errors:\n{error}",
            style="red",
            markup=False,
            soft_wrap=True,
        )
        sys.exit(USER_ERROR)
    except KeyboardInterrupt:
        err.print("interrupted", style="yellow")
        sys.exit(INTERRUPTED)
    except MemoryError:
        err.print(
            "error: analysis: must fit in memory, got more unknowns than it holds; take larger elements",
            style="red",
        )
        sys.exit(USER_ERROR)
    except Exception as error:
        if os.environ.get("KEDFEM_DEBUG"):
            raise
        if interruption_asked():  # raised within a library that went on without what it interrupted
            err.print("interrupted", style="yellow")
            sys.exit(INTERRUPTED)
        what = f"{type(error).__name__}: {error}"
        err.print(
            f"internal error: {what}\nThis is a defect of kedfem; KEDFEM_DEBUG=1 shows where.",
            style="red",
            markup=False,
        )
        sys.exit(DEFECT)
    finally:
        gc.freeze()  # else Python looks through all that was imported once more before it ends: half a second
