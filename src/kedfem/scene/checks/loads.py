"""Cross checks of loads, bodies, probes, springs and fatigue with the links to which they belong."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from kedfem.errors import Fault
from kedfem.scene.checks.parts import Entry, Parts, category, link_names
from kedfem.scene.records.analysis import ELASTIC
from kedfem.scene.records.joints import ROTARY
from kedfem.scene.records.links import GROUND
from kedfem.scene.records.materials import LINE
from kedfem.scene.records.wording import unknown_name


def load_faults(parts: Parts) -> Iterator[Fault]:
    """Loads, bodies and probes that do not suit their link."""
    for load in parts.loads.values():
        known, at = load.word("link") in parts.links and parts.joints, load.word("joint")
        if known and load.word("kind") == "torque" and at is not None:
            here = [x.name for x in parts.joints.values() if load.word("link") in link_names(x)]
            if at in parts.joints and at not in here:
                yield load.fault("joint", unknown_name("a joint of the link", at, here))
        if (link := parts.links.get(load.word("link") or "")) is not None and load.word("kind") == "line":
            yield from line_faults(load, link)
    for probe in parts.probes.values():
        link, quantity = parts.links.get(probe.word("link") or ""), probe.word("quantity")
        if link is not None and category(link) == "rigid" and quantity in {"stress", "deflection"}:
            got = f"got {link.name!r}, a rigid link"
            yield probe.fault("link", f"must name an elastic link for a {quantity}, {got}")
        if quantity in ELASTIC and not parts.driven:
            wanted = "position, travel or deflection" if quantity == "displacement" else f"total_{quantity}"
            why = "without a drive (there is no rigid motion to compare with)"
            yield probe.fault("quantity", f"must be {wanted} {why}, got {quantity!r}")
    for body in parts.bodies.values():
        yield from flywheel_faults(body, parts)


def line_faults(load: Entry, link: Entry) -> Iterator[Fault]:
    """A load along a line of a rigid link without a line."""
    own = link.word("shape", "kind") in {"bar", "polyline"} and not (link.word("material") or "").startswith(LINE)
    if category(link) == "rigid" and link.has("shape") and not own and not load.has("between"):
        wanted = "is required [m] on a rigid link that is no bar or polyline: two points of a line, got nothing"
        yield load.fault("between", wanted)


def flywheel_faults(body: Entry, parts: Parts) -> Iterator[Fault]:
    """A flywheel that is not at a hinge of its link."""
    link_name = body.word("link")
    if body.record is None or body.word("kind") != "flywheel" or link_name not in parts.links:
        return
    own = [joint for joint in parts.joints.values() if link_name in link_names(joint)]
    if any(joint.record is None and joint.word("kind") != "prismatic" for joint in own):
        return
    turning = [joint.record.on(link_name) for joint in own if joint.word("kind") in ROTARY]
    good = [joint.record for joint in parts.joints.values() if joint.record]
    apart = [math.dist(joint.on(link_name), body.record.at) for joint in good]
    near = 1e-9 + 1e-7 * max(apart, default=0.0)
    if not any(not math.dist(at, body.record.at) > near for at in turning):
        at = ", ".join(f"{part:.6g}" for part in body.record.at)
        yield body.fault("at", f"must be the point of a revolute joint of links.{link_name} [m], got ({at})")


def spring_faults(parts: Parts) -> Iterator[Fault]:
    """Springs between two points of the ground."""
    for spring in parts.springs.values():
        ends = spring.raw.get("between")
        given = ends if isinstance(ends, (list, tuple)) else ()
        if [end.get("link") if isinstance(end, Mapping) else None for end in given] == [GROUND, GROUND]:
            yield spring.fault("between", "must hold a link, got the ground twice")


def fatigue_faults(parts: Parts) -> Iterator[Fault]:
    """Fatigue data of rigid links, or without any link in the scene."""
    entry = parts.fatigue
    materials, links = (named(entry.raw.get(key)) for key in ("materials", "links"))
    for name in links:
        if name in parts.links and category(parts.links[name]) == "rigid":
            yield Fault(("fatigue", "links", name), "must name an elastic link, got a rigid one")
    if not (materials or links) or {*links} - {*parts.links} or {*materials} - {*parts.materials}:
        return
    elastic = {name: link for name, link in parts.links.items() if category(link) != "rigid"}
    of_material = any(link.word("material") in materials for link in elastic.values())
    if elastic.keys().isdisjoint(links) and not of_material:
        got = "data of none of them" if elastic else "rigid links only"
        yield Fault(entry.where, f"must have data of an elastic link or of its material, got {got}")


def named(table: object) -> list[str]:
    """Names in a table."""
    return [str(name) for name in table] if isinstance(table, Mapping) else []
