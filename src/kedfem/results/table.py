"""Results as a table for spreadsheets."""

import csv
from pathlib import Path

import numpy as np

from kedfem.results.files import replacing
from kedfem.results.records import Results


def write_csv(results: Results, path: Path) -> None:
    """Write all channels as comma-separated values, one row per step.

    The header names every column with its unit, e.g. ``probes/rocker_mid/stress von_mises [Pa]``;
    numbers have the digits that give back the same float. A table of an unfinished run begins with a line
    that says so.

    Parameters
    ----------
    results
        What was read.
    path
        The file; an older one is replaced when the new one is whole.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    header = ["time [s]", f"{results.drive.name.replace('_', ' ')} [{results.drive.unit}]"]
    blocks = [results.time[:, None], results.angle[:, None]]
    for channel, values in results.channels.values():
        header += [f"{channel.name} {column} [{channel.unit}]" for column in channel.columns]
        blocks.append(values)
    with replacing(Path(path)) as part, part.open("w", encoding="utf-8", newline="") as file:
        if results.status != "complete":
            file.write(f"# not a whole run: {results.status} after {len(results.time)} steps\n")
        csv.writer(file, lineterminator="\n").writerow(header)
        np.savetxt(file, np.hstack(blocks), fmt="%.17g", delimiter=",")
