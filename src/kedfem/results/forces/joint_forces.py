"""Channels of what joints, drives and gears exert on elastic links, from their port forces; block by block."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Float, Int

from kedfem.dynamics.history import Block
from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.joints.constraint_joints import ordered
from kedfem.dynamics.joints.ports import turned_ports
from kedfem.dynamics.loads import applied
from kedfem.dynamics.model import Model, PrescribedBody, Slider
from kedfem.links.record import Link, in_space
from kedfem.motion.constraints import cross
from kedfem.motion.joint_equations import joint_axis
from kedfem.results.forces.constraint_forces import ConstraintForces, known, of_joint
from kedfem.results.forces.force_elements import Measured
from kedfem.results.recorded import Recorded, Rows, drive_prefix
from kedfem.results.records import Channel
from kedfem.scene import GROUND, Scene

XYZ = ("x", "y", "z")
INDETERMINATE = 1e-6  # [-, m] share of a loose port force of one that a joint would carry


@dataclass(frozen=True, slots=True)
class Forces:
    """What acts beside port forces: forces of constraint equations, and of motors and springs."""

    rows: ConstraintForces
    actions: Measured


def joint_channels(scene: Scene, model: Model, name: str, forces: Forces) -> list[Recorded]:
    """Force and moment (about the joint's nominal point) that a joint exerts on one of its links."""
    slider = next((s for s in model.sliders if name in (s.guide, s.joint)), None)
    if any(row.name == name for row in model.rows) and slider is None:
        return _row_joint(scene, model, name, forces)
    if slider is not None:
        return _slider_force(scene, model, slider, name, forces)
    hub = next((x for x in model.carried if x.hub == name), None)
    if hub is not None:
        return _hub(scene, model, hub, forces)
    held = [link for link in scene.joints[name].links if link in {x.name for x in model.links}]
    if not held:
        return []
    k = _holder(model, held[0], name)
    first, second = scene.joints[name].links
    opposite = first in {x.link.name for x in model.carried}  # it has no ports of its own
    on, other = (first, second) if held[0] == first or opposite else (second, first)
    sign = -1.0 if opposite else 1.0
    label = f"of joint {name} on link {on} from {other}"
    at = np.asarray(scene.joints[name].at)
    wrench = _wrench(model, k, name, at, forces)
    return [
        Recorded(channel, partial(_part_of, wrench, which, sign))
        for which, (channel, told) in enumerate(
            zip(_force_and_moment(name, label), _determinate(model, k, name, at), strict=True)
        )
        if told
    ]


def _row_joint(scene: Scene, model: Model, name: str, forces: Forces) -> list[Recorded]:
    """Of a joint enforced by constraint equations, about its point on the first link, of a slot the pin."""
    first, second = scene.joints[name].links
    on, other = (second, first) if first == GROUND else (first, second)
    sign = 1.0 if ordered(scene.joints[name])[0] == on else -1.0
    label = f"of joint {name} on link {on} from {other}"
    channels = zip(_force_and_moment(name, label), known(model, name), strict=True)
    return [
        Recorded(channel, partial(_row_part, forces, name, which, sign))
        for which, (channel, told) in enumerate(channels)
        if told
    ]


def _row_part(forces: Forces, name: str, which: int, sign: float, block: Block) -> Rows:
    """Force (0) or moment (1)."""
    return sign * forces.rows.wrench(name, block)[which]


Wrench = Callable[[Block], tuple[Rows, Rows]]


def _part_of(wrench: Wrench, which: int, sign: float, block: Block) -> Rows:
    """Force (0) or moment (1)."""
    return sign * wrench(block)[which]


def _force_and_moment(joint: str, label: str) -> tuple[Channel, Channel]:
    about = f"moment {label}, about the joint's nominal point"
    return (
        Channel(f"joints/{joint}/force", XYZ, "N", "world", f"force {label}"),
        Channel(f"joints/{joint}/moment", XYZ, "N m", "world", about),
    )


def _hub(scene: Scene, model: Model, carried: PrescribedBody, forces: Forces) -> list[Recorded]:
    """Force and moment that the driven joint exerts on a rigid link that moves with it."""
    wrench, others = _hub_wrench(scene, model, carried, forces)
    told = [all(_small(_loose(model, *x)[which]) for x in others) for which in (0, 1)]
    rows = [known(model, name) for name in _row_joints_of(scene, model, carried)]
    told = [told[which] and all(x[which] and x[0] for x in rows) for which in (0, 1)]
    label = f"of joint {carried.hub} on link {carried.link.name} from {_partner(scene, carried)}"
    channels = enumerate(_force_and_moment(carried.hub, label))
    return [Recorded(channel, partial(_part_of, wrench, k, 1.0)) for k, channel in channels if told[k]]


def _partner(scene: Scene, carried: PrescribedBody) -> str:
    """What a prescribed body's driven joint holds it on: the ground, or a moving part of it."""
    first, second = scene.joints[carried.hub].links
    return second if first == carried.link.name else first


Held = tuple[int, str, Float[np.ndarray, "3"]]  # link, joint and its point


def _row_joints_of(scene: Scene, model: Model, carried: PrescribedBody) -> list[str]:
    """Joints of a carried link enforced by constraint equations."""
    joints = scene.joints
    return [x.name for x in model.rows if x.name in joints and carried.link.name in joints[x.name].links]


def _hub_wrench(
    scene: Scene, model: Model, carried: PrescribedBody, forces: Forces
) -> tuple[Wrench, list[Held]]:
    """What holds a carried link in balance: P − M R0'', motors, springs, other joints, and the hub's; these joints."""
    link, hub = carried.link, np.asarray(scene.joints[carried.hub].at)
    held: list[Held] = []
    sliding = _row_joints_of(scene, model, carried)
    for name, joint in scene.joints.items():
        elastic = [x.name for x in model.links if x.name in joint.links]
        if link.name in joint.links and elastic and name not in sliding:
            held.append((_holder(model, elastic[0], name), name, np.asarray(joint.at)))
    others = [(_wrench(model, *each, forces), each[2]) for each in held]
    riders = [
        (x, *_hub_wrench(scene, model, x, forces)) for x in model.carried if _partner(scene, x) == link.name
    ]
    held += [each for _, _, below in riders for each in below]

    def wrench(block: Block) -> tuple[Rows, Rows]:
        F, R = _on_carried(carried, block), block.motion.R[:, carried.body]
        arms = (link.X - np.outer(link.one, hub)) @ R.transpose(0, 2, 1)
        centre = block.motion.p[:, carried.body] + R @ hub
        force, moment = forces.actions.on(link.name, block, centre)
        force = -force - in_space(link, np.tensordot(F, link.one, (1, 0)))
        moment = -moment - _resultant(link, arms, F)[1]
        for other, at in others:
            f, m = other(block)
            force = force + f
            moment = moment + m + cross((R @ (at - hub)), f)
        for rider, on_rider, _ in riders:
            f, m = on_rider(block)
            place = block.motion.p[:, rider.body] + block.motion.R[:, rider.body] @ scene.joints[rider.hub].at
            force, moment = force + f, moment + m + cross(place - centre, f)
        for name in sliding:
            f, m, point = forces.rows.wrench(name, block)
            sign = -1.0 if ordered(scene.joints[name])[0] == link.name else 1.0  # on the other link
            force, moment = force + sign * f, moment + sign * (m + cross(point - centre, f))
        f, m = _geared(scene, model, carried, forces, block, centre)
        return force - f, moment - m

    return wrench, held


def _geared(
    scene: Scene, model: Model, carried: PrescribedBody, forces: Forces, block: Block, about: Rows
) -> tuple[Rows, Rows]:
    """Force and moment about points that gears exert on a carried link: along the coordinates of their joints."""
    force, moment = np.zeros((2, len(block), 3))
    rows = {row.name: row for row in model.rows}
    for gears in scene.gears:
        row = rows[f"gears.{gears}"]
        effort = forces.rows.between_gears(gears, block)[:, None]
        for share, joint in ((1.0, row), *row.plus):
            i, j = joint.bodies
            sign = share * ((carried.body == i) - (carried.body == j))
            along = sign * effort * (block.motion.R[:, j] @ joint.axis)
            if joint.gap.any():  # a rack's push goes through the point of link i
                place = block.motion.p[:, i] + block.motion.R[:, i] @ joint.at
                force, moment = force + along, moment + cross(place - about, along)
            else:
                moment = moment + along
    return force, moment


def _on_carried(carried: PrescribedBody, block: Block) -> Float[np.ndarray, "T n d"]:
    """P − M R0'' of a carried link."""
    return applied(carried.link, carried.loads, block.motion, carried.body)


def _wrench(model: Model, k: int, joint: str, at: Float[np.ndarray, "3"], forces: Forces) -> Wrench:
    """Force and moment about `at` of one joint on link k, world components, from the port forces that tell it."""
    attachment, link = model.joints[k], model.links[k]
    rows = rows_of_joint(attachment, joint)
    arms, placed = _arms(attachment, joint, at), _arms_over_time(model, k, joint, at)
    shares = [(j, attachment.shares[j][rows]) for j in _sharing(attachment, rows)]
    from_rows = attachment.from_rows[rows]

    def wrench(block: Block) -> tuple[Rows, Rows]:
        f = np.zeros((len(block), len(rows)))
        for j, share in shares:
            history = block.links[j]
            f += turned_ports(model.joints[j], history.R, history.port_forces) @ share.T
        if from_rows.any():
            f += forces.rows.on_ports(block) @ from_rows.T
        return _resultant(link, placed(block), f.reshape(len(f), len(arms), link.d))

    return wrench


def _sharing(attachment: Attachment, rows: Int[np.ndarray, " m"]) -> Int[np.ndarray, " l"]:
    """Links whose port forces tell some of a link's."""
    if not attachment.shares:
        return np.zeros(0, int)
    ends = np.cumsum([share.shape[1] for share in attachment.shares])
    told = np.concatenate(attachment.shares, axis=1)[rows].any(axis=0)
    return np.unique(np.searchsorted(ends, np.flatnonzero(told), side="right"))


def _arms_over_time(
    model: Model, k: int, joint: str, at: Float[np.ndarray, "3"]
) -> Callable[[Block], Float[np.ndarray, "T p 3"]]:
    """From a joint's point on link k to its ports, world components.

    Of rigid-body frames as these turn. Co-rotational frames know where the ports are: displaced from the rigid-body
    motion, the joint's point as it lies among them. So force and moment do the work that the ports' displacements say.
    """
    attachment, link, body = model.joints[k], model.links[k], model.bodies[k]
    here = np.array([name == joint for name in attachment.joints], bool)
    drawn, weights = attachment.points[here], attachment.weights[here]
    among = np.linalg.lstsq(
        np.vstack([np.ones(len(drawn)), (drawn - at).T]), np.array([1.0, 0, 0, 0]), rcond=1e-9
    )[0]
    beside = at - among @ drawn

    def nominal(block: Block) -> Float[np.ndarray, "T p 3"]:
        return np.asarray((drawn - at) @ _turned(block, k, link).transpose(0, 2, 1))

    def displaced(block: Block) -> Float[np.ndarray, "T p 3"]:
        u = np.asarray(weights @ block.links[k].u[:, attachment.nodes])
        x = drawn @ block.motion.R[:, body].transpose(0, 2, 1) + in_space(link, u)
        centre = among @ x + _turned(block, k, link) @ beside
        return np.asarray(x - centre[:, None])

    return nominal if link.fit is None else displaced


def _turned(block: Block, k: int, link: Link) -> Float[np.ndarray, "T 3 3"]:
    """Orientation of a link's frame, in space."""
    R = np.tile(np.eye(3), (len(block), 1, 1))
    R[:, : link.d, : link.d] = block.links[k].R
    return R


def _determinate(model: Model, k: int, joint: str, at: Float[np.ndarray, "3"]) -> tuple[bool, bool]:
    """Whether statics tell the force and the moment that a joint exerts on link k, where ports depend on each other."""
    force, moment = _loose(model, k, joint, at)
    return _small(force), _small(force) and _small(moment)


def _loose(model: Model, k: int, joint: str, at: Float[np.ndarray, "3"]) -> tuple[Rows, Rows]:
    """Forces and moments of a joint that statics leave open, as drawn."""
    attachment = model.joints[k]
    arms, link = _arms(attachment, joint, at), model.links[k]
    loose = attachment.loose[rows_of_joint(attachment, joint)].T
    return _resultant(link, arms[None], loose.reshape(len(loose), len(arms), link.d))


def _small(loose: Float[np.ndarray, "..."]) -> bool:
    return bool(np.abs(loose).max(initial=0.0) < INDETERMINATE)


def rows_of_joint(attachment: Attachment, joint: str) -> Int[np.ndarray, " m"]:
    """All components of all ports of a joint."""
    here = np.flatnonzero([name == joint for name in attachment.joints])
    return (attachment.components * here[:, None] + np.arange(attachment.components)).ravel()


def _arms(attachment: Attachment, joint: str, at: Float[np.ndarray, "3"]) -> Float[np.ndarray, "p 3"]:
    """From a point to the ports of a joint, as drawn."""
    return np.asarray(attachment.points[[name == joint for name in attachment.joints]] - at)


def _resultant(
    link: Link, arms: Float[np.ndarray, "_ p 3"], f: Float[np.ndarray, "T p d"]
) -> tuple[Rows, Rows]:
    """Force and moment of port forces, all in one frame."""
    if link.kind == "beam":  # third component is a moment
        return in_space(link, f).sum(axis=1), f.sum(axis=1) * [0, 0, 1]
    force = in_space(link, f)
    return force.sum(axis=1), cross(arms, force).sum(axis=1)


def _slider_force(scene: Scene, model: Model, slider: Slider, name: str, forces: Forces) -> list[Recorded]:
    """Guide: on the slider from the ground. Joint: on the carrier link from the slider, whose inertia rides on it."""
    pins = [name] if name != slider.guide else [
        j for j, joint in scene.joints.items() if slider.name in joint.links and j != name
    ]  # fmt: skip
    zero = np.zeros(3)
    pairs = [(k, j) for k, x in enumerate(model.joints) for j in pins if j in x.joints]
    if not all(_determinate(model, k, j, zero)[0] for k, j in pairs):
        return []
    wrenches = [_wrench(model, k, j, zero, forces) for k, j in pairs]
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
        nominal = motion.p2[:, body] + motion.R2[:, body] @ (slider.weights @ carrier.X)
        elastic = np.tensordot(block.links[slider.carrier].a, slider.weights, (1, 0))
        a = nominal + in_space(carrier, elastic)
        force = wrenches[0](block)[0] - slider.mass * (a - gravity)
        for x in slider.loads:
            force += np.outer(x.factor(motion.t, motion.phi), in_space(carrier, carrier.one @ x.forces))
        return np.asarray(force + forces.actions.on(slider.name, block, np.zeros((len(block), 3)))[0])

    return [Recorded(Channel(f"joints/{name}/force", XYZ, "N", "world", description), pin)]


def drive_channels(scene: Scene, model: Model, driven: str, forces: Forces) -> list[Recorded]:
    """Torque of the drive on its link, about the driven joint's axis."""
    if any(row.name == driven for row in model.rows):
        return [_row_drive(scene, model, driven, forces)]
    joint = scene.joints[driven]
    carried = next((x for x in model.carried if x.hub == driven), None)
    if carried is not None:
        return _hub_drive(scene, model, carried, forces)
    name = next(link for link in joint.links if link != "ground")
    axis, at = joint_axis(joint), np.asarray(joint.at)
    wrench = _wrench(model, _holder(model, name, driven), driven, at, forces)
    channel = _drive_channel(scene, driven, name)
    return [Recorded(channel, lambda block: wrench(block)[1] @ axis[:, None])]


def _hub_drive(scene: Scene, model: Model, carried: PrescribedBody, forces: Forces) -> list[Recorded]:
    """Torque, of a slide force, of the drive that moves a prescribed body, on the joint's first link, along its axis."""
    joint, partner = scene.joints[carried.hub], _partner(scene, carried)
    axis, which = joint_axis(joint), 0 if joint.kind == "prismatic" else 1
    wrench, others = _hub_wrench(scene, model, carried, forces)
    if not all(_small(_loose(model, *each)[which] @ axis) for each in others):
        return []
    on = next(link for link in joint.links if link != GROUND)
    sign = 1.0 if on == carried.link.name else -1.0
    bodies = {x.link.name: x.body for x in model.carried}

    def along(block: Block) -> Rows:
        direction = block.motion.R[:, bodies.get(partner, 0)] @ axis
        return np.asarray(sign * (wrench(block)[which] * direction).sum(axis=1, keepdims=True))

    return [Recorded(_drive_channel(scene, carried.hub, on), along)]


def _drive_channel(scene: Scene, driven: str, on: str) -> Channel:
    """What the drive of a joint exerts on its first link."""
    slide = scene.joints[driven].kind == "prismatic"
    quantity, unit = ("force", "N") if slide else ("torque", "N m")
    text = f"{quantity} of the drive on link {on}"
    return Channel(f"{drive_prefix(scene, driven)}{quantity}", (quantity,), unit, "world", text)


def gear_channel(model: Model, name: str, forces: Forces) -> Recorded:
    """What gears exert on the first joint's link."""
    row, _ = of_joint(model.rows, f"gears.{name}")
    share = row.plus[0][0]
    text = f"torque of gears {name} on the link that the first joint's turn is of, about its axis"
    return Recorded(
        Channel(f"gears/{name}/torque", ("torque",), "N m", "world", text),
        lambda block: share * forces.rows.between_gears(name, block)[:, None],
    )


def _row_drive(scene: Scene, model: Model, driven: str, forces: Forces) -> Recorded:
    """Torque, of a slide force, of a drive enforced by constraint equations, along its axis in the second link."""
    joint, (row, _) = scene.joints[driven], of_joint(model.rows, driven)
    on = next(link for link in joint.links if link != GROUND)
    sign, slide = 1.0 if ordered(joint)[0] == on else -1.0, joint.kind == "prismatic"
    number = [each.name for each in model.rows].index(driven)
    channel = _drive_channel(scene, driven, on)

    def along(block: Block) -> Rows:
        if block.exerted is not None:
            return np.asarray(sign * block.exerted.effort[:, [number]])
        axis = block.motion.R[:, row.bodies[1]] @ row.axis
        effort = forces.rows.wrench(driven, block)[0 if slide else 1]
        return np.asarray(sign * (effort * axis).sum(axis=1, keepdims=True))

    return Recorded(channel, along)


def _holder(model: Model, name: str, joint: str) -> int:
    """The link of a name, or its segment, that a joint holds."""
    return next(
        k for k, link in enumerate(model.links) if link.name == name and joint in model.joints[k].joints
    )
