"""Cross checks of segments, force elements, initial velocities, and of scenes without a drive.

Which combinations are refused the table of capabilities says.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from kedfem.errors import Fault
from kedfem.scene.checks.combinations import frames_of, slider
from kedfem.scene.checks.parts import Entry, Parts, category
from kedfem.scene.records.drives import SLIDING, TURNING
from kedfem.scene.records.links import GROUND
from kedfem.scene.records.units import Quantity, si_number
from kedfem.scene.records.wording import shown, unknown_name

AXES = {"revolute": TURNING, "prismatic": SLIDING}  # joints with one motion, and its speed


def frame_faults(parts: Parts) -> Iterator[Fault]:
    """Frames and segments that do not suit a link."""
    for link in parts.links.values():
        if slider(link):
            for key in ("frames", "segments"):
                if link.has(key):
                    got = shown(link.raw[key])
                    yield link.fault(key, f"must be left out for a rigid link without a shape, got {got}")
        else:
            yield from segment_faults(parts, link)


def segment_faults(parts: Parts, link: Entry) -> Iterator[Fault]:
    """A number of segments where there is nothing to cut."""
    if not link.has("segments"):
        return
    got = f"got {shown(link.raw['segments'])}"
    if category(link) == "rigid":
        yield link.fault("segments", f"must be left out for a rigid link (it is one segment), {got}")
    elif category(link) == "beam":
        yield link.fault("segments", f"must be left out for a beam: its elements are its segments, {got}")
    elif frames_of(parts, link) == "rigid-body":
        yield link.fault(
            "segments", f"must be combined with co-rotational frames, {got} with rigid-body ones"
        )


def motor_faults(parts: Parts) -> Iterator[Fault]:
    """Motors on joints that do not exist."""
    for motor in parts.motors.values():
        yield from unknown_joint(parts, motor)


def unknown_joint(parts: Parts, entry: Entry) -> Iterator[Fault]:
    """A name of a joint that there is not."""
    name = entry.word("joint")
    if name and parts.joints and name not in parts.joints:
        yield entry.fault("joint", unknown_name("a joint", name, parts.joints))


def spring_faults(parts: Parts) -> Iterator[Fault]:
    """Springs on links or joints that do not exist."""
    for spring in parts.springs.values():
        if spring.word("kind") == "torsion" or spring.has("joint"):
            yield from unknown_joint(parts, spring)
            continue
        names = end_links(spring)
        for i, name in enumerate(names):
            if name is not None and parts.links and name not in parts.links and name != GROUND:
                known = [*parts.links, GROUND]
                yield spring.fault("between", unknown_name("a link", name, known), i, "link")
        if names == [GROUND, GROUND]:
            yield spring.fault("between", "must hold a link, got the ground twice")


def limit_faults(parts: Parts) -> Iterator[Fault]:
    """Limits of joints that do not exist."""
    for limit in parts.limits.values():
        yield from unknown_joint(parts, limit)


def end_links(spring: Entry) -> list[str | None]:
    """The links at the ends of a spring between two points, as given."""
    ends = spring.raw.get("between")
    given = ends if isinstance(ends, (list, tuple)) else ()
    words = [end.get("link") if isinstance(end, Mapping) else None for end in given]
    return [word if isinstance(word, str) else None for word in words]


def initial_faults(parts: Parts) -> Iterator[Fault]:
    """Velocities at the start of what has none of its own, and forces on links that are not there."""
    forces = parts.analysis.raw.get("initial_deflection")
    for name, force in forces.items() if isinstance(forces, Mapping) and parts.links else ():
        link = force.get("link") if isinstance(force, Mapping) else None
        if isinstance(link, str) and link not in parts.links:
            message = unknown_name("a link", link, parts.links)
            yield parts.analysis.fault("initial_deflection", message, str(name), "link")
    for key, known, what in (
        ("initial_speeds", parts.joints, "a joint"),
        ("initial_motions", parts.links, "a link"),
    ):
        given = parts.analysis.raw.get(key)
        if not isinstance(given, Mapping) or not given:
            continue
        for name in given if known else ():
            if name not in known:
                yield parts.analysis.fault(key, unknown_name(what, str(name), known), str(name))
            elif key == "initial_speeds":
                yield from speed_faults(parts, parts.joints[name], given[name])


def speed_faults(parts: Parts, joint: Entry, given: Any) -> Iterator[Fault]:
    """A speed of a joint that has none, that the drive moves, or in a unit of another kind."""
    kind = joint.word("kind")
    if kind in {"spherical", "weld"}:
        got = f"got {joint.name!r}, which is {kind}"
        message = f"must be of a revolute or prismatic joint, {got}"
        yield parts.analysis.fault("initial_speeds", message, joint.name)
    elif joint.name in parts.driven_joints:
        message = f"must be of a joint that the drive does not move, got {joint.name!r}"
        yield parts.analysis.fault("initial_speeds", message, joint.name)
    elif kind in AXES and isinstance(given, str) and not in_unit(given, AXES[kind]):
        message = f"must be {AXES[kind].kind} for a {kind} joint, got {given!r}"
        yield parts.analysis.fault("initial_speeds", message, joint.name)


def in_unit(text: str, quantity: Quantity) -> bool:
    """Whether a text is a number with a unit of one kind; one that is no number at all has its fault already."""
    others = [other for other in AXES.values() if other != quantity]
    return readable(text, quantity) or not any(readable(text, other) for other in others)


def readable(text: str, quantity: Quantity) -> bool:
    """Whether a text is a number with a unit."""
    try:
        si_number(text, quantity.unit)
    except ValueError:
        return False
    return True


def undriven_faults(parts: Parts) -> Iterator[Fault]:
    """What only makes sense with a drive, in a scene without one."""
    if parts.driven:
        return
    drawn = parts.animation.record
    if drawn is not None and drawn.deformation_scale != 1.0:
        message = "must be 1 in a scene without a drive, which has no motion that it deviates from"
        yield parts.animation.fault("deformation_scale", f"{message}, got {drawn.deformation_scale:g}")
