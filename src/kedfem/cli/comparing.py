"""`kedfem compare`."""

from pathlib import Path
from typing import Annotated

import typer

from kedfem.cli.screen import out, show
from kedfem.errors import OutputError


def compare(
    results: Annotated[
        list[Path],
        typer.Argument(metavar="RESULTS...", help="results.h5 of each run, or the folders that have them."),
    ],
    over: Annotated[
        str | None,
        typer.Option(
            help="time or drive, what curves are over; default: the drive's position where runs have other speeds."
        ),
    ] = None,
    folder: Annotated[
        Path | None, typer.Option(help="Where all goes; default: compare beside the first results.")
    ] = None,
) -> None:
    """Runs beside each other: what differs in their scenes, curves over each other, differences as a table."""
    from kedfem.compare import compare as compared
    from kedfem.tables import compare_tables

    if over not in {None, "time", "drive"}:
        raise OutputError(f"--over: must be time or drive, got {over}")
    found = compared(results, None if over is None else "drive" if over == "drive" else "time", folder)
    show(compare_tables(found), found.warnings)
    out.print(f"{found.folder}  curves over each other, differences.csv", markup=False, soft_wrap=True)
