"""Attachments of joints enforced by constraint equations: coupling surfaces, or stations along the line of a slot."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.joints.constraint_joints import (
    ConstraintJoint,
    Side,
    constrained,
    coordinate,
    direction,
    in_plane,
    surface_ports,
)
from kedfem.dynamics.joints.places import on_part, part_surface
from kedfem.dynamics.system.record import Constraint, Held
from kedfem.links.point_rows import point_rows, require_on_axis
from kedfem.links.record import Link
from kedfem.links.stations import Stations, stations
from kedfem.links.surfaces.coupling_surfaces import port_weights, rigid_link_surface
from kedfem.motion.joint_equations import joint_axis, ordered
from kedfem.motion.linkage import Linkage
from kedfem.motion.path import Path
from kedfem.motion.rigid import rigid_motion, seen_from
from kedfem.scene import Limit, LineSpring, Motor, Scene, Spring, corotational_links
from kedfem.scene.records.materials import LINE


@dataclass(frozen=True, slots=True)
class LinkageLayout:
    """Data of the linkage for joints: numbers of bodies by name, and the travel of each slot's pin along its line [m].

    Where its stations are known already, these in its place.
    """

    bodies: Mapping[str, int]
    slots: Mapping[str, tuple[float, float] | Stations]


FINER = 8  # positions examined between two points of a path, for how far pins go along slots


def gear_joint(scene: Scene, name: str, links: dict[str, Link], layout: LinkageLayout) -> ConstraintJoint:
    """The constraint of a pair of gears: motion of the second joint less its transmission times that of the first."""
    gear, key = scene.gears[name], f"gears.{name}"
    each_turns = zip(gear.joints, gear.turning, strict=True)
    terms = (coordinate(scene.joints[x], turns=turns) for x, turns in each_turns)
    first, second = (
        constraint_joint(scene, each, links, layout, (Constraint(key, (term,), Held(), linear=True),))
        for each, term in zip(gear.joints, terms, strict=True)
    )
    return replace(second, name=key, plus=((-gear.transmission, first),))


def constraint_joint(
    scene: Scene, name: str, links: dict[str, Link], layout: LinkageLayout,
    only: tuple[Constraint, ...] | None = None, about: str | None = None,
) -> ConstraintJoint:  # fmt: skip
    """A joint enforced by constraint equations, still without the interface unknowns.

    Parameters
    ----------
    only : constraints in place of what the joint has
    about : as of `ordered`

    Raises
    ------
    MeshError
        If it finds no coupling surface or line on one of its links.
    """
    joint = scene.joints[name]
    i, j = ordered(joint, about)
    first, second = (_side(scene, name, on, links, layout) for on in (i, j))
    here = [link for link in links.values() if link.name in (i, j)]
    planar = bool(here) and all(link.planar for link in here)
    every = constrained(scene, name) if only is None else only
    kept = tuple(each for each in every if not planar or any(in_plane(*direction(term)) for term in each.terms))
    bodies = layout.bodies[i], layout.bodies[j]
    return ConstraintJoint(name, np.asarray(joint.at), bodies, (first, second), joint_axis(joint), kept)


def element_joint(
    scene: Scene, name: str, element: Spring | Motor | Limit, links: dict[str, Link], layout: LinkageLayout
) -> ConstraintJoint:
    """The two sides of a spring, motor or limit, as a joint without rows: on those of its joint, or at two points."""
    if not isinstance(element, LineSpring) or element.between is None:
        about = getattr(element, "about", None)
        return replace(constraint_joint(scene, str(element.joint), links, layout, (), about), name=name)
    one, other = (
        _point_side(f"{name}.between[{k}].at", scene, end.link, np.asarray(end.at), links, layout)
        for k, end in enumerate(element.between)
    )
    i, j = (layout.bodies[end.link] for end in element.between)
    return ConstraintJoint(name, np.asarray(element.between[0].at), (i, j), (one, other))


def can_be_bars(link: Link) -> bool:
    """Whether a link is a rigid one in space, which four of its points show, and no slider, which its guide may hold."""
    return link.rigid and link.d == 3 and link.n == 4 and link.kind != "beam" and not link.anywhere


def rigid_points(link: Link, key: str, layout: LinkageLayout) -> ConstraintJoint:
    """Four points of a rigid link, its centre of mass and one along each axis, as a joint without rows."""
    centre = link.centre
    surface, length = rigid_link_surface(link, centre), link.size / 2
    points = centre + length * np.concatenate([np.zeros((1, 3)), np.eye(3)])
    weights = surface.fit[0] + length * np.concatenate([np.zeros((1, link.n)), surface.fit[1:]])
    side = Side(layout.bodies[link.name], points, keys=(key,) * 4, weights=weights)
    return ConstraintJoint(f"rigid.{key}", centre, (side.body, 0), (side, None))


def _point_side(
    where: str, scene: Scene, on: str, at: Float[np.ndarray, "3"], links: dict[str, Link], layout: LinkageLayout
) -> Side | None:  # fmt: skip
    """A point of a link; None on the ground and on prescribed links."""
    if all(link.name != on for link in links.values()):
        return None
    key, rows = on_part(links, on, at, lambda link: point_rows(link, where, at))
    link = links[key]
    require_on_axis(link, where, at, rows.X)
    turns = link.kind == "beam"
    return Side(layout.bodies[on], rows.X[None], link.d, turns, keys=(key,), weights=rows.value[None])


def _side(scene: Scene, name: str, on: str, links: dict[str, Link], layout: LinkageLayout) -> Side | None:
    """The coupling surface of a joint on one of its links, or the line of a slot; None where links have no
    unknowns."""
    joint, where = scene.joints[name], f"joints.{name}"
    at = np.asarray(joint.at)
    if all(link.name != on for link in links.values()):
        return None
    if joint.kind == "slot" and on == ordered(joint)[1]:
        parts = {key: link for key, link in links.items() if link.name == on}
        line = layout.slots[name]
        if not isinstance(line, Stations):
            whole = not corotational_links(scene).isdisjoint(joint.links)
            endless = str(scene.links[on].material).startswith(LINE)
            line = stations(parts, where, (at, joint_axis(joint)), line, whole, endless)
        part = next(iter(parts.values()))
        return Side(layout.bodies[on], line.points, part.d, part.kind == "beam", line, line.keys, line.weights)
    key, surface = part_surface(scene, name, links, on)
    points, part = surface_ports(surface, links[key], where), links[key]
    keys, weights = (key,) * len(points), port_weights(surface, points)
    return Side(layout.bodies[on], points, part.d, part.kind == "beam", keys=keys, weights=weights)


def slot_travels(scene: Scene, linkage: Linkage, along: Path | None = None) -> dict[str, tuple[float, float]]:
    """Least and greatest place of each slot's pin along its line, from its reference position [m]; 0 without a drive.

    Parameters
    ----------
    along : path over the drive's range, needed with slots and a drive
    """
    slots = {name: joint for name, joint in scene.joints.items() if joint.kind == "slot"}
    if not slots:
        return {}
    if not linkage.drives:
        return dict.fromkeys(slots, (0.0, 0.0))
    if along is None:
        raise ValueError("the path of a linkage with slots must be given, got none")
    angles = np.linspace(along.phi[0], along.phi[-1], FINER * len(along.phi))
    still = np.zeros_like(angles)
    motion = rigid_motion(linkage, along, angles, (angles, still, still))
    out = {}
    for name, joint in slots.items():
        bodies = [linkage.bodies.index(link) for link in ordered(joint)]
        s = seen_from(motion, (bodies[0], bodies[1]), np.asarray(joint.at)) @ joint_axis(joint)
        out[name] = (float(s.min()), float(s.max()))
    return out
