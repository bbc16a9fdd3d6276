"""Channels of motors and springs, and of how far hinges have turned."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from jaxtyping import Float

from kedfem.dynamics.action import DISTANCE, TURN, Action, Table, kernel_table, vectors
from kedfem.dynamics.actions import actions, hinges
from kedfem.dynamics.history import Block
from kedfem.dynamics.model import Model
from kedfem.results.recorded import Recorded, Rows
from kedfem.results.records import Channel
from kedfem.scene import Scene

POSITION, SPEED, EFFORT = 0, 1, 2


@dataclass
class Measured:
    """Values of actions over successive blocks, turns counted on from block to block; worked out once for each block."""

    every: Sequence[Action]
    table: Table
    turned: Float[np.ndarray, " A"] = field(default_factory=lambda: np.zeros(0))
    block: Block | None = None
    values: Float[np.ndarray, "T A 4"] = field(default_factory=lambda: np.zeros((0, 0, 4)))

    def of(self, block: Block) -> Float[np.ndarray, "T A 4"]:
        """Coordinate, rate, force and stored energy of all actions; blocks in the order of time."""
        if block is not self.block:
            from kedfem.dynamics.actions_kernel import evaluate_all

            before = np.zeros(len(self.every)) if block.step == 0 else self.turned
            self.turned, self.values = before.copy(), np.zeros((len(block), len(self.every), 4))
            x, v = vectors(self.every, block)
            evaluate_all(block.motion.t, x, v, self.turned, self.table, np.zeros_like(x), self.values)
            self.block = block
        return self.values


def acting(scene: Scene, model: Model) -> list[Recorded]:
    """How motors, springs and, without a drive, hinges move, and what force they exert.

    Raises
    ------
    MeshError, SceneError
        If a motor or spring does not fit its link.
    """
    turns = () if scene.driven is not None else hinges(scene, model)
    every = (*actions(scene, model), *turns)
    if not every:
        return []
    measured = Measured(every, kernel_table(every))
    return [
        Recorded(channel, partial(_column, measured, i, which, sign))
        for i, action in enumerate(every)
        for channel, which, sign in _channels(scene, action)
    ]


def _column(measured: Measured, i: int, which: int, sign: float, block: Block) -> Rows:
    return np.asarray(sign * measured.of(block)[:, i, which, None])


def _channels(scene: Scene, action: Action) -> list[tuple[Channel, int, float]]:
    """Channels of one action: which value it is, with which sign."""
    kind, name = action.name.split("/")
    if kind == "joints":
        one, other = scene.joints[name].links
        one, other = (other, one) if one == "ground" else (one, other)
        text = f"turn of joint {name}: link {one} against {other}, from the drawn position"
        return [(Channel(f"{action.name}/angle", ("angle",), "rad", "", text), POSITION, 1.0)]
    what = f"{kind.removesuffix('s')} {name}"
    if action.kind == DISTANCE:
        length = Channel(f"{action.name}/length", ("length",), "m", "", f"length of {what}")
        force = Channel(f"{action.name}/force", ("force",), "N", "", f"pull of {what} and its damper")
        return [(length, POSITION, 1.0), (force, EFFORT, -1.0)]
    hinge = action.kind == TURN
    place, unit = ("angle", "rad") if hinge else ("travel", "m")
    effort, force_unit = ("torque", "N m") if hinge else ("force", "N")
    out = [
        (
            Channel(f"{action.name}/{place}", (place,), unit, "", f"{place} of the joint of {what}"),
            POSITION,
            1.0,
        ),
        (Channel(f"{action.name}/{effort}", (effort,), force_unit, "", f"{effort} of {what}"), EFFORT, 1.0),
    ]
    if kind == "motors":
        speed = Channel(f"{action.name}/speed", ("speed",), f"{unit}/s", "", f"speed of the joint of {what}")
        out.insert(1, (speed, SPEED, 1.0))
    return out
