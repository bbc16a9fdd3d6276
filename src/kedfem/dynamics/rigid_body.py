"""The rigid-body motion of a model over time: blocks of it, loads along it, what starts and estimates ask of instants."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.history import Forcing
from kedfem.dynamics.joints.constraint_matrices import joint_rows
from kedfem.dynamics.joints.first_rows import INSTANTS, FirstRows, first_rows
from kedfem.dynamics.loads import applied
from kedfem.dynamics.matrices.interface import static_tie
from kedfem.dynamics.model import Model
from kedfem.dynamics.stepping.start import Instant
from kedfem.dynamics.stiffening import Stiffening
from kedfem.motion.linkage import Linkage
from kedfem.motion.newton import cross_matrix
from kedfem.motion.path import Path
from kedfem.motion.rigid import RigidMotion, joined, rigid_motion
from kedfem.scene import ConstantSpeed, Scene, path_parameter, time_grid, turn_steps

POINTS = 1024  # time points of rigid motion found together
KEPT = 20_000  # time points of a turn whose rigid motion is kept
FINER = 8  # instants in a step, from whose differences the rates of constraints at the start are


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
    turn = (turn_steps(scene) or 0.0) * (along.period / (2 * np.pi) if along.periodic else 1.0)
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
            yield (
                first,
                replace(kept[0].at((steps - 1) % round(turn)), t=t, phi=drive[0], drives=drive[0][:, None]),
            )
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


def forcing_of(
    model: Model, motion: RigidMotion, loads: Sequence[Float[np.ndarray, "T _ _"]]
) -> list[Forcing]:
    """The same where P − M R0'' is known."""
    every = zip(model.links, model.bodies, loads, strict=True)
    return [Forcing(motion.R[:, body, : link.d, : link.d], F) for link, body, F in every]


def instants(model: Model, motion: RigidMotion, stresses: Stiffening | None = None) -> list[Instant]:
    """Orientation, load, spin and, if given, stress stiffness of all links at each time point."""
    forcing = forcings(model, motion)
    if stresses is not None:
        forcing = stresses.over(forcing, motion)
    ties = (
        joint_rows(model.rows, motion.part(k, k + 1), model.interface_unknowns) for k in range(len(motion.t))
    )  # of many links each is large
    W = cross_matrix(motion.omega)
    spin = cross_matrix(motion.alpha) + W @ W
    return [
        Instant(
            [each.at(k) for each in forcing],
            [spin[k, body, : link.d, : link.d] for link, body in zip(model.links, model.bodies, strict=True)],
            None if stresses is None else stresses.turnings([each.at(k) for each in forcing]),
            None if rows is None else static_tie(rows, 0),
        )
        for k, rows in enumerate(ties)
    ]


def rows_at_start(scene: Scene, linkage: Linkage, along: Path, model: Model) -> FirstRows | None:
    """Rows of joints at t = 0 with their derivatives in time; None without any."""
    if not model.rows:
        return None
    grid = time_grid(scene)
    h = min(grid.step, grid.end / (INSTANTS - 1)) / FINER
    t = h * np.arange(INSTANTS)
    motion = rigid_motion(linkage, along, t, path_parameter(scene, t))
    rows = joint_rows(model.rows, motion, model.interface_unknowns)
    return None if rows is None else first_rows(rows, h)


def drive_range(scene: Scene) -> tuple[float, float]:
    """Least and greatest drive angle of the analysis [rad]."""
    grid = time_grid(scene)
    t = grid.step * np.arange(grid.steps + 1)
    phi = path_parameter(scene, t)[0]
    return min(float(phi.min()), 0.0), max(float(phi.max()), 0.0)
