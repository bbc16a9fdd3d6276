"""Constraint equations of a scene's joints, gears and drives."""

from dataclasses import replace

import numpy as np

from kedfem.arrays import Float
from kedfem.motion.constraints import (
    ANGLE,
    GAP,
    TURN,
    ConstraintEquation,
    coupled,
    free_rows,
    joint_rows,
    travel_row,
    turn_row,
)
from kedfem.scene import Joint, Scene, driven_travel
from kedfem.scene.records.points import XYZ
from kedfem.vectors import cross

GROUND = "ground"
PLANE = "the plane"


def body_names(scene: Scene) -> tuple[str, ...]:
    """The ground and all links, in the order of their numbers in a linkage."""
    return GROUND, *scene.links


def joint_points(scene: Scene) -> Float[np.ndarray, "j 3"]:
    """Places of all joints [m]."""
    return np.array([joint.at for joint in scene.joints.values()]).reshape(-1, 3)


def scene_centre(scene: Scene) -> Float[np.ndarray, "3"]:
    """The middle of all joints [m]; the origin where there are none."""
    points = joint_points(scene)
    return np.asarray(points.mean(axis=0)) if len(points) else np.zeros(3)


def unit(axis: tuple[float, float, float]) -> Float[np.ndarray, "3"]:
    """A direction made a unit vector."""
    return np.asarray(np.asarray(axis) / np.linalg.norm(axis))


def joint_axis(joint: Joint) -> Float[np.ndarray, "3"]:
    """Unit vector of a joint's axis; the default, of hinges, is z."""
    return unit(joint.axis or (0.0, 0.0, 1.0))


def rows_of(
    scene: Scene, name: str, bodies: tuple[str, ...], centre: np.ndarray, kind: str | None = None
) -> list[ConstraintEquation]:
    """Rows of a joint, of its own kind or another."""
    joint = scene.joints[name]
    axis: np.ndarray | tuple[np.ndarray, np.ndarray] | None = None if joint.axis is None else unit(joint.axis)
    i, j = _pair(joint, bodies)
    if joint.axes is not None:
        one, other = (unit(each) for each in joint.axes)
        axis = (one, other) if bodies.index(joint.links[0]) == i else (other, one)
    rows = joint_rows(kind or joint.kind, name, i, j, np.asarray(joint.at) - centre, axis)
    if joint.open:  # gaps are between its links' own points
        ends = {k: np.asarray(joint.on(bodies[k])) - centre for k in (i, j)}
        rows = [replace(row, a=ends[row.i], a_j=ends[row.j]) if row.kind == GAP else row for row in rows]
    if joint.lead is not None:
        travel, turn = (coordinate_row(scene, name, bodies, turns) for turns in (False, True))
        rows.append(coupled(travel, (-joint.lead / (2 * np.pi), turn)))
    return rows


def moving_pair(joint: Joint) -> tuple[str, str]:
    """The link of a joint whose coordinates are meant, the first that is not the ground, and the other."""
    one, other = joint.links
    return (other, one) if one == GROUND else (one, other)


def ordered(joint: Joint, about: str | None = None) -> tuple[str, str]:
    """The links i and j of a joint whose coordinates are of i against j: j is the second, or the ground.

    Of a slot i has the pin and j the line.

    Parameters
    ----------
    about : of a universal joint, the link that is j instead
    """
    first, second = joint.links
    if about is not None:
        return (first if about == second else second), about
    return (second, first) if first == GROUND and joint.kind != "slot" else (first, second)


def coordinate_axis(joint: Joint, about: str | None = None, along: XYZ | None = None) -> Float[np.ndarray, "3"]:
    """Unit vector that a joint's coordinate is about or along, fixed in the second of its `ordered` links.

    Parameters
    ----------
    about : of a universal joint, the link about whose axis the other link's rotates, as the cross has both
    along : of a planar joint, a direction in its plane
    """
    if about is not None and joint.axes is not None:
        return unit(joint.axes[joint.links.index(about)])
    return joint_axis(joint) if along is None else unit(along)


def coordinate_row(
    scene: Scene, name: str, bodies: tuple[str, ...], turns: bool, about: str | None = None, along: XYZ | None = None
) -> ConstraintEquation:
    """Rotation or travel of a joint; about and along as of `coordinate_axis`."""
    joint, axis = scene.joints[name], coordinate_axis(scene.joints[name], about, along)
    one, other = ordered(joint, about)
    i, j = bodies.index(one), bodies.index(other)
    if about is not None:
        return ConstraintEquation(ANGLE, i, j, coordinate_axis(joint, one), axis, name)
    if turns:
        return turn_row(name, i, j, axis)
    return travel_row(name, i, j, np.asarray(joint.at) - scene_centre(scene), axis)


def cross_row(joint: Joint, name: str, bodies: tuple[str, ...], about: str) -> ConstraintEquation:
    """The sine of a universal joint's angle about the axis of its other link, at any angle about its own."""
    other = next(link for link in joint.links if link != about)
    axis = coordinate_axis(joint, about)
    normal = cross(axis, coordinate_axis(joint, other))
    return ConstraintEquation(TURN, bodies.index(other), bodies.index(about), normal, axis, name)


def driven_row(scene: Scene, name: str, bodies: tuple[str, ...]) -> ConstraintEquation:
    """Rotation or travel that one of `Scene.all_drives` prescribes."""
    drive = scene.all_drives[name]
    return coordinate_row(scene, drive.joint, bodies, not driven_travel(scene, name), drive.about, drive.along)


def gear_row(scene: Scene, name: str, bodies: tuple[str, ...]) -> ConstraintEquation:
    """Gears: coordinate of the second joint less ratio · that of the first; the greater coefficient is one."""
    gear, where = scene.gears[name], f"gears.{name}"
    first, second = (
        replace(coordinate_row(scene, each, bodies, turns), joint=where)
        for each, turns in zip(gear.joints, gear.turning, strict=True)
    )
    if second.kind == ANGLE and abs(gear.transmission) > 1:
        return coupled(first, (-1 / gear.transmission, second))
    return coupled(second, (-gear.transmission, first))


def undriven_rows(scene: Scene) -> list[ConstraintEquation]:
    """Rows of joints and couplings, without the drives'."""
    bodies, centre = body_names(scene), scene_centre(scene)
    rows = [row for name in scene.joints for row in rows_of(scene, name, bodies, centre)]
    return rows + [gear_row(scene, name, bodies) for name in scene.gears]


def joint_free_rows(scene: Scene, name: str, bodies: tuple[str, ...]) -> list[ConstraintEquation]:
    """Rows of what a joint releases."""
    joint = scene.joints[name]
    axis, point = None if joint.axis is None else unit(joint.axis), np.asarray(joint.at) - scene_centre(scene)
    return free_rows(joint.kind, name, *_pair(joint, bodies), point, axis)


def plane_rows(bodies: tuple[str, ...]) -> list[ConstraintEquation]:
    """Rows that constrain all links to planes z = constant."""
    numbers, origin, z = range(1, len(bodies)), np.zeros(3), np.eye(3)[2]
    return [row for k in numbers for row in joint_rows("planar", PLANE, k, 0, origin, z)]


def _pair(joint: Joint, bodies: tuple[str, ...]) -> tuple[int, int]:
    """Numbers of a joint's bodies; the ground, where there is one, comes second: directions are fixed in it.

    Of a slot the link with the pin comes first: directions are fixed in the link with the line.
    """
    if joint.kind == "slot":
        return bodies.index(joint.links[0]), bodies.index(joint.links[1])
    i, j = sorted((bodies.index(link) for link in joint.links), reverse=True)
    return i, j
