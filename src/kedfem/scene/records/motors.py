"""Motors: torques and forces on joints, over time, speed or position."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import BeforeValidator, model_validator
from pydantic_core import PydanticCustomError

from kedfem.scene.records.base import Record, refuse
from kedfem.scene.records.loads import Abscissa, Force, Torque, curve_faults
from kedfem.scene.records.units import Quantity


class Curve(Record):
    """What curves of motors share: increasing abscissae `at`, a value for each."""

    units: ClassVar[dict[str, str]]
    over: str
    at: tuple[Abscissa, ...]
    value: tuple[float, ...]

    @model_validator(mode="after")
    def _numbers(self) -> Self:
        quantity = Quantity(self.units[self.over])
        numbers: list[float] = []
        for i, given in enumerate(self.at):
            try:
                numbers.append(quantity.number(given))
            except PydanticCustomError as reason:
                refuse([(("at", i), reason.message())])
        refuse(curve_faults(numbers, self.value, quantity))
        return self.fill(at=tuple(numbers))


class TorqueCurve(Curve):
    """A torque over time, speed or angle: linear between the values, held outside."""

    units: ClassVar[dict[str, str]] = {"time": "s", "speed": "rad/s", "angle": "rad"}
    over: Literal["time", "speed", "angle"]
    """what it depends on; speed and angle are those of the joint, the angle from the reference position"""
    at: tuple[Abscissa, ...]
    """times, speeds or angles, increasing"""
    value: tuple[Torque, ...]
    """torque there"""


class ForceCurve(Curve):
    """A force over time, speed or travel: linear between the values, held outside."""

    units: ClassVar[dict[str, str]] = {"time": "s", "speed": "m/s", "travel": "m"}
    over: Literal["time", "speed", "travel"]
    """what it depends on; speed and travel are those of the joint, the travel from the reference position"""
    at: tuple[Abscissa, ...]
    """times, speeds or travels, increasing"""
    value: tuple[Force, ...]
    """force there"""


def constant_as_curve(value: Any) -> Any:
    """A constant as a curve of one value."""
    return value if isinstance(value, (dict, Curve)) else {"over": "time", "at": [0.0], "value": [value]}


TorqueOver = Annotated[TorqueCurve, BeforeValidator(constant_as_curve)]
ForceOver = Annotated[ForceCurve, BeforeValidator(constant_as_curve)]


class Motor(Record):
    """A torque on a hinge or a force on a slider: on the joint's first link that is not the ground, against the other.

    A curve over speed or angle is one over those of that link against the other.
    """

    joint: str
    """the joint: revolute, cylindrical or screw for a torque, prismatic or cylindrical for a force"""
    torque: TorqueOver | None = None
    """of a hinge, positive about its axis: a number, or `{ over = "speed", at = [...], value = [...] }`"""
    force: ForceOver | None = None
    """of a slider, positive along its direction: a number, or such a table"""

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if self.torque is None and self.force is None:
            refuse([(("torque",), "is required [N*m], or force [N] of a slider, got neither")])
        if self.torque is not None and self.force is not None:
            refuse([(("torque",), "cannot be combined with force, got both")])
        return self

    @property
    def curve(self) -> TorqueCurve | ForceCurve:
        """The torque or the force."""
        curve = self.torque or self.force
        if curve is None:
            raise ValueError("a motor has a torque or a force")  # refused already
        return curve
