"""The whole scene, validated at once."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

from pydantic import (
    Field,
    ModelWrapValidatorHandler,
    PrivateAttr,
    TypeAdapter,
    ValidationError,
    model_validator,
)

from kedfem.errors import SceneError
from kedfem.scene.analysis import Analysis, Output
from kedfem.scene.base import FileName, Line, Name, Record, plain
from kedfem.scene.checks import (
    drive_faults,
    gear_faults,
    joint_faults,
    link_faults,
    load_faults,
    reference_faults,
)
from kedfem.scene.combinations import combination_faults
from kedfem.scene.damping import Damping
from kedfem.scene.drives import Drive, Gear, MotionLaw
from kedfem.scene.fatigue import Fatigue
from kedfem.scene.fatigue_checks import fatigue_faults
from kedfem.scene.faults import fault_lines
from kedfem.scene.files import scene_folder, with_factor_tables, with_motion_tables
from kedfem.scene.frames import default_frames
from kedfem.scene.limits import analysis_faults, file_faults, planar_faults
from kedfem.scene.links import Joint, LinkScene, spelt_out
from kedfem.scene.loads import Body, Load
from kedfem.scene.materials import BUILT_IN, Material
from kedfem.scene.motors import Motor
from kedfem.scene.parameters import Parameter, ParameterName, with_expressions
from kedfem.scene.parts import Parts, scene_parts
from kedfem.scene.patterns import Pattern, in_patterns, steep_faults, with_patterns
from kedfem.scene.placing import Placement
from kedfem.scene.planes import beam_faults
from kedfem.scene.points import UNPLACED, XYZ, AccelerationVector, Point, known_points
from kedfem.scene.rigid_links import with_rigid_bodies
from kedfem.scene.springs import Spring
from kedfem.scene.stops import Limit
from kedfem.scene.timing import time_grid
from kedfem.scene.undriven import (
    frame_faults,
    initial_faults,
    limit_faults,
    motor_faults,
    spring_faults,
    undriven_faults,
)
from kedfem.scene.unit_plausibility import bare_numbers

MOST_STEPS = 1e9  # of an analysis: days of computing, and more rows than a disk holds
GRAVITY: TypeAdapter[XYZ] = TypeAdapter(AccelerationVector)


class Scene(Record):
    """A linkage, its drive and loads, and what to find out about it.

    Point fields hold coordinates and numbers are in SI; `materials` holds those that are built in too.

    Raises
    ------
    SceneError
        With all faults of the scene.
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
    _doubts: tuple[str, ...] = PrivateAttr(())
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
        """The folder that file names in the scene are relative to."""
        return self._folder

    @property
    def as_given(self) -> Mapping[str, Any]:
        """Keys and values as they were given, expressions and all, with the tables of included files."""
        return self._as_given

    @property
    def doubts(self) -> tuple[str, ...]:
        """Numbers without a unit that were probably meant in another one, in words."""
        return self._doubts

    @property
    def motion(self) -> MotionLaw | None:
        """How the driven joint moves; None without a drive, and with several."""
        drives = list(self.driven_joints.values())
        return drives[0].motion if len(drives) == 1 else None

    @property
    def driven(self) -> str | None:
        """Name of the driven joint, of several the first; None without a drive."""
        return next(iter(self.driven_joints), None)

    @property
    def driven_joints(self) -> dict[str, Drive]:
        """The joints whose motion is prescribed, and the drive of each."""
        own = [] if self.drive is None else [self.drive]
        return {drive.joint: drive for drive in [*own, *self.drives.values()]}

    @property
    def results_folder(self) -> Path:
        """Where the results go."""
        return self._folder / (self.output.folder or f"{self._stem}-results")

    @model_validator(mode="wrap")
    @classmethod
    def _all_at_once(cls, raw: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        if isinstance(raw, cls):
            return raw
        raw = plain(raw)
        if not isinstance(raw, Mapping):
            raise SceneError(f"must be a table of keys, got {raw!r}")
        written, (raw, wrong) = raw, with_expressions(raw, cls)
        repeated, (raw, more, origins) = raw.get("patterns"), with_patterns(raw, cls)
        wrong = wrong + more
        given, placement = raw, Placement(raw.get("points"), raw.get("joints"))
        points = {name: placement[name] for name in placement if not name.startswith("joints.")}
        if isinstance(links := raw.get("links"), Mapping):
            raw = {**raw, "links": {name: spelt_out(link) for name, link in links.items()}}
        if (
            isinstance(analysis := raw.get("analysis"), Mapping)
            and analysis.get("accuracy", "quick") != "quick"
        ):
            raw = {**raw, "links": left_open(raw.get("links"))}
        raw, faults = with_motion_tables(raw, scene_folder.get())
        raw, more = with_factor_tables(raw, scene_folder.get())
        faults = wrong + placement.faults + faults + more
        if (raw.get("drive") is not None or raw.get("drives")) and raw.get("joints", {}) == {}:
            faults.append("joints: is required with a drive, got nothing")
        with known_points(placement):
            raw = with_rigid_bodies(raw)
            try:
                scene = handler(prepared(raw, points))
            except ValidationError as error:
                scene, faults = None, faults + fault_lines(error, cls, raw)
            faults += cross_faults(scene_parts(raw, gravity_of(raw), scene_folder.get()))
        if scene is not None and not faults:
            faults = steep_faults(scene.links, repeated)
        if scene is None or faults:
            places = {each.partition(": ")[0] for each in wrong}
            rest = [each for each in faults[len(wrong) :] if each.partition(": ")[0] not in places]
            raise SceneError(list(dict.fromkeys(in_patterns(each, origins) for each in [*wrong, *rest])))
        if (steps := time_grid(scene).steps) > MOST_STEPS:
            raise SceneError(f"analysis: must end within {MOST_STEPS:.0e} steps, got {steps:.3g}")
        scene._doubts, scene._as_given = tuple(bare_numbers(given, cls)), written
        if scene.analysis.frames is None:
            scene.analysis.fill(frames=default_frames(bool(scene.driven_joints)))
        return scene


def left_open(links: Any) -> Any:
    """Raw links of a scene that asks for an accuracy: those with a shape that do not state their fidelity are `auto`."""
    if not isinstance(links, Mapping):
        return links
    return {
        name: {**link, "fidelity": "auto"}
        if isinstance(link, Mapping) and "shape" in link and not link.keys() & {"fidelity", "reduced"}
        else link
        for name, link in links.items()
    }


def prepared(raw: Mapping[str, Any], points: Mapping[str, XYZ]) -> dict[str, Any]:
    """A raw scene with its points placed and the built-in materials that its links name."""
    ready = dict(raw)
    if isinstance(raw.get("points"), Mapping):
        ready["points"] = {name: point for name, point in points.items() if point is not UNPLACED}
    own, links = raw.get("materials", {}), raw.get("links")
    if isinstance(own, Mapping) and isinstance(links, Mapping):
        named = {str(link.get("material")) for link in links.values() if isinstance(link, Mapping)}
        ready["materials"] = {**{name: BUILT_IN[name] for name in BUILT_IN if name in named}, **own}
    return ready


def gravity_of(raw: Mapping[str, Any]) -> tuple[float, ...]:
    """The gravity of a raw scene; none if it has a fault."""
    try:
        gravity: tuple[float, ...] = GRAVITY.validate_python(raw.get("gravity", [0.0, 0.0, 0.0]))
    except ValidationError:
        return (0.0, 0.0, 0.0)
    return gravity


def cross_faults(parts: Parts) -> list[str]:
    """The faults that only show when parts of the scene are seen together."""
    checks = (
        reference_faults,
        link_faults,
        joint_faults,
        drive_faults,
        gear_faults,
        load_faults,
        planar_faults,
        beam_faults,
        analysis_faults,
        file_faults,
        frame_faults,
        motor_faults,
        spring_faults,
        limit_faults,
        initial_faults,
        undriven_faults,
        fatigue_faults,
        combination_faults,
    )
    return [fault for check in checks for fault in check(parts)]
