"""Forces on the drive joint of a rigid link whose motion a drive prescribes."""

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.history import Block
from kedfem.dynamics.loads import applied
from kedfem.dynamics.model import Model, PrescribedBody
from kedfem.dynamics.system.forces.exerted import effort
from kedfem.dynamics.system.forces.supports import supports
from kedfem.links.record import in_space
from kedfem.motion.joint_equations import ordered
from kedfem.results.forces.port_forces import Forces, Wrench, link_of_joint, port_wrench, resultant
from kedfem.results.recorded import Rows
from kedfem.scene import Scene
from kedfem.vectors import cross


def partner(scene: Scene, prescribed: PrescribedBody) -> str:
    """The other link of a prescribed body's drive joint: the ground, or a moving part of it."""
    first, second = scene.joints[prescribed.drive_joint].links
    return second if first == prescribed.link.name else first


Held = tuple[int, str, Float[np.ndarray, "3"]]  # link, joint and its point


def constrained_joints(scene: Scene, model: Model, prescribed: PrescribedBody) -> list[str]:
    """Joints of a prescribed link enforced by constraint equations."""
    joints = scene.joints
    return [x.name for x in model.rows if x.name in joints and prescribed.link.name in joints[x.name].links]


def drive_joint_wrench(
    scene: Scene, model: Model, prescribed: PrescribedBody, forces: Forces
) -> tuple[Wrench, list[Held]]:
    """Force and moment of the drive joint that balance a prescribed link under P − M R0'', motors, springs, other joints;
    and these joints."""
    link, centre_of_joint = prescribed.link, np.asarray(scene.joints[prescribed.drive_joint].at)
    held: list[Held] = []
    sliding = constrained_joints(scene, model, prescribed)
    for name, joint in scene.joints.items():
        elastic = [x.name for x in model.links if x.name in joint.links]
        if link.name in joint.links and elastic and name not in sliding:
            held.append((link_of_joint(model, elastic[0], name), name, np.asarray(joint.at)))
    others = [(port_wrench(model, *each, forces), each[2]) for each in held]
    driven = [x for x in model.prescribed if partner(scene, x) == link.name]
    riders = [(x, *drive_joint_wrench(scene, model, x, forces)) for x in driven]
    held += [each for _, _, below in riders for each in below]

    def wrench(block: Block) -> tuple[Rows, Rows]:
        F = applied(link, prescribed.loads, block.motion, prescribed.body)
        R = block.motion.R[:, prescribed.body]
        arms = (link.X - np.outer(link.one, centre_of_joint)) @ R.transpose(0, 2, 1)
        centre = block.motion.p[:, prescribed.body] + R @ centre_of_joint
        force, moment = forces.force_elements.on(link.name, block, centre)
        force = -force - in_space(link, np.tensordot(F, link.one, (1, 0)))
        moment = -moment - resultant(link, arms, F)[1]
        for other, at in others:
            f, m = other(block)
            force = force + f
            moment = moment + m + cross((R @ (at - centre_of_joint)), f)
        for rider, on_rider, _ in riders:
            f, m = on_rider(block)
            place = block.motion.position(rider.body, np.asarray(scene.joints[rider.drive_joint].at))
            force, moment = force + f, moment + m + cross(place - centre, f)
        for name in sliding:
            f, m, point = forces.rows.wrench(name, block)
            sign = -1.0 if ordered(scene.joints[name])[0] == link.name else 1.0  # on the other link
            force, moment = force + sign * f, moment + sign * (m + cross(point - centre, f))
        f, m = _geared(scene, model, prescribed, block, centre)
        return force - f, moment - m

    return wrench, held


def _geared(scene: Scene, model: Model, prescribed: PrescribedBody, block: Block, about: Rows) -> tuple[Rows, Rows]:
    """Force and moment about points that gears exert on a prescribed link: along the coordinates of their joints."""
    force, moment = np.zeros((2, len(block), 3))
    rows = {row.name: row for row in model.rows}
    for gears in scene.gears:
        row = rows[f"gears.{gears}"]
        pushed = effort(supports(block), f"gears.{gears}")[:, None]
        for share, joint in ((1.0, row), *row.plus):
            i, j = joint.bodies
            sign = share * ((prescribed.body == i) - (prescribed.body == j))
            along = sign * pushed * (block.motion.R[:, j] @ joint.axis)
            if joint.along[0].any():  # a rack's push goes through the point of link i
                place = block.motion.position(i, joint.at)
                force, moment = force + along, moment + cross(place - about, along)
            else:
                moment = moment + along
    return force, moment
