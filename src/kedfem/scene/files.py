"""Files beside the scene: TOML text, parts and motion tables."""

from __future__ import annotations

import re
import stat
import tomllib
from collections.abc import Callable, Mapping
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from kedfem.errors import SceneError
from kedfem.scene.faults import fault_lines, place
from kedfem.scene.hints import Where
from kedfem.scene.loads import FACTOR_UNITS
from kedfem.scene.placing import Placement
from kedfem.scene.points import known_points
from kedfem.scene.shapes import PartGeometry
from kedfem.scene.units import si_number

MOST_TEXT = 50_000_000  # bytes of a scene, part or table
DEEPEST = 100  # tables in tables
DOTTED = re.compile(rf"\s*\[*\s*(?:[\w\-]+\s*\.\s*){{{DEEPEST},}}")
scene_folder: ContextVar[Path] = ContextVar("scene_folder", default=Path())
sketched: ContextVar[bool] = ContextVar("sketched", default=False)
"""Whether elastic links of the scene under validation may lack shape and material."""


def file_text(path: Path) -> str:
    """Text of a file, UTF-8 with or without a byte order mark.

    Raises
    ------
    SceneError
        No such file, not a file, not readable, not text.
    """
    try:
        found = path.stat()
        if not (stat.S_ISREG(found.st_mode) or stat.S_ISDIR(found.st_mode)):
            raise SceneError(f"{path}: must be a regular file, got a pipe or a device")
        if found.st_size > MOST_TEXT:
            raise SceneError(
                f"{path}: must be at most {MOST_TEXT / 1e6:g} MB, got {found.st_size / 1e6:.4g} MB"
            )
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise SceneError(f"{path}: must be a file, got nothing there") from None
    except UnicodeDecodeError as reason:
        raise SceneError(
            f"{path}: must be text in UTF-8, got other bytes at position {reason.start}"
        ) from None
    except ValueError:  # a zero byte in its name
        raise SceneError("must be a path without control characters, got one with a zero byte") from None
    except OSError as reason:
        raise SceneError(f"{path}: must be a readable file, got: {reason.strerror}") from None


def outside(raw: Any, folder: Path) -> list[str]:
    """Faults of all names of files and folders in a raw scene that lead out of its own folder, links followed."""
    names: list[tuple[str, str]] = []

    def noted(where: Where, name: str) -> str:
        names.append((place(where), name))
        return name

    _with_names(raw, (), noted)
    wanted = "must be within the scene's folder (--within)"
    return [f"{where}: {wanted}, got {name!r}" for where, name in names if not inside(folder, name)]


def renamed(raw: Mapping[str, Any], beside: Path) -> dict[str, Any]:
    """A raw scene with its names of files made relative to the folder that its own is `beside` of."""
    changed: dict[str, Any] = _with_names(raw, (), lambda where, name: str(beside / name) if name else name)
    return changed


def _with_names(x: Any, where: Where, of: Callable[[Where, str], str]) -> Any:
    """Raw input with something in place of its names of files and folders."""
    if isinstance(x, list):
        return [_with_names(each, (*where, k), of) for k, each in enumerate(x)]
    if isinstance(x, Mapping):
        return {key: _with_names(each, (*where, str(key)), of) for key, each in x.items()}
    names = where and isinstance(x, str) and (where[-1] in {"file", "folder"} or is_step_file(where))
    return of(where, x) if names else x


def is_step_file(where: Where) -> bool:
    """Whether a key is the CAD file of a link, not the step of an analysis."""
    inner = where[2:] if where and where[0] == "patterns" else where
    return len(inner) == 3 and inner[0] == "links" and inner[2] == "step"


def inside(folder: Path, name: str | Path) -> bool:
    """Whether a file is in a folder, links followed."""
    try:
        return (folder / name).resolve().is_relative_to(folder.resolve())
    except (ValueError, OSError, RuntimeError):  # no name of a file at all, or links in a circle
        return False


def toml_table(path: Path) -> tuple[dict[str, Any], str]:
    """Content and text of a TOML file.

    Raises
    ------
    SceneError
        Not readable, empty or not TOML; the line is named.
    """
    text = file_text(path)
    for k, line in enumerate(text.splitlines(), start=1):
        if DOTTED.match(line):
            raise SceneError(f"{path}, line {k}: must be nested less than {DEEPEST} deep, got more")
    try:
        table = tomllib.loads(text)
    except RecursionError:
        raise SceneError(f"{path}: must be nested less than {DEEPEST} deep, got more") from None
    except tomllib.TOMLDecodeError as reason:
        found = re.search(r"^(.*) \(at line (\d+), column (\d+)\)$", str(reason), re.DOTALL)
        number = found[2] if found else str(len(text.splitlines()))
        raise SceneError(
            f"{path}, line {number}: must be valid TOML, got: {found[1] if found else str(reason)}"
        ) from None
    if not table:
        raise SceneError(f"{path}: must hold at least one key, got an empty file")
    return table, text


def part_geometry(path: Path) -> PartGeometry:
    """The geometry of a part from its TOML file; may hold a table of `points` of its own, like a scene.

    Raises
    ------
    SceneError
        With all faults of the file, each preceded by its name.
    """
    raw, _ = toml_table(path)
    placement = Placement(raw.get("points"), {})
    placement.place_all()
    faults = placement.faults
    shape = {key: value for key, value in raw.items() if key != "points"}
    try:
        with known_points(placement):
            part = PartGeometry.model_validate(shape)
    except ValidationError as error:
        faults = faults + fault_lines(error, PartGeometry, shape)
    if faults:
        raise SceneError([f"{path.name}: {fault}" for fault in faults])
    return part


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


def with_motion_tables(raw: Mapping[str, Any], folder: Path) -> tuple[dict[str, Any], list[str]]:
    """A raw scene with the motion tables of its drives read from the files that they name; and faults."""
    read: dict[str, Any] = dict(raw)
    faults: list[str] = []
    if isinstance(raw.get("drive"), Mapping):
        read["drive"], faults = _with_motion_table("drive", raw["drive"], folder)
    if isinstance(raw.get("drives"), Mapping):
        tables = {
            name: _with_motion_table(f"drives.{name}", each, folder) for name, each in raw["drives"].items()
        }
        read["drives"] = {name: drive for name, (drive, _) in tables.items()}
        faults = faults + [fault for _, found in tables.values() for fault in found]
    return read, faults


def _with_motion_table(where: str, drive: Any, folder: Path) -> tuple[Any, list[str]]:
    motion = drive.get("motion") if isinstance(drive, Mapping) else None
    if not isinstance(motion, Mapping):
        return drive, []
    named = motion.get("kind") == "table" and isinstance(motion.get("file"), str)
    if not named or any(key in motion for key in ("time", "angle", "travel")):
        return drive, []
    try:
        time, key, values = motion_table(folder / motion["file"])
    except SceneError as error:
        return drive, [f"{where}.motion.file: {fault}" for fault in error.faults]
    others = {name: value for name, value in motion.items() if name != "file"}
    return {**drive, "motion": {**others, "time": time, key: values}}, []


def with_factor_tables(raw: Mapping[str, Any], folder: Path) -> tuple[dict[str, Any], list[str]]:
    """A raw scene with the factors of its loads and springs read from the files that they name; and faults."""
    read, faults = dict(raw), list[str]()
    for section, key in (("loads", "factor"), ("springs", "stiffness_factor")):
        if isinstance(raw.get(section), Mapping):
            read[section], more = _with_factors(raw[section], section, key, folder)
            faults += more
    return read, faults


def _with_factors(
    every: Mapping[str, Any], section: str, key: str, folder: Path
) -> tuple[dict[str, Any], list[str]]:
    """The same of one section: its tables by name, their factors under `key`."""
    read, faults = dict(every), list[str]()
    for name, each in every.items():
        factor = each.get(key) if isinstance(each, Mapping) else None
        if not isinstance(factor, Mapping) or not isinstance(factor.get("file"), str):
            continue
        over = factor.get("over", "time")
        if over not in FACTOR_UNITS or factor.keys() & {"time", "at", "value"}:
            continue
        try:
            at, value = two_columns(folder / factor["file"], (over, "factor"), (FACTOR_UNITS[over].unit, "1"))
        except SceneError as error:
            faults += [f"{section}.{name}.{key}.file: {fault}" for fault in error.faults]
            continue
        table = {word: x for word, x in factor.items() if word != "file"}
        read[name] = {**each, key: {**table, "over": over, "at": at, "value": value}}
    return read, faults
