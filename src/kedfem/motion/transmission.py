"""Transmission angles of couplers to the links that they drive.

A coupler transmits force along the line between its two joints. The driven link rotates or slides on the ground, so that
its joint moves in one direction only; the angle between both is the pressure angle α. The transmission angle
is 90° − α, and 90° + α where the coupler leans away from the driven link's hinge: the angle between coupler and rocker of
a four-bar.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.motion.joint_equations import GROUND, unit
from kedfem.motion.linkage import Linkage
from kedfem.motion.rigid import RigidMotion
from kedfem.scene import Scene
from kedfem.vectors import cross

ENDS = ("revolute", "spherical", "universal")
LEAST = np.radians(40.0)  # the usual limit: below it, and above 180° − it, a linkage tends to jam
SAME = 1e-9  # of the linkage's size: joints at the same place


@dataclass(frozen=True, slots=True)
class Transmission:
    """A coupler and the link that it drives.

    coupler, driven : names
    body, output : their numbers
    near, far : joints of the coupler in the reference position: with the driven link, and the other one [m]
    pivot, axis : point and direction of the driven link's joint with the ground, in the reference position
    turns : whether that is a hinge, else a slide
    """

    coupler: str
    driven: str
    body: int
    output: int
    near: Float[np.ndarray, "3"]
    far: Float[np.ndarray, "3"]
    pivot: Float[np.ndarray, "3"]
    axis: Float[np.ndarray, "3"]
    turns: bool

    def angle(self, motion: RigidMotion) -> Float[np.ndarray, " T"]:
        """The transmission angle over time [rad], 0 to π; of a slide 0 to π/2."""
        along = motion.R[:, self.body] @ (self.far - self.near)
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        if not self.turns:
            return np.asarray(np.arcsin(np.clip(np.abs(along @ self.axis), 0.0, 1.0)))
        arm = motion.R[:, self.output] @ (self.pivot - self.near)
        arm -= np.outer(arm @ self.axis, self.axis)
        arm /= np.linalg.norm(arm, axis=1, keepdims=True)
        moves = cross(np.broadcast_to(self.axis, arm.shape), arm)
        sine = np.clip(np.abs(np.einsum("tk,tk->t", along, moves)), 0.0, 1.0)
        beyond = np.einsum("tk,tk->t", along, arm) < 0
        return np.asarray(np.where(beyond, np.pi - np.arcsin(sine), np.arcsin(sine)))


def transmissions(scene: Scene, linkage: Linkage) -> list[Transmission]:
    """Transmissions of all couplers: links with two joints that transmit no moment, whose far end is driven."""
    apart = _distances(scene)
    out: list[Transmission] = []
    for name in scene.links:
        joints = [key for key, joint in scene.joints.items() if name in joint.links]
        if len(joints) != 2 or any(scene.joints[key].kind not in ENDS for key in joints):
            continue
        ends = [(key, _beyond(scene, linkage, key, name)) for key in joints]
        points = [np.asarray(scene.joints[key].at) for key in joints]
        if any(end == GROUND for _, end in ends) or _same(linkage, *points):
            continue
        k = max((0, 1), key=lambda k: apart.get(ends[k][1], -1))
        if apart.get(ends[k][1], -1) > apart.get(ends[1 - k][1], -1):
            out += _on(scene, linkage, name, ends[k][1], points[k], points[1 - k])
    return out


def _on(
    scene: Scene, linkage: Linkage, coupler: str, output: str,
    near: Float[np.ndarray, "3"], far: Float[np.ndarray, "3"],
) -> Iterator[Transmission]:  # fmt: skip
    """The transmission of a coupler to an undriven link with one hinge on the ground, not at the coupler, or slide."""
    held = {key: joint for key, joint in scene.joints.items() if set(joint.links) == {GROUND, output}}
    if len(held) != 1 or held.keys() & scene.driven_joints.keys():
        return
    (joint,) = held.values()
    if joint.kind not in {"revolute", "prismatic"} or joint.axis is None:
        return
    axis, pivot = unit(joint.axis), np.asarray(joint.at)
    arm = np.cross(axis, pivot - near)
    if joint.kind == "revolute" and np.linalg.norm(arm) <= SAME * linkage.size:
        return
    bodies = (linkage.bodies.index(coupler), linkage.bodies.index(output))
    yield Transmission(coupler, output, *bodies, near, far, pivot, axis, joint.kind == "revolute")


def _beyond(scene: Scene, linkage: Linkage, joint: str, link: str) -> str:
    """The other link at a joint; beyond a cross, whose two joints are at one point, the next link."""
    other = next(each for each in scene.joints[joint].links if each != link)
    if other == GROUND:
        return other
    rest = [key for key, each in scene.joints.items() if other in each.links and key != joint]
    if len(rest) != 1 or GROUND in scene.joints[rest[0]].links:
        return other
    at, there = (np.asarray(scene.joints[key].at) for key in (joint, rest[0]))
    return _beyond(scene, linkage, rest[0], other) if _same(linkage, at, there) else other


def _same(linkage: Linkage, a: Float[np.ndarray, "3"], b: Float[np.ndarray, "3"]) -> bool:
    return bool(np.linalg.norm(a - b) <= SAME * linkage.size)


def _distances(scene: Scene) -> dict[str, int]:
    """Number of joints between each link and a driven one, not through the ground."""
    out = {link: 0 for name in scene.driven_joints for link in scene.joints[name].links if link != GROUND}
    here = list(out)
    while here:
        held = (joint.links for link in here for joint in scene.joints.values() if link in joint.links)
        found = [other for links in held for other in links if other != GROUND and other not in out]
        out |= dict.fromkeys(found, out[here[0]] + 1)
        here = list(dict.fromkeys(found))
    return out
