"""Curves: forces, torques and factors over time, or over an angle, travel or speed."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import BeforeValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from kedfem.errors import Fault
from kedfem.scene.records.base import FileName, Record, refuse
from kedfem.scene.records.units import Number, Quantity, Time

Abscissa = Annotated[Any, Field()]
"""A place on a curve: its unit depends on what the curve is over."""
Span = Annotated[Any, "of times, angles, travels or speeds"]
Force = Annotated[float, Quantity("N")]
Torque = Annotated[float, Quantity("N*m")]


class Curve(Record):
    """Base class of curves: a value at each of increasing places, constant beyond the ends or repeated.

    units : units of the possible arguments; what : names and units of the values; least : fewest values
    """

    units: ClassVar[dict[str, str]]
    what: ClassVar[dict[str, str]]
    least: ClassVar[int] = 1
    over: str
    time: tuple[Time, ...] = ()
    """times, increasing: short for `over = "time"` and `at`"""
    at: tuple[Abscissa, ...] = ()
    """places on what it is over, increasing"""
    value: tuple[float, ...] = ()
    interpolation: Literal["linear", "smooth"] = "linear"
    """between the values: straight lines, or cubics (PCHIP) without corners that nowhere pass beyond them"""
    period: Span = None
    """after which it repeats itself, such as `"360 deg"`; if not given it is held outside"""
    file: FileName | None = None
    """CSV file with two columns, places and values, instead of the two lists; a heading may give units: `angle [deg],
    factor`, `speed [rpm], torque [N*m]`"""

    @model_validator(mode="after")
    def _one_value_per_place(self) -> Self:
        if self.file is not None:
            given = self.at or self.value or self.time
            refuse([Fault(("file",), "cannot be combined with at and value, got both")] if given else [])
            return self
        if self.time:
            refuse(self._time_faults())
        quantity = Quantity(self.units[self.over])
        key = "time" if self.time or (self.over == "time" and not self.at) else "at"
        at = tuple(_number(quantity, (key, i), x) for i, x in enumerate(self.time or self.at))
        refuse(_faults(self, at, quantity, key))
        self.fill(at=at, period=None if self.period is None else _period(quantity, self.period, at))
        return self.fill(time=at) if self.time else self

    def _time_faults(self) -> list[Fault]:
        if self.over != "time":
            article = "an" if self.over == "angle" else "a"
            return [Fault(("time",), f"must be left out over {article} {self.over} (it has at), got times")]
        if self.at and self.at != self.time:
            return [Fault(("at",), "cannot be combined with time, got both")]
        return []


def _period(quantity: Quantity, given: Any, at: Sequence[float]) -> float:
    """The period of a curve in SI, not shorter than the curve."""
    number, span = _number(quantity, ("period",), given), at[-1] - at[0]
    if not number > 0.0 or number < span * (1.0 - 1e-12):
        wanted = f"must be positive, and no shorter than the table, {span:.6g}{quantity.bracket}"
        refuse([Fault(("period",), f"{wanted}, got {number:.6g}")])
    return number


def _number(quantity: Quantity, where: tuple[str | int, ...], given: Any) -> float:
    """A number whose unit depends on another key."""
    try:
        return quantity.number(given)
    except PydanticCustomError as reason:
        refuse([Fault(where, reason.message())])
        raise


def _faults(curve: Curve, at: Sequence[float], quantity: Quantity, key: str) -> list[Fault]:
    """Faults of the values of a curve over a quantity, whose places a key holds."""
    if len(at) < curve.least:
        wanted = "one value" if curve.least == 1 else f"{curve.least} values"
        return [Fault((key,), f"must hold at least {wanted}{quantity.bracket}, got {len(at) or 'none'}")]
    faults: list[Fault] = []
    for i, (before, after) in enumerate(pairwise(at), start=1):
        if after <= before:
            message = f"must be above the one before, {before:.6g}{quantity.bracket}, got {after:.6g}"
            faults.append(Fault((key, i), message))
            break
    if len(curve.value) != len(at):
        wanted = f"must hold one value for each of the {len(at)} of {key}"
        faults.append(Fault(("value",), f"{wanted}, got {len(curve.value)}"))
    return faults


class Factor(Curve):
    """A factor on a load or a stiffness over time, or over the angle or travel of the only drive."""

    units: ClassVar = {"time": "s", "angle": "rad", "travel": "m"}
    what: ClassVar = {"factor": "1"}
    over: Literal["time", "angle", "travel"] = "time"
    """what it depends on; angle and travel: those of the drive, from the reference position"""
    value: tuple[Number, ...] = ()
    """factor there"""


class TorqueCurve(Curve):
    """A torque over time, speed or angle."""

    units: ClassVar = {"time": "s", "speed": "rad/s", "angle": "rad"}
    what: ClassVar = {"torque": "N*m"}
    over: Literal["time", "speed", "angle"] = "time"
    """what it depends on; speed and angle are those of the joint, the angle from the reference position"""
    value: tuple[Torque, ...] = ()
    """torque there"""


class ForceCurve(Curve):
    """A force over time, speed or travel."""

    units: ClassVar = {"time": "s", "speed": "m/s", "travel": "m"}
    what: ClassVar = {"force": "N"}
    over: Literal["time", "speed", "travel"] = "time"
    """what it depends on; speed and travel are those of the joint, the travel from the reference position"""
    value: tuple[Force, ...] = ()
    """force there"""


class PullCurve(Curve):
    """A pull over time, or over the length, travel or speed of the element that pulls."""

    units: ClassVar = {"time": "s", "speed": "m/s", "length": "m", "travel": "m"}
    what: ClassVar = {"force": "N"}
    over: Literal["time", "speed", "length", "travel"] = "time"
    """what it depends on; `"length"`: the distance of both ends; `"travel"`: along a slide, from the reference position;
    `"speed"`: at which either grows"""
    value: tuple[Force, ...] = ()
    """pull there; negative: it pushes"""


def constant_as_curve(value: Any) -> Any:
    """A constant as a curve of one value."""
    return value if isinstance(value, (dict, Curve)) else {"time": [0.0], "value": [value]}


FactorOver = Annotated[Factor, BeforeValidator(constant_as_curve)]
TorqueOver = Annotated[TorqueCurve, BeforeValidator(constant_as_curve)]
ForceOver = Annotated[ForceCurve, BeforeValidator(constant_as_curve)]
PullOver = Annotated[PullCurve, BeforeValidator(constant_as_curve)]
ONE = Factor(at=(0.0,), value=(1.0,))
