"""Loads and attached bodies."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from kedfem.scene.base import Record, refuse
from kedfem.scene.drives import table_faults
from kedfem.scene.points import Point, as_vector
from kedfem.scene.units import Mass, Number, Pressure, Quantity, Time

Force = Annotated[float, Quantity("N")]
ForcePerVolume = Annotated[float, Quantity("N/m^3")]
Inertia = Annotated[float, Quantity("kg*m^2")]
PositiveInertia = Annotated[float, Quantity("kg*m^2", above=0.0)]
ForceVector = Annotated[tuple[Force, Force, Force], BeforeValidator(as_vector)]
BodyVector = Annotated[tuple[ForcePerVolume, ForcePerVolume, ForcePerVolume], BeforeValidator(as_vector)]
SurfaceVector = Annotated[tuple[Pressure, Pressure, Pressure], BeforeValidator(as_vector)]


class Factor(Record):
    """What a load is multiplied by over time: linear between the times, held before and after."""

    time: tuple[Time, ...]
    """times, increasing"""
    value: tuple[Number, ...]
    """factor at these times"""

    @model_validator(mode="after")
    def _one_value_per_time(self) -> Self:
        refuse(table_faults(self.time, "value", self.value))
        return self


def constant_as_table(value: Any) -> Any:
    """A constant factor as a table of one time."""
    return value if isinstance(value, (dict, Factor)) else {"time": [0.0], "value": [value]}


FactorOverTime = Annotated[Factor, BeforeValidator(constant_as_table)]
ONE = Factor(time=(0.0,), value=(1.0,))


class ForceLoad(Record):
    """A force at a point of a link."""

    kind: Literal["force"] = "force"
    link: str
    """the link it acts on"""
    at: Point
    """where, in the drawn position"""
    vector: ForceVector
    """the force"""
    frame: Literal["world", "link"] = "world"
    """world: keeps its direction; link: given in the drawn position, turns with the link from there"""
    factor: FactorOverTime = ONE
    """a number, or `{ time = [...], value = [...] }`: linear between, held outside"""


class BodyLoad(Record):
    """A force per volume of a link."""

    kind: Literal["body"] = "body"
    link: str
    """the link it acts on"""
    vector: BodyVector
    """the force per volume"""
    frame: Literal["world", "link"] = "world"
    """world: keeps its direction; link: given in the drawn position, turns with the link from there"""
    factor: FactorOverTime = ONE
    """a number, or `{ time = [...], value = [...] }`: linear between, held outside"""


class SurfaceLoad(Record):
    """A force per area on a face of a solid link."""

    kind: Literal["surface"] = "surface"
    link: str
    """the link it acts on"""
    at: Point
    """a point of the flat or cylindrical face, in the drawn position"""
    vector: SurfaceVector
    """the force per area"""
    frame: Literal["world", "link"] = "world"
    """world: keeps its direction; link: given in the drawn position, turns with the link from there"""
    factor: FactorOverTime = ONE
    """a number, or `{ time = [...], value = [...] }`: linear between, held outside"""


Load = Annotated[ForceLoad | BodyLoad | SurfaceLoad, Field(discriminator="kind")]


class Flywheel(Record):
    """A disc on a bore, turning about the axis of the joint there."""

    kind: Literal["flywheel"] = "flywheel"
    link: str
    """the link that carries it"""
    at: Point
    """the joint's point: the bore that carries it"""
    inertia: PositiveInertia
    """moment of inertia about the joint's axis"""
    mass: Mass = 0.0
    """its mass, on the axis"""


class PointMass(Record):
    """A mass without extension."""

    kind: Literal["point_mass"] = "point_mass"
    link: str
    """the link that carries it"""
    at: Point
    """the joint's point: the bore that carries it"""
    mass: Annotated[float, Quantity("kg", above=0.0)]
    """its mass"""


class RigidBody(Record):
    """A rigid body with mass and full inertia."""

    kind: Literal["rigid_body"] = "rigid_body"
    link: str
    """the link that carries it"""
    at: Point
    """the joint's point: the bore that carries it"""
    mass: Annotated[float, Quantity("kg", above=0.0)]
    """its mass"""
    inertia: tuple[Inertia, Inertia, Inertia, Inertia, Inertia, Inertia]
    """tensor about its centre, as drawn: Ixx, Iyy, Izz, Ixy, Iyz, Izx, with Ixy = −∫xy dm and so on"""
    centre: Point
    """its centre of mass in the drawn position"""

    @model_validator(mode="after")
    def _possible_inertia(self) -> Self:
        a, b, c = np.linalg.eigvalsh(inertia_tensor(self.inertia))
        wrong = a < -1e-9 * abs(c) or c > (a + b) * (1.0 + 1e-9)
        message = (
            "must have principal moments that are positive, none larger than the sum of the others [kg*m^2], "
            f"got {a:.6g}, {b:.6g} and {c:.6g}"
        )
        refuse([(("inertia",), message)] if wrong else [])
        return self


Body = Annotated[Flywheel | PointMass | RigidBody, Field(discriminator="kind")]


def inertia_tensor(inertia: tuple[float, ...]) -> np.ndarray:
    """The (3, 3) tensor [kg m²] of Ixx, Iyy, Izz, Ixy, Iyz, Izx."""
    xx, yy, zz, xy, yz, zx = inertia
    return np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])
