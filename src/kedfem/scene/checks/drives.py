"""Cross checks of drives and gears."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from pydantic_core import PydanticCustomError

from kedfem.errors import Fault, place
from kedfem.scene.checks.parts import Entry, Parts
from kedfem.scene.records.drives import SLIDING, TURNING
from kedfem.scene.records.wording import unknown_name


def drive_faults(parts: Parts) -> Iterator[Fault]:
    """Drives on joints that cannot be driven, or twice, or with a law for another kind of joint."""
    if parts.drive.where and parts.drives:
        yield Fault(("drives",), "cannot be combined with drive, got both")
    met: dict[str, Entry] = {}
    for drive in parts.all_drives:
        joint = parts.joints.get(drive.word("joint") or "")
        if joint is None:
            continue
        if joint.name in met:
            other = place(met[joint.name].where)
            yield drive.fault("joint", f"must name a joint of its own, got {joint.name!r} as in {other}")
        met[joint.name] = drive
        kind = joint.word("kind")
        if kind in {"revolute", "prismatic"}:
            yield from law_faults(drive, str(kind))


def law_faults(drive: Entry, kind: str) -> Iterator[Fault]:
    """A law of motion that is one of angles on a slide, or of travel on a hinge."""
    motion = drive.raw.get("motion")
    if not isinstance(motion, Mapping):
        return
    wanted, other = ("travel", "angle") if kind == "prismatic" else ("angle", "travel")
    if motion.get(other) is not None:
        article = "an" if other == "angle" else "a"
        yield drive.fault(
            "motion", f"must be given as {wanted} of a {kind} joint, got {article} {other}", other
        )
    if (speed := motion.get("speed")) is not None:
        try:
            (SLIDING if kind == "prismatic" else TURNING).number(speed)
        except PydanticCustomError as reason:
            yield drive.fault("motion", reason.message(), "speed")


def gear_faults(parts: Parts) -> Iterator[Fault]:
    """Gears on joints that do not exist."""
    for gear in parts.gears.values():
        names = gear.raw.get("joints")
        if not isinstance(names, (list, tuple)) or len(names) != 2:
            continue
        if names[0] == names[1]:
            yield gear.fault("joints", f"must be two different joints, got {names[0]!r} twice")
        for i, name in enumerate(names):
            if parts.joints and not (isinstance(name, str) and name in parts.joints):
                yield gear.fault("joints", unknown_name("a joint", str(name), parts.joints), i)
