"""Cross checks of drives and gears, of the analysis with them, and of scenes without a drive."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from pydantic_core import PydanticCustomError

from kedfem.errors import Fault, place
from kedfem.scene.checks.capabilities import DRIVEN
from kedfem.scene.checks.parts import Entry, Parts
from kedfem.scene.questions.laws import curve_noise
from kedfem.scene.questions.timing import continuous_speed, cycle
from kedfem.scene.records.analysis import WITHOUT_VIBRATION
from kedfem.scene.records.drives import (
    SLIDING,
    TURNING,
    ConstantSpeed,
    Cycloidal,
    MotionCurve,
    Polynomial,
    Ramp,
    prescribes_travel,
)
from kedfem.scene.records.units import Quantity, si_number

ROUGH = 0.05  # largest share of noise in a curve's acceleration
AXES = {"revolute": TURNING, "prismatic": SLIDING}  # joints with a single coordinate, and its rate
SEVERAL = {  # joints with several coordinates: the key of a drive that selects one, and the choices
    "cylindrical": ("coordinate", "it has two, 'angle' and 'travel'"),
    "universal": ("about", "it has two, an angle about the axis of either link"),
    "planar": ("along", "it has three, the angle, for which along is left out, and travels along two directions"),
}
PARALLEL = 1e-3  # [rad], angle between two driven travels in a plane below which they count as one
STARTED = {**AXES, "cylindrical": SLIDING, "screw": TURNING, "slot": SLIDING}  # joints that may have a speed at the start


def drive_faults(parts: Parts) -> Iterator[Fault]:
    """Drives of a coordinate that has one already, or with keys for another kind of joint."""
    if parts.drive.where and parts.drives:
        yield Fault(("drives",), "cannot be combined with drive, got both")
    met: dict[str, list[Entry]] = {}
    for drive in parts.all_drives:
        joint = parts.joints.get(drive.word("joint") or "")
        if joint is None:
            continue
        kind, before = str(joint.word("kind")), met.setdefault(joint.name, [])
        if kind in DRIVEN:
            yield from shared_joint_faults(joint, kind, before, drive) if before else ()
            yield from coordinate_of_drive_faults(drive, kind)
            yield from law_faults(drive, kind)
        before.append(drive)


def shared_joint_faults(joint: Entry, kind: str, before: list[Entry], drive: Entry) -> Iterator[Fault]:
    """A further drive of a coordinate that earlier drives of the joint prescribe."""
    others = ", ".join(place(each.where) for each in before)
    if kind not in SEVERAL:
        why = "its travel is one lead for each of its turns" if kind == "screw" else f"a {kind} joint has one coordinate"
        wanted = f"must name a joint of its own, as {why}"
        yield drive.fault("joint", f"{wanted}, got {joint.name!r} as in {others}: leave one of these drives out")
        return
    key, take = SEVERAL[kind]
    travels = sum(each.has("along") for each in (*before, drive))
    if travels > 2 or any(same_coordinate(kind, drive, each) for each in before):
        wanted = f"must be of another coordinate of joint {joint.name!r} than {others}"
        yield drive.fault(key, f"{wanted}, got {drive.given(key) or 'the angle'}: {take}")


def same_coordinate(kind: str, one: Entry, other: Entry) -> bool:
    """Whether two drives on one joint prescribe the same coordinate; parallel travels of a planar joint are the same."""
    if len({(driven_coordinate(each, kind), each.word("about")) for each in (one, other)}) > 1:
        return False
    a, b = (getattr(each.record, "along", None) for each in (one, other))
    return not (a and b) or abs(sum(x * y for x, y in zip(a, b, strict=True))) > 1.0 - PARALLEL**2 / 2.0


def coordinate_of_drive_faults(drive: Entry, kind: str) -> Iterator[Fault]:
    """The key `coordinate` on a joint with a single coordinate, or on a planar joint, which has `along`."""
    if drive.has("coordinate") and kind not in {"cylindrical", "screw"}:
        wanted = "must be given on a cylindrical or screw joint only"
        instead = "; take along for a travel" if kind == "planar" else ""
        yield drive.fault("coordinate", f"{wanted}, got one on a {kind} joint{instead}")


def driven_coordinate(drive: Entry, kind: str) -> str:
    """Whether a drive prescribes the angle or the travel of a joint of some kind."""
    return "travel" if prescribes_travel(kind, drive.given("coordinate"), drive.given("along")) else "angle"


def law_faults(drive: Entry, kind: str) -> Iterator[Fault]:
    """A law of motion of angles for a travel, or of travels for an angle."""
    motion = drive.raw.get("motion")
    if not isinstance(motion, Mapping):
        return
    wanted = driven_coordinate(drive, kind)
    other = "travel" if wanted == "angle" else "angle"
    if motion.get(other) is not None:
        article = "an" if other == "angle" else "a"
        message = f"must be given as {wanted} of a {kind} joint, got {article} {other}"
        yield drive.fault("motion", message, other)
    values = motion.get("value")
    given: Any = [(("value", i), x) for i, x in enumerate(values)] if isinstance(values, (list, tuple)) else []
    for key, x in [(("speed",), motion.get("speed")), (("smoothing",), motion.get("smoothing")), *given]:
        turning, sliding = (TURNING, SLIDING) if key == ("speed",) else (Quantity("rad"), Quantity("m"))
        try:
            (turning if wanted == "angle" else sliding).number(x or 0.0)
        except PydanticCustomError as reason:
            yield drive.fault("motion", reason.message(), *key)
            break


def gear_faults(parts: Parts) -> Iterator[Fault]:
    """Gears that couple a joint to itself."""
    for gear in parts.gears.values():
        names = gear.raw.get("joints")
        if isinstance(names, (list, tuple)) and len(names) == 2 and names[0] == names[1]:
            yield gear.fault("joints", f"must be two different joints, got {names[0]!r} twice")


def analysis_faults(parts: Parts) -> Iterator[Fault]:
    """An end or step of the analysis that is missing, given twice or impossible with the drive."""
    analysis = parts.analysis
    if not analysis.raw and analysis.record is None:
        return
    if analysis.has("revolutions") and analysis.has("end_time"):
        yield analysis.fault("revolutions", "cannot be combined with end_time, got both")
    if not analysis.has("revolutions") and not analysis.has("end_time") and not _repeats(parts):
        if parts.driven:
            yield analysis.fault("revolutions", "is required, or end_time [s], got neither")
        else:
            yield analysis.fault("end_time", "is required [s], got nothing")
    if analysis.has("step") and analysis.has("steps_per_revolution"):
        yield analysis.fault("step", "cannot be combined with steps_per_revolution, got both")
    quick = parts.driven and analysis.word("accuracy") == "quick"
    for link in (x for x in parts.links.values() if quick and x.word("model") == "auto"):
        yield link.fault("model", "needs an analysis.accuracy, e.g. 0.01, got 'quick' for 'auto'")
    drives = [drive for drive in parts.all_drives if drive.record is not None]
    for drive in drives:
        yield from drive_curve_faults(parts, drive)
    if len(parts.all_drives) == 1:
        for drive in drives:
            yield from drive_and_analysis_faults(parts, drive)
    elif drives:
        got = f"{len(parts.all_drives)} drives"
        yield from steps_faults(parts, got, "one drive that rotates continuously", "several drives")


def _repeats(parts: Parts) -> bool:
    """Whether the end need not be given: for static balance without a drive, or for one period of a repeating drive."""
    if not parts.all_drives:
        return parts.analysis.word("kind") == "static"
    if len(parts.all_drives) > 1 or parts.analysis.word("kind") not in {"steady", *WITHOUT_VIBRATION}:
        return False
    drive = parts.all_drives[0]
    if drive.record is None:  # its fault is one of another key: what it was meant to be repeats itself
        return any(drive.has("motion", key) for key in ("period", "return_time", "speed", "frequency"))
    return cycle(drive.record.motion) is not None


def drive_and_analysis_faults(parts: Parts, drive: Entry) -> Iterator[Fault]:
    """Revolutions or steps of the analysis that do not suit the only drive."""
    motion, joint = drive.record.motion, parts.joints.get(drive.record.joint)
    kind = "" if joint is None else str(joint.word("kind"))
    if driven_coordinate(drive, kind) == "travel":
        yield from steps_faults(parts, f"one of the travel of a {kind} joint")
    elif continuous_speed(motion) == 0.0:
        still = isinstance(motion, (ConstantSpeed, Ramp))
        yield from steps_faults(parts, "speed 0" if still else f"{motion.kind!r}")


def steps_faults(
    parts: Parts, got: str, wanted: str = "a drive that rotates continuously",
    doing: str = "a drive that does not rotate continuously",
) -> Iterator[Fault]:  # fmt: skip
    """Revolutions without a drive that makes any, and a missing step."""
    analysis = parts.analysis
    for key, instead in (("revolutions", "end_time"), ("steps_per_revolution", "step")):
        if analysis.has(key):
            yield analysis.fault(key, f"needs {wanted} (else {instead} [s]), got {got}")
    stated = any(analysis.has(key) for key in ("step", "steps_per_revolution"))
    if not stated and analysis.word("accuracy") == "quick":
        yield analysis.fault("step", f"is required with {doing} [s], got {got}")


def drive_curve_faults(parts: Parts, drive: Entry) -> Iterator[Fault]:
    """A curve of motion that does not cover the analysis or is too rough; a dwell without a return."""
    motion = drive.record.motion
    stays = isinstance(motion, (Cycloidal, Polynomial)) and motion.return_time is None
    if stays and motion.dwell_after > 0.0:
        yield drive.fault("motion", "must be combined with return_time, got no return", "dwell_after")
    if not isinstance(motion, MotionCurve) or not motion.at:
        return
    key = "time" if motion.time else "at"
    if motion.period is None and motion.at[0] > 0.0:
        wanted = f"must begin at 0 or before [s], got {motion.at[0]:.6g}"
        yield drive.fault("motion", wanted, key)
    end = parts.analysis.record.end_time if parts.analysis.record is not None else None
    if motion.period is None and end is not None and end > motion.at[-1] * (1.0 + 1e-9):
        wanted = f"must reach the end of the analysis {end:.6g} [s]"
        remedy = "let it end there, give it a period, or go on with rows of the last value where the joint is to stay"
        yield drive.fault("motion", f"{wanted}, got {motion.at[-1]:.6g}: {remedy}", key)
    noise, share = curve_noise(motion)
    if motion.smoothing is None and share > ROUGH:
        joint = parts.joints.get(drive.record.joint)
        unit = "rad" if joint is None or driven_coordinate(drive, str(joint.word("kind"))) == "angle" else "m"
        wanted = "must be smooth enough for its acceleration to shake nothing (more digits, or smoothing"
        got = f"got values that scatter by {noise:.2g} [{unit}], {100 * share:.0f} % of the acceleration"
        yield drive.fault("motion", f"{wanted} = {2 * noise:.1g}), {got}", "value")


def initial_faults(parts: Parts) -> Iterator[Fault]:
    """Speeds at the start of joints that cannot have one."""
    given = parts.analysis.raw.get("initial_speeds")
    for name, speed in given.items() if isinstance(given, Mapping) else ():
        if name in parts.joints:
            yield from speed_faults(parts, parts.joints[name], speed)


def speed_faults(parts: Parts, joint: Entry, given: Any) -> Iterator[Fault]:
    """A speed of a joint that has no single speed or is driven, or a speed in a unit of another kind."""
    kind = joint.word("kind")
    if joint.record is not None and kind not in STARTED:
        got = f"got {joint.name!r}, a {kind} joint"
        message = f"must be of a revolute, prismatic, cylindrical, screw or slot joint, {got}; take initial_motions"
    elif joint.name in parts.driven_joints:
        message = f"must be of a joint that the drive does not move, got {joint.name!r}"
    elif kind in STARTED and isinstance(given, str) and not in_unit(given, STARTED[kind]):
        message = f"must be {STARTED[kind].kind} for a {kind} joint, got {given!r}"
    else:
        return
    yield parts.analysis.fault("initial_speeds", message, joint.name)


def in_unit(text: str, quantity: Quantity) -> bool:
    """Whether a text may be a number with a unit of one kind; a text that is no number has a fault elsewhere."""
    others = [other for other in AXES.values() if other != quantity]
    return readable(text, quantity) or not any(readable(text, other) for other in others)


def readable(text: str, quantity: Quantity) -> bool:
    """Whether a text is a number with a unit of a kind."""
    try:
        si_number(text, quantity.unit)
    except ValueError:
        return False
    return True


def undriven_faults(parts: Parts) -> Iterator[Fault]:
    """Keys in a scene without a drive that need one."""
    if parts.driven:
        return
    drawn = parts.animation.record
    if drawn is not None and drawn.deformation_scale != 1.0:
        message = "must be 1 in a scene without a drive, which has no motion that it deviates from"
        yield parts.animation.fault("deformation_scale", f"{message}, got {drawn.deformation_scale:g}")
