"""Cross-sections of beams."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from kedfem.errors import Fault
from kedfem.scene.records.base import Record, refuse
from kedfem.scene.records.units import PositiveLength, Quantity

Area = Annotated[float, Quantity("m^2", above=0.0)]
AreaMoment = Annotated[float, Quantity("m^4", above=0.0)]
ShearCoefficient = Annotated[float, Quantity("1", above=0.0, most=1.0)]


class RectangleSection(Record):
    """A rectangle."""

    kind: Literal["rectangle"] = "rectangle"
    width: PositiveLength
    """across the line, in the xy plane unless `up` says otherwise"""
    thickness: PositiveLength
    """across line and width"""


class RoundSection(Record):
    """A full circle."""

    kind: Literal["round"] = "round"
    diameter: PositiveLength
    """its diameter"""


class TubeSection(Record):
    """A ring between two circles."""

    kind: Literal["tube"] = "tube"
    diameter: PositiveLength
    """outer diameter"""
    wall: PositiveLength
    """thickness of the wall, less than half the diameter"""

    @model_validator(mode="after")
    def _hollow(self) -> Self:
        half = self.diameter / 2
        message = f"must be less than half the diameter {half:.6g} [m], got {self.wall:.6g}"
        refuse([Fault(("wall",), message)] if self.wall >= half else [])
        return self


class ConstantsSection(Record):
    """Any section with two principal axes, by its constants; its shear stresses are not known."""

    kind: Literal["constants"] = "constants"
    area: Area
    """A"""
    second_moment_width: AreaMoment
    """∫ y² dA with y along the width: bending in the plane of line and width"""
    second_moment_thickness: AreaMoment
    """∫ z² dA with z along the thickness: bending in the plane of line and thickness"""
    torsion_constant: AreaMoment
    """J: torque per shear modulus and twist; not the polar moment, unless the section is round"""
    width: PositiveLength
    """extent along y: the outer fibres are at half of it on both sides"""
    thickness: PositiveLength
    """extent along z"""
    shear_coefficient_width: ShearCoefficient = 5.0 / 6.0
    """part of the area that carries a shear force along y"""
    shear_coefficient_thickness: ShearCoefficient = 5.0 / 6.0
    """part of the area that carries a shear force along z"""


SectionShape = Annotated[
    RectangleSection | RoundSection | TubeSection | ConstantsSection, Field(discriminator="kind")
]
