"""A scene under validation: what it says, and those of its parts that are good already."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from kedfem.scene.analysis import Analysis, Animation, Probe
from kedfem.scene.damping import Damping
from kedfem.scene.drives import Drive, Gear
from kedfem.scene.fatigue import Fatigue
from kedfem.scene.faults import line
from kedfem.scene.links import Joint, LinkScene
from kedfem.scene.loads import Body, Load
from kedfem.scene.materials import BUILT_IN
from kedfem.scene.motors import Motor
from kedfem.scene.springs import Spring
from kedfem.scene.stops import Limit

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


@cache
def adapter(section: str) -> TypeAdapter[Any]:
    """The check of one entry of a section."""
    return TypeAdapter(TYPES[section])


def good(section: str, raw: Any) -> Any:
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

    def fault(self, key: str, message: str, *inner: str | int) -> str:
        """A fault line about one of its keys."""
        return line((*self.where, key, *inner), message)


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
    gravity: tuple[float, ...]
    materials: list[str]
    folder: Path

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
        str(name): Entry((*above, section, str(name)), value, good(section, value))
        for name, value in found
        if isinstance(value, Mapping)
    }


def single(section: str, raw: Any, *above: str) -> Entry:
    """A section that is one table."""
    return Entry((*above, section), raw if isinstance(raw, Mapping) else {}, good(section, raw))


def scene_parts(raw: Mapping[str, Any], gravity: tuple[float, ...], folder: Path) -> Parts:
    """The parts of a raw scene; to be called where the names of its points are known."""
    output = raw.get("output")
    own = raw.get("materials")
    return Parts(
        links=entries("links", raw.get("links")),
        joints=entries("joints", raw.get("joints")),
        loads=entries("loads", raw.get("loads")),
        bodies=entries("bodies", raw.get("bodies")),
        motors=entries("motors", raw.get("motors")),
        springs=entries("springs", raw.get("springs")),
        limits=entries("limits", raw.get("limits")),
        probes=entries("probes", output.get("probes") if isinstance(output, Mapping) else None, "output"),
        drive=single("drive", raw.get("drive")) if raw.get("drive") is not None else NONE,
        drives=entries("drives", raw.get("drives")),
        gears=entries("gears", raw.get("gears")),
        damping=single("damping", raw.get("damping")),
        analysis=single("analysis", raw.get("analysis")),
        animation=single(
            "animation", output.get("animation") if isinstance(output, Mapping) else None, "output"
        ),
        fatigue=single("fatigue", raw.get("fatigue")) if raw.get("fatigue") is not None else NONE,
        gravity=gravity,
        materials=[*(own if isinstance(own, Mapping) else ()), *BUILT_IN],
        folder=folder,
    )


def fidelity(link: Entry) -> str:
    """The fidelity of a link as given; of one that leaves it open what it is meshed as."""
    given = link.word("fidelity") or "solid"
    if given not in {"reduced", "auto"}:
        return given
    return "beam" if link.word("shape", "kind") == "polyline" else "solid"


def link_names(joint: Entry) -> list[str]:
    """The names of the links that a joint joins, as given."""
    names = joint.raw.get("links")
    return [name for name in names if isinstance(name, str)] if isinstance(names, (list, tuple)) else []
