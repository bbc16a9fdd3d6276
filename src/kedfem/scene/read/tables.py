"""Curves from CSV files."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from kedfem.errors import Fault, SceneError, Where
from kedfem.scene.checks.hints import kind_of, models, replaced
from kedfem.scene.read.files import file_text
from kedfem.scene.records.curves import Curve
from kedfem.scene.records.units import NUMBER, USUAL, si_number

NO_UNIT = {"-", "–", "—", "−", "1", ""}  # in headings of columns without a unit
NAMES = {"time", "speed", "angle", "travel", "length", "torque", "force", "factor"}  # of columns


def two_columns(path: Path, names: tuple[str, str], si: tuple[str, str]) -> tuple[list[float], list[float]]:
    """Two columns of a CSV file in SI units, by names, after an optional heading with units; a SceneError for faults."""
    rows = [(i, row.split(",")) for i, row in enumerate(file_text(path).splitlines(), start=1) if row.strip()]
    factors = (1.0, 1.0)
    if rows and not any(map(_is_number, rows[0][1])):
        factors = _heading_factors(path, rows[0][1], names, si)
        rows = rows[1:]
    pairs = []
    for i, row in rows:
        if len(row) != 2 or not all(map(_is_number, row)):
            wanted = f"must be two numbers, {names[0]} and {names[1]}"
            raise SceneError(f"{path.name}, line {i}: {wanted}, got {','.join(row)!r}")
        pairs.append((float(row[0]), float(row[1])))
    return [at * factors[0] for at, _ in pairs], [value * factors[1] for _, value in pairs]


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _heading_factors(path: Path, row: list[str], names: tuple[str, str], si: tuple[str, str]) -> tuple[float, float]:
    """SI units per unit of each column, from a heading such as 'time [ms], angle (deg)'."""
    said = [NAMES & set(re.split(r"[^a-z]+", cell.lower())) for cell in row]
    if len(row) != 2 or any(words and name not in words for words, name in zip(said, names, strict=True)):
        wanted = f"must head two columns, {names[0]} and {names[1]}"
        raise SceneError(f"{path.name}, line 1: {wanted}, got {','.join(row)!r}")
    try:
        one, other = (_factor(cell, of) for cell, of in zip(row, si, strict=True))
    except ValueError as reason:
        wanted = f"must have units of {names[0]} and {names[1]}"
        raise SceneError(f"{path.name}, line 1: {wanted}, got: {reason}") from None
    return one, other


def _factor(cell: str, of: str) -> float:
    """SI units per unit of a column; 1 if its heading has no unit."""
    if found := re.search(r"\[(.*)\]|\((.*)\)", cell):
        unit = (found[1] or found[2] or "").strip()
        if unit in NO_UNIT:
            if of != "1":
                raise ValueError(f"{cell.strip()!r}, which has no unit; wanted is one of the kind of {of}")
            return 1.0
        if not NUMBER.fullmatch(f"1 {unit}"):
            raise ValueError(f"{unit!r} is not a unit; wanted is one of the kind of {of}")
        return si_number(f"1 {unit}", of)
    last = re.split(r"[\s_]", cell.strip())[-1]
    for word in (last, last.partition("/")[2]):  # n_rpm, n/rpm
        if len(word) > 1 and _is_unit(word, of):
            raise ValueError(f"{cell.strip()!r}; units stand in brackets, as in [{word}]")
    return 1.0


def _is_unit(word: str, of: str) -> bool:
    """Whether a word is a unit other than the SI unit of a column: a usual one, or any of its kind."""
    if word in USUAL:
        return USUAL[word] != (of, 1.0)
    try:
        return si_number(f"1 {word}", of) != 1.0
    except ValueError:
        return False


def with_tables(raw: Mapping[str, Any], folder: Path, hint: Any) -> tuple[dict[str, Any], list[Fault]]:
    """A raw scene of a type with curves read from the files that they name, and faults."""
    faults: list[Fault] = []

    def of(where: Where, value: Any, kind: Any) -> Any:
        if not isinstance(value, Mapping) or not isinstance(value.get("file"), str):
            return value
        try:
            for record in models(kind):
                if kind_of(record) in {None, value.get("kind")} and issubclass(record, Curve):
                    return with_curve(value, record, folder)
        except SceneError as error:
            faults.extend(fault.under(*where, "file") for fault in error.faults)
        return value

    read: dict[str, Any] = replaced(raw, hint, of)
    return read, faults


def with_curve(given: Mapping[str, Any], curve: type[Curve], folder: Path) -> Mapping[str, Any]:
    """A raw curve with the columns of its file, unless its other keys are faulty.

    If values may be of two kinds, the heading determines the kind, and each value gets its unit.
    """
    over = given.get("over", "time")
    if over not in curve.units or given.keys() & {"time", "at", "value"}:
        return given
    path = folder / given["file"]
    heading = next((row for row in file_text(path).splitlines() if row.strip()), "").lower()
    said = [word for word in curve.what if word in heading]
    word = said[0] if said else next(iter(curve.what))
    at, value = two_columns(path, (over, word), (curve.units[over], curve.what[word]))
    united = [f"{x!r} {curve.what[word]}" for x in value] if said and len(curve.what) > 1 else value
    rest = {key: x for key, x in given.items() if key != "file"}
    return {**rest, "over": over, "time" if over == "time" else "at": at, "value": united}
