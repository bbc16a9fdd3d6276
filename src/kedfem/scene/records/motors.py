"""Motors: torques and forces on joints, over time, speed or position."""

from __future__ import annotations

from typing import Self

from pydantic import model_validator

from kedfem.scene.records.base import Record, refuse
from kedfem.scene.records.curves import ForceCurve, ForceOver, TorqueCurve, TorqueOver


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
