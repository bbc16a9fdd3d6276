"""Record of a whole scene, whose tables are checked independently of each other."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import Field, PrivateAttr

from kedfem.scene.records.analysis import Analysis, Output
from kedfem.scene.records.base import FileName, Line, Name, Record
from kedfem.scene.records.drives import Drive, Gear, MotionLaw
from kedfem.scene.records.expressions import Parameter, ParameterName
from kedfem.scene.records.fatigue import Fatigue
from kedfem.scene.records.force_elements import Limit, Motor, Spring
from kedfem.scene.records.joints import Joint
from kedfem.scene.records.links import LinkScene
from kedfem.scene.records.loads import Body, Load
from kedfem.scene.records.materials import Damping, Material
from kedfem.scene.records.patterns import Pattern
from kedfem.scene.records.points import AccelerationVector, Point


class Scene(Record):
    """A linkage with its drives and loads, and the analysis and output that are requested.

    Point fields hold coordinates, and numbers are in SI units; `materials` includes the built-in ones. `scene_from` and
    `read_scene` make scenes and check their tables against each other.
    """

    title: Line = ""
    """a line about the scene, for pictures and summaries"""
    include: tuple[FileName, ...] = Field(default=(), max_length=0)
    """other scene files (one, or a list) whose tables this scene has too, see above; read before anything else"""
    parameters: dict[ParameterName, Parameter] = Field(default_factory=dict)
    """numbers by name, with or without a unit, for expressions anywhere in the scene; may be expressions of each other"""
    gravity: AccelerationVector = (0.0, 0.0, 0.0)
    """acceleration of free fall; none if not given"""
    points: dict[Name, Point] = Field(default_factory=dict)
    """points by name: coordinates or a construction"""
    materials: dict[Name, Material] = Field(default_factory=dict)
    """materials of this scene, beside those that are built in; one of the same name replaces them"""
    links: dict[Name, LinkScene] = Field(min_length=1)
    """the links by name"""
    joints: dict[Name, Joint] = Field(default_factory=dict)
    """the joints by name; required with a drive"""
    gears: dict[Name, Gear] = Field(default_factory=dict)
    """joints whose motions are in proportion: gears, belts, racks"""
    drive: Drive | None = None
    """what moves the mechanism; without one it moves by itself: under motors, springs, gravity and other loads, from its
    initial speeds, with co-rotational frames"""
    drives: dict[Name, Drive] = Field(default_factory=dict)
    """several drives, by name, instead of `drive`"""
    motors: dict[Name, Motor] = Field(default_factory=dict)
    """torques and forces on joints that are not driven"""
    springs: dict[Name, Spring] = Field(default_factory=dict)
    """springs and dampers between links, or links and the ground"""
    limits: dict[Name, Limit] = Field(default_factory=dict)
    """stops that a hinge or slide runs against"""
    loads: dict[Name, Load] = Field(default_factory=dict)
    """forces, beside gravity and inertia"""
    bodies: dict[Name, Body] = Field(default_factory=dict)
    """rigid bodies attached to links"""
    patterns: dict[Name, Pattern] = Field(default_factory=dict)
    """tables that are repeated, turned about an axis or shifted; what is stored has them written out"""
    damping: Damping = Damping()
    """damping of the elastic motion"""
    analysis: Analysis
    """how long, in which steps"""
    fatigue: Fatigue | None = None
    """damage by the stresses of a motion that repeats itself; needs `pip install 'kedfem[fatigue]'`"""
    output: Output = Output()
    """what is written"""

    _source: str | None = PrivateAttr(None)
    _folder: Path = PrivateAttr(Path())
    _stem: str = PrivateAttr("scene")
    _unit_warnings: tuple[str, ...] = PrivateAttr(())
    _checked: bool = PrivateAttr(False)
    _as_given: Mapping[str, Any] = PrivateAttr(default_factory=dict)

    def __eq__(self, other: object) -> bool:
        """Whether all keys have the same values, however they were written."""
        return isinstance(other, Scene) and dict(self) == dict(other)

    __hash__ = None  # type: ignore[assignment]  # its tables have none

    @property
    def source(self) -> str | None:
        """Text of the scene file, or None for a scene from Python."""
        return self._source

    @property
    def folder(self) -> Path:
        """Folder to which file names in the scene are relative."""
        return self._folder

    @property
    def as_given(self) -> Mapping[str, Any]:
        """Keys and values as given, expressions included, with the tables of included files."""
        return self._as_given

    @property
    def unit_warnings(self) -> tuple[str, ...]:
        """Warnings about numbers without a unit that probably are in another one than SI."""
        return self._unit_warnings

    @property
    def checked(self) -> bool:
        """Whether its tables have been checked against each other, as `scene_from` and `read_scene` do."""
        return self._checked

    @property
    def motion(self) -> MotionLaw | None:
        """Law of the driven joint; None without a drive and with several."""
        drives = list(self.all_drives.values())
        return drives[0].motion if len(drives) == 1 else None

    @property
    def driven(self) -> str | None:
        """Name of the driven joint, the first if there are several; None without a drive."""
        return next(iter(self.driven_joints), None)

    @property
    def all_drives(self) -> dict[str, Drive]:
        """Drives by the name of their joint, or by `JOINT.DRIVE` if several drive one joint."""
        named = self.drives if self.drive is None else {"": self.drive, **self.drives}
        count = Counter(drive.joint for drive in named.values())
        return {x.joint if count[x.joint] == 1 else f"{x.joint}.{name}": x for name, x in named.items()}

    @property
    def driven_joints(self) -> dict[str, list[Drive]]:
        """Drives of each joint with a prescribed motion."""
        out: dict[str, list[Drive]] = {}
        for drive in self.all_drives.values():
            out.setdefault(drive.joint, []).append(drive)
        return out

    @property
    def results_folder(self) -> Path:
        """Folder of the results."""
        return self._folder / (self.output.folder or f"{self._stem}-results")
