"""Bushings: what a joint holds, held by springs and dampers."""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import BeforeValidator, model_validator

from kedfem.scene.records.base import Record, refuse
from kedfem.scene.records.units import Quantity, fault
from kedfem.scene.records.wording import shown


def three(value: object) -> Any:
    """One number for all directions, or three."""
    if isinstance(value, (list, tuple)) and len(value) != 3:
        raise fault(f"must be one number or three, along x, y, z of the joint, got {shown(value)}")
    return value if value is None or isinstance(value, (list, tuple)) else (value, value, value)


Rate = Annotated[float, Quantity("N/m", above=0.0)]
Damper = Annotated[float, Quantity("N*s/m", least=0.0)]
TurningRate = Annotated[float, Quantity("N*m/rad", above=0.0)]
TurningDamper = Annotated[float, Quantity("N*m*s/rad", least=0.0)]
Rates = Annotated[tuple[Rate, Rate, Rate], BeforeValidator(three)]
Dampers = Annotated[tuple[Damper, Damper, Damper], BeforeValidator(three)]
TurningRates = Annotated[tuple[TurningRate, TurningRate, TurningRate], BeforeValidator(three)]
TurningDampers = Annotated[tuple[TurningDamper, TurningDamper, TurningDamper], BeforeValidator(three)]


class Bushing(Record):
    """What a joint holds, held by springs and dampers; what it leaves free stays free.

    One number for all directions, or three along the axes x, y, z of the joint. z is its `axis`; x is at right angles to
    z and to that world axis which is farthest from it in the reference position (of equals the first), y at right angles
    to both. Without an `axis` they are the world's in the reference position. They are fixed in the joint's second link,
    or the ground if that is one."""

    stiffness: Rates | None = None
    """of displacements; held rigidly if not given"""
    damping: Dampers = (0.0, 0.0, 0.0)
    """of displacements"""
    rotational_stiffness: TurningRates | None = None
    """of turns; held rigidly if not given. Of a universal joint, whose one turn held is about the normal of its cross,
    the third"""
    rotational_damping: TurningDampers = (0.0, 0.0, 0.0)
    """of turns"""

    @model_validator(mode="after")
    def _springs(self) -> Self:
        if self.stiffness is None and self.rotational_stiffness is None:
            refuse([(("stiffness",), "is required [N/m], or rotational_stiffness [N m/rad], got neither")])
        for stiffness, damping in (("stiffness", "damping"), ("rotational_stiffness", "rotational_damping")):
            if getattr(self, stiffness) is None and any(getattr(self, damping)):
                refuse([((damping,), f"must be combined with {stiffness}, got it alone")])
        return self
