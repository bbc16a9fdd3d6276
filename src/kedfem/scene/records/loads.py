"""Loads, attached bodies and their inertia."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from kedfem.arrays import Float
from kedfem.errors import Fault
from kedfem.scene.records.base import JointName, LinkName, Record, refuse
from kedfem.scene.records.curves import ONE, FactorOver, Force, Torque
from kedfem.scene.records.points import Point, as_vector
from kedfem.scene.records.shapes import TwoPoints
from kedfem.scene.records.units import Mass, Pressure, Quantity, fault

Inertia = Annotated[float, Quantity("kg*m^2")]


def six_moments(value: object) -> object:
    """Ixx, Iyy, Izz, Ixy, Iyz, Izx from all six or from the first three, if x, y, z are principal axes."""
    if not isinstance(value, (list, tuple)) or len(value) == 6:
        return value
    if len(value) != 3:
        wanted = "must be three values [kg*m^2], Ixx, Iyy, Izz, or six, with Ixy, Iyz, Izx"
        raise fault(f"{wanted}, got {len(value) or 'none'}")
    return (*value, 0.0, 0.0, 0.0)


Moments = Annotated[tuple[Inertia, Inertia, Inertia, Inertia, Inertia, Inertia], BeforeValidator(six_moments)]


def inertia_tensor(inertia: Sequence[float]) -> np.ndarray:
    """The (3, 3) tensor [kg m²] of Ixx, Iyy, Izz, Ixy, Iyz, Izx."""
    xx, yy, zz, xy, yz, zx = inertia
    return np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])


def moments_of_inertia(J: Float[np.ndarray, "3 3"]) -> tuple[float, float, float, float, float, float]:
    """Ixx, Iyy, Izz, Ixy, Iyz, Izx of a tensor [kg m²]."""
    xx, yy, zz, xy, yz, zx = J[[0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]].tolist()
    return xx, yy, zz, xy, yz, zx


def inertia_faults(inertia: Sequence[float]) -> list[Fault]:
    """Faults, under the key `inertia`, of moments of inertia that no body can have."""
    a, b, c = np.linalg.eigvalsh(inertia_tensor(inertia))
    if a >= -1e-9 * abs(c) and c <= (a + b) * (1.0 + 1e-9):
        return []
    message = (
        "must have principal moments that are positive, none larger than the sum of the others [kg*m^2], "
        f"got {a:.6g}, {b:.6g} and {c:.6g}"
    )
    return [Fault(("inertia",), message)]


ForcePerVolume = Annotated[float, Quantity("N/m^3")]
ForcePerLength = Annotated[float, Quantity("N/m")]
PositiveInertia = Annotated[float, Quantity("kg*m^2", above=0.0)]
ForceVector = Annotated[tuple[Force, Force, Force], BeforeValidator(as_vector)]
TorqueVector = Annotated[tuple[Torque, Torque, Torque], BeforeValidator(as_vector)]
BodyVector = Annotated[tuple[ForcePerVolume, ForcePerVolume, ForcePerVolume], BeforeValidator(as_vector)]
LineVector = Annotated[tuple[ForcePerLength, ForcePerLength, ForcePerLength], BeforeValidator(as_vector)]
SurfaceVector = Annotated[tuple[Pressure, Pressure, Pressure], BeforeValidator(as_vector)]


class _Load(Record):
    """Base class of loads."""

    kind: str
    link: LinkName
    """the link it acts on"""
    factor: FactorOver = ONE
    """a number, or a curve over time or the drive's angle or travel: `{ over = "angle", at = [...], value = [...] }`"""


class _Directed(_Load):
    """Base class of loads with a direction."""

    frame: Literal["world", "link"] = "world"
    """world: keeps its direction; link: given in the reference position, rotates with the link from there"""


class ForceLoad(_Directed):
    """A force at a point of a link."""

    kind: Literal["force"] = "force"
    at: Point
    """where, in the reference position"""
    vector: ForceVector
    """the force"""


class BodyLoad(_Directed):
    """A force per volume of a link."""

    kind: Literal["body"] = "body"
    vector: BodyVector
    """the force per volume"""


class LineLoad(_Directed):
    """A force per length along the axis of a beam, or along a line of a rigid link."""

    kind: Literal["line"] = "line"
    vector: LineVector
    """the force per length of the axis"""
    end_vector: LineVector | None = None
    """the force per length where the load ends, changing linearly from `vector` to it; constant if not given"""
    between: TwoPoints | None = None
    """two points of the axis, from which and to which it acts; if not given on all of it. Of a rigid link two points on a
    straight line, of a polyline or a bar if not given those of its shape"""


class SurfaceLoad(_Directed):
    """A force per area on a face of a solid link."""

    kind: Literal["surface"] = "surface"
    at: Point
    """a point of the flat or cylindrical face, in the reference position"""
    vector: SurfaceVector
    """the force per area"""


class PressureLoad(_Load):
    """A pressure on a face of a solid or plane link or a flat side of a beam; it stays normal to the rotating face."""

    kind: Literal["pressure"] = "pressure"
    at: Point
    """a point of the flat or curved face, in the reference position; of a beam a point of one side of its section, half
    the width or thickness off its axis: it acts on this side of all of the axis in line with it"""
    pressure: Pressure
    """force per area, positive pushing on the face"""


class TorqueLoad(_Directed):
    """A torque on a bore, face or section of a link, which acts on its mean rotation."""

    exactly_one = ("at", "joint"), " [m], or a joint of the link"
    kind: Literal["torque"] = "torque"
    at: Point | None = None
    """a point on the axis of a bore or journal, or of a face; of a beam a point of its axis, of one in space one where it
    has a node; in the reference position"""
    joint: JointName | None = None
    """a joint of the link, on whose bore or face it acts, instead of `at`"""
    vector: TorqueVector
    """the torque"""


Load = Annotated[ForceLoad | BodyLoad | LineLoad | SurfaceLoad | PressureLoad | TorqueLoad, Field(discriminator="kind")]


class Flywheel(Record):
    """A disc on a bore, which rotates about the axis of the joint there."""

    kind: Literal["flywheel"] = "flywheel"
    link: LinkName
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
    link: LinkName
    """the link that carries it"""
    at: Point
    """where: anywhere on a link (of a planar beam on its axis)"""
    mass: Annotated[float, Quantity("kg", above=0.0)]
    """its mass"""


class RigidBody(Record):
    """A rigid body with mass and full inertia."""

    kind: Literal["rigid_body"] = "rigid_body"
    link: LinkName
    """the link that carries it"""
    at: Point
    """where: anywhere on a beam's axis or on a rigid link; on an elastic solid a bore, as of a joint"""
    mass: Annotated[float, Quantity("kg", above=0.0)]
    """its mass"""
    inertia: Moments
    """tensor about its centre in the reference position, along x, y, z of the scene: Ixx, Iyy, Izz, Ixy, Iyz, Izx, with
    Ixy = −∫xy dm and so on; three values: Ixx, Iyy, Izz where x, y, z are principal axes"""
    centre: Point
    """its centre of mass in the reference position"""

    @model_validator(mode="after")
    def _possible_inertia(self) -> Self:
        refuse(inertia_faults(self.inertia))
        return self


Body = Annotated[Flywheel | PointMass | RigidBody, Field(discriminator="kind")]
