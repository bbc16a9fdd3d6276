"""Channels of the forces of joints on links, from their port forces, block by block."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from kedfem.dynamics.history import Block
from kedfem.dynamics.model import Model, PrescribedBody
from kedfem.motion.joint_equations import moving_pair, ordered
from kedfem.results.channels import XYZ, Channel
from kedfem.results.forces.drive_joint_forces import constrained_joints, drive_joint_wrench, partner
from kedfem.results.forces.port_forces import (
    Forces,
    determinate,
    indeterminate_part,
    link_of_joint,
    negligible,
    port_wrench,
)
from kedfem.results.recorded import Recorded, Rows, once_per_block
from kedfem.scene import Scene


def joint_channels(scene: Scene, model: Model, name: str, forces: Forces) -> list[Recorded]:
    """Force and moment (about the joint's point of the rigid-body motion) that a joint exerts on one of its links."""
    if any(row.name == name for row in model.rows):
        return _constraint_joint(scene, name, forces)
    prescribed = next((x for x in model.prescribed if x.drive_joint == name), None)
    if prescribed is not None:
        return _on_prescribed(scene, model, prescribed, forces)
    held = [link for link in scene.joints[name].links if link in {x.name for x in model.links}]
    if not held:
        return []
    k = link_of_joint(model, held[0], name)
    first, second = scene.joints[name].links
    opposite = first in {x.link.name for x in model.prescribed}  # it has no ports of its own
    on, other = (first, second) if held[0] == first or opposite else (second, first)
    sign = -1.0 if opposite else 1.0
    label = f"of joint {name} on link {on} from {other}"
    at = np.asarray(scene.joints[name].at)
    wrench = port_wrench(model, k, name, at, forces)
    return _channels(name, label, wrench, determinate(model, k, name, at), sign)


def _constraint_joint(scene: Scene, name: str, forces: Forces) -> list[Recorded]:
    """Wrench of a joint enforced by constraint equations, about its point on the first link, of a slot the pin."""
    on, other = moving_pair(scene.joints[name])
    sign = 1.0 if ordered(scene.joints[name])[0] == on else -1.0
    label = f"of joint {name} on link {on} from {other}"
    return _channels(name, label, partial(forces.rows.wrench, name), forces.rows.determined(name), sign)


def _channels(
    joint: str, label: str, wrench: Callable[[Block], tuple[Rows, ...]], determined: Sequence[bool], sign: float = 1.0
) -> list[Recorded]:
    """Force and moment of a joint, as far as statics determine them."""
    about = f"moment {label}, about the joint's point of the rigid-body motion"
    every = (
        Channel(f"joints/{joint}/force", XYZ, "N", "world", f"force {label}"),
        Channel(f"joints/{joint}/moment", XYZ, "N m", "world", about),
    )

    both = once_per_block(wrench)

    def rows(which: int) -> Callable[[Block], Rows]:
        return lambda block: sign * both(block)[which]

    return [Recorded(channel, rows(k)) for k, channel in enumerate(every) if determined[k]]


def _on_prescribed(scene: Scene, model: Model, prescribed: PrescribedBody, forces: Forces) -> list[Recorded]:
    """Force and moment that the driven joint exerts on a rigid link that moves with it."""
    wrench, others = drive_joint_wrench(scene, model, prescribed, forces)
    determined = [all(negligible(indeterminate_part(model, *x)[which]) for x in others) for which in (0, 1)]
    rows = [forces.rows.determined(name) for name in constrained_joints(scene, model, prescribed)]
    determined = [determined[which] and all(x[which] and x[0] for x in rows) for which in (0, 1)]
    label = f"of joint {prescribed.drive_joint} on link {prescribed.link.name} from {partner(scene, prescribed)}"
    return _channels(prescribed.drive_joint, label, wrench, determined)
