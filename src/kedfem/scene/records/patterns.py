"""Records of patterns: tables of a scene that are repeated, rotated about an axis or shifted."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import Field, model_validator

from kedfem.errors import Fault
from kedfem.scene.records.base import Record, refuse
from kedfem.scene.records.links import Count
from kedfem.scene.records.points import Axis, Point, as_vector
from kedfem.scene.records.units import Angle, Length

Entries = dict[str, Any]


class Pattern(Record):
    """Repeated tables: NAME_1 as written; NAME_2 and so on are rotated, shifted or both, each further than the last.

    Coordinates, axes and vectors in the tables move, as do points of the pattern; named points of the scene stay. Names
    of links, joints and points of the pattern mean those of the same copy.
    """

    count: Count
    """how many there are"""
    rotation: Angle = 0.0
    """from each to the next: `"=360 deg / n"`"""
    about: Axis = (0.0, 0.0, 1.0)
    """axis of the rotation: `"x"`, `"y"`, `"z"` or a vector"""
    centre: Point = (0.0, 0.0, 0.0)
    """a point of this axis, by its coordinates"""
    shift: tuple[Length, Length, Length] = (0.0, 0.0, 0.0)
    """from each to the next, after the rotation: in the scene's axes, which no rotation changes"""
    phase: Angle = 0.0
    """from each to the next: by how much later on the drive's angle the factors of loads and springs are"""
    points: Entries = Field(default_factory=dict)
    """as those of the scene, like all tables that follow"""
    links: Entries = Field(default_factory=dict)
    """links"""
    joints: Entries = Field(default_factory=dict)
    """joints"""
    gears: Entries = Field(default_factory=dict)
    """gears"""
    drives: Entries = Field(default_factory=dict)
    """drives"""
    motors: Entries = Field(default_factory=dict)
    """motors"""
    springs: Entries = Field(default_factory=dict)
    """springs"""
    limits: Entries = Field(default_factory=dict)
    """limits"""
    loads: Entries = Field(default_factory=dict)
    """loads"""
    bodies: Entries = Field(default_factory=dict)
    """bodies"""
    probes: Entries = Field(default_factory=dict)
    """probes, which are those of `output`"""

    @model_validator(mode="before")
    @classmethod
    def _whole_vector(cls, raw: Any) -> Any:
        given = isinstance(raw, Mapping) and "shift" in raw
        return {**raw, "shift": as_vector(raw["shift"])} if given else raw

    @model_validator(mode="after")
    def _goes_on(self) -> Pattern:
        if self.count > 1 and not self.rotation and not any(self.shift):
            wanted = "is required, or a shift [m], so that copies are not in one place"
            refuse([Fault(("rotation",), f"{wanted}, got neither")])
        return self


SECTIONS = tuple(Pattern.model_fields)[6:]
