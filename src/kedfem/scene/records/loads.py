"""Loads and attached bodies."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from kedfem.scene.records.base import Fault, FileName, Record, refuse
from kedfem.scene.records.drives import table_faults
from kedfem.scene.records.inertia import Inertia, inertia_faults
from kedfem.scene.records.points import Point, as_vector
from kedfem.scene.records.units import Mass, Number, Pressure, Quantity, Time

Force = Annotated[float, Quantity("N")]
ForcePerVolume = Annotated[float, Quantity("N/m^3")]
Abscissa = Annotated[Any, Field()]
"""A place in a table: its unit depends on what the table is over."""
Torque = Annotated[float, Quantity("N*m")]
PositiveInertia = Annotated[float, Quantity("kg*m^2", above=0.0)]
ForceVector = Annotated[tuple[Force, Force, Force], BeforeValidator(as_vector)]
TorqueVector = Annotated[tuple[Torque, Torque, Torque], BeforeValidator(as_vector)]
BodyVector = Annotated[tuple[ForcePerVolume, ForcePerVolume, ForcePerVolume], BeforeValidator(as_vector)]
SurfaceVector = Annotated[tuple[Pressure, Pressure, Pressure], BeforeValidator(as_vector)]


Period = Annotated[Any, "of times or angles"]


class Factor(Record):
    """What a load is multiplied by: linear between the points of a table, held outside or repeated."""

    over: Literal["time", "angle"] = "time"
    """what it depends on; angle: that of the drive, from the reference position"""
    time: tuple[Time, ...] = ()
    """times, increasing: short for `over = "time"` and `at`"""
    at: tuple[Abscissa, ...] = ()
    """times or angles, increasing"""
    value: tuple[Number, ...] = ()
    """factor there"""
    period: Period = None
    """time or angle after which the table repeats itself, such as `"360 deg"`; if not given it is held outside"""
    file: FileName | None = None
    """CSV file with two columns, time or angle and factor, instead of the two lists; a heading may give the unit:
    `angle [deg], factor`"""

    @model_validator(mode="after")
    def _one_value_per_point(self) -> Self:
        if self.file is not None:
            refuse(
                [(("file",), "cannot be combined with at and value, got both")]
                if self.at or self.value
                else []
            )
            return self
        if self.time:
            refuse(self._time_faults())
        else:
            quantity = FACTOR_UNITS[self.over]
            self.fill(at=tuple(_number(quantity, ("at", i), x) for i, x in enumerate(self.at)))
            refuse(curve_faults(self.at, self.value, quantity))
        return self.fill(at=self.time or self.at, period=self._repeats())

    def _time_faults(self) -> list[Fault]:
        if self.over != "time":
            return [(("time",), "must be left out over an angle (it has at), got times")]
        if self.at and self.at != self.time:
            return [(("at",), "cannot be combined with time, got both")]
        return table_faults(self.time, "value", self.value)

    def _repeats(self) -> float | None:
        """The period in SI."""
        if self.period is None:
            return None
        quantity = FACTOR_UNITS[self.over]
        number, at = _number(quantity, ("period",), self.period), self.time or self.at
        span = at[-1] - at[0]
        if not number > 0.0 or number < span * (1.0 - 1e-12):
            wanted = f"must be positive, and no shorter than the table, {span:.6g}{quantity.bracket}"
            refuse([(("period",), f"{wanted}, got {number:.6g}")])
        return number


FACTOR_UNITS = {"time": Quantity("s"), "angle": Quantity("rad")}


def _number(quantity: Quantity, where: tuple[str | int, ...], given: Any) -> float:
    """A number whose unit depends on another key."""
    try:
        return quantity.number(given)
    except PydanticCustomError as reason:
        refuse([(where, reason.message())])
        raise


def curve_faults(at: Sequence[float], value: Sequence[float], quantity: Quantity) -> list[Fault]:
    """What is wrong with a curve: places and messages."""
    if not at:
        return [(("at",), f"must hold at least one value{quantity.bracket}, got none")]
    faults: list[Fault] = []
    for i, (before, after) in enumerate(pairwise(at), start=1):
        if after <= before:
            message = f"must be above the one before, {before:.6g}{quantity.bracket}, got {after:.6g}"
            faults.append((("at", i), message))
            break
    if len(value) != len(at):
        faults.append((("value",), f"must hold one value for each of the {len(at)} of at, got {len(value)}"))
    return faults


def constant_as_table(value: Any) -> Any:
    """A constant factor as a table of one time."""
    return value if isinstance(value, (dict, Factor)) else {"time": [0.0], "value": [value]}


FactorOver = Annotated[Factor, BeforeValidator(constant_as_table)]
ONE = Factor(at=(0.0,), value=(1.0,))


class ForceLoad(Record):
    """A force at a point of a link."""

    kind: Literal["force"] = "force"
    link: str
    """the link it acts on"""
    at: Point
    """where, in the reference position"""
    vector: ForceVector
    """the force"""
    frame: Literal["world", "link"] = "world"
    """world: keeps its direction; link: given in the reference position, turns with the link from there"""
    factor: FactorOver = ONE
    """a number, or a table over time or the drive's angle: `{ over = "angle", at = [...], value = [...] }`"""


class BodyLoad(Record):
    """A force per volume of a link."""

    kind: Literal["body"] = "body"
    link: str
    """the link it acts on"""
    vector: BodyVector
    """the force per volume"""
    frame: Literal["world", "link"] = "world"
    """world: keeps its direction; link: given in the reference position, turns with the link from there"""
    factor: FactorOver = ONE
    """a number, or a table over time or the drive's angle: `{ over = "angle", at = [...], value = [...] }`"""


class SurfaceLoad(Record):
    """A force per area on a face of a solid link."""

    kind: Literal["surface"] = "surface"
    link: str
    """the link it acts on"""
    at: Point
    """a point of the flat or cylindrical face, in the reference position"""
    vector: SurfaceVector
    """the force per area"""
    frame: Literal["world", "link"] = "world"
    """world: keeps its direction; link: given in the reference position, turns with the link from there"""
    factor: FactorOver = ONE
    """a number, or a table over time or the drive's angle: `{ over = "angle", at = [...], value = [...] }`"""


class PressureLoad(Record):
    """A pressure on a face of a solid or plane link: across the face everywhere, as it turns with the link."""

    kind: Literal["pressure"] = "pressure"
    link: str
    """the link it acts on"""
    at: Point
    """a point of the flat or curved face, in the reference position"""
    pressure: Pressure
    """force per area, positive pushing on the face"""
    factor: FactorOver = ONE
    """a number, or a table over time or the drive's angle: `{ over = "angle", at = [...], value = [...] }`"""


class TorqueLoad(Record):
    """A torque on a bore, face or section of a link: on the mean rotation of it."""

    kind: Literal["torque"] = "torque"
    link: str
    """the link it acts on"""
    at: Point | None = None
    """a point on the axis of a bore or journal, or of a face; of a beam a point of its axis, of one in space one where it
    has a node; in the reference position"""
    joint: str | None = None
    """a joint of the link, on whose bore or face it acts, instead of `at`"""
    vector: TorqueVector
    """the torque"""
    frame: Literal["world", "link"] = "world"
    """world: keeps its direction; link: given in the reference position, turns with the link from there"""
    factor: FactorOver = ONE
    """a number, or a table over time or the drive's angle: `{ over = "angle", at = [...], value = [...] }`"""

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if self.at is None and self.joint is None:
            refuse([(("at",), "is required [m], or a joint of the link, got neither")])
        if self.at is not None and self.joint is not None:
            refuse([(("at",), "cannot be combined with joint, got both")])
        return self


Load = Annotated[ForceLoad | BodyLoad | SurfaceLoad | PressureLoad | TorqueLoad, Field(discriminator="kind")]


class Flywheel(Record):
    """A disc on a bore, turning about the axis of the joint there."""

    kind: Literal["flywheel"] = "flywheel"
    link: str
    """the link that carries it"""
    at: Point
    """the joint's point: the bore that carries it"""
    inertia: PositiveInertia
    """moment of inertia about the joint's axis"""
    mass: Mass = 0.0
    """its mass, on the axis"""


class PointMass(Record):
    """A mass without extension."""

    kind: Literal["point_mass"] = "point_mass"
    link: str
    """the link that carries it"""
    at: Point
    """where: anywhere on a link (of a planar beam on its axis)"""
    mass: Annotated[float, Quantity("kg", above=0.0)]
    """its mass"""


class RigidBody(Record):
    """A rigid body with mass and full inertia."""

    kind: Literal["rigid_body"] = "rigid_body"
    link: str
    """the link that carries it"""
    at: Point
    """where: anywhere on a beam's axis or on a rigid link; on an elastic solid a bore, as of a joint"""
    mass: Annotated[float, Quantity("kg", above=0.0)]
    """its mass"""
    inertia: tuple[Inertia, Inertia, Inertia, Inertia, Inertia, Inertia]
    """tensor about its centre in the reference position: Ixx, Iyy, Izz, Ixy, Iyz, Izx, with Ixy = −∫xy dm and so on"""
    centre: Point
    """its centre of mass in the reference position"""

    @model_validator(mode="after")
    def _possible_inertia(self) -> Self:
        refuse(inertia_faults(self.inertia))
        return self


Body = Annotated[Flywheel | PointMass | RigidBody, Field(discriminator="kind")]
