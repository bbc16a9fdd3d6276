"""Results as a table for spreadsheets, and as data sets of xarray and pandas.

An OutputError reports a file that cannot be written or a package that is not installed.
"""

import csv
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import numpy as np

from kedfem.arrays import Float
from kedfem.results.dimensions import cf_attributes, columns_dimension
from kedfem.results.files import of_extra, replacing

if TYPE_CHECKING:
    from kedfem.results.records import Results
from kedfem.results.channels import TIME, Channel

ROWS = 100_000  # of a table, put together at a time
# of numbers in tables: more than any result is exact to, half as long as what gives back the same float
DIGITS = "%.9g"
EVERY = slice(None)


def write_csv(results: "Results", path: Path) -> None:
    """Write all channels as comma-separated values, one row per step.

    The header names every column with its unit, e.g. ``probes/rocker_mid/stress von_mises [Pa]``;
    numbers have nine significant digits. A table of an unfinished run begins with a line that says so.
    """
    with text_file(Path(path)) as file:
        if results.status != "complete":
            file.write(f"# not a whole run: {results.status} after {len(results.instants)} steps\n")
        parts = range(0, len(results.time), ROWS)
        write_numbers(file, header(results), (columns_of(results, slice(k, k + ROWS)) for k in parts))


@contextmanager
def text_file(path: Path) -> Iterator[TextIO]:
    """A table's file, which appears when it is complete."""
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


def write_parquet(results: "Results", path: Path) -> None:
    """Write the table of `write_csv` as Parquet, all digits kept, time as index; how the run ended is in its `attrs`."""
    require_parquet()
    table = as_data_frame(results)
    table.attrs = {"status": results.status, "reason": results.reason, "kedfem_version": results.version}
    with replacing(Path(path)) as part:
        table.to_parquet(part, engine="pyarrow")


def require_parquet() -> None:
    """OutputError unless the packages for Parquet are installed."""
    for package in ("pandas", "pyarrow"):
        of_extra(package, "output.parquet")


def as_data_tree(results: "Results") -> Any:
    """An xarray.DataTree with the groups and names of the results file."""
    xarray = of_extra("xarray", "Results.to_xarray")
    time = xarray.Variable("time", results.time, cf_attributes(TIME))
    drive = xarray.Variable("time", results.angle, cf_attributes(results.drive))
    along = {"time": time, results.drive.name: drive}
    groups: dict[str, dict[str, Any]] = {}
    for channel, values in results.channels.values():
        group, _, name = channel.name.rpartition("/")
        dimension = columns_dimension(channel.columns)
        dims, array = (("time", dimension), values) if dimension else (("time",), values[:, 0])
        attributes = cf_attributes(channel) | {"frame": channel.frame}
        labels = {dimension: list(channel.columns)} if dimension else {}
        found = xarray.DataArray(array, dims=dims, coords=along | labels, attrs=attributes)
        groups.setdefault(group, {})[name] = found
    run = {"status": results.status, "reason": results.reason, "kedfem_version": results.version}
    sets = {group: xarray.Dataset(variables) for group, variables in groups.items()}
    return xarray.DataTree.from_dict({"/": xarray.Dataset(coords=along, attrs=run), **sets})


def as_data_frame(results: "Results") -> Any:
    """A pandas.DataFrame with the columns of the table, over time [s]."""
    pandas = of_extra("pandas", "Results.to_pandas")
    first, *names = header(results)
    return pandas.DataFrame(columns_of(results)[:, 1:], pandas.Index(results.time, name=first), names)


def drive_heading(drive: Channel) -> str:
    """Name of the drive's position with its unit."""
    return f"{drive.name.replace('_', ' ')} [{drive.unit}]"


def header(results: "Results") -> list[str]:
    """Names of all columns with their units, time and drive first."""
    out = ["time [s]", drive_heading(results.drive)]
    for channel, _ in results.channels.values():
        out += [f"{channel.name} {column} [{channel.unit}]" for column in channel.columns]
    return out


def columns_of(results: "Results", rows: slice = EVERY) -> np.ndarray:
    """All columns (n, c) of some rows, time and drive first."""
    blocks = [results.time[rows, None], results.angle[rows, None]]
    return np.hstack([*blocks, *(values[rows] for _, values in results.channels.values())])
