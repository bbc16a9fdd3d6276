"""Instants at which a linkage is examined before its modes are chosen, and at which the residual of a run is taken."""

import numpy as np
from jaxtyping import Float, Int

from kedfem.accuracy.prepared import Prepared
from kedfem.motion.rigid import RigidMotion, rigid_motion
from kedfem.scene import (
    drive_angle,
    path_parameter,
    time_grid,
    turn_steps,
)

INSTANTS = 16  # where the linkage is examined before the first run


MOMENTS = 16  # of a run where its residual is taken


def training_motion(full: Prepared) -> RigidMotion:
    """Rigid motion at the instants where the linkage is examined: over the whole time, the last turn more closely."""
    scene, grid = full.scene, time_grid(full.scene)
    per_turn = turn_steps(scene)
    half = INSTANTS // 2
    t = grid.end * (np.arange(half) + 0.5) / half
    if per_turn is not None:
        turn = min(per_turn * grid.step, grid.end)
        t = np.concatenate([t, grid.end - turn * np.arange(INSTANTS - half) / (INSTANTS - half)])
    t = np.unique(np.concatenate([t, _loaded(full, grid.step * np.arange(grid.steps + 1))]))
    return rigid_motion(full.linkage, full.path, t, path_parameter(scene, t))


def _loaded(full: Prepared, t: Float[np.ndarray, " T"]) -> Float[np.ndarray, " l"]:
    """The time at which each load is greatest, so that short ones are not missed."""
    phi = drive_angle(full.scene.motion, t)[0]
    factors = [np.abs(load.factor(t, phi)) for loads in full.model.loads for load in loads]
    return np.array([t[f.argmax()] for f in factors if np.ptp(f) > 0.0])


def residual_moments(full: Prepared) -> set[int]:
    """Steps of a run at which its residual is taken, evenly over it."""
    steps: Int[np.ndarray, " k"] = np.linspace(1, time_grid(full.scene).steps, MOMENTS).astype(int)
    return set(steps.tolist())
