"""What joints enforced by constraint equations have on their links: coupling surfaces, or stations along the line of a
slot."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.joints.constraint_joints import (
    NO_ROWS,
    ConstraintJoint,
    Side,
    bore_axis,
    held_rows,
    in_plane,
    ordered,
    station_ports,
    stiffnesses,
    surface_ports,
)
from kedfem.dynamics.joints.places import on_part, part_surface, slider_axis
from kedfem.links.point_rows import point_rows, require_on_axis
from kedfem.links.record import Link
from kedfem.links.stations import Stations, stations
from kedfem.links.surfaces.coupling_surfaces import port_weights, rigid_link_surface
from kedfem.motion.joint_equations import joint_axis
from kedfem.scene import Limit, LineSpring, Motor, Scene, Spring, corotational_links


@dataclass(frozen=True, slots=True)
class LinkageLayout:
    """What joints need of the linkage: numbers of bodies by name, and the travel of each slot's pin along its line [m].

    Where its stations are known already, these in its place.
    """

    bodies: Mapping[str, int]
    slots: Mapping[str, tuple[float, float] | Stations]


@dataclass(frozen=True, slots=True)
class Own:
    """Port points that one side of a joint has to itself.

    key : of the link; points, weights : (p, 3) in the reference position, and (n,) of each
    keys : of each point, if they are on several segments of the link
    slider : name of a rigid slider instead, whose one unknown is its travel along an axis
    """

    key: str = ""
    points: Float[np.ndarray, "p 3"] = field(default_factory=lambda: NO_ROWS)
    weights: Float[np.ndarray, "p n"] | Sequence[Float[np.ndarray, " _"]] = ()
    keys: tuple[str, ...] = ()
    slider: str = ""
    axis: Float[np.ndarray, "3"] | None = None


Sides = tuple[Side | None, Own | None]
ONLY_U = np.concatenate([np.eye(3), np.zeros((3, 3))])[None]
Held = tuple[Float[np.ndarray, "r 3"], Float[np.ndarray, "r 3"]]


def gear_joint(
    scene: Scene, name: str, links: dict[str, Link], layout: LinkageLayout
) -> tuple[ConstraintJoint, list[Own | None]]:
    """The row of a pair of gears: motion of the second joint less its transmission times that of the first."""
    gear, zero = scene.gears[name], np.zeros((1, 3))
    found = []
    for each in gear.joints:
        axis = joint_axis(scene.joints[each])[None]
        slides = scene.joints[each].kind == "prismatic"
        found.append(row_joint(scene, each, links, layout, (axis, zero) if slides else (zero, axis)))
    (first, own), (second, others) = found
    row = replace(second, name=f"gears.{name}", plus=((-gear.transmission, first),))
    return row, [*others, *own]


def row_joint(
    scene: Scene, name: str, links: dict[str, Link], layout: LinkageLayout, only: Held | None = None
) -> tuple[ConstraintJoint, list[Own | None]]:
    """A joint enforced by constraint equations, still without the interface unknowns, and the port points of its two
    sides.

    Parameters
    ----------
    only : directions of other rows than those of what the joint holds, and all hard

    Raises
    ------
    MeshError
        If it finds no coupling surface or line on one of its links.
    """
    joint = scene.joints[name]
    i, j = ordered(joint)
    (first, own), (second, others) = (_side(scene, name, on, links, layout) for on in (i, j))
    gap, turn, along = (*only, []) if only else held_rows(joint, name in scene.driven_joints)
    axes = None
    if joint.axes is not None and only is None:
        a, b = (np.asarray(bore_axis(joint, link)) for link in (i, j))
        axes, turn[-1] = (a, b), np.cross(a, b)
    here = [link for link in links.values() if link.name in (i, j)]
    planar = bool(here) and all(link.planar for link in here)  # a slider on the ground is of no plane
    kept = in_plane(gap, turn) if planar else np.ones(len(gap), bool)
    stiffness = np.full(len(gap), np.inf) if only else stiffnesses(scene, name, gap, along)
    row = ConstraintJoint(
        name, np.asarray(joint.at), (layout.bodies[i], layout.bodies[j]), (first, second), joint_axis(joint), gap[kept],
        turn[kept], stiffness[kept], axes,
    )  # fmt: skip
    return row, [own, others]


def element_joint(
    scene: Scene, name: str, element: Spring | Motor | Limit, links: dict[str, Link], layout: LinkageLayout
) -> tuple[ConstraintJoint, list[Own | None]]:
    """The two sides of a spring, motor or limit, as a joint without rows: on those of its joint, or at two points."""
    if not isinstance(element, LineSpring) or element.between is None:
        row, own = row_joint(scene, str(element.joint), links, layout, (NO_ROWS, NO_ROWS))
        return replace(row, name=name), own
    (one, first), (other, second) = (
        _point_side(f"{name}.between[{k}].at", scene, end.link, np.asarray(end.at), links, layout)
        for k, end in enumerate(element.between)
    )
    i, j = (layout.bodies[end.link] for end in element.between)
    return ConstraintJoint(name, np.asarray(element.between[0].at), (i, j), (one, other)), [first, second]


def can_be_bars(link: Link) -> bool:
    """Whether a link is a rigid one in space, which four of its points show."""
    return link.rigid and link.d == 3 and link.n == 4 and link.kind != "beam"


def rigid_points(link: Link, key: str, layout: LinkageLayout) -> tuple[ConstraintJoint, list[Own | None]]:
    """Four points of a rigid link, its centre of mass and one along each axis, as a joint without rows."""
    centre = link.centre
    surface, length = rigid_link_surface(link, centre), link.size / 2
    points = centre + length * np.concatenate([np.zeros((1, 3)), np.eye(3)])
    weights = surface.fit[0] + length * np.concatenate([np.zeros((1, link.n)), surface.fit[1:]])
    every = np.zeros((4, 6, 3))
    every[:, :3] = np.eye(3)
    body = layout.bodies[link.name]
    row = ConstraintJoint(f"rigid.{key}", centre, (body, 0), (Side(body, centre, every, points), None))
    return row, [Own(key, points, weights), None]


def _without_ports(
    scene: Scene, on: str, at: Float[np.ndarray, "3"], links: dict[str, Link], layout: LinkageLayout
) -> Sides | None:
    """A point of a rigid slider; nothing on the ground and on what the drive carries. None on links with ports."""
    if on in scene.links and (axis := slider_axis(scene, on)) is not None:
        return Side(layout.bodies[on], at, ONLY_U, at[None], shared=False), Own(slider=on, axis=axis)
    return None if on in {link.name for link in links.values()} else (None, None)


def _point_side(
    where: str, scene: Scene, on: str, at: Float[np.ndarray, "3"], links: dict[str, Link], layout: LinkageLayout
) -> Sides:  # fmt: skip
    """A point of a link."""
    if (found := _without_ports(scene, on, at, links, layout)) is not None:
        return found
    key, rows = on_part(links, on, at, lambda link: point_rows(link, where, at))
    link = links[key]
    require_on_axis(link, where, at, rows.X)
    known = ONLY_U[:, :, : link.d].copy()
    if link.kind == "beam":
        known[0, [2, 5], 2] = 0.0, 1.0  # (u, v, ψ)
    return Side(layout.bodies[on], rows.X, known, rows.X[None]), Own(key, rows.X[None], rows.value[None])


def _side(scene: Scene, name: str, on: str, links: dict[str, Link], layout: LinkageLayout) -> Sides:
    """What a joint has on one of its links: a coupling surface, or the line of a slot."""
    joint, where = scene.joints[name], f"joints.{name}"
    at = np.asarray(joint.at)
    if (found := _without_ports(scene, on, at, links, layout)) is not None:
        return found
    if joint.kind == "slot" and on == ordered(joint)[1]:
        parts = {key: link for key, link in links.items() if link.name == on}
        line = layout.slots[name]
        if not isinstance(line, Stations):
            whole = not corotational_links(scene).isdisjoint(joint.links)
            line = stations(parts, where, at, joint_axis(joint), line, whole)
        points, known = station_ports(line, next(iter(parts.values())))
        side = Side(layout.bodies[on], line.points[0], known, points, line)
        return side, Own(line.keys[0], points, line.weights, line.keys)
    key, surface = part_surface(scene, name, links, on)
    points, known = surface_ports(surface, links[key], where)
    side = Side(layout.bodies[on], surface.origin, known, points)
    return side, Own(key, points, port_weights(surface, points))
