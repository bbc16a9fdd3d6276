"""Channels of the forces of joints on links, from their port forces, block by block."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import cast

import numpy as np

from kedfem.dynamics.history import Block
from kedfem.dynamics.model import Model, PrescribedBody, Slider
from kedfem.links.record import in_space
from kedfem.motion.constraints import cross
from kedfem.motion.joint_equations import moving_pair, ordered
from kedfem.results.channels import XYZ, Channel
from kedfem.results.forces.drive_joint_forces import constrained_joints, drive_joint_wrench, partner
from kedfem.results.forces.port_forces import Forces, determinate, holder, loose, negligible, port_wrench
from kedfem.results.recorded import Recorded, Rows, once
from kedfem.scene import ForceLoad, Scene


def joint_channels(scene: Scene, model: Model, name: str, forces: Forces) -> list[Recorded]:
    """Force and moment (about the joint's point of the rigid-body motion) that a joint exerts on one of its links."""
    slider = next((s for s in model.sliders if name in (s.guide, s.joint)), None)
    if any(row.name == name for row in model.rows) and slider is None:
        return _constraint_joint(scene, name, forces)
    if slider is not None:
        return _slider(scene, model, slider, name, forces)
    prescribed = next((x for x in model.prescribed if x.drive_joint == name), None)
    if prescribed is not None:
        return _on_prescribed(scene, model, prescribed, forces)
    held = [link for link in scene.joints[name].links if link in {x.name for x in model.links}]
    if not held:
        return []
    k = holder(model, held[0], name)
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

    both = once(wrench)

    def rows(which: int) -> Callable[[Block], Rows]:
        return lambda block: sign * both(block)[which]

    return [Recorded(channel, rows(k)) for k, channel in enumerate(every) if determined[k]]


def _on_prescribed(scene: Scene, model: Model, prescribed: PrescribedBody, forces: Forces) -> list[Recorded]:
    """Force and moment that the driven joint exerts on a rigid link that moves with it."""
    wrench, others = drive_joint_wrench(scene, model, prescribed, forces)
    determined = [all(negligible(loose(model, *x)[which]) for x in others) for which in (0, 1)]
    rows = [forces.rows.determined(name) for name in constrained_joints(scene, model, prescribed)]
    determined = [determined[which] and all(x[which] and x[0] for x in rows) for which in (0, 1)]
    label = f"of joint {prescribed.drive_joint} on link {prescribed.link.name} from {partner(scene, prescribed)}"
    return _channels(prescribed.drive_joint, label, wrench, determined)


def _slider(scene: Scene, model: Model, slider: Slider, name: str, forces: Forces) -> list[Recorded]:
    """Guide: on the slider from the ground. Joint: on the carrier link from the slider, whose inertia rides on it.

    The slider does not rotate and its mass is at the joint, so that moments pass through it to the guide.
    """
    guided = name == slider.guide
    others = [j for j, x in scene.joints.items() if slider.name in x.links and j != name]
    joints = others if guided else [name]
    pairs = [(k, j) for k, x in enumerate(model.joints) for j in joints if j in x.joints]
    points = {j: np.asarray(scene.joints[j].at) for j in {*joints, name}}
    known = [determinate(model, k, j, points[j]) for k, j in pairs]
    borne = [(points[j] - points[name], port_wrench(model, k, j, points[j], forces)) for k, j in pairs]

    def wrench(block: Block) -> tuple[Rows, Rows]:
        force, moment = np.zeros((2, len(block), 3))
        for arm, of in borne:
            f, m = of(block)
            force, moment = force + f, moment + m + cross(arm, f)
        own_force, own_moment = _on_slider(scene, model, slider, forces, block)
        return (force, moment - own_moment) if guided else (force + own_force, moment)

    on = f"slider {slider.name} from ground"
    if not guided:
        on = f"link {model.links[slider.carrier].name} from slider {slider.name}"
    determined = [all(x[which] for x in known) for which in (0, 1)]
    return _channels(name, f"of joint {name} on {on}", wrench, determined)


def _on_slider(scene: Scene, model: Model, slider: Slider, forces: Forces, block: Block) -> tuple[Rows, Rows]:
    """Weight, inertia, loads and force elements of a slider, whose forces ride on its carrier; about its joint."""
    carrier, motion, body = model.links[slider.carrier], block.motion, model.bodies[slider.carrier]
    X = slider.weights @ carrier.X
    elastic = np.tensordot(block.links[slider.carrier].a, slider.weights, (1, 0))
    a = motion.acceleration(body, X) + in_space(carrier, elastic)
    force, moment = slider.mass * (np.asarray(scene.gravity) - a), np.zeros((len(block), 3))
    for x in slider.loads:
        f = np.outer(x.factor(motion.t, motion.phi), in_space(carrier, carrier.one @ x.forces))
        force, moment = force + f, moment + cross(np.asarray(cast(ForceLoad, scene.loads[x.load]).at) - X, f)
    f, m = forces.force_elements.on(slider.name, block, motion.position(body, X))
    return force + f, moment + m
