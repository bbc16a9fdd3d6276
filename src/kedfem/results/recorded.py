"""Channels with the functions that compute their rows, and names of the drive's channels."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.history import Block
from kedfem.motion.joint_equations import ordered
from kedfem.results.channels import ANGLE, TRAVEL, Channel
from kedfem.scene import Scene, driven_travel

Rows = Float[np.ndarray, "T c"]
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Recorded:
    """A channel, and its rows over a block of time points."""

    channel: Channel
    rows: Callable[[Block], Rows]


def once_per_block(of: Callable[[Block], T]) -> Callable[[Block], T]:
    """A function of a block that is evaluated once for each block, though several channels show parts of its result."""
    last: tuple[Block, T] | None = None

    def made(block: Block) -> T:
        nonlocal last
        if last is None or last[0] is not block:
            last = block, of(block)
        return last[1]

    return made


def drive_prefix(scene: Scene, driven: str) -> str:
    """Prefix of the channels of one of `Scene.all_drives`: `drive/`, or `drive/NAME/` with several."""
    return f"drive/{driven}/" if len(scene.all_drives) > 1 else "drive/"


def drive_effort(scene: Scene, driven: str, rigid: str = "") -> tuple[str, str, str]:
    """Channel name of the effort of a drive, or with `rigid_` of that with rigid links; quantity and unit."""
    quantity, unit = ("force", "N") if driven_travel(scene, driven) else ("torque", "N m")
    return f"{drive_prefix(scene, driven)}{rigid}{quantity}", quantity, unit


def effort_channel(scene: Scene, driven: str, rigid: str = "") -> Channel:
    """The channel that `drive_effort` names; of several drives on one joint its text says which."""
    (key, quantity, unit), drive = drive_effort(scene, driven, rigid), scene.all_drives[driven]
    on, own = ordered(scene.joints[drive.joint], drive.about)[0], driven.removeprefix(drive.joint).replace(".", " ")
    text = f"{quantity} of the drive{own} on link {on}{' with all links rigid' if rigid else ''}"
    return Channel(key, (quantity,), unit, "world", text)


def drive_channel(scene: Scene) -> Channel:
    """The channel of the position of a scene's drive; of several drives that of the first."""
    names = list(scene.all_drives)
    if not names:
        return ANGLE
    channel = TRAVEL if driven_travel(scene, names[0]) else ANGLE
    if len(names) == 1:
        return channel
    text = f"{channel.description}, of {names[0]}, the first of {len(names)} drives"
    return replace(channel, description=text)
