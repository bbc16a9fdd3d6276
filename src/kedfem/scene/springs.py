"""Springs with dampers: between two points, or about a hinge."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from kedfem.scene.base import Record, refuse
from kedfem.scene.points import Point
from kedfem.scene.units import Angle, Quantity

Stiffness = Annotated[float, Quantity("N/m", least=0.0)]
Damper = Annotated[float, Quantity("N*s/m", least=0.0)]
TorsionStiffness = Annotated[float, Quantity("N*m/rad", least=0.0)]
TorsionDamper = Annotated[float, Quantity("N*m*s/rad", least=0.0)]
FreeLength = Annotated[float, Quantity("m", least=0.0)]


class SpringEnd(Record):
    """Where a spring is fixed."""

    link: str
    """the link, or `"ground"`"""
    at: Point
    """where, in the drawn position"""


class _Elastic(Record):
    """What all springs share."""

    @model_validator(mode="after")
    def _does_something(self) -> Self:
        if not (getattr(self, "stiffness", 1.0) or getattr(self, "damping", 1.0)):
            refuse([(("stiffness",), "must be positive, or damping, got neither")])
        return self


class LineSpring(_Elastic):
    """A spring and a damper between two points: it pulls with k (l − l0) + c l'."""

    kind: Literal["spring"] = "spring"
    between: tuple[SpringEnd, SpringEnd]
    """its two ends, each `{ link = "...", at = point }`"""
    stiffness: Stiffness = 0.0
    """k"""
    damping: Damper = 0.0
    """c"""
    free_length: FreeLength | None = None
    """l0, at which it does not pull; as long as drawn if not given"""

    @model_validator(mode="after")
    def _has_a_direction(self) -> Self:
        a, b = self.between
        if a.at == b.at and self.free_length != 0.0:
            refuse(
                [(("between",), "must be two different points unless free_length = 0, got the same twice")]
            )
        return self


class TorsionSpring(_Elastic):
    """A spring and a damper about a hinge: they turn back with k (φ − φ0) + c φ'."""

    kind: Literal["torsion"] = "torsion"
    joint: str
    """the hinge"""
    stiffness: TorsionStiffness = 0.0
    """k"""
    damping: TorsionDamper = 0.0
    """c"""
    free_angle: Angle = 0.0
    """φ0, at which it does not turn, from the drawn position: the turn of the joint's first link that is not the ground
    against the other, about the joint's axis"""


Spring = Annotated[LineSpring | TorsionSpring, Field(discriminator="kind")]
