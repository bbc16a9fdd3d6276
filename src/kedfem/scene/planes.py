"""Which beams are planar: those that nothing in the scene moves out of a plane z = constant."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from kedfem.scene.apart import Apart
from kedfem.scene.checks import NOUNS
from kedfem.scene.moving_joints import moving_joints
from kedfem.scene.parts import NONE, Entry, Parts, fidelity, link_names
from kedfem.scene.points import XYZ
from kedfem.scene.shapes import Bar, Polyline

if TYPE_CHECKING:
    from kedfem.scene.scene import Scene

FLAT = 1e-9  # how far from the plane, relative to the size of the scene
WORDS = ("fidelity", "beam", "kind", "link", "links", "joint")
Key = tuple[str, *tuple[str | int, ...]]


def spatial_beams(scene: Scene) -> frozenset[str]:
    """Names of the beams that move in space; all others are planar, rows (u, v, ψ)."""
    tables: dict[str, Mapping[str, Any]] = {
        "links": scene.links, "joints": scene.joints, "loads": scene.loads, "bodies": scene.bodies,
        "motors": scene.motors, "springs": scene.springs, "limits": scene.limits,
    }  # fmt: skip
    known = {section: _entries(section, table) for section, table in tables.items()}
    probes = _entries("probes", scene.output.probes, "output")
    parts = Parts(
        **known, probes=probes, drive=NONE, drives=_entries("drives", scene.driven_joints), gears={}, damping=NONE,
        analysis=NONE, animation=NONE, fatigue=NONE, gravity=scene.gravity, materials=[], folder=scene.folder,
    )  # fmt: skip
    return spatial_names(parts)


def _entries(section: str, records: Mapping[str, Any], *above: str) -> dict[str, Entry]:
    """Entries of records, with the keys that are looked up here."""
    return {
        name: Entry((*above, section, name), {key: getattr(record, key, None) for key in WORDS}, record)
        for name, record in records.items()
    }


def spatial_names(parts: Parts) -> frozenset[str]:
    """The same of a scene under validation, as far as its parts are good."""
    beams = {
        link.name: link for link in parts.links.values() if fidelity(link) == "beam" or _rigid_line(link)
    }
    free = {name: link.word("beam") for name, link in beams.items()}
    open_ones = [name for name, kind in free.items() if kind is None]
    found = {name for name, kind in free.items() if kind == "spatial"}
    if any(common_obstacles(parts, "")):
        found.update(open_ones)
    around = by_link(parts)
    found.update(name for name in open_ones if any(own_obstacles(parts, name, around[name])))
    beside = {name: welded(parts, name) for name in open_ones} if _welds(parts) else {}
    while more := {name for name, others in beside.items() if others & found} - found:
        found |= more
    return frozenset(found)


def _rigid_line(link: Entry) -> bool:
    """Whether a link is a rigid polyline, which has a beam's record."""
    return fidelity(link) == "rigid" and isinstance(getattr(link.record, "shape", None), Polyline)


def rigid_in_space(parts: Parts, link: Entry) -> bool:
    """Whether a rigid link moves as a body in space: it has a solid shape, and no drive simply carries it along."""
    if fidelity(link) != "rigid" or _rigid_line(link) or getattr(link.record, "shape", None) is None:
        return False
    by_rows = {joint.name for joint in moving_joints(parts)}
    return not any(
        link.name in link_names(parts.joints[name])
        for name in parts.driven_joints & parts.joints.keys() - by_rows
    )


def _welds(parts: Parts) -> list[Entry]:
    return [joint for joint in parts.joints.values() if joint.word("kind") == "weld"]


def welded(parts: Parts, name: str) -> set[str]:
    """What is welded to a link."""
    pairs = [link_names(joint) for joint in _welds(parts)]
    return {other for pair in pairs if name in pair for other in pair} - {name}


def beam_faults(parts: Parts) -> Iterator[str]:
    """What leaves the plane of beams that are said to be planar."""
    spatial = spatial_names(parts)
    for link in parts.links.values():
        if fidelity(link) != "beam":
            if link.has("beam"):
                yield link.fault("beam", f"must be given for a beam only, got a {fidelity(link)}")
        elif link.word("beam") == "planar":
            yield from obstacles(parts, link.name)
            for other in sorted(welded(parts, link.name) & spatial):
                yield link.fault(
                    "beam", f"must not be 'planar' beside the spatial beam welded to it, got {other!r}"
                )


def obstacles(parts: Parts, name: str) -> Iterator[str]:
    """Why a beam cannot be planar, as fault lines."""
    whose = f"for the planar beam {name!r}"
    yield from common_obstacles(parts, whose)
    yield from own_obstacles(parts, name, touching(parts, name))


def common_obstacles(parts: Parts, whose: str) -> Iterator[str]:
    """What moves any beam of the scene out of the plane: axes of joints, gravity, loads."""
    for joint in parts.joints.values():
        yield from joint_obstacles(joint, whose)
    if parts.gravity[2] != 0.0:
        yield f"gravity: must lie in the xy plane {whose} [m/s^2], got {vector(parts.gravity)}"
    for load in parts.loads.values():
        yield from leaving(load, whose)


def own_obstacles(parts: Parts, name: str, around: Iterable[Entry]) -> Iterator[str]:
    """What moves one beam out of the plane: its shape, and what is around it."""
    whose, around = f"for the planar beam {name!r}", list(around)
    shape = parts.links[name].record.shape if parts.links[name].record is not None else None
    if isinstance(shape, Polyline):
        for key in ("smooth", "up"):
            if getattr(shape, key):
                yield parts.links[name].fault("shape", "must be left out for a planar beam, got one", key)
    if isinstance(shape, Bar) and math.hypot(*shape.upward[:2]) > FLAT:
        yield parts.links[name].fault("shape", f"must be along z {whose}, got {vector(shape.upward)}", "up")
    for entry in around:
        others = [
            parts.links[x] for x in getattr(entry.record, "links", ()) if x in parts.links and x != name
        ]
        if getattr(entry.record, "kind", None) == "weld" and others:
            other = fidelity(others[0])
            if other not in {"beam", "plane", "rigid"} or rigid_in_space(parts, others[0]):
                yield entry.fault(
                    "kind", f"must be a hinge {whose}, got a weld to a {NOUNS.get(other, 'rigid link')}"
                )
        centre = getattr(entry.record, "centre", None)
        if centre is not None and math.dist(centre, entry.record.at) > FLAT:
            yield entry.fault(
                "centre", f"must be its point {vector(entry.record.at)} {whose} [m], got {vector(centre)}"
            )
    yield from off_plane(around, f"the planar beam {name!r}")


def leaving(load: Entry, whose: str) -> Iterator[str]:
    """A force out of the xy plane, or a torque in it."""
    given = getattr(load.record, "vector", None)
    if given is None:
        return
    if load.record.kind == "torque" and any(given[:2]):
        yield load.fault("vector", f"must be along z {whose}, got {vector(given)}")
    elif load.record.kind != "torque" and given[2] != 0.0:
        yield load.fault("vector", f"must lie in the xy plane {whose}, got {vector(given)}")


def joint_obstacles(joint: Entry, whose: str) -> Iterator[str]:
    """A joint that turns or moves something out of the plane."""
    if joint.record is None:
        return
    axis, kind = joint.record.axis, joint.record.kind
    upright = kind in {"revolute", "cylindrical", "screw", "planar"}
    if upright and axis is not None and math.hypot(*axis[:2]) > FLAT:
        yield joint.fault("axis", f"must be along z {whose}, got {vector(axis)}")
    if kind in {"prismatic", "slot"} and axis is not None and abs(axis[2]) > FLAT:
        yield joint.fault("axis", f"must lie in the xy plane {whose}, got {vector(axis)}")
    if kind == "universal":
        yield joint.fault("kind", f"must be one that turns about z only {whose}, got a universal joint")


def vector(parts: tuple[float, ...]) -> str:
    """A vector as text."""
    return "(" + ", ".join(f"{part:.6g}" for part in parts) + ")"


def off_plane(entries: Iterable[Entry], of: str) -> Iterator[str]:
    """Points of good entries that are not in the z plane of the first; `of` says what lies in it."""
    placed = [
        (entry, key, point)
        for entry in entries
        for key, point in points_of(entry.record)
        if all(math.isfinite(part) for part in point)
    ]
    if not placed:
        return
    first = placed[0][2]
    size = max(math.dist(point[:2], first[:2]) for _, _, point in placed) or 1.0
    for entry, key, point in placed:
        if abs(point[2] - first[2]) > FLAT * size:
            wanted = f"must lie in the plane z = {first[2]:.6g} of {of} [m]"
            yield entry.fault(key[0], f"{wanted}, got z = {point[2]:.6g}", *key[1:])


def touching(parts: Parts, name: str) -> list[Entry]:
    """A link, its joints and what acts on it or reads it, as far as they are good."""
    return by_link(parts)[name]


def by_link(parts: Parts) -> dict[str, list[Entry]]:
    """The same of every link."""
    out: dict[str, list[Entry]] = {name: [link] for name, link in parts.links.items()}
    for joint in parts.joints.values():
        for name in dict.fromkeys(link_names(joint)):
            out.get(name, []).append(joint)
    for section in (parts.loads, parts.bodies, parts.probes):
        for entry in section.values():
            out.get(str(entry.word("link")), []).append(entry)
    for spring in parts.springs.values():
        ends = spring_ends(spring)
        for name in dict.fromkeys(end.record.link for end in ends if end.record is not None):
            out.get(name, []).extend(ends)
    return {name: [entry for entry in here if entry.record is not None] for name, here in out.items()}


def spring_ends(spring: Entry) -> list[Entry]:
    """The ends of a spring between two points, as entries, if it is good."""
    ends = getattr(spring.record, "between", ())
    return [Entry((*spring.where, "between", i), {}, end) for i, end in enumerate(ends or ())]


def points_of(record: Any) -> Iterator[tuple[Key, XYZ]]:
    """The points of a link, joint, load, body or probe, with their keys."""
    shape = getattr(record, "shape", None)
    for key in ("between", "points"):
        for i, point in enumerate(getattr(shape, key, ())):
            yield ("shape", key, i), point
    for i, item in enumerate(getattr(shape, "outline", ())[:1]):  # the others are level with it
        yield ("shape", "outline", i), getattr(item, "to", item)
    at = getattr(record, "at", None)
    for name, point in at.points.items() if isinstance(at, Apart) else ():
        yield ("at", name), point
    for key in ("at", "centre"):
        if getattr(record, key, None) is not None:
            yield (key,), getattr(record, key)
