"""Coordinates of joints: rotations of hinges and travels of slides, from the reference position.

They are those of the joint's first link that is not the ground against the other, about or along the joint's axis; in a
slot those of the link with the pin along the line of the other; in a universal joint, about each axis, against the link
with this axis.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from kedfem.arrays import Float
from kedfem.motion.constraints import perpendiculars
from kedfem.motion.joint_equations import coordinate_axis, ordered, unit
from kedfem.motion.linkage import Linkage
from kedfem.motion.rigid import RigidMotion
from kedfem.scene import Joint, Scene, driven_travel

Vector = Float[np.ndarray, "3"]
TURNS = ("revolute", "cylindrical", "screw", "planar")
TRAVELS = ("prismatic", "cylindrical", "screw", "slot")


@dataclass(frozen=True, slots=True)
class Coordinate:
    """One coordinate of a joint.

    joint, name : e.g. ``angle``, ``travel``
    kind : whether it is an angle [rad] or a length [m]
    body, other : numbers of the body that moves and the one that it moves against
    at : the joint's point in the reference position [m]
    axis : unit vector in the other body, in the reference position, that it is about or along
    mark : of an angle, the direction in the moving body, in the reference position, whose rotation is measured
    """

    joint: str
    name: str
    kind: Literal["angle", "length"]
    body: int
    other: int
    at: Vector
    axis: Vector
    mark: Vector

    def values(self, motion: RigidMotion) -> Float[np.ndarray, " T"]:
        """Over time; angles within ±π."""
        back = np.swapaxes(motion.R[:, self.other], 1, 2)
        if self.kind == "length":
            gap = motion.p[:, self.body] - motion.p[:, self.other]
            gap += (motion.R[:, self.body] - motion.R[:, self.other]) @ self.at
            return np.asarray((back @ gap[..., None])[..., 0] @ self.axis)
        return rotation_about(motion.R[:, self.body], motion.R[:, self.other], self.axis, self.mark)


def rotation_about(
    R_i: Float[np.ndarray, "T 3 3"], R_j: Float[np.ndarray, "T 3 3"], axis: Vector, mark: Vector
) -> Float[np.ndarray, " T"]:
    """Angle of body i against body j about an axis of j, within ±π [rad].

    mark : direction in body i, in the reference position, across the axis: its rotation is measured
    """
    seen = (np.swapaxes(R_j, 1, 2) @ R_i) @ mark
    return np.asarray(np.arctan2(seen @ np.cross(axis, mark), seen @ mark))


def coordinates(scene: Scene, linkage: Linkage) -> list[Coordinate]:
    """Coordinates of all joints: none of spherical ones, of universal ones the rotations about both axes."""
    return [each for name, joint in scene.joints.items() for each in _of(name, joint, linkage)]


def driven_names(scene: Scene, joint: str) -> list[str]:
    """Names of the coordinates that a joint's drives prescribe, but for directions in a plane."""
    drives = [each for each in scene.all_drives.items() if each[1].joint == joint and each[1].along is None]
    names = ["travel" if driven_travel(scene, name) else "angle" for name, _ in drives]
    return [x if drive.about is None else f"{x}_about_{drive.about}" for x, (_, drive) in zip(names, drives, strict=True)]


def unwrapped(angle: Float[np.ndarray, "T c"], before: Float[np.ndarray, " c"] | None) -> Float[np.ndarray, "T c"]:
    """Angles beyond ±π, continuous with those of the time point before, if given [rad]."""
    if before is None:
        return np.asarray(np.unwrap(angle, axis=0))
    return np.asarray(np.unwrap(np.vstack([before, angle]), axis=0)[1:])


def _of(name: str, joint: Joint, linkage: Linkage) -> list[Coordinate]:
    one, other = ordered(joint)
    body, against = linkage.bodies.index(one), linkage.bodies.index(other)
    at, none = np.asarray(joint.at), np.zeros(3)
    if joint.axes is not None:
        first, second = (coordinate_axis(joint, link) for link in (one, other))
        return [  # the cross has both axes: each rotates about the other
            Coordinate(name, f"angle_about_{other}", "angle", body, against, at, second, first),
            Coordinate(name, f"angle_about_{one}", "angle", against, body, at, first, second),
        ]
    if joint.axis is None or joint.kind in {"spherical", "weld"}:
        return []
    axis = unit(joint.axis)
    e1, e2 = perpendiculars(axis)
    out = []
    if joint.kind in TURNS:
        out.append(Coordinate(name, "angle", "angle", body, against, at, axis, e1))
    if joint.kind in TRAVELS:
        out.append(Coordinate(name, "travel", "length", body, against, at, axis, none))
    if joint.kind == "planar":
        out += [Coordinate(name, f"travel_{k}", "length", body, against, at, e, none) for k, e in ((1, e1), (2, e2))]
    return out
