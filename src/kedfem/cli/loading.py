"""`kedfem loads`."""

from pathlib import Path
from typing import Annotated

import typer

from kedfem.cli.screen import out, show


def loads(
    results: Annotated[
        Path, typer.Argument(metavar="RESULTS", help="results.h5, or the folder that has it.")
    ],
    last: Annotated[
        float | None,
        typer.Option(metavar="REVOLUTIONS", help="Of the drive, at the end, that count; default: all."),
    ] = None,
    folder: Annotated[
        Path | None, typer.Option(help="Where all goes; default: loads beside the results.")
    ] = None,
) -> None:
    """Loads of joints and drives for suppliers: link axes, polar diagrams, equivalent bearing loads, torque, power."""
    from kedfem.loads import loads as written
    from kedfem.report.loads import loads_tables

    found = written(results, last, folder)
    show(loads_tables(found), found.warnings)
    out.print(f"{found.folder}  tables and polar diagrams", markup=False, soft_wrap=True)
