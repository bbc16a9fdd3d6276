"""Tables of numbers beside a scene: laws of motion and factors over time, in CSV files."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from kedfem.errors import Fault, SceneError, Where
from kedfem.scene.read.files import file_text
from kedfem.scene.records.curves import Curve, Factor, ForceCurve, PullCurve, TorqueCurve
from kedfem.scene.records.units import si_number


def two_columns(path: Path, names: tuple[str, str], si: tuple[str, str]) -> tuple[list[float], list[float]]:
    """Two columns of a CSV file, in SI units, under an optional heading with units.

    Parameters
    ----------
    names, si : what the columns are, and their SI units

    Raises
    ------
    SceneError
        Not readable, or a line that is not two numbers.
    """
    rows = [(i, row.split(",")) for i, row in enumerate(file_text(path).splitlines(), start=1) if row.strip()]
    factors = (1.0, 1.0)
    if rows and not _numbers(rows[0][1]):
        factors = _heading_factors(path, rows[0][1], names, si)
        rows = rows[1:]
    pairs = []
    for i, row in rows:
        numbers = _numbers(row)
        if numbers is None:
            raise SceneError(
                f"{path.name}, line {i}: must be two numbers, {names[0]} and {names[1]}, got {','.join(row)!r}"
            )
        pairs.append(numbers)
    return [at * factors[0] for at, _ in pairs], [value * factors[1] for _, value in pairs]


def motion_table(path: Path) -> tuple[list[float], str, list[float]]:
    """Times [s], and `angle` [rad] or `travel` [m], as the heading says, of a CSV file.

    Raises
    ------
    SceneError
        Not readable, or a line that is not two numbers.
    """
    first = next((row for row in file_text(path).splitlines() if row.strip()), "")
    key, unit = ("travel", "m") if "travel" in first else ("angle", "rad")
    time, values = two_columns(path, ("time", key), ("s", unit))
    return time, key, values


def _numbers(row: list[str]) -> tuple[float, float] | None:
    try:
        time, angle = (float(cell) for cell in row)
    except ValueError:
        return None
    return time, angle


def _heading_factors(
    path: Path, row: list[str], names: tuple[str, str], si: tuple[str, str]
) -> tuple[float, float]:
    """SI units per unit of each column, from a heading such as 'time [ms], angle [deg]'."""
    units = [re.search(r"\[(.*)\]", cell) for cell in row]
    if len(units) != 2:
        raise SceneError(
            f"{path.name}, line 1: must head two columns, {names[0]} and {names[1]}, got {','.join(row)!r}"
        )
    try:
        one, other = (
            si_number(f"1 {unit[1]}", of) if unit else 1.0 for unit, of in zip(units, si, strict=True)
        )
    except ValueError as reason:
        wanted = f"must have units of {names[0]} and {names[1]}"
        raise SceneError(f"{path.name}, line 1: {wanted}, got: {reason}") from None
    return one, other


def with_motion_tables(raw: Mapping[str, Any], folder: Path) -> tuple[dict[str, Any], list[Fault]]:
    """A raw scene with the motion tables of its drives read from the files that they name; and faults."""
    read: dict[str, Any] = dict(raw)
    faults: list[Fault] = []
    if isinstance(raw.get("drive"), Mapping):
        read["drive"], faults = _with_motion_table(("drive",), raw["drive"], folder)
    if isinstance(raw.get("drives"), Mapping):
        tables = {
            name: _with_motion_table(("drives", name), each, folder) for name, each in raw["drives"].items()
        }
        read["drives"] = {name: drive for name, (drive, _) in tables.items()}
        faults = faults + [fault for _, found in tables.values() for fault in found]
    return read, faults


def _with_motion_table(where: Where, drive: Any, folder: Path) -> tuple[Any, list[Fault]]:
    motion = drive.get("motion") if isinstance(drive, Mapping) else None
    if not isinstance(motion, Mapping):
        return drive, []
    named = motion.get("kind") == "table" and isinstance(motion.get("file"), str)
    if not named or any(key in motion for key in ("time", "angle", "travel")):
        return drive, []
    try:
        time, key, values = motion_table(folder / motion["file"])
    except SceneError as error:
        return drive, [fault.under(*where, "motion", "file") for fault in error.faults]
    others = {name: value for name, value in motion.items() if name != "file"}
    return {**drive, "motion": {**others, "time": time, key: values}}, []


CURVES: dict[tuple[str, str], type[Curve]] = {
    ("loads", "factor"): Factor,
    ("springs", "stiffness_factor"): Factor,
    ("springs", "force"): PullCurve,
    ("springs", "torque"): TorqueCurve,
    ("motors", "torque"): TorqueCurve,
    ("motors", "force"): ForceCurve,
}
"""Keys of a section's tables that hold curves."""


def with_curve_tables(raw: Mapping[str, Any], folder: Path) -> tuple[dict[str, Any], list[Fault]]:
    """A raw scene with its curves read from the files that they name; and faults."""
    read, faults = dict(raw), list[Fault]()
    for (section, key), curve in CURVES.items():
        every = read.get(section)
        for name, each in every.items() if isinstance(every, Mapping) else ():
            given = each.get(key) if isinstance(each, Mapping) else None
            if isinstance(given, Mapping) and isinstance(given.get("file"), str):
                made, more = _with_curve(given, curve, folder)
                faults += [fault.under(section, name, key, "file") for fault in more]
                read[section] = {**read[section], name: {**each, key: made}}
    return read, faults


def _with_curve(
    given: Mapping[str, Any], curve: type[Curve], folder: Path
) -> tuple[Mapping[str, Any], list[Fault]]:
    """A raw curve with the columns of its file, if it is one that its record can read; and faults."""
    over = given.get("over", "time")
    if over not in curve.units or given.keys() & {"time", "at", "value"}:
        return given, []
    word, unit = curve.what
    try:
        at, value = two_columns(folder / given["file"], (over, word), (curve.units[over], unit))
    except SceneError as error:
        return given, list(error.faults)
    return {
        **{key: x for key, x in given.items() if key != "file"},
        "over": over,
        "at": at,
        "value": value,
    }, []
