"""Cross checks of joints, and of the planes of plane links and planar beams."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from kedfem.errors import Fault
from kedfem.scene.checks.parts import Entry, Parts, category, link_names
from kedfem.scene.questions.planes import (
    Placed,
    leaving,
    obstacles,
    off_plane,
    on_links,
    spatial_beams,
    spring_ends,
    tilted,
    upward_faults,
    welded,
)
from kedfem.scene.records.joints import DIRECTED, SQUARE
from kedfem.scene.records.links import GROUND
from kedfem.scene.records.scene import Scene
from kedfem.scene.records.wording import NOUNS, unknown_name


def joint_faults(parts: Parts) -> Iterator[Fault]:
    """Joints without two different parts, and links without a connection to the ground."""
    for joint in parts.joints.values():
        names = link_names(joint)
        if names == [GROUND, GROUND]:
            yield joint.fault("links", "must hold a link, got the ground twice")
        elif len(names) == 2 and names[0] == names[1]:
            yield joint.fault("links", f"must be two different links, got {names[0]!r} twice")
        yield from surface_faults(joint, parts)
        yield from direction_faults(joint)
    held = parts.joints.values() if parts.driven else ()  # without a drive links may be free
    pairs = [link_names(joint) for joint in held]
    reached = connected(GROUND, pairs)
    for link in parts.links.values() if pairs else ():
        if not any(link.name in pair for pair in pairs):
            yield Fault(link.where, "must be connected by a joint, got none")
        elif link.name not in reached:
            yield Fault(link.where, "must be connected with the ground through joints, got no way there")


def direction_faults(joint: Entry) -> Iterator[Fault]:
    """Directions or a lead that a joint lacks, or that belong to other kinds of joint."""
    kind = joint.word("kind")
    if kind in DIRECTED and not joint.has("axis"):
        yield joint.fault("axis", f"is required for a {kind} joint: 'x', 'y', 'z' or a vector, got nothing")
    for key, owner, wanted in (
        ("axes", "universal", "a universal joint: two axes, of the first link and of the second"),
        ("lead", "screw", "a screw [m], travel in one revolution"),
    ):
        if kind == owner and not joint.has(key):
            yield joint.fault(key, f"is required for {wanted}, got nothing")
        if kind != owner and joint.has(key):
            yield joint.fault(key, f"must be given for a {owner} joint only, got one for a {kind} joint")
    if kind == "universal" and joint.has("axis"):
        yield joint.fault("axis", "must be left out for a universal joint (it has axes), got one")
    axes = joint.record.axes if joint.record is not None else None
    if axes is not None and abs(cosine := sum(a * b for a, b in zip(*axes, strict=True))) > SQUARE:
        angle = math.degrees(math.acos(max(-1.0, min(1.0, cosine))))
        yield joint.fault("axes", f"must be at right angles to each other, got {angle:.6g} deg")
    if joint.record is not None and joint.record.lead == 0.0:
        yield joint.fault("lead", "must not be zero [m] (a screw without lead is a revolute joint), got 0")


def surface_faults(joint: Entry, parts: Parts) -> Iterator[Fault]:
    """Couplings and faces of links that the joint does not have, and faces of links without faces."""
    names = link_names(joint)
    for key in ("coupling", "faces"):
        given = joint.raw.get(key)
        for name in given if isinstance(given, Mapping) else ():
            link = parts.links.get(name)
            if name not in names or name == GROUND:
                own = [each for each in names if each != GROUND]
                yield joint.fault(key, unknown_name("a link of the joint", str(name), own))
            elif key == "faces" and link is not None and category(link) not in {"solid", "rigid"}:
                noun = NOUNS.get(category(link), category(link))
                yield joint.fault(key, f"must name faces of a solid, got {name!r}, a {noun}", name)


def coordinate_faults(parts: Parts) -> Iterator[Fault]:
    """Drives, motors, springs and limits whose choice of a joint's coordinate is missing or wrong."""
    elements = (*parts.motors.values(), *parts.springs.values(), *parts.limits.values())
    turning = [(x, x.has("torque") or x.word("kind") in {"torsion", "angle"}) for x in elements]
    turning += [(x, not x.has("along")) for x in parts.all_drives]
    for entry, turns in turning:
        joint = parts.joints.get(entry.word("joint") or "")
        if joint is None:
            continue
        kind = joint.word("kind")
        for key, owner, own, wanted in (
            ("about", "universal", turns, "the link about whose axis"),
            ("along", "planar", not turns, "a direction in its plane"),
        ):
            if kind == owner and own and not entry.has(key):
                yield entry.fault(key, f"is required on a {owner} joint, {wanted}, got nothing")
            if kind != owner and entry.has(key):
                yield entry.fault(key, f"must be given on a {owner} joint only, got one on a {kind} joint")
        names, about = link_names(joint), entry.word("about")
        if kind == "universal" and about is not None and about not in names:
            yield entry.fault("about", unknown_name("a link of the joint", about, names))
        normal, along = (getattr(x.record, key, None) for x, key in ((joint, "axis"), (entry, "along")))
        if kind == "planar" and normal and along:
            sine = abs(sum(a * b for a, b in zip(normal, along, strict=True)))  # both are unit vectors
            if sine > SQUARE:
                off = math.degrees(math.asin(min(1.0, sine)))
                yield entry.fault("along", f"must be in the plane of joint '{joint.name}', got {off:.6g} deg off it")


def connected(start: str, pairs: list[list[str]]) -> set[str]:
    """The names that pairs connect with `start`."""
    reached = {start}
    while more := {name for pair in pairs if reached & set(pair) for name in pair} - reached:
        reached |= more
    return reached


def planar_faults(parts: Parts) -> Iterator[Fault]:
    """Axes, gravity, loads and points outside of the plane of a scene with plane links."""
    if all(category(link) != "plane" for link in parts.links.values()):
        return
    scene, here = parts.good, f"a scene of {NOUNS['plane']}s"
    for name, joint in scene.joints.items():
        yield from tilted(("joints", name), joint, f"in {here}", {"revolute"})
    yield from leaving(scene, f"in {here}")
    for name, link in scene.links.items():
        if link.category == "plane":
            yield from upward_faults(name, link.shape, f"in {here}")
    yield from off_plane(_beside_plane(scene), f"the other points of {here}")


def _beside_plane(scene: Scene) -> Iterator[Placed]:
    """Joints, plane and rigid links and what is attached to them; points of other links may be anywhere."""
    others = {name for name, link in scene.links.items() if link.category in {"solid", "beam"}}
    for name, joint in scene.joints.items():
        yield ("joints", name), joint
    for name, link in scene.links.items():
        if name not in others:
            yield ("links", name), link
    ends = [end for name in scene.springs for end in spring_ends(scene, name)]
    yield from ((where, record) for where, record in [*on_links(scene), *ends] if record.link not in others)


def beam_faults(parts: Parts) -> Iterator[Fault]:
    """What moves beams out of a plane that are stated to be planar."""
    spatial = spatial_beams(parts.good)
    for link in parts.links.values():
        if category(link) != "beam":
            if link.has("beam"):
                yield link.fault("beam", f"must be given for a beam only, got a {category(link)}")
        elif link.word("beam") == "planar" and link.record is not None:
            yield from obstacles(parts.good, link.name)
            for other in sorted(welded(parts.good, link.name) & spatial):
                wanted = "must not be 'planar' beside a link in space that is welded to it"
                yield link.fault("beam", f"{wanted}, got {other!r}")
