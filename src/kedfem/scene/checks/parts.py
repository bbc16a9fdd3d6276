"""A scene under validation: its tables as given, and the records of valid ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from kedfem.errors import Fault
from kedfem.scene.checks.hints import below
from kedfem.scene.records.analysis import Analysis, Output
from kedfem.scene.records.materials import BUILT_IN
from kedfem.scene.records.points import XYZ
from kedfem.scene.records.scene import Scene

TABLES = ("links", "joints", "loads", "bodies", "motors", "springs", "limits", "drives", "gears")


@cache
def adapter(*keys: str) -> TypeAdapter[Any]:
    """Pydantic's check of the input at a place of the scene."""
    hint: Any = Scene
    for key in keys:
        hint = below(hint, key, {})
    return TypeAdapter(hint)


def record_of(raw: Any, *keys: str) -> Any:
    """The record of the input at a place; None if it has a fault."""
    try:
        return adapter(*keys).validate_python(raw)
    except ValidationError:
        return None


@dataclass(frozen=True, slots=True)
class Entry:
    """A part of the scene: its place, the given keys, and its record; None if that has a fault."""

    where: tuple[str | int, ...]
    raw: Mapping[str, Any]
    record: Any

    @property
    def name(self) -> str:
        """Its name."""
        return str(self.where[-1])

    def word(self, *path: str) -> str | None:
        """The given value of a key if it is a word; else None."""
        value = self.given(*path)
        return value if isinstance(value, str) else None

    def has(self, *path: str) -> bool:
        """Whether a key is given."""
        return self.given(*path) is not None

    def given(self, *path: str) -> Any:
        """The given value of a key; None if it is absent."""
        value: Any = self.raw
        for key in path:
            value = value.get(key) if isinstance(value, Mapping) else None
        return value

    def fault(self, key: str, message: str, *inner: str | int) -> Fault:
        """A fault of one of its keys."""
        return Fault((*self.where, key, *inner), message)


NONE = Entry((), {}, None)
"""An absent part."""


@dataclass(frozen=True, slots=True)
class Parts:
    """A scene under validation: its entries by name, known materials and the folder of its files."""

    links: dict[str, Entry]
    joints: dict[str, Entry]
    loads: dict[str, Entry]
    bodies: dict[str, Entry]
    motors: dict[str, Entry]
    springs: dict[str, Entry]
    limits: dict[str, Entry]
    probes: dict[str, Entry]
    drive: Entry
    drives: dict[str, Entry]
    gears: dict[str, Entry]
    analysis: Entry
    animation: Entry
    fatigue: Entry
    materials: list[str]
    raw: Mapping[str, Any]
    folder: Path
    sketch: bool
    good: Scene
    """the scene of the valid ones"""

    @property
    def driven(self) -> bool:
        """Whether the scene has a drive, valid or not."""
        return bool(self.all_drives)

    @property
    def all_drives(self) -> list[Entry]:
        """The drive or the drives."""
        return [*([self.drive] if self.drive.where else []), *self.drives.values()]

    @property
    def driven_joints(self) -> set[str]:
        """Names of the driven joints."""
        return {name for drive in self.all_drives if (name := drive.word("joint")) is not None}


def scene_parts(raw: Mapping[str, Any], scene: Scene | None, folder: Path, sketch: bool = False) -> Parts:
    """The parts of a raw scene; called within `known_points`.

    Parameters
    ----------
    scene : the record of the whole scene; None if it has a fault, and each part is validated by itself
    folder : folder of the files that it names
    sketch : whether elastic links may lack shape and material
    """

    def found(*keys: str) -> tuple[Any, Any]:
        given: Any = raw
        record: Any = scene
        for key in keys:
            given = given.get(key) if isinstance(given, Mapping) else None
            record = getattr(record, key, None)
        return given, record

    def single(*keys: str) -> Entry:
        given, record = found(*keys)
        known = record if scene else record_of(given, *keys)
        return Entry(keys, given if isinstance(given, Mapping) else {}, known)

    def entries(*keys: str) -> dict[str, Entry]:
        given, records = found(*keys)
        named = given.items() if isinstance(given, Mapping) else ()
        return {
            str(name): Entry((*keys, str(name)), x, records[name] if scene else record_of(x, *keys, "NAME"))
            for name, x in named if isinstance(x, Mapping)
        }  # fmt: skip

    own = raw.get("materials")
    tables = {name: entries(name) for name in TABLES} | {"probes": entries("output", "probes")}
    drive, analysis = single("drive") if raw.get("drive") is not None else NONE, single("analysis")
    return Parts(
        **tables, drive=drive, analysis=analysis,
        animation=single("output", "animation"),
        fatigue=single("fatigue") if raw.get("fatigue") is not None else NONE,
        materials=[*(own if isinstance(own, Mapping) else ()), *BUILT_IN], raw=raw, folder=folder,
        sketch=sketch, good=scene or good_scene(tables, drive, analysis, record_of(raw.get("gravity"), "gravity")),
    )  # fmt: skip


def good_scene(tables: Mapping[str, Mapping[str, Entry]], drive: Entry, analysis: Entry, gravity: XYZ | None) -> Scene:
    """The scene of all valid records, for questions about it; an invalid analysis only has its frames."""
    good: dict[str, Any] = {
        section: {name: entry.record for name, entry in table.items() if entry.record is not None}
        for section, table in tables.items()
    }
    output = Output.model_construct(probes=good.pop("probes"))
    still = gravity or (0.0, 0.0, 0.0)
    asked = analysis.record or Analysis.model_construct(frames=analysis.word("frames"))
    return Scene.model_construct(**good, drive=drive.record, analysis=asked, gravity=still, output=output)


def category(link: Entry) -> str:
    """The model of a link as given; if it is left open, the model with which it is meshed."""
    given = link.word("model")
    if given not in {None, "auto"}:
        return str(given)
    return "beam" if link.word("shape", "kind") == "polyline" else "solid"


def link_names(joint: Entry) -> list[str]:
    """The names of a joint's links as given."""
    names = joint.raw.get("links")
    return [name for name in names if isinstance(name, str)] if isinstance(names, (list, tuple)) else []
