"""`kedfem loads`."""

from pathlib import Path
from typing import Annotated

import typer

from kedfem.cli.screen import out, progress, show
from kedfem.errors import SceneError


def loads(
    results: Annotated[
        Path, typer.Argument(metavar="RESULTS", help="results.h5, or the folder that has it.")
    ],
    last: Annotated[
        float | None,
        typer.Option(metavar="REVOLUTIONS", help="Of the drive, at the end, that count; default: all."),
    ] = None,
    link: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Load cases of this link instead, for a static analysis of it."),
    ] = None,
    at: Annotated[
        list[float] | None,
        typer.Option(
            metavar="SECONDS",
            help="Instant of a load case; several: given again. Default: that of the link's highest stress.",
        ),
    ] = None,
    folder: Annotated[
        Path | None, typer.Option(help="Where all goes; default: loads beside the results.")
    ] = None,
) -> None:
    """Loads of joints and drives for suppliers: link axes, polar diagrams, equivalent bearing loads, torque, power.

    With --link NAME load cases of one link: a deck for Abaqus and CalculiX, VTU, and a table of forces.
    """
    if link is not None:
        if last is not None:
            raise SceneError(
                f"--last: must be left out with --link, which takes instants (--at), got {last:g}"
            )
        _cases(results, link, at or [], folder)
        return
    if at:
        raise SceneError(f"--at: must be combined with --link NAME, got {at[0]:g} alone")
    from kedfem.loads import loads as written
    from kedfem.tables import loads_tables

    found = written(results, last, folder)
    show(loads_tables(found), found.warnings)
    out.print(f"{found.folder}  tables and polar diagrams", markup=False, soft_wrap=True)


def _cases(results: Path, link: str, at: list[float], folder: Path | None) -> None:
    from kedfem.load_cases import load_cases
    from kedfem.tables import case_tables

    with progress() as watch:
        found = load_cases(results, link, at, folder, watch)
    show(case_tables(found), found.warnings)
    for name, what in (
        (
            f"{link}.inp",
            f"deck for Abaqus and CalculiX: {found.elements:,} {found.element}, a step an instant",
        ),
        (f"{link}.pvd", "the same for ParaView, with the run's stresses"),
        (f"{link}.csv", "forces and moments of joints, loads and inertia"),
    ):
        if (found.folder / name).exists():  # no deck of 27-node hexahedra
            out.print(f"{found.folder / name}  {what}", markup=False, soft_wrap=True)
