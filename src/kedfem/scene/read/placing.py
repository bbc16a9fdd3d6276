"""The points of a scene, from coordinates and from constructions that may refer to each other."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import TypeAdapter, ValidationError
from pydantic_core import PydanticCustomError

from kedfem.errors import Fault, Where
from kedfem.scene.checks.faults import record_faults
from kedfem.scene.records.points import UNPLACED, XYZ, Point, construction_of, is_construction, known_points
from kedfem.scene.records.units import fault

POINT: TypeAdapter[XYZ] = TypeAdapter(Point)


class Placement(Mapping[str, XYZ]):
    """Points by name, constructed on access; those that cannot be constructed are `UNPLACED`, with a fault.

    Parameters
    ----------
    points, joints : the given `points` and `joints` of the scene; joints have the names `joints.NAME`
    """

    def __init__(self, points: object, joints: object) -> None:
        self._unknown = points is not None and not isinstance(points, Mapping)
        self._raw: dict[str, tuple[Where, Any]] = {}
        for name, value in points.items() if isinstance(points, Mapping) else ():
            self._raw[str(name)] = (("points", str(name)), value)
        for name, value in joints.items() if isinstance(joints, Mapping) else ():
            self._raw[f"joints.{name}"] = (("joints", str(name)), value)
        self._placed: dict[str, XYZ] = {}
        self._pending: list[str] = []
        self.faults: list[Fault] = []

    def __iter__(self) -> Iterator[str]:
        return iter(self._raw)

    def __len__(self) -> int:
        return len(self._raw)

    def __contains__(self, name: object) -> bool:
        return self._unknown or name in self._raw

    def __getitem__(self, name: str) -> XYZ:
        if self._unknown:  # the points are not a table, which is a fault of its own
            return UNPLACED
        where, value = self._raw[name]
        if where[0] == "joints" and isinstance(value, Mapping) and by_link(value.get("at")):
            raise fault(f"must be one point, got {name!r}, which has one for each of its links")
        if name in self._pending:
            circle = " → ".join([*self._pending[self._pending.index(name) :], name])
            raise fault(f"must not be defined by itself, got {circle}")
        if name not in self._placed:
            self._pending.append(name)
            self._placed[name] = self._joint(value) if where[0] == "joints" else self._point(where, value)
            self._pending.pop()
        return self._placed[name]

    def place_all(self) -> None:
        """Construct all points, so that all faults are found."""
        for name in self:
            self[name]

    def _point(self, where: Where, value: Any) -> XYZ:
        try:
            with known_points(self):
                if isinstance(value, Mapping):
                    xyz = construction_of(value).model_validate(value).xyz()
                    return xyz if all(map(math.isfinite, xyz)) else UNPLACED
                return POINT.validate_python(value)
        except ValidationError as error:
            meant = construction_of(value) if isinstance(value, Mapping) else Point
            self.faults += record_faults(error, meant, value, where)
        except PydanticCustomError as reason:
            self.faults.append(Fault(where, reason.message()))
        return UNPLACED

    def _joint(self, value: Any) -> XYZ:
        """The point of a joint; its faults are reported with the joint."""
        try:
            with known_points(self):
                return POINT.validate_python(value["at"])
        except (ValidationError, KeyError, TypeError):
            return UNPLACED


def by_link(at: object) -> bool:
    """Whether a joint has a point for each of its links."""
    return isinstance(at, Mapping) and not is_construction(at)
