"""Results as a table for spreadsheets and data frames; an OutputError says that a file cannot be written."""

import csv
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

import numpy as np
from jaxtyping import Float

from kedfem.results.data_sets import as_data_frame, columns_of, header
from kedfem.results.extras import of_extra
from kedfem.results.files import replacing
from kedfem.results.records import Results

ROWS = 100_000  # of a table, put together at a time
# of numbers in tables: more than any result is exact to, half as long as what gives back the same float
DIGITS = "%.9g"


def write_csv(results: Results, path: Path) -> None:
    """Write all channels as comma-separated values, one row per step.

    The header names every column with its unit, e.g. ``probes/rocker_mid/stress von_mises [Pa]``;
    numbers have nine significant digits. A table of an unfinished run begins with a line that says so.

    Parameters
    ----------
    results : what was read
    path : the file; an older one is replaced when the new one is whole
    """
    with text_file(Path(path)) as file:
        if results.status != "complete":
            file.write(f"# not a whole run: {results.status} after {len(results.time)} steps\n")
        parts = range(0, len(results.time), ROWS)
        write_numbers(file, header(results), (columns_of(results, slice(k, k + ROWS)) for k in parts))


@contextmanager
def text_file(path: Path) -> Iterator[TextIO]:
    """A table's file, which takes its place when it is whole."""
    with replacing(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        yield file


def write_rows(path: Path, names: Iterable[str], rows: Iterable[Iterable[object]]) -> None:
    """A table of words and numbers: a line of names, and a line for each row; of floats see `cell`."""
    with text_file(path) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        writer.writerows([cell(x) if isinstance(x, float) else x for x in row] for row in rows)


def write_numbers(file: TextIO, names: Iterable[str], parts: Iterable[Float[np.ndarray, "n c"]]) -> None:
    """A line of names, and a line of numbers for each row of all parts."""
    csv.writer(file, lineterminator="\n").writerow(names)
    for values in parts:
        np.savetxt(file, values, fmt=DIGITS, delimiter=",")


def cell(x: float) -> str:
    """A number in a table; nothing where it is not known."""
    return "" if np.isnan(x) else DIGITS % x


def write_parquet(results: Results, path: Path) -> None:
    """Write the table of `write_csv` as Parquet, all digits kept, time as index; how the run ended is in its `attrs`.

    Raises
    ------
    OutputError
        The file cannot be written, or pandas or pyarrow is not installed.
    """
    require_parquet("output.parquet")
    table = as_data_frame(results)
    table.attrs = {"status": results.status, "reason": results.reason, "kedfem_version": results.version}
    with replacing(Path(path)) as part:
        table.to_parquet(part, engine="pyarrow")


def require_parquet(where: str) -> None:
    """OutputError unless what Parquet needs is installed."""
    for package in ("pandas", "pyarrow"):
        of_extra(package, where)
