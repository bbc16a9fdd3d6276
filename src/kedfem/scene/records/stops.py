"""Limits of joints: stops that a hinge or slide runs against, with stiffness and damping."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from kedfem.scene.records.base import Fault, Record, refuse
from kedfem.scene.records.springs import Damper, TorsionDamper
from kedfem.scene.records.units import Angle, Length, Quantity

StopStiffness = Annotated[float, Quantity("N/m", above=0.0)]
TorsionStopStiffness = Annotated[float, Quantity("N*m/rad", above=0.0)]


class _Range(Record):
    """What both kinds share."""

    @model_validator(mode="after")
    def _holds_the_reference_position(self) -> Self:
        lower, upper = getattr(self, "lower", None), getattr(self, "upper", None)
        unit = "rad" if self.__class__ is AngleLimit else "m"
        faults: list[Fault] = []
        if lower is None and upper is None:
            faults.append((("lower",), f"is required, or upper [{unit}], got neither"))
        elif lower is not None and upper is not None and lower >= upper:
            faults.append((("lower",), f"must be below upper {upper:.6g} [{unit}], got {lower:.6g}"))
        else:
            drawn = f"0 [{unit}], the reference position, which must be within the limits"
            if lower is not None and lower > 0.0:
                faults.append((("lower",), f"must be at most {drawn}, got {lower:.6g}"))
            if upper is not None and upper < 0.0:
                faults.append((("upper",), f"must be at least {drawn}, got {upper:.6g}"))
        refuse(faults)
        return self

    @property
    def range(self) -> tuple[float, float]:
        """Lower and upper end [rad or m]; −inf and inf where there is none."""
        lower, upper = getattr(self, "lower", None), getattr(self, "upper", None)
        return (-math.inf if lower is None else lower, math.inf if upper is None else upper)


class TravelLimit(_Range):
    """Stops along a slide: beyond one they push back with k s + c s', s how far beyond, and never pull.

    The travel is that of the joint's first link that is not the ground against the other, from the reference position.
    """

    kind: Literal["travel"] = "travel"
    joint: str
    """a prismatic or cylindrical joint that no drive moves"""
    lower: Length | None = None
    """least travel that is free; no stop there if not given"""
    upper: Length | None = None
    """largest travel that is free; no stop there if not given"""
    stiffness: StopStiffness
    """k of the stops"""
    damping: Damper = 0.0
    """c of the stops"""


class AngleLimit(_Range):
    """Stops about a hinge: beyond one they turn back with k s + c s', s how far beyond, and never pull.

    The angle is the rotation of the joint's first link that is not the ground against the other, about the joint's axis,
    from the reference position.
    """

    kind: Literal["angle"] = "angle"
    joint: str
    """a hinge, cylindrical joint or screw that no drive moves"""
    lower: Angle | None = None
    """least angle that is free; no stop there if not given"""
    upper: Angle | None = None
    """largest angle that is free; no stop there if not given"""
    stiffness: TorsionStopStiffness
    """k of the stops"""
    damping: TorsionDamper = 0.0
    """c of the stops"""


Limit = Annotated[TravelLimit | AngleLimit, Field(discriminator="kind")]
