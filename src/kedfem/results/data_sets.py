"""Results as xarray and pandas have them."""

from typing import Any

import numpy as np

from kedfem.results.dimensions import cf_units, columns_dimension
from kedfem.results.extras import of_extra
from kedfem.results.records import Channel, Results

EVERY = slice(None)


def as_data_tree(results: Results) -> Any:
    """An xarray.DataTree with the groups and names of the results file.

    Raises
    ------
    OutputError
        xarray is not installed.
    """
    xarray = of_extra("xarray", "Results.to_xarray")
    time = xarray.Variable("time", results.time, {"units": "s", "long_name": "time"})
    attributes = {"units": results.drive.unit, "long_name": results.drive.description}
    along = {"time": time, results.drive.name: xarray.Variable("time", results.angle, attributes)}
    groups: dict[str, dict[str, Any]] = {}
    for channel, values in results.channels.values():
        group, _, name = channel.name.rpartition("/")
        dimension = columns_dimension(channel.columns)
        dims, array = (("time", dimension), values) if dimension else (("time",), values[:, 0])
        attributes = {
            "units": cf_units(channel.unit),
            "long_name": channel.description,
            "frame": channel.frame,
        }
        labels = {dimension: list(channel.columns)} if dimension else {}
        found = xarray.DataArray(array, dims=dims, coords=along | labels, attrs=attributes)
        groups.setdefault(group, {})[name] = found
    run = {"status": results.status, "reason": results.reason, "kedfem_version": results.version}
    sets = {group: xarray.Dataset(variables) for group, variables in groups.items()}
    return xarray.DataTree.from_dict({"/": xarray.Dataset(coords=along, attrs=run), **sets})


def as_data_frame(results: Results) -> Any:
    """A pandas.DataFrame with the columns of the table, over time [s].

    Raises
    ------
    OutputError
        pandas is not installed.
    """
    pandas = of_extra("pandas", "Results.to_pandas")
    first, *names = header(results)
    return pandas.DataFrame(columns_of(results)[:, 1:], pandas.Index(results.time, name=first), names)


def drive_heading(drive: Channel) -> str:
    """Name of the drive's position with its unit."""
    return f"{drive.name.replace('_', ' ')} [{drive.unit}]"


def header(results: Results) -> list[str]:
    """Names of all columns with their units, time and drive first."""
    out = ["time [s]", drive_heading(results.drive)]
    for channel, _ in results.channels.values():
        out += [f"{channel.name} {column} [{channel.unit}]" for column in channel.columns]
    return out


def columns_of(results: Results, rows: slice = EVERY) -> np.ndarray:
    """All columns (n, c) of some rows, time and drive first."""
    blocks = [results.time[rows, None], results.angle[rows, None]]
    return np.hstack([*blocks, *(values[rows] for _, values in results.channels.values())])
