"""Planar beams: those that nothing in the scene moves out of a plane z = constant.

The obstacles are faults with their places, for beams that are stated to be planar.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator
from typing import Any

from kedfem.errors import Fault, Where
from kedfem.scene.questions.modelling import by_constraint_equations
from kedfem.scene.records.joints import Joint
from kedfem.scene.records.points import XYZ, Apart
from kedfem.scene.records.scene import Scene
from kedfem.scene.records.shapes import Bar, Polyline
from kedfem.scene.records.wording import NOUNS

FLAT = 1e-9  # largest distance from the plane, in sizes of the scene
Placed = tuple[Where, Any]
"""A record and its place in the scene."""


def spatial_beams(scene: Scene) -> frozenset[str]:
    """Names of the beams that move in space; all others are planar, with unknowns (u, v, ψ)."""
    lines = {name: x for name, x in scene.links.items() if x.category == "beam" or x.rigid_line}
    kinds = {name: link.beam for name, link in lines.items()}
    open_ones = [name for name, kind in kinds.items() if kind is None]
    found = {name for name, kind in kinds.items() if kind == "spatial"}
    if any(_common_obstacles(scene, "")):
        found.update(open_ones)
    around = _by_link(scene)
    found.update(name for name in open_ones if any(_own_obstacles(scene, name, around[name])))
    welds = any(joint.kind == "weld" for joint in scene.joints.values())
    beside = {name: welded(scene, name) for name in open_ones} if welds else {}
    while more := {name for name, others in beside.items() if others & found} - found:
        found |= more
    return frozenset(found)


def plane_scene(scene: Scene) -> bool:
    """Whether all links move in a plane z = constant: planar beams, plane links, and rigid links with them."""
    spatial, flat = spatial_beams(scene), False
    for name, link in scene.links.items():
        in_plane = link.category == "plane" or ((link.category == "beam" or link.rigid_line) and name not in spatial)
        if not in_plane and (link.category != "rigid" or link.rigid_line or rigid_in_space(scene, name)):
            return False
        flat = flat or in_plane
    return flat


def rigid_in_space(scene: Scene, name: str) -> bool:
    """Whether a rigid link moves as a body in space: it has a solid shape, and no drive prescribes it."""
    link = scene.links[name]
    if link.category != "rigid" or link.rigid_line or link.shape is None:
        return False
    driven = [x for x in scene.driven_joints.keys() & scene.joints.keys() if name in scene.joints[x].links]
    return all(by_constraint_equations(scene.joints[each], scene.driven_joints[each]) for each in driven)


def welded(scene: Scene, name: str) -> set[str]:
    """Names of what is welded to a link."""
    pairs = [joint.links for joint in scene.joints.values() if joint.kind == "weld"]
    return {other for pair in pairs if name in pair for other in pair} - {name}


def obstacles(scene: Scene, name: str) -> Iterator[Fault]:
    """Why a beam cannot be planar."""
    yield from _common_obstacles(scene, f"for the planar beam {name!r}")
    yield from _own_obstacles(scene, name, _by_link(scene)[name])


def _common_obstacles(scene: Scene, whose: str) -> Iterator[Fault]:
    """Obstacles for all planar beams: axes of joints, gravity, loads."""
    for name, joint in scene.joints.items():
        where: Where = ("joints", name)
        yield from tilted(where, joint, whose, {"revolute", "cylindrical", "screw", "planar"})
        if joint.kind == "universal":
            got = "got a universal joint"
            yield Fault((*where, "kind"), f"must be one that rotates about z only {whose}, {got}")
    yield from leaving(scene, whose)


def _own_obstacles(scene: Scene, name: str, around: Iterable[Placed]) -> Iterator[Fault]:
    """Obstacles for one planar beam: its shape, and what is attached to it."""
    whose, around, place = f"for the planar beam {name!r}", list(around), ("links", name, "shape")
    shape = scene.links[name].shape
    if isinstance(shape, Polyline):
        for key in ("smooth", "up"):
            if getattr(shape, key):
                yield Fault((*place, key), "must be left out for a planar beam, got one")
    yield from upward_faults(name, shape, whose)
    for where, record in around:
        others = [x for x in getattr(record, "links", ()) if x in scene.links and x != name]
        if getattr(record, "kind", None) == "weld" and others:
            other = scene.links[others[0]].category
            if other not in {"beam", "plane", "rigid"} or rigid_in_space(scene, others[0]):
                noun = NOUNS.get(other, "rigid link")
                yield Fault((*where, "kind"), f"must be a hinge {whose}, got a weld to a {noun}")
        centre = getattr(record, "centre", None)
        if centre is not None and math.dist(centre, record.at) > FLAT:
            at = f"must be its point {vector(record.at)} {whose} [m], got {vector(centre)}"
            yield Fault((*where, "centre"), at)
    yield from off_plane(around, f"the planar beam {name!r}")


def leaving(scene: Scene, whose: str) -> Iterator[Fault]:
    """Gravity, forces and speeds out of the xy plane, and torques and rotations in it."""
    if scene.gravity[2] != 0.0:
        yield Fault(("gravity",), f"must lie in the xy plane {whose} [m/s^2], got {vector(scene.gravity)}")
    for where, given, turns in _vectors(scene):
        if given is not None and turns and any(given[:2]):
            yield Fault(where, f"must be along z {whose}, got {vector(given)}")
        elif given is not None and not turns and given[2] != 0.0:
            yield Fault(where, f"must lie in the xy plane {whose}, got {vector(given)}")


def _vectors(scene: Scene) -> Iterator[tuple[Where, XYZ | None, bool]]:
    """Vectors of loads and of motions at the start, and whether each is a torque or a rotation."""
    for name, load in scene.loads.items():
        for key in ("vector", "end_vector"):
            yield ("loads", name, key), getattr(load, key, None), load.kind == "torque"
    start = scene.analysis
    for name, force in start.initial_deflection.items():
        yield ("analysis", "initial_deflection", name, "force"), force.force, False
    for name, motion in start.initial_motions.items():
        yield ("analysis", "initial_motions", name, "velocity"), motion.velocity, False
        yield ("analysis", "initial_motions", name, "angular_velocity"), motion.angular_velocity, True


def tilted(where: Where, joint: Joint, whose: str, upright: Collection[str]) -> Iterator[Fault]:
    """A joint whose axis must be along z and is not, or that slides out of the plane."""
    axis, kind = joint.axis, joint.kind
    if kind in upright and axis is not None and math.hypot(*axis[:2]) > FLAT:
        yield Fault((*where, "axis"), f"must be along z {whose}, got {vector(axis)}")
    if kind in {"prismatic", "slot"} and axis is not None and abs(axis[2]) > FLAT:
        yield Fault((*where, "axis"), f"must lie in the xy plane {whose}, got {vector(axis)}")


def upward_faults(name: str, shape: Any, whose: str) -> Iterator[Fault]:
    """A bar whose thickness is not along z."""
    if isinstance(shape, Bar) and math.hypot(*shape.upward[:2]) > FLAT:
        where = "links", name, "shape", "up"
        yield Fault(where, f"must be along z {whose}, got {vector(shape.upward)}")


def vector(parts: tuple[float, ...]) -> str:
    """A vector as text."""
    return "(" + ", ".join(f"{part:.6g}" for part in parts) + ")"


def off_plane(records: Iterable[Placed], of: str) -> Iterator[Fault]:
    """Points of records outside of the z plane of the first point; `of` names what lies in it."""
    every = (((*where, *key), point) for where, record in records for key, point in _points(record))
    placed = [(where, point) for where, point in every if all(map(math.isfinite, point))]
    if not placed:
        return
    first = placed[0][1]
    size = max(math.dist(point[:2], first[:2]) for _, point in placed) or 1.0
    for where, point in placed:
        if abs(point[2] - first[2]) > FLAT * size:
            wanted = f"must lie in the plane z = {first[2]:.6g} of {of} [m]"
            yield Fault(where, f"{wanted}, got z = {point[2]:.6g}")


def _by_link(scene: Scene) -> dict[str, list[Placed]]:
    """The records of each link: its own, its joints, loads, bodies, probes and springs."""
    out: dict[str, list[Placed]] = {name: [(("links", name), link)] for name, link in scene.links.items()}
    for name, joint in scene.joints.items():
        for link in dict.fromkeys(joint.links):
            out.get(link, []).append((("joints", name), joint))
    for where, record in on_links(scene):
        out.get(record.link, []).append((where, record))
    for spring in scene.springs:
        ends = spring_ends(scene, spring)
        for link in dict.fromkeys(end.link for _, end in ends):
            out.get(link, []).extend(ends)
    return out


def on_links(scene: Scene) -> Iterator[Placed]:
    """Loads, bodies and probes."""
    for name, load in scene.loads.items():
        yield ("loads", name), load
    for name, body in scene.bodies.items():
        yield ("bodies", name), body
    for name, probe in scene.output.probes.items():
        yield ("output", "probes", name), probe


def spring_ends(scene: Scene, name: str) -> list[Placed]:
    """The ends of a spring between two points."""
    ends = getattr(scene.springs[name], "between", None) or ()
    return [(("springs", name, "between", i), end) for i, end in enumerate(ends)]


def _points(record: Any) -> Iterator[tuple[Where, XYZ]]:
    """The points of a link, joint, load, body or probe, with their keys."""
    shape = getattr(record, "shape", None)
    for key in ("between", "points"):
        for i, point in enumerate(getattr(shape, key, ())):
            yield ("shape", key, i), point
    for i, item in enumerate(getattr(shape, "outline", ())[:1]):  # the others have the same z
        yield ("shape", "outline", i), getattr(item, "to", item)
    at = getattr(record, "at", None)
    for name, point in at.points.items() if isinstance(at, Apart) else ():
        yield ("at", name), point
    for i, point in enumerate(getattr(record, "between", None) or ()):
        yield ("between", i), point
    for key in ("at", "centre"):
        if getattr(record, key, None) is not None:
            yield (key,), getattr(record, key)
