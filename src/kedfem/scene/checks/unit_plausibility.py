"""Bare numbers that were probably meant in another unit than SI: angles in degrees, speeds in rpm or mm/s."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from kedfem.errors import Where, place
from kedfem.scene.checks.hints import below, quantities
from kedfem.scene.records.units import RPM

TURN = 2.0 * math.pi
FAST = (
    60.0  # rad/s, from which a round number is rather one of rpm, or m/s, from which it is rather one of mm/s
)


def bare_numbers(raw: Any, hint: Any, where: Where = ()) -> Iterator[str]:
    """Doubts about numbers without a unit in raw input that was found good; lists of numbers are not examined.

    Parameters
    ----------
    raw : the input
    hint : its type, a record
    where : its place in the scene
    """
    items = raw.items() if isinstance(raw, Mapping) else enumerate(raw)
    for key, value in items:
        inner = below(hint, key, raw)
        if inner is None:
            continue
        if isinstance(value, (Mapping, list)):
            yield from bare_numbers(value, inner, (*where, key))
        elif isinstance(value, (int, float)) and abs(value) < 1e300 and isinstance(raw, Mapping):
            units = {quantity.unit for quantity in quantities(inner)}
            yield from doubts(place((*where, key)), float(value), units)


def doubts(where: str, value: float, units: set[str]) -> Iterator[str]:
    """What is doubtful about one bare number of a quantity."""
    if units == {"rad"} and abs(value) > TURN:
        yield (
            f"{where}: {value:g} without a unit is in radians, {math.degrees(value):.4g}°; "
            f"if degrees are meant write '{value:g} deg', else '{value:g} rad'"
        )
    if units == {"rad/s"} and abs(value) >= FAST and value % 10 == 0:
        yield (
            f"{where}: {value:g} without a unit is in rad/s, {value * RPM:.4g} rpm; "
            f"if rpm are meant write '{value:g} rpm', else '{value:g} rad/s'"
        )
    if units == {"m/s"} and abs(value) >= FAST and value % 10 == 0:
        yield (
            f"{where}: {value:g} without a unit is in m/s; if mm/s are meant write '{value:g} mm/s', else "
            f"'{value:g} m/s'"
        )
