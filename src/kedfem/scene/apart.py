"""The point of a joint: one, or one for each of its links where these are drawn a little apart."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import PlainSerializer, TypeAdapter, ValidatorFunctionWrapHandler, WrapValidator

from kedfem.scene.points import XYZ, Point, is_construction, placed
from kedfem.scene.units import Length

BY_LINK: TypeAdapter[dict[str, XYZ]] = TypeAdapter(dict[str, Point])


class Apart(tuple[float, float, float]):
    """A joint's point on its first link [m], and those on both.

    points : by link [m]
    """

    points: dict[str, XYZ]


def apart(points: Mapping[str, XYZ]) -> Apart:
    """Points by link, the first link's first."""
    made = Apart(next(iter(points.values()), (0.0, 0.0, 0.0)))
    made.points = dict(points)
    return made


def joint_point(value: object, coordinates: ValidatorFunctionWrapHandler) -> Any:
    """A point, or points in a table by link."""
    by_link = isinstance(value, Mapping) and not is_construction(value)
    return apart(BY_LINK.validate_python(value)) if by_link else placed(value, coordinates)


def stored_point(at: XYZ) -> object:
    """What `joint_point` makes the same of."""
    return dict(at.points) if isinstance(at, Apart) else at


JointPoint = Annotated[
    tuple[Length, Length, Length], WrapValidator(joint_point), PlainSerializer(stored_point)
]
