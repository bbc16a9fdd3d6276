"""Files of a scene: TOML texts, parts, and the files that it names."""

from __future__ import annotations

import math
import re
import stat
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from kedfem.errors import Fault, SceneError, Where
from kedfem.scene.checks.faults import record_faults
from kedfem.scene.checks.hints import replaced, walk
from kedfem.scene.checks.parts import Parts
from kedfem.scene.questions.geometry_files import with_named
from kedfem.scene.read.placing import Placement
from kedfem.scene.records.points import known_points
from kedfem.scene.records.shapes import Cad, MeshFile, Part, PartGeometry

MOST_TEXT = 50_000_000  # bytes of a scene, part or table
DEEPEST = 100  # nesting of tables
DOTTED = re.compile(rf"\s*\[*\s*(?:[\w\-]+\s*\.\s*){{{DEEPEST},}}")


def file_text(path: Path) -> str:
    """Text of a file in UTF-8, with or without a byte order mark; a SceneError if it cannot be read."""
    try:
        found = path.stat()
        if not (stat.S_ISREG(found.st_mode) or stat.S_ISDIR(found.st_mode)):
            raise SceneError(f"{path}: must be a regular file, got a pipe or a device")
        if found.st_size > MOST_TEXT:
            got = f"got {found.st_size / 1e6:.4g} MB"
            raise SceneError(f"{path}: must be at most {MOST_TEXT / 1e6:g} MB, {got}")
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise SceneError(f"{path}: must be a file, got nothing there") from None
    except UnicodeDecodeError as reason:
        got = f"got other bytes at position {reason.start}"
        raise SceneError(f"{path}: must be text in UTF-8, {got}") from None
    except ValueError:  # a zero byte in its name
        raise SceneError("must be a path without control characters, got one with a zero byte") from None
    except OSError as reason:
        raise SceneError(f"{path}: must be a readable file, got: {reason.strerror}") from None


def outside(raw: Any, folder: Path) -> list[Fault]:
    """Faults of all names of files and folders in a raw scene that are outside of its folder, with links resolved."""
    wanted = "must be within the scene's folder (--within)"
    named = ((where, x) for where, x, _ in walk(raw, None) if names_file(where, x))
    return [Fault(where, f"{wanted}, got {got}") for where, x in named if (got := _outside(folder, x))]


def _outside(folder: Path, name: str) -> str:
    """How a file, or one that it names, is called if it is outside of a folder; empty if none is."""
    if not inside(folder, name):
        return repr(name)
    return next((f"{name!r}, which names {x}" for x in with_named(folder / name) if not inside(folder, x)), "")


def renamed(raw: Mapping[str, Any], beside: Path) -> dict[str, Any]:
    """A raw scene with names of files relative to another folder, from which its own has the path `beside`."""
    changed: dict[str, Any] = replaced(
        raw, None, lambda where, x, _: str(beside / x) if x and names_file(where, x) else x
    )
    return changed


def names_file(where: Where, value: Any) -> bool:
    """Whether raw input is the name of a file or folder."""
    return isinstance(value, str) and where[-1:] in {("file",), ("folder",)}


def inside(folder: Path, name: str | Path) -> bool:
    """Whether a file is in a folder, with links resolved."""
    try:
        return (folder / name).resolve().is_relative_to(folder.resolve())
    except (ValueError, OSError, RuntimeError):  # not a file name, or circular links
        return False


def toml_table(path: Path) -> tuple[dict[str, Any], str]:
    """Content and text of a TOML file; a SceneError names the line that is not valid."""
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
        number, got = (found[2], found[1]) if found else (len(text.splitlines()), reason)
        raise SceneError(f"{path}, line {number}: must be valid TOML, got: {got}") from None
    if not table:
        raise SceneError(f"{path}: must hold at least one key, got an empty file")
    return table, text


def part_geometry(path: Path) -> PartGeometry:
    """The geometry of a part from its TOML file, which may have its own table of `points`, like a scene.

    A SceneError has all faults of the file, each preceded by the file's name.
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
        faults = faults + record_faults(error, PartGeometry, shape)
    if faults:
        raise SceneError(Fault((), f"{path.name}: {fault}") for fault in faults)
    return part


def file_faults(parts: Parts) -> Iterator[Fault]:
    """Missing files of shapes, and parts that do not fit between their points."""
    for link in parts.links.values():
        shape = link.record.shape if link.record is not None else None
        if isinstance(shape, Cad | MeshFile) and not (parts.folder / shape.file).is_file():
            what = "CAD" if isinstance(shape, Cad) else "mesh"
            yield link.fault("shape", f"must be a {what} file, got nothing at {parts.folder / shape.file}", "file")
        if isinstance(shape, Part):
            try:
                part = part_geometry(parts.folder / shape.file)
            except SceneError as error:
                yield from (link.fault("shape", str(fault), "file") for fault in error.faults)
                continue
            wanted, got = math.dist(*shape.between), math.dist(part.origin, part.x_point)
            if abs(wanted - got) > 1e-6 * got:
                message = f"must be as far apart as origin and x_point of the part {got:.9g} [m]"
                yield link.fault("shape", f"{message}, got {wanted:.9g}", "between")
