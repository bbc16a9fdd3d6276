"""The start: velocities of joints and of links, and forces that are let go."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import BeforeValidator, PlainValidator, model_validator
from pydantic_core import PydanticCustomError

from kedfem.errors import Fault
from kedfem.scene.records.base import Record, refuse
from kedfem.scene.records.drives import EitherSpeed
from kedfem.scene.records.loads import ForceVector
from kedfem.scene.records.points import Point, as_vector
from kedfem.scene.records.units import Quantity, Speed, fault

Velocity = Annotated[float, Quantity("m/s")]
VelocityVector = Annotated[tuple[Velocity, Velocity, Velocity], BeforeValidator(as_vector)]
AngularVelocity = Annotated[tuple[Speed, Speed, Speed], BeforeValidator(as_vector)]


def joint_speed(value: object) -> float:
    """A rotational speed or a speed; which of them suits the joint is checked with the joint."""
    try:
        return EitherSpeed("rad/s").number(value)
    except PydanticCustomError as reason:
        if not isinstance(value, str):
            raise
        raise fault(f"{reason.message()} (of a slider in m/s)") from None


class InitialForce(Record):
    """A force at a point of a link that has deflected the mechanism, and is let go at the start."""

    link: str
    """the link it acts on, an elastic one"""
    at: Point
    """where, in the reference position"""
    force: ForceVector
    """the force, in the world"""


JointSpeed = Annotated[float, PlainValidator(joint_speed)]


class InitialMotion(Record):
    """How a link moves at the start."""

    at: Point
    """a point of the link, in the reference position"""
    velocity: VelocityVector | None = None
    """velocity of this point; left open if not given"""
    angular_velocity: AngularVelocity | None = None
    """rotational speed of the link, a vector; left open if not given"""

    @model_validator(mode="after")
    def _says_something(self) -> Self:
        given = self.velocity is not None or self.angular_velocity is not None
        refuse([] if given else [Fault(("velocity",), "is required [m/s], or spin [rad/s], got neither")])
        return self
