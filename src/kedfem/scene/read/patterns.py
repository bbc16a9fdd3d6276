"""`patterns` of a scene: tables that are repeated, rotated about an axis or shifted, written out."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, get_args, get_origin

import numpy as np
from pydantic import ValidationError
from pydantic_core import PydanticCustomError

from kedfem.errors import Fault, Where
from kedfem.scene.checks.faults import record_faults
from kedfem.scene.checks.hints import below, marks, members
from kedfem.scene.records.base import NameOf
from kedfem.scene.records.loads import inertia_tensor, moments_of_inertia
from kedfem.scene.records.patterns import SECTIONS, Pattern
from kedfem.scene.records.points import XYZ
from kedfem.scene.records.shapes import STEEP, Bar, Polyline, with_kind
from kedfem.scene.records.units import Quantity

BY_LINK = ("at", "coupling", "faces")  # keys of joints that may have a table by links
FLAT = ("plate_link", "extrusion", "part")  # shapes whose thickness is along z
LEVEL = {"angle": "an angle", "distances": "distances", "offset": "an offset"}  # of points, in the xy plane
PLACED, LINES = ("cad", "mesh"), ("bar", "polyline")
FACTORS = ("factor", "stiffness_factor")
ANGLE, INERTIA = Quantity("rad"), Quantity("kg*m^2")
Tables = dict[str, Any]


@dataclass(frozen=True)
class _Copy:
    """One copy of a pattern's tables: the pattern, and the copy's number from 0."""

    pattern: Pattern
    number: int

    @property
    def R(self) -> np.ndarray:
        """Its rotation, (3, 3), by Rodrigues' formula."""
        x, y, z = self.pattern.about
        K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        angle = self.number * self.pattern.rotation
        return np.asarray(np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K)

    def called(self, section: str, name: str) -> str:
        """The name of an entry in this copy; unchanged if it is not one of the pattern's entries."""
        return f"{name}_{self.number + 1}" if name in getattr(self.pattern, section) else name

    def of(self, value: Any, hint: Any, key: str) -> Any:
        """A raw value of this copy."""
        unit = _triple(hint)
        if isinstance(value, str):
            return self._word(value, unit, hint)
        if isinstance(value, list):
            if unit is not None and len(value) in (2, 3):
                return self._vector(value, unit)
            return [self.of(x, below(hint, k, value), key) for k, x in enumerate(value)]
        if not isinstance(value, Mapping):
            return value
        made = {
            self.called("links", name) if key in BY_LINK else name: self.of(x, below(hint, name, value), name)
            for name, x in value.items()
        }
        if unit == "m":
            level = [key for key in LEVEL if key in value]
            if level and self.pattern.rotation and self.pattern.about != (0.0, 0.0, 1.0):
                wanted = "must be coordinates in a pattern rotated about another axis than z"
                raise ValueError(f"{wanted}, got {LEVEL[level[0]]}")
            if "angle" in value:
                made["angle"] = ANGLE.number(value["angle"]) + self.number * self.pattern.rotation
        if key in FACTORS and self.pattern.phase and value.get("over") == "angle":
            if "at" not in value:
                raise ValueError("must have its angles in a list in a pattern with a phase, got a file")
            made["at"] = [ANGLE.number(x) + self.number * self.pattern.phase for x in value["at"]]
        return made

    def _word(self, text: str, unit: str | None, hint: Any) -> Any:
        if unit == "m":
            section, dot, name = text.partition(".")
            of_joint = dot and section == "joints"
            return f"joints.{self.called('joints', name)}" if of_joint else self.called("points", text)
        if unit == "1" and text in ("x", "y", "z") and self.pattern.rotation:
            return (self.R @ np.eye(3)["xyz".index(text)]).tolist()
        sections = {each.section for each in marks(hint, NameOf)} & {"links", "joints"}
        return self.called(sections.pop(), text) if sections else text

    def _vector(self, value: list[Any], unit: str) -> Any:
        x = np.array([Quantity(unit).number(each) for each in (*value, 0.0)[:3]])
        if unit != "m":
            return (self.R @ x).tolist() if self.pattern.rotation else x.tolist()
        centre = np.array(self.pattern.centre)
        return (centre + self.R @ (x - centre) + self.number * np.array(self.pattern.shift)).tolist()

    def completed(self, section: str, raw: Any, made: Any) -> Any:
        """An entry with defaults that must move with the copy; a ValueError if it cannot be moved."""
        if not isinstance(raw, Mapping):
            return made
        shape = with_kind(raw.get("shape")) if section == "links" else None
        kind = shape.get("kind") if isinstance(shape, Mapping) else None
        if not self.pattern.rotation:
            if kind in PLACED and "origin" not in (shape or {}):  # in coordinates of the scene, which are shifted
                made = {**made, "shape": {**made["shape"], "origin": self._vector([0.0, 0.0, 0.0], "m")}}
            return made
        tilted = not np.allclose(self.R[:, 2], [0, 0, 1])
        if section == "joints":
            bushing = raw.get("bushing")
            if isinstance(bushing, Mapping) and any(isinstance(x, list) for x in bushing.values()):
                wanted = "must have a bushing alike in all directions in a pattern that rotates"
                raise ValueError(f"{wanted}, got three numbers")
            if raw.get("kind") == "revolute" and "axis" not in raw and tilted:
                made = {**made, "axis": self.R[:, 2].tolist()}
        inertia = raw.get("inertia") if section in {"bodies", "links"} else None
        if isinstance(inertia, list) and len(inertia) in {3, 6}:
            J = inertia_tensor([*map(INERTIA.number, inertia), 0.0, 0.0, 0.0][:6])
            made = {**made, "inertia": list(moments_of_inertia(self.R @ J @ self.R.T))}
        about = "in a pattern rotated about another axis than z"
        if kind in PLACED:
            wanted = "must not be a part of a file in a pattern that rotates"
            raise ValueError(f"{wanted}, got one of kind {kind!r}")
        if kind in FLAT and tilted:
            raise ValueError(f"must be a bar or a polyline {about}, got {kind!r}")
        if kind in LINES and "up" not in (shape or {}) and tilted:
            raise ValueError(f"must have a shape with `up` {about}, got none")
        return made


def _triple(hint: Any) -> str | None:
    """The unit of a type of three numbers: m for points, 1 for axes; None for other types."""
    for part in members(hint):
        inner = get_args(part) if get_origin(part) is tuple else ()
        if len(inner) == 3 and float in members(inner[0]):
            return next((x.unit for x in marks(part, Quantity)), None)
    return None


def with_patterns(raw: Mapping[str, Any], hint: Any) -> tuple[Tables, list[Fault], dict[Where, Where]]:
    """A raw scene of a type with its patterns written out.

    Returns
    -------
    A changed copy without patterns; faults; and the place in a pattern of each table that was made, by its own place.
    """
    given = raw.get("patterns")
    if not isinstance(given, Mapping):
        return dict(raw), [], {}
    out = {key: x for key, x in raw.items() if key != "patterns"}
    faults, origins = list[Fault](), dict[Where, Where]()
    for name, each in given.items():
        where: Where = ("patterns", str(name))
        try:
            pattern = Pattern.model_validate(each)
        except ValidationError as error:
            faults += record_faults(error, Pattern, each, where)
            continue
        if pattern.phase and not _phased(pattern):
            wanted = "must be of factors over the drive's angle, of loads or springs"
            faults.append(Fault((*where, "phase"), f"{wanted}, got none of these"))
        for section in SECTIONS:
            for entry, value in getattr(pattern, section).items():
                faults += _repeated(out, origins, pattern, (*where, section, entry), value, hint)
    return out, faults, origins


def _phased(pattern: Pattern) -> bool:
    """Whether a pattern has a factor that its phase moves."""
    entries = [x for x in (*pattern.loads.values(), *pattern.springs.values()) if isinstance(x, Mapping)]
    factors = [x.get(key) for x in entries for key in FACTORS]
    return any(isinstance(x, Mapping) and x.get("over") == "angle" for x in factors)


def _repeated(
    out: Tables, origins: dict[Where, Where], pattern: Pattern, where: Where, value: Any, hint: Any
) -> list[Fault]:
    """Put all copies of one entry into a scene's tables; returns faults."""
    section, entry = str(where[-2]), str(where[-1])
    above = ("output", "probes") if section == "probes" else (section,)
    tables, kind = out, hint
    for key in above:
        inner = tables.get(key)
        if inner is not None and not isinstance(inner, Mapping):
            return []  # a fault of its own
        tables[key] = dict(inner or {})
        tables, kind = tables[key], below(kind, key, tables)
    kind = below(kind, entry, tables)
    for number in range(pattern.count):
        copy, made = _Copy(pattern, number), f"{entry}_{number + 1}"
        if made in tables:
            return [Fault(where, f"must have a name that is free with its number, got {made!r} twice")]
        try:
            whole = copy.of(value, kind, "at" if section == "points" else "")
            tables[made] = copy.completed(section, value, whole)
        except (ValueError, PydanticCustomError) as reason:
            text = reason.message() if isinstance(reason, PydanticCustomError) else str(reason)
            return [Fault(where, text)]
        origins[*above, made] = where
    return []


def in_pattern(fault: Fault, origins: Mapping[Where, Where]) -> Fault:
    """The fault at the place in the pattern from which its table was made, if it was made from one."""
    for made, origin in origins.items():
        if fault.where[: len(made)] == made:
            return Fault((*origin, *fault.where[len(made) :]), fault.message)
    return fault


def steep_faults(links: Mapping[str, Any], given: object) -> list[Fault]:
    """Steep lines of patterns without `up`: their sections would not rotate with the copies, as x is up by default."""
    found = []
    for name, each in given.items() if isinstance(given, Mapping) else ():
        pattern = Pattern.model_validate(each)
        for link in pattern.links if pattern.rotation else ():
            shape, raw = links[f"{link}_1"].shape, pattern.links[link].get("shape")
            lacks_up = isinstance(raw, Mapping) and "up" not in raw
            if isinstance(shape, Bar | Polyline) and lacks_up and _steep(shape):
                wanted = "must have a shape with `up` where it is steep in a pattern that rotates, got none"
                found.append(Fault(("patterns", str(name), "links", link), wanted))
    return found


def _steep(shape: Bar | Polyline) -> bool:
    points: tuple[XYZ, ...] = shape.between if isinstance(shape, Bar) else shape.points
    return any(abs(q[2] - p[2]) >= STEEP * math.dist(p, q) for p, q in pairwise(points))
