"""Records of drives, which prescribe motions of joints, and of gears between joints."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, StrictBool, StrictInt, model_validator
from pydantic_core import PydanticCustomError

from kedfem.errors import Fault
from kedfem.scene.records.base import EndName, JointName, Record, refuse
from kedfem.scene.records.curves import Curve
from kedfem.scene.records.materials import Frequency
from kedfem.scene.records.points import Axis
from kedfem.scene.records.units import (
    Angle,
    Duration,
    Length,
    Number,
    PositiveRotationalStiffness,
    PositiveTime,
    Quantity,
    RotationalDamper,
)

TURNING, SLIDING = Quantity("rad/s"), Quantity("m/s")


@dataclass(frozen=True, slots=True)
class Either(Quantity):
    """A quantity of an angle or of a travel. Whether it suits the joint is checked with the joint."""

    slides: str = "m"
    """the unit of the travel's"""

    def number(self, value: object) -> float:
        """The SI number of a field that holds a number, or a string with a unit of either kind."""
        try:
            return Quantity.number(self, value)
        except PydanticCustomError:
            if isinstance(value, str):
                with suppress(PydanticCustomError):
                    return Quantity(self.slides, above=self.above).number(value)
            raise


EITHER_SPEED = Either("rad/s", slides="m/s")
DriveSpeed = Annotated[float, EITHER_SPEED]
AngleOrTravel = Annotated[float, Either("rad")]
PositiveAngleOrTravel = Annotated[float, Either("rad", above=0.0)]
Period = Annotated[Any, "of times"]
Teeth = Annotated[StrictInt, Field(ge=1)]


class ConstantSpeed(Record):
    """Rotation or sliding at a constant speed: φ = ω t."""

    kind: Literal["constant_speed"] = "constant_speed"
    speed: DriveSpeed
    """rotational speed, positive from x to y about z; rpm allowed in a string; of a travel its speed"""


class Ramp(Record):
    """Acceleration from rest, then rotation at a constant speed."""

    kind: Literal["ramp"] = "ramp"
    speed: DriveSpeed
    """final speed: rotational, or of a travel"""
    time: PositiveTime
    """duration of the speeding up"""
    shape: Literal["smooth", "linear"] = "smooth"
    """smooth: the speed rises as ½ (1 − cos πt/T), acceleration without jumps; linear: as t/T"""


class MotionCurve(Curve):
    """An angle or a travel over time, by a cubic spline, whose acceleration is continuous."""

    units: ClassVar = {"time": "s"}
    what: ClassVar = {"angle": "rad", "travel": "m"}
    least: ClassVar = 2
    kind: Literal["curve"] = "curve"
    over: Literal["time"] = "time"
    """what it depends on"""
    value: tuple[AngleOrTravel, ...] = ()
    """angle or travel there, from the reference position; of a file its heading says which"""
    interpolation: Literal["spline"] = "spline"  # type: ignore[assignment]
    """between the values: cubics, twice continuously differentiable, periodic or with not-a-knot ends"""
    period: Period = None
    """after which it repeats itself; if not given it must be from 0 or before to the end of the analysis"""
    smoothing: PositiveAngleOrTravel | None = None
    """how far a smoother curve may pass from the values, in the mean square; for values that are rounded or measured"""

    @model_validator(mode="after")
    def _returns(self) -> MotionCurve:
        if self.period is None or not self.at or self.at[-1] < self.at[0] + self.period * (1.0 - 1e-12):
            return self
        first, last = self.value[0], self.value[-1]
        if abs(last - first) > 1e-9 * (max(self.value) - min(self.value)):
            wanted = f"must end as it begins, with {first:.6g}, where it repeats itself"
            refuse([Fault(("value", len(self.value) - 1), f"{wanted}, got {last:.6g}")])
        return self


class _Rise(Record):
    """Base class of laws that move by an angle or a travel."""

    exactly_one = ("angle", "travel"), " [rad], or travel [m] where the drive prescribes one"
    kind: str
    angle: Angle | None = None
    """the rise; the amplitude φ0 of what swings"""
    travel: Length | None = None
    """the same of a travel, instead of an angle"""

    @property
    def height(self) -> float:
        """Angle or travel."""
        return self.angle if self.angle is not None else self.travel or 0.0


class _RiseAndDwell(_Rise):
    """Base class of laws that rise, dwell and return."""

    rise: PositiveTime
    """duration of the rise"""
    dwell: Duration = 0.0
    """duration of the dwell at the top"""
    return_time: PositiveTime | None = None
    """duration of the return; without it the drive stays at the top"""
    dwell_after: Duration = 0.0
    """duration of the dwell after the return, before it all repeats"""


class Cycloidal(_RiseAndDwell):
    """Rise by an angle, dwell, return, dwell, and so on, by the cycloidal law: s = x − sin(2πx)/2π."""

    kind: Literal["cycloidal"] = "cycloidal"


class Polynomial(_RiseAndDwell):
    """Rise by an angle, dwell, return, dwell, and so on, by a polynomial law."""

    kind: Literal["polynomial"] = "polynomial"
    order: Literal[5, 7] = 5
    """5: the 3-4-5 polynomial, zero acceleration at the ends; 7: 4-5-6-7, zero jerk there too"""


class Harmonic(_Rise):
    """An oscillation from the reference position: φ = φ0 (sin(2π f t + α) − sin α)."""

    kind: Literal["harmonic"] = "harmonic"
    frequency: Frequency
    """f"""
    phase: Angle = 0.0
    """α: 0 begins at full speed, `"-90 deg"` at rest"""


MotionLaw = Annotated[ConstantSpeed | Ramp | MotionCurve | Cycloidal | Polynomial | Harmonic, Field(discriminator="kind")]


class Drive(Record):
    """A prescribed motion of a joint: of its first link that is not the ground, relative to the other.

    In a slot the pin slides along the line. Several drives of one joint prescribe one coordinate each.
    """

    only_with = (("shaft_damping", "shaft_stiffness"),)
    joint: JointName
    """name of the driven joint: any but spherical and weld"""
    coordinate: Literal["angle", "travel"] | None = None
    """of a cylindrical or screw joint: which of its two is prescribed; the angle if not given. A screw has one
    drive, as one follows from the other"""
    about: EndName | None = None
    """of a universal joint: the link about whose axis the angle is, as the cross has both axes"""
    along: Axis | None = None
    """of a planar joint: the direction in its plane along which the travel is prescribed, fixed in the joint's second
    link, or the ground if that is one; the angle is if not given"""
    motion: MotionLaw
    """how it turns or slides, from the reference position"""
    shaft_stiffness: PositiveRotationalStiffness | None = None
    """of an angle: torsional stiffness of the shaft between the given motion and the link that it drives; rigid if not
    given"""
    shaft_damping: RotationalDamper = 0.0
    """of an angle: torsional damping of that shaft"""


def prescribes_travel(kind: str, coordinate: object, along: object) -> bool:
    """Whether a drive with these two keys prescribes the travel of a joint of this kind, not its angle."""
    return kind in ("prismatic", "slot") or coordinate == "travel" or along is not None


class Gear(Record):
    """Gears, belts or a rack: a constant ratio of the motions of two joints.

    The motion of a joint is that of its first link that is not the ground relative to the other, about or along its
    axis.
    """

    exactly_one = ("ratio", "teeth", "radius"), ", or teeth, or radius [m] of a rack"
    only_with = (("internal", "teeth"),)
    joints: tuple[JointName, JointName]
    """the two joints: A and B revolute, cylindrical, screw or planar; of a rack B prismatic, cylindrical or screw"""
    ratio: Number | None = None
    """revolutions of B per revolution of A, positive in the same direction about their axes; not zero"""
    teeth: tuple[Teeth, Teeth] | None = None
    """numbers of teeth at A and B, instead of `ratio`: the ratio is −A/B, as wheels that mesh turn against each other"""
    internal: StrictBool = False
    """with teeth: whether one of the wheels is toothed inside, so that both turn the same way"""
    radius: Length | None = None
    """of a rack: travel of B per radian of A; negative if it runs against B's axis"""

    @model_validator(mode="after")
    def _moves(self) -> Gear:
        zero = [key for key in ("ratio", "radius") if getattr(self, key) == 0.0]
        refuse([Fault((key,), "must not be zero, got 0") for key in zero])
        return self

    @property
    def transmission(self) -> float:
        """Motion of the second joint per motion of the first [- or m]."""
        if self.teeth is not None:
            return (1 if self.internal else -1) * self.teeth[0] / self.teeth[1]
        return self.radius if self.radius is not None else self.ratio or 0.0

    @property
    def turning(self) -> tuple[bool, bool]:
        """Whether it couples the angle of each joint; a rack couples the travel of its second joint."""
        return True, self.radius is None
