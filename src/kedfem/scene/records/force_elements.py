"""Records of force elements: motors, springs with dampers, limits of joints."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from kedfem.errors import Fault
from kedfem.scene.records.base import EndName, JointName, Record, refuse
from kedfem.scene.records.curves import (
    ONE,
    FactorOver,
    Force,
    ForceCurve,
    ForceOver,
    PullCurve,
    PullOver,
    Torque,
    TorqueCurve,
    TorqueOver,
)
from kedfem.scene.records.points import Axis, Point
from kedfem.scene.records.units import (
    Angle,
    Damper,
    Length,
    PositiveRotationalStiffness,
    PositiveStiffness,
    Quantity,
    RotationalDamper,
)


class Motor(Record):
    """A torque about a hinge or a force along a slide, between the links of a joint.

    It acts on the joint's first link that is not the ground, and in the opposite direction on the other. The speed or
    angle of its curve is that of this link relative to the other.
    """

    exactly_one = ("torque", "force"), " [N*m], or force [N] of a slider"
    only_with = ("about", "torque"), ("along", "force")
    joint: JointName
    """the joint: revolute, cylindrical, screw, planar or universal for a torque, prismatic, cylindrical, screw, planar
    or slot for a force"""
    about: EndName | None = None
    """of a torque on a universal joint: the link about whose axis it is"""
    along: Axis | None = None
    """of a force on a planar joint: its direction in the plane, in the reference position; fixed in the joint's second
    link, or the ground if that is one"""
    torque: TorqueOver | None = None
    """of a hinge, positive about its axis: a number, or `{ over = "speed", at = [...], value = [...] }`"""
    force: ForceOver | None = None
    """of a slider, positive along its direction: a number, or such a table"""

    @property
    def curve(self) -> TorqueCurve | ForceCurve:
        """The torque or the force."""
        curve = self.torque or self.force
        if curve is None:
            raise ValueError("a motor has a torque or a force")  # refused already
        return curve


Stiffness = Annotated[float, Quantity("N/m", least=0.0)]
TorsionStiffness = Annotated[float, Quantity("N*m/rad", least=0.0)]
FreeLength = Annotated[float, Quantity("m", least=0.0)]


class SpringEnd(Record):
    """End of a spring: a point of a link or of the ground."""

    link: EndName
    """the link, or `"ground"`"""
    at: Point
    """where, in the reference position"""


class _Elastic(Record):
    """Base class of springs."""

    effort: ClassVar[str]
    """the key of its curve"""
    stiffness_factor: FactorOver = ONE
    """what k is multiplied by, nowhere negative: a number, or a table over time or the drive's angle as the factor of a
    load has it, such as the stiffness of a tooth mesh; repeated with a `period`"""

    @model_validator(mode="after")
    def _never_pushed_apart(self) -> Self:
        least = min(self.stiffness_factor.value, default=1.0)
        if least < 0.0:
            wanted = "must hold values of at least 0 (a spring of negative stiffness would push apart)"
            refuse([Fault(("stiffness_factor", "value"), f"{wanted}, got {least:.6g}")])
        if self.stiffness_factor != ONE and not getattr(self, "stiffness", 1.0):
            refuse([Fault(("stiffness_factor",), "must be combined with a stiffness, got none")])
        return self

    @property
    def curve(self) -> PullCurve | TorqueCurve | None:
        """The pull or restoring torque in addition to that of the constants."""
        curve: PullCurve | TorqueCurve | None = getattr(self, self.effort, None)
        return curve

    @model_validator(mode="after")
    def _does_something(self) -> Self:
        if not (getattr(self, "stiffness", 1.0) or getattr(self, "damping", 1.0) or self.curve):
            wanted = f"must be positive, or damping, or a {self.effort}, got none of them"
            refuse([Fault(("stiffness",), wanted)])
        return self

    @model_validator(mode="after")
    def _preloaded(self) -> Self:
        if getattr(self, "preload", None) is None:
            return self
        for key in ("free_length", "free_travel", "free_angle"):
            if getattr(self, key, None) is not None:
                refuse([Fault(("preload",), f"cannot be combined with {key}, got both")])
        if not getattr(self, "stiffness", 1.0):
            refuse([Fault(("preload",), "must be combined with a stiffness, got none")])
        return self


class LineSpring(_Elastic):
    """A spring and a damper between two points or along a slide, with the pull k (l − l0) + c l' + F.

    Along a slide l is the travel of the joint's first link that is not the ground relative to the other, along a slot the
    travel of the pin, both from the reference position. The spring pulls this link back.
    """

    effort = "force"
    exactly_one = ("between", "joint"), ", or a joint"
    only_with = (("along", "joint"),)
    kind: Literal["spring"] = "spring"
    between: tuple[SpringEnd, SpringEnd] | None = None
    """its two ends, each `{ link = "...", at = point }`"""
    joint: JointName | None = None
    """a prismatic, cylindrical, screw, planar or slot joint that it lies along, instead of two ends"""
    along: Axis | None = None
    """of a planar joint: the direction in its plane that it lies along, as that of a motor"""
    stiffness: Stiffness = 0.0
    """k"""
    damping: Damper = 0.0
    """c"""
    free_length: FreeLength | None = None
    """l0 between two points, at which it does not pull; as long in the reference position if not given"""
    free_travel: Length | None = None
    """l0 along a slide or slot, at which it does not pull; 0, the reference position, if not given"""
    preload: Force | None = None
    """its pull in the reference position, instead of l0; negative: it pushes"""
    force: PullOver | None = None
    """F: a pull in addition to these, or alone: a number, or a curve over the length (of a gas spring, a stop of
    rubber), over the speed (of a damper) or over time (of a cylinder whose force is given): `{ over = "speed", at =
    [...], value = [...] }`"""

    @model_validator(mode="after")
    def _has_a_direction(self) -> Self:
        if self.between is None:
            if self.free_length is not None:
                refuse([Fault(("free_length",), "must be free_travel [m] along a joint, got a length")])
            self._curve_over("length", "travel", "along a joint")
            return self
        if self.free_travel is not None:
            refuse([Fault(("free_travel",), "must be free_length [m] between two points, got a travel")])
        self._curve_over("travel", "length", "between two points")
        a, b = self.between
        if a.at == b.at and (self.free_length != 0.0 or self.preload):
            wanted = "must be two different points unless free_length = 0, got the same twice"
            refuse([Fault(("between",), wanted)])
        return self

    def _curve_over(self, wrong: str, right: str, where: str) -> None:
        if self.force is not None and self.force.over == wrong:
            wanted = f"must be {right!r} {where}, or 'speed' or 'time', got {wrong!r}"
            refuse([Fault(("force", "over"), wanted)])

    @property
    def free(self) -> float:
        """Free length l0: the length or travel without a pull [m]."""
        distance = 0.0 if self.between is None else math.dist(*(end.at for end in self.between))
        given = self.free_travel if self.between is None else self.free_length
        if self.preload is not None:
            return distance - self.preload / self.stiffness
        return distance if given is None else given


class TorsionSpring(_Elastic):
    """A spring and a damper about a hinge, with the restoring torque k (φ − φ0) + c φ' + T."""

    effort = "torque"
    kind: Literal["torsion"] = "torsion"
    joint: JointName
    """the hinge, or cylindrical, screw, planar or universal joint"""
    about: EndName | None = None
    """of a universal joint: the link about whose axis it is"""
    stiffness: TorsionStiffness = 0.0
    """k"""
    damping: RotationalDamper = 0.0
    """c"""
    free_angle: Angle | None = None
    """φ0, at which its torque is zero, from the reference position; 0 if not given: the rotation of the joint's first
    link that is not the ground against the other, about the joint's axis"""
    preload: Torque | None = None
    """its restoring torque in the reference position, −k φ0, instead of φ0"""
    torque: TorqueOver | None = None
    """T: a restoring torque in addition to these, or alone: a number, or a curve over the angle, the speed or time"""

    @property
    def free(self) -> float:
        """Free angle φ0 [rad]."""
        if self.preload is not None:
            return -self.preload / self.stiffness
        return self.free_angle or 0.0


Spring = Annotated[LineSpring | TorsionSpring, Field(discriminator="kind")]


class _Range(Record):
    """Base class of limits."""

    @model_validator(mode="after")
    def _holds_the_reference_position(self) -> Self:
        lower, upper = getattr(self, "lower", None), getattr(self, "upper", None)
        unit = "rad" if self.__class__ is AngleLimit else "m"
        faults: list[Fault] = []
        if lower is None and upper is None:
            faults.append(Fault(("lower",), f"is required, or upper [{unit}], got neither"))
        elif lower is not None and upper is not None and lower >= upper:
            faults.append(Fault(("lower",), f"must be below upper {upper:.6g} [{unit}], got {lower:.6g}"))
        else:
            reference = f"0 [{unit}], the reference position, which must be within the limits"
            if lower is not None and lower > 0.0:
                faults.append(Fault(("lower",), f"must be at most {reference}, got {lower:.6g}"))
            if upper is not None and upper < 0.0:
                faults.append(Fault(("upper",), f"must be at least {reference}, got {upper:.6g}"))
        refuse(faults)
        return self

    @property
    def range(self) -> tuple[float, float]:
        """Lower and upper limit [rad or m]; −inf and inf where there is none."""
        lower, upper = getattr(self, "lower", None), getattr(self, "upper", None)
        return (-math.inf if lower is None else lower, math.inf if upper is None else upper)


class TravelLimit(_Range):
    """Stops along a slide or slot. At a travel s beyond a limit they push back with k s + c s', and never pull.

    The travel is that of the joint's first link that is not the ground relative to the other, along a slot that of its
    pin, from the reference position.
    """

    kind: Literal["travel"] = "travel"
    joint: JointName
    """a prismatic, cylindrical, screw, planar or slot joint that no drive moves"""
    along: Axis | None = None
    """of a planar joint: the direction in its plane along which the travel is, as that of a motor"""
    lower: Length | None = None
    """least travel that is free; no stop there if not given"""
    upper: Length | None = None
    """largest travel that is free; no stop there if not given"""
    stiffness: PositiveStiffness
    """k of the stops"""
    damping: Damper = 0.0
    """c of the stops"""


class AngleLimit(_Range):
    """Stops about a hinge. At an angle s beyond a limit they push back with k s + c s', and never pull.

    The angle is the rotation of the joint's first link that is not the ground relative to the other, about the joint's
    axis, from the reference position.
    """

    kind: Literal["angle"] = "angle"
    joint: JointName
    """a hinge, or cylindrical, screw, planar or universal joint that no drive moves"""
    about: EndName | None = None
    """of a universal joint: the link about whose axis the angle is"""
    lower: Angle | None = None
    """least angle that is free; no stop there if not given"""
    upper: Angle | None = None
    """largest angle that is free; no stop there if not given"""
    stiffness: PositiveRotationalStiffness
    """k of the stops"""
    damping: RotationalDamper = 0.0
    """c of the stops"""


Limit = Annotated[TravelLimit | AngleLimit, Field(discriminator="kind")]
