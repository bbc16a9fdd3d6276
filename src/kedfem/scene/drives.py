"""Drives: which joint turns, and how."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, model_validator

from kedfem.scene.base import Fault, FileName, Record, refuse
from kedfem.scene.units import Angle, Duration, PositiveTime, Speed, Time


class ConstantSpeed(Record):
    """Turns at a constant speed: φ = ω t."""

    kind: Literal["constant_speed"] = "constant_speed"
    speed: Speed
    """rotational speed, positive from x to y about z; rpm allowed in a string"""


class Ramp(Record):
    """Speeds up from rest, then turns at a constant speed."""

    kind: Literal["ramp"] = "ramp"
    speed: Speed
    """final speed"""
    time: PositiveTime
    """duration of the speeding up"""
    shape: Literal["smooth", "linear"] = "smooth"
    """smooth: the speed rises as ½ (1 − cos πt/T), acceleration without jumps; linear: as t/T"""


class Table(Record):
    """An angle given over time: a cubic spline (twice continuously differentiable, not-a-knot ends)."""

    kind: Literal["table"] = "table"
    time: tuple[Time, ...] = ()
    """times, increasing, from 0 or before"""
    angle: tuple[Angle, ...] = ()
    """angle at these times, from the drawn position"""
    file: FileName | None = None
    """CSV file with two columns, time and angle, instead of the two lists; a heading may give the units:
    `time [s], angle [deg]`"""

    @model_validator(mode="after")
    def _one_row_per_time(self) -> Table:
        if self.file is None:
            refuse(table_faults(self.time, "angle", self.angle, at_least=2))
        elif self.time or self.angle:
            refuse([(("file",), "must stand without time and angle, got both")])
        return self


class Cycloidal(Record):
    """Rise by an angle, dwell, return, dwell, and so on, by the cycloidal law: s = x − sin(2πx)/2π."""

    kind: Literal["cycloidal"] = "cycloidal"
    angle: Angle
    """the rise"""
    rise: PositiveTime
    """duration of the rise"""
    dwell: Duration = 0.0
    """duration of the dwell at the top"""
    return_time: PositiveTime | None = None
    """duration of the return; without it the drive stays at the top"""
    dwell_after: Duration = 0.0
    """duration of the dwell after the return, before it all repeats"""


class Polynomial(Record):
    """Rise by an angle, dwell, return, dwell, and so on, by a polynomial law."""

    kind: Literal["polynomial"] = "polynomial"
    order: Literal[5, 7] = 5
    """5: the 3-4-5 polynomial, zero acceleration at the ends; 7: 4-5-6-7, zero jerk there too"""
    angle: Angle
    """the rise"""
    rise: PositiveTime
    """duration of the rise"""
    dwell: Duration = 0.0
    """duration of the dwell at the top"""
    return_time: PositiveTime | None = None
    """duration of the return; without it the drive stays at the top"""
    dwell_after: Duration = 0.0
    """duration of the dwell after the return, before it all repeats"""


MotionLaw = Annotated[ConstantSpeed | Ramp | Table | Cycloidal | Polynomial, Field(discriminator="kind")]


class Drive(Record):
    """A hinge on the ground that turns in a given way."""

    joint: str
    """name of the driven joint: a revolute one between the ground and a link"""
    motion: MotionLaw
    """how it turns, from the drawn position"""


def table_faults(
    time: tuple[float, ...], key: str, values: tuple[float, ...], at_least: int = 1
) -> list[Fault]:
    """What is wrong with a table over time: places and messages."""
    if len(time) < at_least:
        return [(("time",), f"must hold at least {at_least} times [s], got {len(time)}")]
    faults: list[Fault] = []
    for i, (before, after) in enumerate(pairwise(time), start=1):
        if after <= before:
            faults.append(
                (("time", i), f"must be later than the time before, {before:.6g} [s], got {after:.6g}")
            )
            break
    if len(values) != len(time):
        faults.append(((key,), f"must hold one value for each of the {len(time)} times, got {len(values)}"))
    return faults
