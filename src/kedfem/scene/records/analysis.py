"""Records of the analysis, its initial state and its output."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BeforeValidator,
    Field,
    PlainValidator,
    SerializerFunctionWrapHandler,
    StrictBool,
    StrictInt,
    TypeAdapter,
    model_serializer,
    model_validator,
)
from pydantic_core import PydanticCustomError

from kedfem.errors import Fault
from kedfem.scene.records.base import FileName, JointName, LinkName, Name, Record, refuse
from kedfem.scene.records.drives import EITHER_SPEED
from kedfem.scene.records.links import Count, Frames
from kedfem.scene.records.loads import ForceVector
from kedfem.scene.records.points import Point, as_vector
from kedfem.scene.records.units import PositiveTime, Quantity, Speed, fault

Velocity = Annotated[float, Quantity("m/s")]
VelocityVector = Annotated[tuple[Velocity, Velocity, Velocity], BeforeValidator(as_vector)]
AngularVelocity = Annotated[tuple[Speed, Speed, Speed], BeforeValidator(as_vector)]


def joint_speed(value: object) -> float:
    """A rotational speed or a speed. Whether it suits the joint is checked with the joint."""
    try:
        return EITHER_SPEED.number(value)
    except PydanticCustomError as reason:
        if not isinstance(value, str):
            raise
        raise fault(f"{reason.message()} (of a slider in m/s)") from None


class InitialForce(Record):
    """A force at a point of a link that deflects the mechanism and is released at the start."""

    link: LinkName
    """the link it acts on, an elastic one or a rigid one whose motion no drive prescribes"""
    at: Point
    """where, in the reference position"""
    force: ForceVector
    """the force, in the world"""


JointSpeed = Annotated[float, PlainValidator(joint_speed)]


class InitialMotion(Record):
    """Initial motion of a link."""

    at_least_one = ("velocity", "angular_velocity"), " [m/s], or angular_velocity [rad/s]"
    at: Point
    """a point of the link, in the reference position"""
    velocity: VelocityVector | None = None
    """velocity of this point; left open if not given"""
    angular_velocity: AngularVelocity | None = None
    """rotational speed of the link, a vector; left open if not given"""


Positive = Annotated[float, Quantity("1", above=0.0)]


WITHOUT_VIBRATION = ("static", "quasi-static")  # kinds that find each position by itself
ACCURACY: TypeAdapter[float] = TypeAdapter(Annotated[float, Quantity("1", above=0.0, below=1.0)])


def accuracy_or_quick(value: object) -> float | str:
    """A relative error, or the word that stands for plain defaults."""
    if isinstance(value, str) and value.strip() == "quick":
        return "quick"
    return ACCURACY.validate_python(value)


class Analysis(Record):
    """Duration, time steps and initial state of the analysis."""

    kind: Literal["transient", "steady", "static", "quasi-static"] = "transient"
    """transient: the motion from the start on; steady: the motion that repeats itself with the drive and the loads, found
    directly and written over one period, which is as many revolutions of the drive as it takes, or `end_time` where the
    drive does not turn at a constant speed, or there are several. static: the mechanism stands still in each position of
    its drive, or without one as a structure, and all loads balance, without inertia; quasi-static: it moves on, with
    the inertia of its rigid-body motion, and does not vibrate. Both write a time point for each position"""
    stability: StrictBool = True
    """of a steady motion: whether it is found out by how much vibrations about it grow or fall in a period"""
    revolutions: Positive | None = None
    """revolutions of the drive; for drives that rotate at a constant speed, or speed up to one"""
    end_time: PositiveTime | None = None
    """end of the analysis, instead of `revolutions`; of a static analysis without a drive 1 s, reached in one step, if it
    is not given"""
    steps_per_revolution: Annotated[StrictInt, Field(ge=4, le=10**9)] | None = None
    """time steps in a revolution (at the final speed); if neither this nor `step` is given 720, or 72 positions of a
    static or quasi-static analysis"""
    step: PositiveTime | None = None
    """time step, instead of `steps_per_revolution`; shortened so that a whole number reaches the end"""
    extrapolation_levels: Annotated[StrictInt, Field(ge=1, le=3)] | None = None
    """levels in time: 2: the motion is solved in whole and in half steps, 3: in quarters too, and combined: of order 4 or
    6 in the step instead of 2, and its error is known; 1 if not given, or what `accuracy` chooses"""
    rho_inf: Annotated[float, Quantity("1", least=0.0, most=1.0)] = 0.95
    """ρ∞ of the generalised-α method: what a step leaves of vibration that it cannot resolve; 1 is Newmark's average
    acceleration, which leaves it all"""
    initial: Literal["rest", "quasi-static"] = "rest"
    """elastic state at the start: none, or the deflection with which the mechanism moves on without vibrating"""
    frames: Frames | None = None
    """rigid-body: the stiffness of links rotates with the rigid-body motion, deflections are small; co-rotational: with
    the links themselves, which may bend as far as they like, or move freely. Rigid-body if not given, but without a
    drive co-rotational"""
    initial_speeds: dict[JointName, JointSpeed] = Field(default_factory=dict)
    """speeds of joints at the start, by name of the joint, of what the drive does not move: of its first link that is not
    the ground against the other, of a hinge and a screw about its axis [rad/s], of a slide and a cylindrical joint along
    it [m/s], of the pin along a slot [m/s]; all else then moves as little as it can"""
    initial_motions: dict[LinkName, InitialMotion] = Field(default_factory=dict)
    """velocities of links at the start, by name of the link: those of the drive's motion included"""
    initial_deflection: dict[str, InitialForce] = Field(default_factory=dict)
    """forces that deflect the mechanism and are released at the start, by name: without a drive from static balance,
    with one beside the deflection of `initial = "quasi-static"`, at rest in links that rotate; limits take the forces
    against them, and may be its only supports"""
    accuracy: Annotated[float | Literal["quick"], BeforeValidator(accuracy_or_quick)] = 0.01
    """relative error to aim at in probes, joint forces and the drive's torque: what the scene leaves open is chosen for
    it by short trial runs: frames, elements, mesh sizes, segments, modes, step and levels in time, and models
    that are `"auto"`. Without a drive elements of beams and the step are. `"quick"`: plain defaults are taken
    instead, which `kedfem run --quick` means too"""
    reduction_tolerance: Annotated[float, Quantity("1", above=0.0, below=1.0)] = 1e-3
    """relative error that reduced links may cause there"""
    stiffening: StrictBool = False
    """whether stresses of the rigid-body motion stiffen the links: tension, as in fast rotors, makes them stiffer across
    it, compression softer"""
    solver: Literal["condensed", "monolithic"] = "condensed"
    """condensed: one factorisation per link; monolithic: assembles and factors at every step"""


class Animation(Record):
    """Frames for ParaView."""

    frames_per_revolution: Count = 36
    """frames in a revolution; in the whole analysis if the drive makes no revolutions, or there is none"""
    deformation_scale: Positive = 1.0
    """factor on the elastic displacement; 1 in a scene without a drive"""
    last_revolutions: Positive | None = None
    """only so many revolutions, the last ones; all if not given"""
    vtkhdf: StrictBool = False
    """whether an elastic run's frames are also one file, `animation.vtkhdf`: mesh stored once, points where the rigid
    motion takes them, `displacement` for ParaView's Warp By Vector (never exaggerated), stresses in the world's axes"""


ELASTIC = ("displacement", "velocity", "acceleration")
TOTAL = ("position", "travel", "total_velocity", "total_acceleration")


class Probe(Record):
    """A quantity at a point of a link over time."""

    link: LinkName
    """the link; a rigid one for motions only"""
    at: Point
    """where, in the reference position; of a rigid link anywhere, and for a motion in the centre of a joint's bore:
    the mean motion of the bore. Of a stress in a beam anywhere in its section: on the axis there is none of
    bending"""
    quantity: Literal[
        "displacement", "velocity", "acceleration", "deflection", "position", "travel", "total_velocity",
        "total_acceleration", "stress",
    ]  # fmt: skip
    """displacement, velocity and acceleration: of the elastic motion, against the rigid mechanism, which a drive moves.
    position, travel (from the reference position), total_velocity and total_acceleration: of rigid and elastic motion
    together, with a drive or without. deflection: of the link against a frame of its own, which goes with its chord"""
    chord: tuple[Point, Point] | None = None
    """of a deflection: two points of the link, between which the chord is; if not given its two joints farthest apart. A
    link with fewer than two joints deflects from its mean rigid motion"""
    frame: Literal["link", "world"] | None = None
    """axes of the components: those of the link (x along it) or the world's. The link's if not given, and of a stress (in
    a beam those of its section there); of position, travel and total motions the world's"""

    @model_validator(mode="after")
    def _in_a_frame(self) -> Self:
        faults: list[Fault] = []
        wanted = "link" if self.quantity == "stress" else "world" if self.quantity in TOTAL else None
        if wanted and self.frame not in {None, wanted}:
            got = f"got {self.frame!r}"
            quantity = self.quantity.replace("_", " ")
            faults.append(Fault(("frame",), f"must be {wanted!r} for a {quantity}, {got}"))
        if self.chord is not None and self.quantity != "deflection":
            got = f"got one for a {self.quantity.replace('_', ' ')}"
            faults.append(Fault(("chord",), f"must be given for a deflection only, {got}"))
        if self.chord is not None and math.dist(*self.chord) == 0.0:
            faults.append(Fault(("chord",), "must be two different points, got one twice"))
        refuse(faults)
        return self.fill(frame=self.frame or wanted or "link")


def animation_or_none(value: Any) -> Any:
    """An animation, or None for `animation = false`."""
    if value is True or (isinstance(value, (int, float, str)) and value is not False):
        raise fault(f"must be a table of keys, or false, got {value!r}")
    return None if value is False else value


class Output(Record):
    """Selection of the results that are written, and their folder."""

    folder: FileName | None = None
    """the folder of the results; `<scene>-results` beside the scene file if not given"""
    every: Count = 1
    """rows of `kedfem run` are those of each so many time steps, the first and the last among them; what is summed up,
    highest or estimated is of all steps"""
    csv: StrictBool = False
    """whether the results are also written as CSV, with nine digits"""
    parquet: StrictBool = False
    """whether they are also written as Parquet; needs `pip install 'kedfem[data]'`"""
    plots: StrictBool | Literal["each"] = True
    """whether curves are plotted, all on one page; `"each"`: every channel on its own too"""
    picture: StrictBool = True
    """whether the frame with the worst stress is drawn"""
    report: StrictBool = False
    """whether all is reported in one page for a browser, `report.html`; needs `pip install 'kedfem[report]'`"""
    animation: Annotated[Animation | None, BeforeValidator(animation_or_none)] = Animation()
    """frames for ParaView; `animation = false` for none"""
    probes: dict[Name, Probe] = Field(default_factory=dict)
    """quantities to follow"""

    @model_serializer(mode="wrap")
    def _no_animation(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        return {**handler(self), **({"animation": False} if self.animation is None else {})}
