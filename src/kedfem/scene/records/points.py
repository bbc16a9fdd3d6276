"""Records of points by coordinates, names and constructions, and of vectors and axes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, PlainSerializer, TypeAdapter, ValidatorFunctionWrapHandler, WrapValidator

from kedfem.scene.records.base import Record
from kedfem.scene.records.units import Angle, Length, Number, PositiveLength, Quantity, fault
from kedfem.scene.records.wording import nearest, shown, unknown_name

XYZ = tuple[float, float, float]
AXES: dict[str, XYZ] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
MARKS = {"from", "between", "along", "distances"}
"""Keys that distinguish one construction of a point from others."""
FARTHEST = 1e100  # m: squares of distances can still be formed
UNIT = 1e-15  # largest deviation from length 1 of a vector that is not normalized, so that it is read again unchanged
NO_PLACE = "must be constructed from points that are known and near, got one at no place"
UNPLACED: XYZ = (math.nan, math.nan, math.nan)  # a named point that could not be constructed

_known_points: ContextVar[Mapping[str, XYZ] | None] = ContextVar("known_points", default=None)


@contextmanager
def known_points(points: Mapping[str, XYZ]) -> Iterator[None]:
    """Allow names of these points in point fields within this context."""
    token = _known_points.set(points)
    try:
        yield
    finally:
        _known_points.reset(token)


def padded(value: object, what: str = "a point: a name, two or three coordinates [m], or a construction") -> object:
    """Two or three coordinates as three: z = 0 unless given."""
    value = value.tolist() if hasattr(value, "tolist") else value
    if isinstance(value, (list, tuple)) and len(value) in {2, 3}:
        return (*value, 0.0) if len(value) == 2 else tuple(value)
    raise fault(f"must be {what}, got {shown(value)}")


def placed(value: object, coordinates: ValidatorFunctionWrapHandler) -> Any:
    """Coordinates of a point field, which holds them, a name or a construction."""
    if isinstance(value, Mapping):
        xyz = construction_of(value).model_validate(value).xyz()
        if not all(math.isfinite(x) and abs(x) < FARTHEST for x in xyz):
            raise fault(NO_PLACE)
        return xyz
    if not isinstance(value, str):
        return coordinates(padded(value))
    points = _known_points.get()
    if points is None:
        raise fault(f"must be coordinates in a record that is made outside a scene, got {value!r}")
    if value not in points:
        alike = [name for name in points if ("." in name) == ("." in value)]
        raise fault(unknown_name("a point", value, alike))
    return points[value]


def unit_axis(value: object, components: ValidatorFunctionWrapHandler) -> Any:
    """The unit vector of an axis given as 'x', 'y', 'z', a vector, or by two points."""
    if isinstance(value, str) and value in AXES:
        return AXES[value]
    if isinstance(value, Mapping):
        vector = AxisPoints.model_validate(value).vector()
    else:
        vector = components(padded(value, "'x', 'y', 'z', a vector, or { from = point, to = point }"))
    size = math.hypot(*vector)
    if size == 0.0:
        raise fault("must be a direction, got a vector of length zero")
    if abs(size - 1.0) < UNIT:
        return tuple(vector)
    return tuple(part / size for part in vector)


def as_vector(value: object) -> object:
    """Two or three components as three: z = 0 unless given."""
    return padded(value, "a vector of two or three components")


Point = Annotated[tuple[Length, Length, Length], WrapValidator(placed)]
Axis = Annotated[tuple[Number, Number, Number], WrapValidator(unit_axis)]
Acceleration = Annotated[float, Quantity("m/s^2")]
AccelerationVector = Annotated[tuple[Acceleration, Acceleration, Acceleration], BeforeValidator(as_vector)]


class AxisPoints(Record):
    """The direction of an axis from one point to another."""

    start: Point = Field(alias="from")
    """the point that it comes from"""
    end: Point = Field(alias="to")
    """the point that it goes to"""

    def vector(self) -> XYZ:
        """Vector from one point to the other [m]."""
        x, y, z = (q - p for p, q in zip(self.start, self.end, strict=True))
        return (x, y, z)


class PolarPoint(Record):
    """A point at a distance and an angle from another, in its xy plane."""

    start: Point = Field(alias="from")
    """the point to start from"""
    distance: Length
    """how far"""
    angle: Angle
    """in which direction, from the x axis towards the y axis"""

    def xyz(self) -> XYZ:
        """Coordinates [m]."""
        x, y, z = self.start
        return (x + self.distance * math.cos(self.angle), y + self.distance * math.sin(self.angle), z)


class CirclesPoint(Record):
    """The point at given distances from two others in their common xy plane, where two circles intersect."""

    centres: tuple[Point, Point] = Field(alias="from")
    """the two other points"""
    distances: tuple[PositiveLength, PositiveLength]
    """the distance from each"""
    side: Literal["left", "right"] = "left"
    """side of the line from the first to the second point, seen from +z"""

    def xyz(self) -> XYZ:
        """Coordinates [m]; a fault if the circles do not meet."""
        (ax, ay, az), (bx, by, bz) = self.centres
        a, b = self.distances
        if abs(az - bz) > 1e-9 * (a + b):
            raise fault(f"both points must have the same z [m], got {az:.12g} and {bz:.12g}")
        apart = math.hypot(bx - ax, by - ay)
        gap = max(apart - (a + b), abs(a - b) - apart)
        if gap > 1e-9 * (a + b) or apart == 0.0:
            raise fault(
                f"circles of radius {a:.6g} and {b:.6g} must meet [m], got centres {apart:.6g} apart: a gap of {gap:.6g}"
            )
        along = (a**2 - b**2 + apart**2) / (2.0 * apart)
        across = math.sqrt(max(a**2 - along**2, 0.0)) * (1.0 if self.side == "left" else -1.0)
        ex, ey = (bx - ax) / apart, (by - ay) / apart
        return (ax + along * ex - across * ey, ay + along * ey + across * ex, az)


class BetweenPoint(Record):
    """A point on the line between two others, or beside it."""

    between: tuple[Point, Point]
    """the two other points"""
    fraction: Number = 0.5
    """where on the line: 0 at the first, 1 at the second point"""
    offset: Length = 0.0
    """distance to the left of the line, in the xy plane"""

    def xyz(self) -> XYZ:
        """Coordinates [m]; a fault if there is no line to be beside of."""
        a, b = self.between
        x, y, z = (p + self.fraction * (q - p) for p, q in zip(a, b, strict=True))
        if self.offset == 0.0:
            return (x, y, z)
        ex, ey = b[0] - a[0], b[1] - a[1]
        flat = math.hypot(ex, ey)
        if flat == 0.0:
            raise fault("offset needs two points that differ in the xy plane, got the same x and y")
        return (x - self.offset * ey / flat, y + self.offset * ex / flat, z)


class LinePoint(Record):
    """The point of a line at a given distance from another point, where a circle intersects the line."""

    centre: Point = Field(alias="from")
    """the other point"""
    distance: PositiveLength
    """the distance from it"""
    along: tuple[Point, Point]
    """two points of the line, which may go on beyond them"""
    end: Literal["far", "near"] = "far"
    """which of two such points: the farther along the line from the first to the second, or the nearer"""

    def xyz(self) -> XYZ:
        """Coordinates [m]; a fault if the circle does not meet the line."""
        first, second = self.along
        length = math.dist(first, second)
        if length == 0.0:
            raise fault("along must be two different points, got one twice")
        unit = [(q - p) / length for p, q in zip(first, second, strict=True)]
        foot = sum(e * (c - p) for e, c, p in zip(unit, self.centre, first, strict=True))
        away = math.dist(self.centre, [p + foot * e for p, e in zip(first, unit, strict=True)])
        if away > self.distance * (1.0 + 1e-9):
            got = f"got a line {away:.6g} from it: a gap of {away - self.distance:.6g}"
            raise fault(f"the line must come within {self.distance:.6g} of the point [m], {got}")
        half = math.sqrt(max(self.distance**2 - away**2, 0.0))
        where = foot + (half if self.end == "far" else -half)
        x, y, z = (p + where * e for p, e in zip(first, unit, strict=True))
        return (x, y, z)


def construction_of(value: Mapping[str, Any]) -> type[PolarPoint | CirclesPoint | BetweenPoint | LinePoint]:
    """The construction that the keys of a point mean or most likely mean."""
    if not MARKS & value.keys():
        value = {nearest(str(key), MARKS) or key: item for key, item in value.items()}
    if "between" in value:
        return BetweenPoint
    if "along" in value:
        return LinePoint
    several = "distances" in value or isinstance(value.get("from"), (list, tuple))
    return CirclesPoint if several else PolarPoint


def is_construction(value: Mapping[str, Any]) -> bool:
    """Whether a table at a joint's `at` is a construction, not points by link."""
    return bool({"from", "between"} & value.keys())


BY_LINK: TypeAdapter[dict[str, XYZ]] = TypeAdapter(dict[str, Point])


class Apart(tuple[float, float, float]):
    """A joint's point on its first link [m], and those on both.

    points : by link [m]
    """

    points: dict[str, XYZ]


def apart(points: Mapping[str, XYZ]) -> Apart:
    """Points by link, that of the first link first."""
    made = Apart(next(iter(points.values()), (0.0, 0.0, 0.0)))
    made.points = dict(points)
    return made


def joint_point(value: object, coordinates: ValidatorFunctionWrapHandler) -> Any:
    """A point, or a table of points by link."""
    by_link = isinstance(value, Mapping) and not is_construction(value)
    return apart(BY_LINK.validate_python(value)) if by_link else placed(value, coordinates)


def stored_point(at: XYZ) -> object:
    """Raw value from which `joint_point` makes the same point."""
    return dict(at.points) if isinstance(at, Apart) else at


JointPoint = Annotated[tuple[Length, Length, Length], WrapValidator(joint_point), PlainSerializer(stored_point)]
