"""Cross checks of loads, bodies and probes, and of all names."""

from __future__ import annotations

import math
from collections.abc import Iterator

from kedfem.errors import Fault
from kedfem.scene.checks.parts import Entry, Parts, category, link_names
from kedfem.scene.records.analysis import ELASTIC
from kedfem.scene.records.links import GROUND
from kedfem.scene.records.wording import unknown_name


def reference_faults(parts: Parts) -> Iterator[Fault]:
    """Names of materials, links and joints that do not exist."""
    for link in parts.links.values():
        material = link.word("material")
        if material is not None and material not in parts.materials:
            yield link.fault("material", unknown_name("a material", material, parts.materials))
    for joint in parts.joints.values() if parts.links else ():
        for i, name in enumerate(link_names(joint)):
            if name not in parts.links and name != GROUND:
                yield joint.fault("links", unknown_name("a link", name, [*parts.links, GROUND]), i)
    for user in [*parts.loads.values(), *parts.bodies.values(), *parts.probes.values()]:
        link_name = user.word("link")
        if link_name is not None and parts.links and link_name not in parts.links:
            yield user.fault("link", unknown_name("a link", link_name, parts.links))
    for drive in parts.all_drives:
        joint_name = drive.word("joint")
        if joint_name is not None and parts.joints and joint_name not in parts.joints:
            yield drive.fault("joint", unknown_name("a joint", joint_name, parts.joints))


def load_faults(parts: Parts) -> Iterator[Fault]:
    """Loads, bodies and probes that do not suit their link."""
    for load in parts.loads.values():
        link = parts.links.get(load.word("link") or "")
        kind = load.word("kind")
        if link is None:
            continue
        if kind == "torque" and load.word("joint") is not None and parts.joints:
            yield from torque_joint_faults(load, parts)
    for probe in parts.probes.values():
        link, quantity = parts.links.get(probe.word("link") or ""), probe.word("quantity")
        if link is not None and category(link) == "rigid" and quantity in {"stress", "deflection"}:
            got = f"got {link.name!r}, which is rigid"
            yield probe.fault("link", f"must name an elastic link for a {quantity}, {got}")
        if quantity in ELASTIC and not parts.driven:
            wanted = "position, travel or deflection" if quantity == "displacement" else f"total_{quantity}"
            why = "without a drive (there is no rigid motion to compare with)"
            yield probe.fault("quantity", f"must be {wanted} {why}, got {quantity!r}")
    for body in parts.bodies.values():
        yield from flywheel_faults(body, parts)


def torque_joint_faults(load: Entry, parts: Parts) -> Iterator[Fault]:
    """A torque at a joint that is not one of its link."""
    here = [joint.name for joint in parts.joints.values() if load.word("link") in link_names(joint)]
    if load.word("joint") not in here:
        yield load.fault("joint", unknown_name("a joint of the link", str(load.word("joint")), here))


def flywheel_faults(body: Entry, parts: Parts) -> Iterator[Fault]:
    """A flywheel away from the hinges of its link."""
    link_name = body.word("link")
    if body.record is None or body.word("kind") != "flywheel" or link_name not in parts.links:
        return
    hinges = [
        joint
        for joint in parts.joints.values()
        if link_name in link_names(joint) and joint.word("kind") != "prismatic"
    ]
    if any(joint.record is None for joint in hinges):
        return
    turning = [
        joint.record.on(link_name)
        for joint in hinges
        if joint.record.kind in {"revolute", "cylindrical", "screw"}
    ]
    apart = [
        math.dist(joint.record.on(link_name), body.record.at)
        for joint in parts.joints.values()
        if joint.record
    ]
    near = 1e-9 + 1e-7 * max(apart, default=0.0)
    if not any(not math.dist(at, body.record.at) > near for at in turning):
        at = ", ".join(f"{part:.6g}" for part in body.record.at)
        yield body.fault("at", f"must be the point of a revolute joint of links.{link_name} [m], got ({at})")
