"""The worst-conditioned position of a path, on the grid or between, and the refusal of dead points."""

from dataclasses import replace

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.errors import MotionError
from kedfem.motion.batch import independent, row_selection
from kedfem.motion.linkage import Linkage
from kedfem.motion.messages import locking_message
from kedfem.motion.newton import BlockFactor, Factor, corrected, factored
from kedfem.motion.path.record import Path, predicted, target_on_path
from kedfem.motion.values import features

WEAK, SINGULAR = 0.05, 1e-7  # reciprocal condition numbers: to be minimised between grid points; of a dead point
LEVEL = 0.999  # of the values beside it: a minimum that is not zero, located well enough


def checked(link: Linkage, along: Path, factor: Factor | BlockFactor | None) -> Path:
    """The path with its independent rows and nearest singularity; refused if it passes a dead point.

    factor : its factored rows, if known
    """
    factor = factor or factored(link, features(link.rows, (along.R, along.p), along.near))
    reciprocal_condition, singular = _reciprocal_conditions(factor)
    phi, least = along.phi, int(reciprocal_condition.argmin())
    if isinstance(factor, Factor):
        along = replace(along, rows=row_selection(link.rows, independent(factor.J, singular)))
    along = replace(along, nearest_singularity=(float(reciprocal_condition[least]), float(phi[least])))
    dips = _dips(reciprocal_condition)
    for k in dips[np.argsort(np.abs(phi[dips]), kind="stable")]:  # the first on the path is reported
        along = _closer(link, along, float(phi[max(k - 1, 0)]), float(phi[min(k + 1, len(phi) - 1)]))
        if along.nearest_singularity[0] < SINGULAR:
            at = np.array([along.nearest_singularity[1]])
            raise MotionError(locking_message(link, predicted(along, at), float(at[0]), target_on_path(link, along, at)))
    return along


def _dips(reciprocal_condition: Float[np.ndarray, " G"]) -> Int[np.ndarray, " d"]:
    """Grid points beside which it may be zero: minima that have fallen by their own value; and a small least one."""
    beside = np.pad(reciprocal_condition, 1, constant_values=np.inf)
    low = np.minimum(beside[:-2], beside[2:])
    before = np.pad(reciprocal_condition, 1, mode="edge")
    fallen = np.maximum(before[:-2], before[2:]) - reciprocal_condition
    least = (np.arange(len(reciprocal_condition)) == reciprocal_condition.argmin()) & (reciprocal_condition < WEAK)
    return np.flatnonzero((reciprocal_condition <= low) & (reciprocal_condition <= fallen) | least)


def _closer(link: Linkage, along: Path, low: float, high: float) -> Path:
    """The path with the minimum between two values of τ, located by narrowing the interval."""
    for _ in range(7):
        tau = np.linspace(low, high, 33)
        aim = target_on_path(link, along, tau)
        poses = corrected(link, predicted(along, tau), aim, iterations=2)
        reciprocal_condition, _ = _reciprocal_conditions(factored(link, features(link.rows, poses, aim.near)))
        k = int(reciprocal_condition.argmin())
        low, high = tau[max(k - 1, 0)], tau[min(k + 1, 32)]
        if reciprocal_condition[k] < along.nearest_singularity[0]:
            along = replace(along, nearest_singularity=(float(reciprocal_condition[k]), float(tau[k])))
        if reciprocal_condition[k] > LEVEL * reciprocal_condition[max(k - 1, 0) : k + 2].max():
            break
    return along


def _reciprocal_conditions(factor: Factor | BlockFactor) -> tuple[Float[np.ndarray, " T"], Float[np.ndarray, " T"]]:
    """Reciprocal condition numbers of the scaled rows, 0 at a dead point, and their least singular values."""
    greatest, least = factor.extremes().T
    return least / greatest, least
