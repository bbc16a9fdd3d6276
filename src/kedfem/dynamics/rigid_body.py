"""The rigid-body motion of a model in blocks of time points and at single instants, with the loads along it."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.history import Forcing
from kedfem.dynamics.loads import applied
from kedfem.dynamics.model import Model
from kedfem.motion.linkage import Linkage
from kedfem.motion.path import Path
from kedfem.motion.rigid import RigidMotion, joined, rigid_motion
from kedfem.scene import ConstantSpeed, Scene, path_parameter, revolution_steps, time_grid

POINTS = 1024  # time points of rigid motion found together
KEPT = 20_000  # time points of a revolution whose rigid motion is kept


def all_motions(scene: Scene, linkage: Linkage, along: Path) -> Iterator[tuple[int, RigidMotion]]:
    """Rigid motion at all time points, with the number of the first of each block."""
    start = np.zeros(1)
    yield 0, rigid_motion(linkage, along, start, path_parameter(scene, start))
    yield from motions(scene, linkage, along)


def motions(scene: Scene, linkage: Linkage, along: Path, since: int = 0) -> Iterator[tuple[int, RigidMotion]]:
    """Rigid motion at all time points after the first, block after block with the number of its first point.

    Blocks that end before the time point `since` are left out.

    A drive at constant speed brings the linkage back after a period, a turn or a few: then only the first is solved, and
    no block goes on beyond its end.
    """
    grid, law = time_grid(scene), scene.motion
    turn = (revolution_steps(scene) or 0.0) * (along.period / (2 * np.pi) if along.periodic else 1.0)
    returns = isinstance(law, ConstantSpeed) and along.periodic and abs(turn - round(turn)) < 1e-9 * turn
    returns = returns and turn <= KEPT
    kept: list[RigidMotion] = []
    last = 0
    while last < grid.steps:
        first, last = last + 1, min(last + POINTS, grid.steps)
        if returns and first <= round(turn):
            last = min(last, round(turn))
        steps = np.arange(first, last + 1)
        if last < since and not (returns and first <= turn):
            continue
        t = grid.step * steps
        drive = path_parameter(scene, t)
        if kept and first > round(turn):
            if len(kept) > 1:
                kept = [joined(kept)]
            yield (first, replace(kept[0].at((steps - 1) % round(turn)), t=t, phi=drive[0], drives=drive[0][:, None]))
            continue
        motion = rigid_motion(linkage, along, t, drive)
        if returns and first <= turn and grid.steps > turn:
            kept.append(motion)
        if last >= since:
            yield first, motion


def forcings(model: Model, motion: RigidMotion) -> list[Forcing]:
    """Orientation and P − M R0'' of all links over time."""
    every = zip(model.links, model.loads, model.bodies, strict=True)
    return forcing_of(model, motion, [applied(link, loads, motion, body) for link, loads, body in every])


def forcing_of(model: Model, motion: RigidMotion, loads: Sequence[Float[np.ndarray, "T _ _"]]) -> list[Forcing]:
    """The same where P − M R0'' is known."""
    every = zip(model.links, model.bodies, loads, strict=True)
    return [Forcing(motion.R[:, body, : link.d, : link.d], F) for link, body, F in every]


def drive_range(scene: Scene) -> tuple[float, float]:
    """Least and greatest drive angle of the analysis [rad]."""
    grid = time_grid(scene)
    t = grid.step * np.arange(grid.steps + 1)
    phi = path_parameter(scene, t)[0]
    return min(float(phi.min()), 0.0), max(float(phi.max()), 0.0)
