"""Channels of motors, springs and limits, and of how far hinges have turned."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.force_element import (
    DISTANCE,
    TURN,
    End,
    ForceElement,
    Table,
    evaluated,
    kernel_table,
    wrench,
)
from kedfem.dynamics.force_elements import force_elements, hinges
from kedfem.dynamics.history import Block
from kedfem.dynamics.model import Model
from kedfem.motion.constraints import cross
from kedfem.results.recorded import Recorded, Rows
from kedfem.results.records import Channel
from kedfem.scene import Scene

POSITION, SPEED, EFFORT = 0, 1, 2


@dataclass
class Measured:
    """Values of force elements over successive blocks, turns counted on; worked out once for each block."""

    every: Sequence[ForceElement]
    table: Table
    turned: Float[np.ndarray, " A"] = field(default_factory=lambda: np.zeros(0))
    block: Block | None = None
    values: Float[np.ndarray, "T A 4"] = field(default_factory=lambda: np.zeros((0, 0, 4)))
    places: Float[np.ndarray, "T A 2 2 3"] = field(default_factory=lambda: np.zeros((0, 0, 2, 2, 3)))
    forces: Float[np.ndarray, "T A 2 2 3"] = field(default_factory=lambda: np.zeros((0, 0, 2, 2, 3)))

    def wrenches(self, block: Block) -> Iterator[tuple[End, Rows, Rows]]:
        """Force and moment about the world's origin (T, 3) of every end of all force elements."""
        if self.every:
            self.of(block)
        known = 0 if block.exerted is None else block.exerted.ends.shape[1]
        for i, element in enumerate(self.every):
            for e, end in enumerate(element.ends):
                if block.exerted is not None and i < known:
                    yield end, block.exerted.ends[:, i, e, 0], block.exerted.ends[:, i, e, 1]
                    continue
                yield end, *wrench(end, self.places[:, i, e], self.forces[:, i, e])

    def on(self, link: str, block: Block, about: Rows) -> tuple[Rows, Rows]:
        """Force and moment of all force elements on a link without unknowns of its own: a slider, a prescribed one.

        Parameters
        ----------
        about : (T, 3) the point that the moment is about
        """
        force, moment = np.zeros((2, len(block), 3))
        for end, f, m in self.wrenches(block):
            if end.link == link:
                force, moment = force + f, moment + m - cross(about, f)
        return force, moment

    def power(self, links: Collection[str], block: Block) -> Float[np.ndarray, " T"]:
        """Power of all force elements on links that move as given [W]."""
        out, motion = np.zeros(len(block)), block.motion
        for end, f, m in self.wrenches(block):
            if end.link in links:
                v, omega = motion.v[:, end.body], motion.omega[:, end.body]
                out += (f * (v - cross(omega, motion.p[:, end.body])) + m * omega).sum(axis=1)
        return out

    def of(self, block: Block) -> Float[np.ndarray, "T A 4"]:
        """Coordinate, rate, force and stored energy of all force elements; blocks in the order of time."""
        if block is not self.block:
            before = np.zeros(len(self.every)) if block.step == 0 or not self.turned.size else self.turned
            self.turned, self.block = before.copy(), block
            found = evaluated(self.every, self.table, self.turned, block.motion, block.links)
            self.places, self.forces, self.values = found.x, found.forces, found.values
            if block.exerted is not None:
                self._taken(block.exerted.element, found.factors)
        return self.values

    def _taken(self, element: Float[np.ndarray, "T 3 k"], factors: Float[np.ndarray, "T A"]) -> None:
        """Coordinates, rates and forces of force elements as the solver has them."""
        known = element.shape[2]
        stiffness = factors[:, :known] * np.array([x.stiffness for x in self.every[:known]])
        lower, upper = np.array([x.limits or (x.free, x.free) for x in self.every[:known]]).reshape(-1, 2).T
        q = element[:, 0]
        self.values[:, :known, :3] = element.transpose(0, 2, 1)
        self.values[:, :known, 3] = 0.5 * stiffness * (q - np.clip(q, lower, upper)) ** 2


def measured_elements(scene: Scene, model: Model) -> Measured:
    """Motors, springs and limits of a scene and, without a drive, the turns of its hinges."""
    turns = () if scene.driven is not None else hinges(scene, model)
    every = (*force_elements(scene, model), *turns)
    return Measured(every, kernel_table(every))


def acting(scene: Scene, measured: Measured) -> list[Recorded]:
    """How motors, springs, limits and, without a drive, hinges move, and what force they exert."""
    return [
        Recorded(channel, partial(_column, measured, i, which, sign))
        for i, element in enumerate(measured.every)
        for channel, which, sign in _channels(scene, element)
    ]


def _column(measured: Measured, i: int, which: int, sign: float, block: Block) -> Rows:
    return np.asarray(sign * measured.of(block)[:, i, which, None])


def _channels(scene: Scene, element: ForceElement) -> list[tuple[Channel, int, float]]:
    """Channels of one force element: which value it is, with which sign."""
    kind, name = element.name.split("/")
    if kind == "joints":
        one, other = scene.joints[name].links
        one, other = (other, one) if one == "ground" else (one, other)
        text = f"rotation of joint {name}: link {one} against {other}, from the reference position"
        return [(Channel(f"{element.name}/angle", ("angle",), "rad", "", text), POSITION, 1.0)]
    what = f"{kind.removesuffix('s')} {name}"
    if element.kind == DISTANCE:
        length = Channel(f"{element.name}/length", ("length",), "m", "", f"length of {what}")
        force = Channel(f"{element.name}/force", ("force",), "N", "", f"pull of {what} and its damper")
        return [(length, POSITION, 1.0), (force, EFFORT, -1.0)]
    hinge = element.kind == TURN
    place, unit = ("angle", "rad") if hinge else ("travel", "m")
    effort, force_unit = ("torque", "N m") if hinge else ("force", "N")
    out = [
        (
            Channel(f"{element.name}/{place}", (place,), unit, "", f"{place} of the joint of {what}"),
            POSITION,
            1.0,
        ),
        (Channel(f"{element.name}/{effort}", (effort,), force_unit, "", f"{effort} of {what}"), EFFORT, 1.0),
    ]
    if kind == "motors":
        speed = Channel(f"{element.name}/speed", ("speed",), f"{unit}/s", "", f"speed of the joint of {what}")
        out.insert(1, (speed, SPEED, 1.0))
    return out
