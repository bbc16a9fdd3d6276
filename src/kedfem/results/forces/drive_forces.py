"""Channels of the forces and torques of drives and gears."""

import numpy as np

from kedfem.dynamics.history import Block
from kedfem.dynamics.model import Model, PrescribedBody
from kedfem.dynamics.system.forces.exerted import effort
from kedfem.dynamics.system.forces.supports import supports
from kedfem.motion.joint_equations import joint_axis, moving_pair
from kedfem.results.channels import Channel
from kedfem.results.forces.constraint_forces import of_joint
from kedfem.results.forces.drive_joint_forces import drive_joint_wrench, partner
from kedfem.results.forces.port_forces import Forces, indeterminate_part, link_of_joint, negligible, port_wrench
from kedfem.results.recorded import Recorded, Rows, effort_channel
from kedfem.scene import Scene


def drive_channels(scene: Scene, model: Model, driven: str, forces: Forces) -> list[Recorded]:
    """Effort of one of `Scene.all_drives` on its link, about or along the axis of its coordinate."""
    drive = scene.all_drives[driven]
    joint, number = scene.joints[drive.joint], list(scene.all_drives).index(driven)
    if any(row.name == drive.joint for row in model.rows):
        return [Recorded(effort_channel(scene, driven), lambda block: effort(supports(block), number)[:, None])]
    prescribed = next((x for x in model.prescribed if x.drive_joint == driven), None)
    if prescribed is not None:
        return _prescribed_drive(scene, model, prescribed, forces)
    name = moving_pair(joint)[0]
    axis, at = joint_axis(joint), np.asarray(joint.at)
    wrench = port_wrench(model, link_of_joint(model, name, driven), driven, at, forces)
    return [Recorded(effort_channel(scene, driven), lambda block: wrench(block)[1] @ axis[:, None])]


def _prescribed_drive(scene: Scene, model: Model, prescribed: PrescribedBody, forces: Forces) -> list[Recorded]:
    """Torque, of a slide force, of the drive that moves a prescribed body, on the joint's first link, along its axis."""
    joint, first = scene.joints[prescribed.drive_joint], partner(scene, prescribed)
    axis, which = joint_axis(joint), 0 if joint.kind == "prismatic" else 1
    wrench, others = drive_joint_wrench(scene, model, prescribed, forces)
    if not all(negligible(indeterminate_part(model, *each)[which] @ axis) for each in others):
        return []
    sign = 1.0 if moving_pair(joint)[0] == prescribed.link.name else -1.0
    bodies = {x.link.name: x.body for x in model.prescribed}

    def along(block: Block) -> Rows:
        direction = block.motion.R[:, bodies.get(first, 0)] @ axis
        return np.asarray(sign * (wrench(block)[which] * direction).sum(axis=1, keepdims=True))

    return [Recorded(effort_channel(scene, prescribed.drive_joint), along)]


def gear_channel(model: Model, name: str) -> Recorded:
    """Torque or force of gears on the first joint's link."""
    row, _ = of_joint(model.rows, f"gears.{name}")
    share = row.plus[0][0]
    text = f"torque of gears {name} on the link whose rotation the first joint's angle is, about that joint's axis"
    return Recorded(
        Channel(f"gears/{name}/torque", ("torque",), "N m", "world", text),
        lambda block: share * effort(supports(block), f"gears.{name}")[:, None],
    )
