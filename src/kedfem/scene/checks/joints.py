"""Cross checks of joints."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from kedfem.errors import Fault
from kedfem.scene.checks.parts import Entry, Parts, category, link_names
from kedfem.scene.records.joints import DIRECTED, SQUARE
from kedfem.scene.records.links import GROUND
from kedfem.scene.records.wording import NOUNS, unknown_name


def joint_faults(parts: Parts) -> Iterator[Fault]:
    """Joints that join nothing, and links that nothing joins."""
    for joint in parts.joints.values():
        names = link_names(joint)
        if names == [GROUND, GROUND]:
            yield joint.fault("links", "must hold a link, got the ground twice")
        elif len(names) == 2 and names[0] == names[1]:
            yield joint.fault("links", f"must be two different links, got {names[0]!r} twice")
        yield from surface_faults(joint, parts)
        yield from direction_faults(joint)
    pairs = (
        [link_names(joint) for joint in parts.joints.values()] if parts.driven else []
    )  # else links may fly
    reached = connected(GROUND, pairs)
    for link in parts.links.values() if pairs else ():
        if not any(link.name in pair for pair in pairs):
            yield Fault(link.where, "must be held by a joint, got none")
        elif link.name not in reached:
            yield Fault(link.where, "must be connected with the ground through joints, got no way there")


def direction_faults(joint: Entry) -> Iterator[Fault]:
    """Joints without the directions or the lead that they need, or with those of other kinds."""
    kind = joint.word("kind")
    if kind in DIRECTED and not joint.has("axis"):
        yield joint.fault("axis", f"is required for a {kind} joint: 'x', 'y', 'z' or a vector, got nothing")
    for key, owner, wanted in (
        (
            "axes",
            "universal",
            "is required for a universal joint: two axes, of the first link and of the second",
        ),
        ("lead", "screw", "is required for a screw [m], travel in one revolution"),
    ):
        if kind == owner and not joint.has(key):
            yield joint.fault(key, f"{wanted}, got nothing")
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
    """Ports and faces of links that the joint does not join, and faces of links that have none."""
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
                yield joint.fault(key, f"must name faces of a solid, got {name!r}, which is a {noun}", name)


def connected(start: str, pairs: list[list[str]]) -> set[str]:
    """The names that pairs connect with a first one."""
    reached = {start}
    while more := {name for pair in pairs if reached & set(pair) for name in pair} - reached:
        reached |= more
    return reached
