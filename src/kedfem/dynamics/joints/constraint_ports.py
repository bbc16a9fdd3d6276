"""What joints enforced by constraint equations have on their links: coupling surfaces, or stations along the line of a
slot."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.joints.constraint_joints import (
    ConstraintJoint,
    Side,
    bore_axis,
    held_rows,
    in_plane,
    ordered,
    springs,
    station_ports,
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

    key : of the link; slider : name of a rigid slider instead, whose one unknown is its travel
    points, weights : (p, 3) in the reference position, and (n,) of each
    selection : (dp, c) displacements there from the side's own unknowns, world components
    keys : of each point, if they are on several segments of the link
    """

    key: str
    slider: str
    points: Float[np.ndarray, "p 3"]
    weights: Float[np.ndarray, "p n"] | Sequence[Float[np.ndarray, " _"]]
    selection: Float[np.ndarray, "m c"]
    keys: tuple[str, ...] = ()


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
    found = [
        _side(scene, name, i, links, layout, slot=False),
        _side(scene, name, j, links, layout, joint.kind == "slot"),
    ]
    sides, own = zip(*found, strict=True)
    gap, turn = only or held_rows(joint, name in scene.driven_joints)
    axes = None
    if joint.axes is not None and only is None:
        a, b = (np.asarray(bore_axis(joint, link)) for link in (i, j))
        axes, turn[-1] = (a, b), np.cross(a, b)
    here = [link for link in links.values() if link.name in (i, j)]
    planar = bool(here) and all(link.planar for link in here)  # a slider on the ground is of no plane
    kept = in_plane(gap, turn) if planar else np.ones(len(gap), bool)
    hard = np.full(len(gap), np.inf), np.zeros(len(gap))
    stiffness, damping = hard if only else springs(scene, name, gap, turn)
    return ConstraintJoint(
        name, np.asarray(joint.at), (layout.bodies[i], layout.bodies[j]), (sides[0], sides[1]), gap[kept], turn[kept],
        axes, stiffness[kept], damping[kept], joint_axis(joint),
    ), list(own)  # fmt: skip


def element_joint(
    scene: Scene, name: str, element: Spring | Motor | Limit, links: dict[str, Link], layout: LinkageLayout
) -> tuple[ConstraintJoint, list[Own | None]]:
    """The two sides of a spring, motor or limit, as a joint without rows: on those of its joint, or at two points."""
    if not isinstance(element, LineSpring) or element.between is None:
        row, own = row_joint(scene, str(element.joint), links, layout, (np.zeros((0, 3)), np.zeros((0, 3))))
        return replace(row, name=name), own
    found = [
        _point_side(f"{name}.between[{k}].at", scene, end.link, np.asarray(end.at), links, layout)
        for k, end in enumerate(element.between)
    ]
    (one, first), (other, second) = found
    bodies = tuple(layout.bodies[end.link] for end in element.between)
    none = np.zeros((0, 3))
    row = ConstraintJoint(
        name, np.asarray(element.between[0].at), (bodies[0], bodies[1]), (one, other), none, none, None,
        np.zeros(0), np.zeros(0), np.eye(3)[2],
    )  # fmt: skip
    return row, [first, second]


def can_be_bars(link: Link) -> bool:
    """Whether a link is a rigid one in space, which four of its points show."""
    return link.rigid and link.d == 3 and link.n == 4 and link.kind != "beam"


def rigid_points(link: Link, key: str, layout: LinkageLayout) -> tuple[ConstraintJoint, list[Own | None]]:
    """Four points of a rigid link, its centre of mass and one along each axis, as a joint without rows."""
    centre = link.centre
    surface, length = rigid_link_surface(link, centre), link.size / 2
    points = centre + length * np.concatenate([np.zeros((1, 3)), np.eye(3)])
    weights = surface.fit[0] + length * np.concatenate([np.zeros((1, link.n)), surface.fit[1:]])
    none, every = np.zeros((0, 3)), np.zeros((4, 6, 3))
    every[:, :3] = np.eye(3)
    side = Side(layout.bodies[link.name], centre, every, np.zeros((4, 3, 0)), points=points)
    row = ConstraintJoint(
        f"rigid.{key}", centre, (layout.bodies[link.name], 0), (side, None), none, none, None, none[:, 0], none[:, 0],
        np.eye(3)[2],
    )  # fmt: skip
    return row, [Own(key, "", points, weights, np.eye(12)), None]


def _point_side(
    where: str,
    scene: Scene,
    on: str,
    at: Float[np.ndarray, "3"],
    links: dict[str, Link],
    layout: LinkageLayout,
) -> tuple[Side | None, Own | None]:
    """A point of a link; nothing on the ground and on what the drive carries."""
    only_u = np.concatenate([np.eye(3), np.zeros((3, 3))])[None]
    if on in scene.links and (axis := slider_axis(scene, on)) is not None:
        side = Side(layout.bodies[on], at, only_u, np.zeros((1, 3, 0)), shared=False, points=at[None])
        return side, Own("", on, at[None], np.zeros((1, 0)), axis[:, None])
    if on not in {link.name for link in links.values()}:
        return None, None
    key, rows = on_part(links, on, at, lambda link: point_rows(link, where, at))
    link = links[key]
    require_on_axis(link, where, at, rows.X)
    d = link.d
    known = only_u[:, :, :d].copy()
    if link.kind == "beam":
        known[0, [2, 5], 2] = 0.0, 1.0  # (u, v, ψ)
    side = Side(layout.bodies[on], rows.X, known, np.zeros((1, d, 0)), points=rows.X[None])
    return side, Own(key, "", rows.X[None], rows.value[None], np.eye(d))


def _side(
    scene: Scene, name: str, on: str, links: dict[str, Link], layout: LinkageLayout, slot: bool
) -> tuple[Side | None, Own | None]:
    """What a joint has on one of its links; nothing on the ground and on what the drive carries."""
    if on in scene.links and (axis := slider_axis(scene, on)) is not None:
        rigid = np.concatenate([np.eye(3), np.zeros((3, 3))])[None]
        side = Side(
            layout.bodies[on], np.asarray(scene.joints[name].at), rigid, np.zeros((1, 3, 0)), shared=False
        )
        return side, Own("", on, np.zeros((1, 3)), np.zeros((1, 0)), axis[:, None])
    if on not in {link.name for link in links.values()}:
        return None, None
    where, body = f"joints.{name}", layout.bodies[on]
    if slot:
        parts = {key: link for key, link in links.items() if link.name == on}
        joint = scene.joints[name]
        line = layout.slots[name]
        if not isinstance(line, Stations):
            whole = not corotational_links(scene).isdisjoint(joint.links)
            line = stations(parts, where, np.asarray(joint.at), joint_axis(joint), line, whole)
        points, known = station_ports(line, next(iter(parts.values())))
        side = Side(body, line.points[0], known, np.zeros((*known.shape[::2], 0)), line, points=points)
        own = np.eye(known.shape[2] * len(points))
        return side, Own(line.keys[0], "", points, line.weights, own, line.keys)
    key, surface = part_surface(scene, name, links, on)
    points, known = surface_ports(surface, links[key], where)
    side = Side(body, surface.origin, known, np.zeros((len(points), links[key].d, 0)), points=points)
    return side, Own(key, "", points, port_weights(surface, points), np.eye(known.shape[2] * len(points)))
