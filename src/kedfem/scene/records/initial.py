"""The start: velocities of joints and of links, and forces that are let go."""

from __future__ import annotations

from typing import Annotated

from pydantic import BeforeValidator, PlainValidator
from pydantic_core import PydanticCustomError

from kedfem.scene.records.base import LinkName, Record
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

    link: LinkName
    """the link it acts on, an elastic one"""
    at: Point
    """where, in the reference position"""
    force: ForceVector
    """the force, in the world"""


JointSpeed = Annotated[float, PlainValidator(joint_speed)]


class InitialMotion(Record):
    """How a link moves at the start."""

    at_least_one = ("velocity", "angular_velocity"), " [m/s], or angular_velocity [rad/s]"
    at: Point
    """a point of the link, in the reference position"""
    velocity: VelocityVector | None = None
    """velocity of this point; left open if not given"""
    angular_velocity: AngularVelocity | None = None
    """rotational speed of the link, a vector; left open if not given"""
