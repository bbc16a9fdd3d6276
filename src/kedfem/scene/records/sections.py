"""Records of cross-sections of beams."""

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
        refuse(_too_thick("wall", self.wall, "half the diameter", self.diameter / 2))
        return self


class BoxSection(Record):
    """A rectangular tube."""

    kind: Literal["box"] = "box"
    width: PositiveLength
    """outer extent across the line, in the xy plane unless `up` says otherwise"""
    thickness: PositiveLength
    """outer extent across line and width"""
    wall: PositiveLength
    """thickness of all four walls, less than half the smaller extent"""

    @model_validator(mode="after")
    def _hollow(self) -> Self:
        half = min(self.width, self.thickness) / 2
        refuse(_too_thick("wall", self.wall, "half the smaller extent", half))
        return self


class ISection(Record):
    """An I or H profile with two equal flanges, a web and sharp corners; under torsion it warps freely."""

    kind: Literal["i"] = "i"
    width: PositiveLength
    """over both flanges, along the web: across the line, in the xy plane unless `up` says otherwise"""
    thickness: PositiveLength
    """of the whole section, across line and width: how wide the flanges are"""
    web: PositiveLength
    """how thick the web is, less than the section"""
    flange: PositiveLength
    """how thick each flange is, less than half the width"""

    @model_validator(mode="after")
    def _of_walls(self) -> Self:
        web = _too_thick("web", self.web, "the thickness", self.thickness)
        refuse(web + _too_thick("flange", self.flange, "half the width", self.width / 2))
        return self


class ConstantsSection(Record):
    """Any section with two principal axes, by its constants; shear stresses are not known."""

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


def _too_thick(key: str, wall: float, name: str, limit: float) -> list[Fault]:
    """The fault of a wall that is not thinner than the named space for it."""
    message = f"must be less than {name} {limit:.6g} [m], got {wall:.6g}"
    return [Fault((key,), message)] if wall >= limit else []


SectionShape = Annotated[
    RectangleSection | RoundSection | TubeSection | BoxSection | ISection | ConstantsSection, Field(discriminator="kind")
]
