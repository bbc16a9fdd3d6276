"""Bare numbers that were probably meant in another unit than SI: angles in degrees, speeds in rpm or mm/s."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from kedfem.errors import place
from kedfem.scene.checks.hints import marks, walk
from kedfem.scene.records.units import RPM, Quantity

TURN = 2.0 * math.pi
FAST = (
    60.0  # rad/s, from which a round number is rather one of rpm, or m/s, from which it is rather one of mm/s
)


def bare_numbers(raw: Any, hint: Any) -> Iterator[str]:
    """Doubts about numbers without a unit in raw input that was found good; lists of numbers are not examined.

    Parameters
    ----------
    raw : the input
    hint : its type, a record
    """
    for where, value, inner in walk(raw, hint):
        if isinstance(value, (int, float)) and abs(value) < 1e300 and isinstance(where[-1], str):
            yield from doubts(
                place(where), float(value), {quantity.unit for quantity in marks(inner, Quantity)}
            )


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
