"""Channels of motors, springs and limits, and of rotations of hinges."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.force_elements import Element, force_elements, on_hinge, places
from kedfem.dynamics.history import Block
from kedfem.dynamics.joints.constraint_joints import coordinate
from kedfem.dynamics.joints.constraint_ports import constraint_joint
from kedfem.dynamics.model import Model
from kedfem.dynamics.rigid_elements import OnLink, links_of, on_links
from kedfem.dynamics.system.forces.exerted import at_ends
from kedfem.dynamics.system.forces.poses import value
from kedfem.dynamics.system.forces.supports import supports
from kedfem.dynamics.system.record import Term
from kedfem.motion.coordinates import unwrapped
from kedfem.motion.joint_equations import body_names, moving_pair
from kedfem.results.channels import Channel
from kedfem.results.recorded import Recorded, Rows
from kedfem.scene import LineSpring, Scene
from kedfem.vectors import cross

POSITION, SPEED, EFFORT = "e", "rate", "multiplier"  # of `Multipliers`


@dataclass
class ElementForces:
    """Force elements, and hinges whose angles are counted on over successive blocks, once for each block.

    ends : names and numbers in the linkage of the links that each force element acts on
    hinges : joints by name, the angle of each and the ends between which it is
    """

    every: Mapping[str, Element]
    ends: Mapping[str, Sequence[tuple[str, int]]]
    hinges: Mapping[str, tuple[Term, tuple[OnLink, OnLink]]]
    block: Block | None = None
    angles: Float[np.ndarray, "T A"] = field(default_factory=lambda: np.zeros((0, 0)))

    def wrenches(self, links: Collection[str], block: Block) -> Iterator[tuple[int, Rows, Rows]]:
        """Bodies of ends on some links, with force and moment about the world's origin (T, 3) on each."""
        for name, ends in self.ends.items():
            if any(link in links for link, _ in ends):
                every = zip(ends, at_ends(supports(block), name), strict=True)
                yield from ((body, *found) for (link, body), found in every if link in links)

    def on(self, link: str, block: Block, about: Rows) -> tuple[Rows, Rows]:
        """Force and moment of all force elements on a link without unknowns of its own: a prescribed one.

        Parameters
        ----------
        about : (T, 3) the point that the moment is about
        """
        force, moment = np.zeros((2, len(block), 3))
        for _, f, m in self.wrenches({link}, block):
            force, moment = force + f, moment + m - cross(about, f)
        return force, moment

    def power(self, links: Collection[str], block: Block) -> Float[np.ndarray, " T"]:
        """Power of all force elements on links that move as given [W]."""
        out, motion = np.zeros(len(block)), block.motion
        for body, f, m in self.wrenches(links, block):
            v, omega = motion.v[:, body], motion.omega[:, body]
            out += (f * (v - cross(omega, motion.p[:, body])) + m * omega).sum(axis=1)
        return out

    def rotations(self, block: Block) -> Float[np.ndarray, "T A"]:
        """Rotations of all hinges; blocks in the order of time."""
        if block is not self.block:
            first = block.step == 0 or not len(self.angles)
            before, angles = np.zeros(len(self.hinges)) if first else self.angles[-1], np.zeros((len(block), 0))
            for term, (one, other) in self.hinges.values():
                z = np.concatenate([one.unknowns(block), other.unknowns(block)], axis=1)
                angle = value(term, (one.end, other.end), block.motion, z)
                angles = np.column_stack([angles, angle])
            self.block, self.angles = block, unwrapped(angles, before)
        return self.angles


def element_forces(scene: Scene, model: Model) -> ElementForces:
    """Motors, springs and limits of a scene and, without a drive, the angles of its hinges."""
    every, names = dict(force_elements(scene)), body_names(scene)
    ends = {key: [(link, names.index(link)) for link, _ in places(scene, x)] for key, x in every.items()}
    links, hinges = links_of(model, names), {}
    for name, joint in scene.joints.items():
        if joint.kind == "revolute" and scene.driven is None:
            at = np.asarray(joint.at)
            hinges[name] = (
                coordinate(joint, turns=True),
                on_links(model, constraint_joint(scene, name, *links, ()), (at, at)),
            )
    return ElementForces(every, ends, hinges)


def element_channels(scene: Scene, measured: ElementForces) -> list[Recorded]:
    """Coordinates and forces of motors, springs, limits and, without a drive, of hinges."""
    every = ((name, *each) for name, element in measured.every.items() for each in _channels(name, element))
    elements = [Recorded(channel, partial(_column, name, which, sign)) for name, channel, which, sign in every]
    return elements + [
        Recorded(_angle_channel(scene, name), partial(lambda i, block: measured.rotations(block)[:, i, None], i))
        for i, name in enumerate(measured.hinges)
    ]


def _column(name: str, which: str, sign: float, block: Block) -> Rows:
    return np.asarray(sign * getattr(block.multipliers, which)[:, supports(block).number(name), None])


def _angle_channel(scene: Scene, name: str) -> Channel:
    one, other = moving_pair(scene.joints[name])
    text = f"rotation of joint {name}: link {one} against {other}, from the reference position"
    return Channel(f"joints/{name}/angle", ("angle",), "rad", "", text)


def _channels(key: str, element: Element) -> list[tuple[Channel, str, float]]:
    """Channels of one force element: which value it is, with which sign."""
    kind, _, name = key.partition(".")
    what, path = f"{kind.removesuffix('s')} {name}", f"{kind}/{name}"
    if isinstance(element, LineSpring) and element.between is not None:
        length = Channel(f"{path}/length", ("length",), "m", "", f"length of {what}")
        force = Channel(f"{path}/force", ("force",), "N", "", f"pull of {what} and its damper")
        return [(length, POSITION, 1.0), (force, EFFORT, -1.0)]
    hinge = on_hinge(element)
    place, unit = ("angle", "rad") if hinge else ("travel", "m")
    effort, force_unit = ("torque", "N m") if hinge else ("force", "N")
    every = [(place, unit, f"{place} of the joint of {what}", POSITION)]
    if kind == "motors":
        every.append(("speed", f"{unit}/s", f"speed of the joint of {what}", SPEED))
    every.append((effort, force_unit, f"{effort} of {what}", EFFORT))
    return [(Channel(f"{path}/{x}", (x,), u, "", text), which, 1.0) for x, u, text, which in every]
