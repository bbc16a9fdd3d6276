"""Conversion of strings such as ``"25.4 mm"`` or ``"600 rpm"`` to the SI numbers of a scene."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from tokenize import TokenError
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import GetCoreSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from kedfem.scene.records.wording import shown

if TYPE_CHECKING:
    import pint

NUMBER = re.compile(r"\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)\s*([^0-9\s+-].*?|)\s*", re.ASCII)
LONGEST = 60  # letters of a unit
RPM = 30 / math.pi  # revolutions per minute of 1 rad/s
NAMED = r"\(*(?!inf\b|nan\b)(?:[A-Za-zµμΩ][A-Za-zµμΩ_0-9]{0,30}|°|%)(?:(?:\^|\*\*) ?-?[1-9]|⁻?[¹²³⁴⁵⁶⁷⁸⁹])?\)*"
UNIT = re.compile(rf"(?:{NAMED}|1(?= ?/))(?:(?: ?[*/·] ?| ){NAMED})*")
"""Names with powers of one digit, multiplied and divided: nothing that could be reckoned with."""

KINDS = {
    "1": "a number", "m": "a length", "m^2": "an area", "m^4": "a second moment of area", "rad": "an angle",
    "s": "a time", "Hz": "a frequency", "rad/s": "a rotational speed", "1/s": "a rate", "m/s": "a speed",
    "m/s^2": "an acceleration", "kg": "a mass", "kg*m^2": "a moment of inertia", "kg/m^3": "a density",
    "Pa": "a pressure", "N": "a force", "N/m^3": "a force per volume", "N*m": "a torque",
    "N/m": "a stiffness", "N*s/m": "a damping constant", "N*m/rad": "a torsional stiffness",
    "N*m*s/rad": "a torsional damping constant",
}  # fmt: skip
# pint's, for no unit
UNREADABLE = (ValueError, TypeError, SyntaxError, AttributeError, ArithmeticError, TokenError)
USUAL = {
    "mm": ("m", 1e-3), "cm": ("m", 1e-2), "dm": ("m", 0.1), "m": ("m", 1.0), "km": ("m", 1e3), "in": ("m", 0.0254),
    "ft": ("m", 0.3048), "deg": ("rad", math.pi / 180), "rad": ("rad", 1.0), "s": ("s", 1.0), "ms": ("s", 1e-3),
    "min": ("s", 60.0), "h": ("s", 3600.0), "Hz": ("Hz", 1.0), "kHz": ("Hz", 1e3), "rpm": ("rad/s", math.pi / 30),
    "rad/s": ("rad/s", 1.0), "m/s": ("m/s", 1.0), "mm/s": ("m/s", 1e-3), "km/h": ("m/s", 1 / 3.6),
    "m/s^2": ("m/s^2", 1.0), "g": ("kg", 1e-3), "kg": ("kg", 1.0), "t": ("kg", 1e3), "kg*m^2": ("kg*m^2", 1.0),
    "kg/m^3": ("kg/m^3", 1.0), "g/cm^3": ("kg/m^3", 1e3), "N": ("N", 1.0), "kN": ("N", 1e3), "Pa": ("Pa", 1.0),
    "kPa": ("Pa", 1e3), "MPa": ("Pa", 1e6), "GPa": ("Pa", 1e9), "bar": ("Pa", 1e5), "N*m": ("N*m", 1.0),
    "kN*m": ("N*m", 1e3), "N/m": ("N/m", 1.0), "N/mm": ("N/m", 1e3), "kN/mm": ("N/m", 1e6),
    "N*s/m": ("N*s/m", 1.0), "N*m/rad": ("N*m/rad", 1.0), "N*m*s/rad": ("N*m*s/rad", 1.0),
}  # fmt: skip
"""Units as they are usually written, in SI: for hints, and read without pint, whose start takes half a second."""
HUGE = 1e30  # numbers beyond it, and positive ones below 1 / HUGE, are refused: their powers would overflow
OVERFLOW = 10**308  # largest whole number; those in TOML are unlimited
CYCLES = "hertz", "count", "counts_per_second", "baud", "becquerel", "curie", "rutherford"
"""How names of frequencies end, kilohertz too."""


def fault(message: str) -> PydanticCustomError:
    """A fault of one field of the scene in kedfem's wording, with the wanted and the given value."""
    return PydanticCustomError("kedfem", "{message}", {"message": message})


@cache
def unit_registry() -> pint.UnitRegistry[float]:
    """Pint's registry of units, imported with the first string with a unit."""
    import pint

    registry: pint.UnitRegistry[float] = pint.UnitRegistry()
    registry.define("@alias revolution = rev")
    return registry


class Evaluated(str):
    """Text of an expression whose value has a unit, and this value, a pint quantity."""

    quantity: Any

    def __repr__(self) -> str:
        return f"{str(self)!r}, {self.quantity:.6g~P}"


def si_number(text: str, unit: str) -> float:
    """SI number of a string with a unit.

    Parameters
    ----------
    text : a number and a unit, ``"914.4 mm"``, or an evaluated expression
    unit : the SI unit of the answer, a key of ``KINDS``.

    Returns
    -------
    float [unit]

    Raises
    ------
    ValueError
        The text is not a number with a unit, or its unit is unknown or of another dimension. Hertz are not accepted for
        a rotational speed nor turns for a frequency, since the factor 2π between them would be a guess; nor is a length
        per revolution for a lead or a radius. Only expressions may have an angle in addition, as v = ω r does.
    """
    if isinstance(text, Evaluated):
        quantity = text.quantity
        given = f"{quantity.units:~P}"
    elif (match := NUMBER.fullmatch(text)) is not None:
        given = match[2]
        si, factor = USUAL.get(given, ("", 1.0))
        if si == unit:
            return float(match[1]) * factor
        quantity = unit_registry().Quantity(float(match[1]), unit_of(given, unit))
    else:
        raise ValueError("not a number with a unit; an expression begins with '='")
    wanted: Any = unit_registry().parse_units(unit)
    got = quantity.units
    if crossed(quantity._units, unit):
        clear = "rpm or rad/s" if unit == "rad/s" else "Hz"
        raise ValueError(f"revolutions or radians per second? give it in {clear}")
    turns = revolutions(got._units)
    if isinstance(text, Evaluated) and not (unit == "rad" and turns < 0.0):  # 1/6 turn is 1/(6 turn), no angle
        turns = 0.0
    if got.dimensionality != wanted.dimensionality or turns not in (0.0, revolutions(wanted._units)):
        raise ValueError(f"the unit {given!r} is of another kind{meant(given, unit)}" if given else "no unit")
    return float(quantity.m_as(wanted))


def unit_of(given: str, wanted: str = "") -> Any:
    """Unit of a text.

    Parameters
    ----------
    given : names with powers of one digit, multiplied or divided
    wanted : a unit of the wanted kind, for hints

    Raises
    ------
    ValueError
        The text is not a unit, or an unknown one.
    """
    import pint

    if given and (len(given) > LONGEST or not UNIT.fullmatch(given)):
        raise ValueError(f"{shown(given)} is not a unit")
    try:
        return unit_registry().parse_units(given)
    except pint.errors.UndefinedUnitError:
        raise ValueError(f"unknown unit {given!r}{meant(given, wanted) if wanted else ''}") from None
    except UNREADABLE:
        raise ValueError(f"{given!r} is not a unit") from None


def revolutions(unit: Mapping[str, float]) -> float:
    """The power of an angle in a unit, given as powers of names: 1 of rpm or rad/s, 0 of Hz."""
    registry: Any = unit_registry()
    return float(registry.get_root_units(registry.UnitsContainer(unit))[1]._units.get("radian", 0))


def crossed(given: Mapping[str, float], unit: str) -> bool:
    """Whether a unit counts cycles if rad/s is wanted, or turns if Hz is, so that the factor 2π would be a guess."""
    if unit == "Hz":
        return revolutions(given) != 0.0
    return unit == "rad/s" and any(name.endswith(CYCLES) for name in given) and revolutions(given) == 0.0


def meant(given: str, unit: str) -> str:
    """A hint at a unit of the wanted kind that differs from the given text only by capitals or a *."""
    wanted = unit_registry().parse_units(unit).dimensionality
    for name in USUAL:
        same = name.casefold().replace("*", "") == given.casefold().replace("*", "") and name != given
        if same and unit_registry().parse_units(name).dimensionality == wanted:
            return f", did you mean {name!r}?"
    return ""


@dataclass(frozen=True, slots=True)
class Quantity:
    """Quantity of a number in the scene, with its SI unit and bounds, as in ``Annotated[float, Quantity("m")]``."""

    unit: str
    above: float = -math.inf
    least: float = -math.inf
    below: float = math.inf
    most: float = math.inf

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Schema of the check of a field, for pydantic."""
        return core_schema.no_info_plain_validator_function(self.number)

    def number(self, value: object) -> float:
        """SI number of a field that holds a number or a string with a unit."""
        value = value.tolist() if hasattr(value, "tolist") else value
        if isinstance(value, str):
            try:
                number = si_number(value, self.unit)
            except ValueError as reason:
                raise fault(f"must be {self.kind}, got {value!r}: {reason}") from None
        elif isinstance(value, (int, float)) and not isinstance(value, bool):
            number = float(value) if not abs(value) > OVERFLOW else math.inf if value > 0 else -math.inf
        else:
            raise fault(f"must be {self.kind}, got {shown(value)}")
        self.check(number, value)
        return number

    def check(self, number: float, value: object) -> None:
        """Raise a fault if a number is not finite or out of bounds; ``value`` is the user's text."""
        got = f"got {value!r}" if isinstance(value, str) else f"got {number:.12g}"
        if not math.isfinite(number):
            raise fault(f"must be finite{self.bracket}, {got}")
        if abs(number) > HUGE or (self.above == 0.0 and 0.0 < number < 1.0 / HUGE):
            bound = f"at most {HUGE:g} in size" if abs(number) > HUGE else f"at least {1.0 / HUGE:g}"
            raise fault(f"must be {bound}{self.bracket}, {got}")
        if not (self.above < number < self.below and self.least <= number <= self.most):
            raise fault(f"must be {self.bounds}{self.bracket}, {got}")

    @property
    def bracket(self) -> str:
        """The unit as messages show it: ' [m]', or nothing for a plain number."""
        return "" if self.unit == "1" else f" [{self.unit}]"

    @property
    def kind(self) -> str:
        """The quantity and its unit in words: 'a length [m]'."""
        return KINDS[self.unit] + self.bracket

    @property
    def bounds(self) -> str:
        """The bounds in words: 'positive', 'between 0 and 1'."""
        if (self.above, self.below, self.most) == (0.0, math.inf, math.inf):
            return "positive"
        if (self.least, self.below, self.most) == (0.0, math.inf, math.inf):
            return "zero or positive"
        parts = [(self.above, "above"), (self.least, "at least"), (self.below, "below"), (self.most, "at most")]
        return " and ".join(f"{word} {bound:g}" for bound, word in parts if math.isfinite(bound))


Number = Annotated[float, Quantity("1")]
Length = Annotated[float, Quantity("m")]
PositiveLength = Annotated[float, Quantity("m", above=0.0)]
PositiveStiffness = Annotated[float, Quantity("N/m", above=0.0)]
PositiveRotationalStiffness = Annotated[float, Quantity("N*m/rad", above=0.0)]
Damper = Annotated[float, Quantity("N*s/m", least=0.0)]
RotationalDamper = Annotated[float, Quantity("N*m*s/rad", least=0.0)]
Angle = Annotated[float, Quantity("rad")]
Time = Annotated[float, Quantity("s")]
PositiveTime = Annotated[float, Quantity("s", above=0.0)]
Duration = Annotated[float, Quantity("s", least=0.0)]
Speed = Annotated[float, Quantity("rad/s")]
Mass = Annotated[float, Quantity("kg", least=0.0)]
Pressure = Annotated[float, Quantity("Pa")]
PositivePressure = Annotated[float, Quantity("Pa", above=0.0)]
