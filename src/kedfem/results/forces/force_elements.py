"""Channels of motors, springs and limits, and of how far hinges have turned."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.force_element import DISTANCE, TURN, End, ForceElement, coordinate, placed
from kedfem.dynamics.force_elements import force_elements, hinges
from kedfem.dynamics.history import Block
from kedfem.dynamics.model import Model
from kedfem.dynamics.system.forces.exerted import at_ends
from kedfem.dynamics.system.forces.supports import supports
from kedfem.motion.constraints import cross
from kedfem.motion.joint_equations import moving_pair
from kedfem.results.recorded import Recorded, Rows
from kedfem.results.records import Channel
from kedfem.scene import Scene

POSITION, SPEED, EFFORT = "e", "rate", "multiplier"  # of `Multipliers`


@dataclass
class Measured:
    """Force elements, and hinges whose turns are counted on over successive blocks, once for each block."""

    every: Sequence[ForceElement]
    hinges: Sequence[ForceElement]
    block: Block | None = None
    angles: Float[np.ndarray, "T A"] = field(default_factory=lambda: np.zeros((0, 0)))

    def wrenches(self, links: Collection[str], block: Block) -> Iterator[tuple[End, Rows, Rows]]:
        """Ends on some links, with force and moment about the world's origin (T, 3) of each."""
        for element in self.every:
            ends = [end.link in links for end in element.ends]
            if any(ends):
                found = at_ends(supports(block), constraint_of(element))
                every = zip(element.ends, found, ends, strict=True)
                yield from ((end, *on) for end, on, here in every if here)

    def on(self, link: str, block: Block, about: Rows) -> tuple[Rows, Rows]:
        """Force and moment of all force elements on a link without unknowns of its own: a slider, a prescribed one.

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
        for end, f, m in self.wrenches(links, block):
            v, omega = motion.v[:, end.body], motion.omega[:, end.body]
            out += (f * (v - cross(omega, motion.p[:, end.body])) + m * omega).sum(axis=1)
        return out

    def turns(self, block: Block) -> Float[np.ndarray, "T A"]:
        """Rotations of all hinges; blocks in the order of time."""
        if block is not self.block:
            first = block.step == 0 or not len(self.angles)
            before = np.zeros(len(self.hinges)) if first else self.angles[-1]
            self.block, self.angles = block, np.zeros((len(block), len(self.hinges)))
            for i, hinge in enumerate(self.hinges):
                x, _ = placed(hinge, block.motion, block.links)
                self.angles[:, i] = coordinate(hinge, x, float(before[i]))
        return self.angles


def constraint_of(element: ForceElement) -> str:
    """What the system calls a force element."""
    return element.name.replace("/", ".", 1)


def measured_elements(scene: Scene, model: Model) -> Measured:
    """Motors, springs and limits of a scene and, without a drive, the turns of its hinges."""
    turns = () if scene.driven is not None else hinges(scene, model)
    return Measured(force_elements(scene, model), turns)


def acting(scene: Scene, measured: Measured) -> list[Recorded]:
    """How motors, springs, limits and, without a drive, hinges move, and what force they exert."""
    every = ((element, *each) for element in measured.every for each in _channels(element))
    elements = [Recorded(channel, partial(_column, x, which, sign)) for x, channel, which, sign in every]
    return elements + [
        Recorded(_turn(scene, hinge), partial(lambda i, block: measured.turns(block)[:, i, None], i))
        for i, hinge in enumerate(measured.hinges)
    ]


def _column(element: ForceElement, which: str, sign: float, block: Block) -> Rows:
    n = supports(block).number(constraint_of(element))
    return np.asarray(sign * getattr(block.multipliers, which)[:, n, None])


def _turn(scene: Scene, hinge: ForceElement) -> Channel:
    name = hinge.name.split("/")[1]
    one, other = moving_pair(scene.joints[name])
    text = f"rotation of joint {name}: link {one} against {other}, from the reference position"
    return Channel(f"{hinge.name}/angle", ("angle",), "rad", "", text)


def _channels(element: ForceElement) -> list[tuple[Channel, str, float]]:
    """Channels of one force element: which value it is, with which sign."""
    kind, name = element.name.split("/")
    what = f"{kind.removesuffix('s')} {name}"
    if element.kind == DISTANCE:
        length = Channel(f"{element.name}/length", ("length",), "m", "", f"length of {what}")
        force = Channel(f"{element.name}/force", ("force",), "N", "", f"pull of {what} and its damper")
        return [(length, POSITION, 1.0), (force, EFFORT, -1.0)]
    hinge = element.kind == TURN
    place, unit = ("angle", "rad") if hinge else ("travel", "m")
    effort, force_unit = ("torque", "N m") if hinge else ("force", "N")
    every = [(place, unit, f"{place} of the joint of {what}", POSITION)]
    if kind == "motors":
        every.append(("speed", f"{unit}/s", f"speed of the joint of {what}", SPEED))
    every.append((effort, force_unit, f"{effort} of {what}", EFFORT))
    return [(Channel(f"{element.name}/{x}", (x,), u, "", text), which, 1.0) for x, u, text, which in every]
