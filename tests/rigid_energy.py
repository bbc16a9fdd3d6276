"""Energy of links as rigid bodies, and the power of their loads."""

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.inertias import Inertias, load_wrench
from kedfem.motion.rigid import RigidMotion
from kedfem.vectors import cross


def kinetic_energy(inertias: Inertias, motion: RigidMotion) -> Float[np.ndarray, " T"]:
    """½ ∫ρ |x'|² dV of all bodies [J]."""
    R1 = _rate(motion)
    v = motion.v + np.einsum("tbij,j->tbi", R1, inertias.centre)
    moving = np.einsum("b,tbi,tbi->t", inertias.mass, v, v)
    mixed = np.einsum("tbi,tbij,bj->t", v, R1, inertias.first)
    turning = np.einsum("tbij,bjk,tbik->t", R1, inertias.second, R1)
    spinning = motion.omega[..., 2] ** 2 @ inertias.spin
    return np.asarray(0.5 * (moving + 2 * mixed + turning + spinning))


def load_power(inertias: Inertias, motion: RigidMotion) -> Float[np.ndarray, " T"]:
    """Power of loads and gravity on the rigid motion [W]."""
    v = motion.v + cross(motion.omega, motion.R @ inertias.centre)
    arm = np.einsum("tbij,bj->tbi", motion.R, inertias.first)
    power = np.asarray((inertias.mass[:, None] * v + cross(motion.omega, arm)).sum(axis=1) @ inertias.gravity)
    for load in inertias.loads:
        f, m = load_wrench(load, motion)
        power = power + (f * v[:, load.body] + m * motion.omega[:, load.body]).sum(axis=1)
    return power


def _rate(motion: RigidMotion) -> Float[np.ndarray, "T B 3 3"]:
    """R' = ω × R, column by column."""
    R = np.swapaxes(motion.R, -1, -2)
    return np.swapaxes(cross(motion.omega[:, :, None], R), -1, -2)
