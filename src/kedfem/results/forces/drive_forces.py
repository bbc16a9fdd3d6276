"""Channels of the forces and torques of drives and gears."""

import numpy as np

from kedfem.dynamics.history import Block
from kedfem.dynamics.model import Model, PrescribedBody
from kedfem.dynamics.system.forces.exerted import effort
from kedfem.dynamics.system.forces.supports import supports
from kedfem.motion.joint_equations import joint_axis, moving_pair, ordered
from kedfem.results.channels import Channel
from kedfem.results.forces.constraint_forces import of_joint
from kedfem.results.forces.drive_joint_forces import drive_joint_wrench, partner
from kedfem.results.forces.port_forces import Forces, holder, loose, negligible, port_wrench
from kedfem.results.recorded import Recorded, Rows, drive_effort
from kedfem.scene import Scene


def drive_channels(scene: Scene, model: Model, driven: str, forces: Forces) -> list[Recorded]:
    """Torque of the drive on its link, about the driven joint's axis."""
    if any(row.name == driven for row in model.rows):
        return [_row_drive(scene, driven)]
    joint = scene.joints[driven]
    prescribed = next((x for x in model.prescribed if x.drive_joint == driven), None)
    if prescribed is not None:
        return _prescribed_drive(scene, model, prescribed, forces)
    name = moving_pair(joint)[0]
    axis, at = joint_axis(joint), np.asarray(joint.at)
    wrench = port_wrench(model, holder(model, name, driven), driven, at, forces)
    channel = _drive_channel(scene, driven, name)
    return [Recorded(channel, lambda block: wrench(block)[1] @ axis[:, None])]


def _prescribed_drive(scene: Scene, model: Model, prescribed: PrescribedBody, forces: Forces) -> list[Recorded]:
    """Torque, of a slide force, of the drive that moves a prescribed body, on the joint's first link, along its axis."""
    joint, first = scene.joints[prescribed.drive_joint], partner(scene, prescribed)
    axis, which = joint_axis(joint), 0 if joint.kind == "prismatic" else 1
    wrench, others = drive_joint_wrench(scene, model, prescribed, forces)
    if not all(negligible(loose(model, *each)[which] @ axis) for each in others):
        return []
    on = moving_pair(joint)[0]
    sign = 1.0 if on == prescribed.link.name else -1.0
    bodies = {x.link.name: x.body for x in model.prescribed}

    def along(block: Block) -> Rows:
        direction = block.motion.R[:, bodies.get(first, 0)] @ axis
        return np.asarray(sign * (wrench(block)[which] * direction).sum(axis=1, keepdims=True))

    return [Recorded(_drive_channel(scene, prescribed.drive_joint, on), along)]


def _drive_channel(scene: Scene, driven: str, on: str) -> Channel:
    """Force or torque of a joint's drive on its first link."""
    key, quantity, unit = drive_effort(scene, driven)
    return Channel(key, (quantity,), unit, "world", f"{quantity} of the drive on link {on}")


def gear_channel(model: Model, name: str) -> Recorded:
    """Torque or force of gears on the first joint's link."""
    row, _ = of_joint(model.rows, f"gears.{name}")
    share = row.plus[0][0]
    text = f"torque of gears {name} on the link whose rotation the first joint's angle is, about that joint's axis"
    return Recorded(
        Channel(f"gears/{name}/torque", ("torque",), "N m", "world", text),
        lambda block: share * effort(supports(block), f"gears.{name}")[:, None],
    )


def _row_drive(scene: Scene, driven: str) -> Recorded:
    """Torque or force of a drive enforced by constraint equations, along its coordinate."""
    on = ordered(scene.joints[driven], scene.driven_joints[driven].about)[0]
    return Recorded(_drive_channel(scene, driven, on), lambda block: effort(supports(block), driven)[:, None])
