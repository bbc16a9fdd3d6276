"""Files of a sweep: a row for each finished point, all rows as `sweep.h5` and `sweep.csv`.

An OutputError is raised if a file cannot be written.
"""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path as FilePath
from typing import Any
from zipfile import BadZipFile

import numpy as np

from kedfem.dynamics.system.period.map import StateArrays
from kedfem.results import replacing
from kedfem.results.layout import installed_version, opened, write_texts
from kedfem.results.table import write_rows
from kedfem.sweep.axes import Axis
from kedfem.sweep.points import MAGNITUDE, Row

ROWS, STATES = "rows", "states"
KINDS = ("max", "min", "rms", "when")
FORMAT = 2


def kept_row(folder: FilePath, identity: str) -> Row | None:
    """The row of a point that an earlier sweep finished; None if there is none, or it failed."""
    try:
        row = Row.read((folder / ROWS / f"{identity}.json").read_text(encoding="utf-8"))
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return None if row.status == "failed" else row


def kept_state(folder: FilePath, identity: str) -> StateArrays | None:
    """The state with which the steady motion of a finished point begins; None if there is none."""
    try:
        with np.load(folder / STATES / f"{identity}.npz", allow_pickle=False) as file:
            return {name: file[name] for name in file.files}
    except (OSError, ValueError, KeyError, BadZipFile):
        return None


def keep_state(folder: FilePath, identity: str, state: StateArrays) -> None:
    """Write the state at the beginning of a steady motion, as a whole or not at all."""
    with replacing(folder / STATES / f"{identity}.npz") as part, part.open("wb") as file:
        np.savez(file, **state)


def keep_row(folder: FilePath, identity: str, row: Row) -> None:
    """Write a row, as a whole or not at all."""
    with replacing(folder / ROWS / f"{identity}.json") as part:
        part.write_text(row.text(), encoding="utf-8")


def write_table(path: FilePath, axes: Sequence[Axis], rows: Sequence[Row]) -> None:
    """One line per point: values of the keys, status, extremes of every column."""
    units = column_units(rows)
    header = [f"{axis.key} [{axis.unit}]" if axis.unit else axis.key for axis in axes]
    header += ["status", "settled", "change of the last revolution"]
    header += [f"{name} {kind} [{'s' if kind == 'when' else unit}]" for name, unit in units.items() for kind in KINDS]

    def line(k: int, row: Row) -> list[object]:
        values = [axis.values[k] if axis.numbers is None else f"{axis.numbers[k]:.15g}" for axis in axes]
        change = "" if math.isnan(row.change) else f"{row.change:.3g}"
        return [*values, row.status, row.settled, change, *_numbers(row, units), row.message]

    write_rows(path, [*header, "message"], (line(k, row) for k, row in enumerate(rows)))


def write_sweep(path: FilePath, axes: Sequence[Axis], rows: Sequence[Row], last: float) -> None:
    """All rows in HDF5, in the layout of netCDF 4, which xarray reads: dimensions `point` and `column`."""
    units = column_units(rows)
    shape = len(rows), len(units), len(KINDS)
    numbers = np.array([list(_numbers(row, units)) for row in rows]).reshape(shape)
    with replacing(path) as part, opened(part, "w") as file:
        file.attrs.update(kedfem_version=installed_version(), sweep_format=FORMAT, last_revolutions=last)
        file["point"] = np.arange(len(rows))
        write_texts(file, "column", list(units))
        for name in ("point", "column"):
            file[name].make_scale(name)
        for axis in axes:
            if axis.numbers is None:
                write_texts(file, axis.key, [str(value) for value in axis.values])
            else:
                file[axis.key] = axis.numbers
                file[axis.key].attrs["units"] = axis.unit
            _along(file, axis.key, "point")
        for name in ("status", "settled", "message"):
            write_texts(file, name, [getattr(row, name) for row in rows])
        for name in ("change", "seconds"):
            file[name] = [getattr(row, name) for row in rows]
        for name in ("status", "settled", "message", "change", "seconds"):
            _along(file, name, "point")
        write_texts(file, "unit", list(units.values()))
        _along(file, "unit", "column")
        for k, kind in enumerate(KINDS):
            file[kind] = numbers[:, :, k]
            _along(file, kind, "point", "column")
        coordinates = [axis.key for axis in axes if " " not in axis.key] + ["unit"]
        file.attrs["coordinates"] = " ".join(coordinates)


def column_units(rows: Sequence[Row]) -> dict[str, str]:
    """Every column that a row has, in order, and its unit."""
    return {name: unit for row in rows for name, (unit, _) in row.extremes.items()}


def plain_quantities(names: Sequence[str]) -> list[str]:
    """Names to be shown: of vectors only the magnitude, none of the rigid mechanism, stresses first."""
    whole = {name.rpartition("/")[0] for name in names if name.endswith(f"/{MAGNITUDE}")}
    elastic = (name for name in names if "/rigid_" not in name)
    some = [x for x in elastic if x.rpartition("/")[0] not in whole or x.endswith(f"/{MAGNITUDE}")]
    return sorted(some, key=lambda name: not name.startswith("stress/"))


def largest(row: Row, name: str) -> float:
    """The largest magnitude of a column; nan where the row has none."""
    if name not in row.extremes:
        return math.nan
    most, least, _, _ = row.extremes[name][1]
    return abs(most) if math.isnan(least) else max(abs(most), abs(least))


def _numbers(row: Row, units: dict[str, str]) -> Iterator[float]:
    """Extremes of all columns one after the other; nan where a row has none."""
    for name in units:
        yield from row.extremes.get(name, ("", (math.nan,) * len(KINDS)))[1]


def _along(file: Any, name: str, *dimensions: str) -> None:
    for k, dimension in enumerate(dimensions):
        file[name].dims[k].attach_scale(file[dimension])
