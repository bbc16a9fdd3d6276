"""A scene under validation: what it says, and those of its parts that are good already."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from kedfem.errors import Fault
from kedfem.scene.records.analysis import Analysis, Animation, Output, Probe
from kedfem.scene.records.damping import Damping
from kedfem.scene.records.drives import Drive, Gear
from kedfem.scene.records.fatigue import Fatigue
from kedfem.scene.records.force_elements import Limit, Motor, Spring
from kedfem.scene.records.joints import Joint
from kedfem.scene.records.links import LinkScene
from kedfem.scene.records.loads import Body, Load
from kedfem.scene.records.materials import BUILT_IN
from kedfem.scene.records.points import XYZ
from kedfem.scene.records.scene import Scene

TYPES: dict[str, Any] = {
    "links": LinkScene,
    "joints": Joint,
    "loads": Load,
    "bodies": Body,
    "motors": Motor,
    "springs": Spring,
    "limits": Limit,
    "probes": Probe,
    "drive": Drive,
    "drives": Drive,
    "gears": Gear,
    "damping": Damping,
    "analysis": Analysis,
    "animation": Animation,
    "fatigue": Fatigue,
}
TABLES = ("links", "joints", "loads", "bodies", "motors", "springs", "limits", "drives", "gears")


@cache
def adapter(section: str) -> TypeAdapter[Any]:
    """The check of one entry of a section."""
    return TypeAdapter(TYPES[section])


def record_of(section: str, raw: Any) -> Any:
    """The record of an entry, or None if it has a fault."""
    try:
        return adapter(section).validate_python(raw)
    except ValidationError:
        return None


@dataclass(frozen=True, slots=True)
class Entry:
    """A part of the scene: its place, what was given, and the record if that is good."""

    where: tuple[str | int, ...]
    raw: Mapping[str, Any]
    record: Any

    @property
    def name(self) -> str:
        """Its name."""
        return str(self.where[-1])

    def word(self, *path: str) -> str | None:
        """What a key holds, as given, if it is a word."""
        value: Any = self.raw
        for key in path:
            value = value.get(key) if isinstance(value, Mapping) else None
        return value if isinstance(value, str) else None

    def has(self, *path: str) -> bool:
        """Whether a key is given."""
        value: Any = self.raw
        for key in path:
            value = value.get(key) if isinstance(value, Mapping) else None
        return value is not None

    def fault(self, key: str, message: str, *inner: str | int) -> Fault:
        """A fault of one of its keys."""
        return Fault((*self.where, key, *inner), message)


NONE = Entry((), {}, None)
"""What is not there."""


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
    damping: Entry
    analysis: Entry
    animation: Entry
    fatigue: Entry
    gravity: XYZ
    materials: list[str]
    folder: Path
    sketch: bool
    good: Scene
    """the scene of those of them that are good already"""

    @property
    def driven(self) -> bool:
        """Whether the scene has a drive, be it a good one or not."""
        return bool(self.all_drives)

    @property
    def all_drives(self) -> list[Entry]:
        """The drive or the drives."""
        return [*([self.drive] if self.drive.where else []), *self.drives.values()]

    @property
    def driven_joints(self) -> set[str]:
        """Names of the joints that are to be driven."""
        return {name for drive in self.all_drives if (name := drive.word("joint")) is not None}


def entries(section: str, raw: Any, *above: str) -> dict[str, Entry]:
    """The entries of a section that are tables, by name."""
    found = raw.items() if isinstance(raw, Mapping) else ()
    return {
        str(name): Entry((*above, section, str(name)), value, record_of(section, value))
        for name, value in found
        if isinstance(value, Mapping)
    }


def single(section: str, raw: Any, *above: str) -> Entry:
    """A section that is one table."""
    return Entry((*above, section), raw if isinstance(raw, Mapping) else {}, record_of(section, raw))


def scene_parts(raw: Mapping[str, Any], gravity: XYZ, folder: Path, sketch: bool = False) -> Parts:
    """The parts of a raw scene; to be called where the names of its points are known."""
    output = raw.get("output")
    own = raw.get("materials")
    animation = output.get("animation") if isinstance(output, Mapping) else None
    probes = output.get("probes") if isinstance(output, Mapping) else None
    tables = {name: entries(name, raw.get(name)) for name in TABLES}
    tables["probes"] = entries("probes", probes, "output")
    drive = single("drive", raw.get("drive")) if raw.get("drive") is not None else NONE
    return Parts(
        **tables,
        drive=drive,
        damping=single("damping", raw.get("damping")),
        analysis=single("analysis", raw.get("analysis")),
        animation=single("animation", animation, "output"),
        fatigue=single("fatigue", raw.get("fatigue")) if raw.get("fatigue") is not None else NONE,
        gravity=gravity,
        materials=[*(own if isinstance(own, Mapping) else ()), *BUILT_IN],
        folder=folder,
        sketch=sketch,
        good=good_scene(tables, drive, gravity),
    )


def good_scene(tables: Mapping[str, Mapping[str, Entry]], drive: Entry, gravity: XYZ) -> Scene:
    """The scene of all records without a fault, for questions about it; without its analysis."""
    good: dict[str, Any] = {
        section: {name: entry.record for name, entry in table.items() if entry.record is not None}
        for section, table in tables.items()
    }
    output = Output.model_construct(probes=good.pop("probes"))
    return Scene.model_construct(**good, drive=drive.record, gravity=gravity, output=output)


def category(link: Entry) -> str:
    """What a link is, as given; of one that leaves it open what it is meshed as."""
    given = link.word("model")
    if given not in {None, "auto"}:
        return str(given)
    return "beam" if link.word("shape", "kind") == "polyline" else "solid"


def link_names(joint: Entry) -> list[str]:
    """The names of the links that a joint joins, as given."""
    names = joint.raw.get("links")
    return [name for name in names if isinstance(name, str)] if isinstance(names, (list, tuple)) else []
