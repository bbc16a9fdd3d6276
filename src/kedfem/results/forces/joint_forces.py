"""Channels of what joints exert on links, from their port forces; block by block."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from kedfem.dynamics.history import Block
from kedfem.dynamics.joints.constraint_joints import ordered
from kedfem.dynamics.model import Model, PrescribedBody, Slider
from kedfem.links.record import in_space
from kedfem.results.forces.constraint_forces import known
from kedfem.results.forces.hub_forces import constrained_joints, hub_wrench, partner
from kedfem.results.forces.port_forces import Forces, determinate, holder, loose, negligible, port_wrench
from kedfem.results.recorded import Recorded, Rows
from kedfem.results.records import XYZ, Channel
from kedfem.scene import GROUND, Scene


def joint_channels(scene: Scene, model: Model, name: str, forces: Forces) -> list[Recorded]:
    """Force and moment (about the joint's point of the rigid-body motion) that a joint exerts on one of its links."""
    slider = next((s for s in model.sliders if name in (s.guide, s.joint)), None)
    if any(row.name == name for row in model.rows) and slider is None:
        return _row_joint(scene, model, name, forces)
    if slider is not None:
        return _slider_force(scene, model, slider, name, forces)
    hub = next((x for x in model.prescribed if x.hub == name), None)
    if hub is not None:
        return _hub(scene, model, hub, forces)
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
    return _channels(
        name, label, port_wrench(model, k, name, at, forces), determinate(model, k, name, at), sign
    )


def _row_joint(scene: Scene, model: Model, name: str, forces: Forces) -> list[Recorded]:
    """Of a joint enforced by constraint equations, about its point on the first link, of a slot the pin."""
    first, second = scene.joints[name].links
    on, other = (second, first) if first == GROUND else (first, second)
    sign = 1.0 if ordered(scene.joints[name])[0] == on else -1.0
    label = f"of joint {name} on link {on} from {other}"
    return _channels(name, label, partial(forces.rows.wrench, name), known(model, name), sign)


def _channels(
    joint: str,
    label: str,
    wrench: Callable[[Block], tuple[Rows, ...]],
    determined: Sequence[bool],
    sign: float = 1.0,
) -> list[Recorded]:
    """Force and moment of a joint, as far as statics determine them."""
    about = f"moment {label}, about the joint's point of the rigid-body motion"
    every = (
        Channel(f"joints/{joint}/force", XYZ, "N", "world", f"force {label}"),
        Channel(f"joints/{joint}/moment", XYZ, "N m", "world", about),
    )

    def rows(which: int) -> Callable[[Block], Rows]:
        return lambda block: sign * wrench(block)[which]

    return [Recorded(channel, rows(k)) for k, channel in enumerate(every) if determined[k]]


def _hub(scene: Scene, model: Model, prescribed: PrescribedBody, forces: Forces) -> list[Recorded]:
    """Force and moment that the driven joint exerts on a rigid link that moves with it."""
    wrench, others = hub_wrench(scene, model, prescribed, forces)
    determined = [all(negligible(loose(model, *x)[which]) for x in others) for which in (0, 1)]
    rows = [known(model, name) for name in constrained_joints(scene, model, prescribed)]
    determined = [determined[which] and all(x[which] and x[0] for x in rows) for which in (0, 1)]
    label = f"of joint {prescribed.hub} on link {prescribed.link.name} from {partner(scene, prescribed)}"
    return _channels(prescribed.hub, label, wrench, determined)


def _slider_force(scene: Scene, model: Model, slider: Slider, name: str, forces: Forces) -> list[Recorded]:
    """Guide: on the slider from the ground. Joint: on the carrier link from the slider, whose inertia rides on it."""
    pins = [name] if name != slider.guide else [
        j for j, joint in scene.joints.items() if slider.name in joint.links and j != name
    ]  # fmt: skip
    zero = np.zeros(3)
    pairs = [(k, j) for k, x in enumerate(model.joints) for j in pins if j in x.joints]
    if not all(determinate(model, k, j, zero)[0] for k, j in pairs):
        return []
    wrenches = [port_wrench(model, k, j, zero, forces) for k, j in pairs]
    if name == slider.guide:
        description = f"force of joint {name} on slider {slider.name} from ground"

        def guide(block: Block) -> Rows:
            return np.asarray(np.sum([wrench(block)[0] for wrench in wrenches], axis=0))

        return [Recorded(Channel(f"joints/{name}/force", XYZ, "N", "world", description), guide)]
    carrier = model.links[slider.carrier]
    description = f"force of joint {name} on link {carrier.name} from slider {slider.name}"
    gravity = np.asarray(scene.gravity)

    def pin(block: Block) -> Rows:
        motion, body = block.motion, model.bodies[slider.carrier]
        rigid = motion.p2[:, body] + motion.R2[:, body] @ (slider.weights @ carrier.X)
        elastic = np.tensordot(block.links[slider.carrier].a, slider.weights, (1, 0))
        a = rigid + in_space(carrier, elastic)
        force = wrenches[0](block)[0] - slider.mass * (a - gravity)
        for x in slider.loads:
            force += np.outer(x.factor(motion.t, motion.phi), in_space(carrier, carrier.one @ x.forces))
        return np.asarray(force + forces.force_elements.on(slider.name, block, np.zeros((len(block), 3)))[0])

    return [Recorded(Channel(f"joints/{name}/force", XYZ, "N", "world", description), pin)]
