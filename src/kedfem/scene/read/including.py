"""`include`: the tables of other scene files, merged with those of a scene."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from kedfem.errors import SceneError
from kedfem.scene.checks.faults import record_faults
from kedfem.scene.read.files import renamed, toml_table
from kedfem.scene.records.base import FileName
from kedfem.scene.records.wording import shown

KEY = "include"
MOST_FILES = 100  # read for one scene: nested includes may grow exponentially
FILES: TypeAdapter[list[str]] = TypeAdapter(list[FileName])


def with_includes(
    raw: Mapping[str, Any], folder: Path, file: Path | None = None, allowed: Callable[[Path], bool] = lambda path: True
) -> dict[str, Any]:
    """A raw scene with the tables of the files that it includes.

    Tables are merged key by key; the scene's own keys come first, then those of later files. A table of another `kind`
    replaces the whole one. Names of files in an included file become relative to this folder.

    Parameters
    ----------
    raw : keys and values of the scene
    folder : folder to which its file names are relative
    file : the scene's own file
    allowed : whether a file may be read

    Raises
    ------
    SceneError
        A file cannot be read or must not be, includes itself, or there are too many.
    """
    read = 0

    def of(raw: Mapping[str, Any], beside: Path, within: tuple[Path, ...]) -> dict[str, Any]:
        """A table of keys from a file in the folder `beside`, relative to the scene's, with all that it includes."""
        nonlocal read
        base: dict[str, Any] = {}
        for name in named_files(raw.get(KEY)):
            path = folder / beside / name
            read += 1
            if not allowed(path):
                raise SceneError(f"{KEY}: must be within the scene's folder (--within), got {name!r}")
            if path.resolve() in within:
                circle = " → ".join(each.name for each in (*within, path.resolve()))
                raise SceneError(f"{KEY}: must not include itself, got {circle}")
            if read > MOST_FILES:
                raise SceneError(f"{KEY}: must read at most {MOST_FILES} files, got more")
            found, _ = toml_table(path)
            tables = of(found, (beside / name).parent, (*within, path.resolve()))
            base = joined(base, renamed(tables, Path(name).parent))
        return joined(base, {key: value for key, value in raw.items() if key != KEY})

    return of(raw, Path(), () if file is None else (file.resolve(),))


def named_files(given: object) -> list[str]:
    """The names of the files that a scene includes, one or a list."""
    if given is None:
        return []
    listed = [given] if isinstance(given, str) else given
    if not isinstance(listed, (list, tuple)):
        raise SceneError(f"{KEY}: must be the name of a scene file or a list of them, got {shown(given)}")
    try:
        return FILES.validate_python(listed)
    except ValidationError as error:
        raise SceneError(record_faults(error, list[FileName], listed, (KEY,))) from None


def joined(base: Mapping[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    """Two tables merged key by key; of other values, and of tables of different kinds, the second."""
    if "kind" in own and own["kind"] != base.get("kind", own["kind"]):
        return dict(own)
    out = {**base, **own}
    for key in base.keys() & own.keys():
        if isinstance(base[key], Mapping) and isinstance(own[key], Mapping):
            out[key] = joined(base[key], own[key])
    return out


def toml_text(table: Mapping[str, Any]) -> str:
    """A table of numbers, texts, lists and tables as TOML."""
    return "".join(f"{toml_string(key)} = {_value(value)}\n" for key, value in table.items())


def _value(x: Any) -> str:
    if isinstance(x, Mapping):
        return "{ " + ", ".join(f"{toml_string(key)} = {_value(value)}" for key, value in x.items()) + " }"
    if isinstance(x, list):
        return "[" + ", ".join(map(_value, x)) + "]"
    if isinstance(x, str):
        return toml_string(x)
    return json.dumps(x) if isinstance(x, (int, bool)) else str(x)


def toml_string(text: str) -> str:
    """A text in TOML's notation."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007F")
