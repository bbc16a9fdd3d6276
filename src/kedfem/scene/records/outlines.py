"""Records of outlines of plates, with corners, arcs and round holes, and checks that they bound an area."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import PlainSerializer, PlainValidator, TypeAdapter, field_validator, model_validator

from kedfem.arrays import Bool, Float
from kedfem.errors import Fault
from kedfem.scene.records.base import Record, refuse
from kedfem.scene.records.points import XYZ, Point, is_construction
from kedfem.scene.records.units import PositiveLength, fault

CHORDS = 64  # number of chords of an arc, for checks only
NEAR = 1e-9  # relative to the size of the outline


class Arc(Record):
    """A circular arc of an outline, from the point before it."""

    via: Point
    """a point on the arc, between its ends"""
    to: Point
    """the end of the arc"""


class Hole(Record):
    """A round hole through a plate; a joint at its centre acts on its surface."""

    at: Point
    """the centre"""
    diameter: PositiveLength
    """the diameter"""


CORNER: TypeAdapter[XYZ] = TypeAdapter(Point)


def outline_item(value: object) -> XYZ | Arc:
    """An arc if the item is a table, else a corner."""
    arc = isinstance(value, Arc) or (isinstance(value, dict) and not is_construction(value))
    return Arc.model_validate(value) if arc else CORNER.validate_python(value)


def stored_item(item: XYZ | Arc) -> object:
    """Raw value from which `outline_item` makes the same item."""
    return item.model_dump() if isinstance(item, Arc) else item


OutlineItem = Annotated[Point | Arc, PlainValidator(outline_item), PlainSerializer(stored_item)]


class Profile(Record):
    """An area bounded by an outline, without its holes, and a thickness."""

    outline: tuple[OutlineItem, ...]
    """corners (points) and arcs `{ via = P, to = Q }` in order; closes by itself"""
    holes: tuple[Hole, ...] = ()
    """round holes"""
    thickness: PositiveLength
    """along z"""

    @field_validator("outline")
    @classmethod
    def _closed_once(cls, outline: tuple[XYZ | Arc, ...]) -> tuple[XYZ | Arc, ...]:
        if outline and isinstance(outline[0], Arc):
            raise fault("must start with a point, got an arc")
        outline = outline[:-1] if len(outline) > 1 and outline[-1] == outline[0] else outline
        if len(outline) + sum(isinstance(item, Arc) for item in outline) < 3:
            raise fault(f"must be at least three points, got {len(outline)}")
        return outline

    @model_validator(mode="after")
    def _bounds_an_area(self) -> Profile:
        refuse(profile_faults(self))
        return self


def profile_faults(profile: Profile) -> list[Fault]:
    """Faults of a profile that is not an area with holes inside it: places and messages."""
    ends = [(item.via, item.to) if isinstance(item, Arc) else (item,) for item in profile.outline]
    points = [point for group in ends for point in group] + [hole.at for hole in profile.holes]
    if not np.isfinite(points).all():  # a point that could not be constructed is another fault
        return []
    heights = [point[2] for group in ends for point in group]
    if max(heights) - min(heights) > NEAR * max(1.0, abs(heights[0])):
        got = f"got z from {min(heights):.6g} to {max(heights):.6g}"
        return [Fault(("outline",), f"must lie in one z plane [m], {got}")]
    try:
        polygon, straight = outline_polygon(profile.outline)
    except ValueError as reason:
        return [Fault(("outline",), str(reason))]
    crossing = crossing_at(polygon)
    if crossing is not None:
        near = f"near ({crossing[0]:.6g}, {crossing[1]:.6g}) [m]"
        return [Fault(("outline",), f"must not cross or touch itself, got that {near}")]
    return hole_faults(profile.holes, polygon, straight)


def hole_faults(
    holes: tuple[Hole, ...], polygon: Float[np.ndarray, "n 2"], straight: Bool[np.ndarray, " n"]
) -> list[Fault]:
    """Faults of holes that cross the outline or meet another hole."""
    faults: list[Fault] = []
    for i, hole in enumerate(holes):
        centre, radius = np.array(hole.at[:2]), 0.5 * hole.diameter
        wall = edge_distance(centre, polygon, straight) if inside(centre, polygon) else 0.0
        if wall <= radius:
            got = f"got radius {radius:.6g} with {wall:.6g} to the edge"
            faults.append(Fault(("holes", i), f"must lie inside the outline [m], {got}"))
        for j, other in enumerate(holes[:i]):
            between = float(np.linalg.norm(centre - other.at[:2])) - radius - 0.5 * other.diameter
            if between <= 0.0:
                got = f"got an overlap of {-between:.6g}"
                faults.append(Fault(("holes", i), f"must not meet holes[{j}] [m], {got}"))
    return faults


def outline_polygon(outline: tuple[Any, ...]) -> tuple[Float[np.ndarray, "n 2"], Bool[np.ndarray, " n"]]:
    """Polygon of an outline, with chords in place of arcs.

    Parameters
    ----------
    outline : corners and arcs of one z plane.

    Returns
    -------
    polygon : (n, 2) [m]
    straight : (n,) True where the side from this corner to the next is straight, not a chord.

    Raises
    ------
    ValueError
        The three points of an arc lie on one line.
    """
    corners, straight = [np.array(outline[0][:2])], []
    for i, item in enumerate(outline[1:], start=1):
        if isinstance(item, Arc):
            points = arc_points(corners[-1], np.array(item.via[:2]), np.array(item.to[:2]))
            if points is None:
                raise ValueError(f"must have arcs through three points not in line, got [{i}] with its points in line")
            corners += list(points)
            straight += [False] * len(points)
        else:
            corners.append(np.array(item[:2]))
            straight.append(True)
    polygon = np.array(corners)
    if np.allclose(polygon[0], polygon[-1], rtol=0.0, atol=NEAR * np.ptp(polygon)):
        return polygon[:-1], np.array(straight)
    return polygon, np.array([*straight, True])


def arc_points(
    P: Float[np.ndarray, "2"], V: Float[np.ndarray, "2"], Q: Float[np.ndarray, "2"]
) -> Float[np.ndarray, "n 2"] | None:
    """Points of the arc from P through V to Q, without P; None if the three lie on one line."""
    p, q = P - V, Q - V
    twice_area = p[0] * q[1] - p[1] * q[0]
    if abs(twice_area) <= NEAR * (p @ p + q @ q):
        return None
    across = np.array([q[1] * (p @ p) - p[1] * (q @ q), p[0] * (q @ q) - q[0] * (p @ p)])
    centre = V + across / (2.0 * twice_area)
    radius = np.linalg.norm(P - centre)
    start, via, end = (np.arctan2(*(point - centre)[::-1]) for point in (P, V, Q))
    turn = (end - start) % (2.0 * np.pi)
    turn = turn if (via - start) % (2.0 * np.pi) < turn else turn - 2.0 * np.pi
    angles = start + turn * np.arange(1, CHORDS + 1) / CHORDS
    return np.asarray(centre + radius * np.column_stack([np.cos(angles), np.sin(angles)]))


def crossing_at(polygon: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "2"] | None:
    """A point near which a polygon crosses or touches itself, or None."""
    from shapely import Polygon, get_coordinates, is_valid_reason, minimum_clearance, minimum_clearance_line

    near, area = NEAR * np.ptp(polygon), Polygon(polygon)
    sides = np.linalg.norm(np.roll(polygon, -1, axis=0) - polygon, axis=1)
    if sides.min() <= near:  # a corner that is given twice, which shapely accepts
        return np.asarray(polygon[sides.argmin()])
    if not area.is_valid:
        return np.array(is_valid_reason(area).partition("[")[2].rstrip("]").split(), dtype=float)
    return np.asarray(get_coordinates(minimum_clearance_line(area))[0]) if minimum_clearance(area) <= near else None


def edge_distance(
    point: Float[np.ndarray, "2"], polygon: Float[np.ndarray, "n 2"], straight: Bool[np.ndarray, " n"]
) -> float:
    """Distance of a point from the straight sides of an outline and the ends of the chords of its arcs."""
    from shapely import MultiLineString, MultiPoint, Point

    sides = np.stack([polygon, np.roll(polygon, -1, axis=0)], axis=1)[straight]
    drawn = [MultiPoint(polygon), MultiLineString([*sides])]
    return float(min(each.distance(Point(point)) for each in drawn if each))


def inside(point: Float[np.ndarray, "2"], polygon: Float[np.ndarray, "n 2"]) -> bool:
    """Whether a point is inside a polygon."""
    from shapely import Point, Polygon

    return bool(Polygon(polygon).contains(Point(point)))
