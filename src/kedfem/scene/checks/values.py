"""Checks by the types of keys: names that must exist, and numbers without a unit that may be in a wrong one."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, get_args, get_origin

from kedfem.errors import Fault, place
from kedfem.scene.checks.hints import marks, members, walk
from kedfem.scene.checks.parts import Parts
from kedfem.scene.records.base import NameOf
from kedfem.scene.records.links import GROUND
from kedfem.scene.records.scene import Scene
from kedfem.scene.records.units import RPM, Quantity
from kedfem.scene.records.wording import unknown_name


def reference_faults(parts: Parts) -> Iterator[Fault]:
    """Names of links, joints and materials that do not exist; a missing table is a fault of its own."""
    known = {"links": [*parts.links], "joints": [*parts.joints], "materials": parts.materials}
    for where, value, hint in walk(parts.raw, Scene):
        names = [(where, value, hint)] if isinstance(value, str) and str in members(hint) else []
        if isinstance(value, dict) and (keys := key_hint(hint)):
            names = [((*where, name), name, keys) for name in value]
        for at, name, kind in names:
            for of in marks(kind, NameOf):
                wanted = [*known[of.section], *([GROUND] if of.ground else [])]
                if known[of.section] and name not in wanted:
                    yield Fault(at, unknown_name(of.what, name, wanted))


def key_hint(hint: Any) -> Any:
    """The type of the names of a table's entries."""
    return next((get_args(part)[0] for part in members(hint) if get_origin(part) is dict), None)


TURN = 2.0 * math.pi
FAST = 60.0  # rad/s or m/s from which a round number is probably in rpm or mm/s


def bare_numbers(raw: Any, hint: Any) -> Iterator[str]:
    """Warnings about numbers without a unit in valid raw input, except for those in lists."""
    for where, value, inner in walk(raw, hint):
        if isinstance(value, (int, float)) and abs(value) < 1e300 and isinstance(where[-1], str):
            units = {quantity.unit for quantity in marks(inner, Quantity)}
            yield from unit_warnings(place(where), float(value), units)


def unit_warnings(where: str, value: float, units: set[str]) -> Iterator[str]:
    """Warnings about a number without a unit that is probably in another one."""
    fast = abs(value) >= FAST and value % 10 == 0
    for unit, suspicious, read, what, other in (
        ("rad", abs(value) > TURN, f"in radians, {math.degrees(value):.4g}°", "degrees", "deg"),
        ("rad/s", fast, f"in rad/s, {value * RPM:.4g} rpm", "rpm", "rpm"),
        ("m/s", fast, "in m/s", "mm/s", "mm/s"),
    ):
        if units == {unit} and suspicious:
            instead = f"if {what} are meant write '{value:g} {other}', else '{value:g} {unit}'"
            yield f"{where}: {value:g} without a unit is {read}; {instead}"
