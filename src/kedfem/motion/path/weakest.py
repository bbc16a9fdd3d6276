"""The weakest position of a path, on the grid or between, and the refusal of dead points."""

from dataclasses import replace

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.errors import MotionError
from kedfem.motion.batch import choice, independent
from kedfem.motion.linkage import Linkage
from kedfem.motion.messages import stopped
from kedfem.motion.newton import BlockFactor, Factor, closed, factored
from kedfem.motion.path.record import Path, aimed, predicted
from kedfem.motion.values import features

WEAK, SINGULAR = 0.05, 1e-7  # relative singular values: worth a closer look; a dead point
LEVEL = 0.999  # of its values beside it: a least one that does not vanish, found well enough


def checked(link: Linkage, along: Path, factor: Factor | BlockFactor | None) -> Path:
    """The path with the rows to solve for, refused if it passes a dead point, on the grid or between.

    factor : its rows, if known
    """
    factor = factor or factored(link, features(link.rows, (along.R, along.p), along.near))
    weakness, singular = _weakness(factor)
    phi, least = along.phi, int(weakness.argmin())
    if isinstance(factor, Factor):
        along = replace(along, rows=choice(link.rows, independent(factor.J, singular)))
    along = replace(along, weakest=(float(weakness[least]), float(phi[least])))
    dips = _dips(weakness)
    for k in dips[np.argsort(np.abs(phi[dips]), kind="stable")]:  # the first met is named
        along = _closer(link, along, float(phi[max(k - 1, 0)]), float(phi[min(k + 1, len(phi) - 1)]))
        if along.weakest[0] < SINGULAR:
            at = np.array([along.weakest[1]])
            raise MotionError(stopped(link, predicted(along, at), float(at[0]), aimed(link, along, at)))
    return along


def _dips(weakness: Float[np.ndarray, " G"]) -> Int[np.ndarray, " d"]:
    """Grid points beside which it may vanish: there it has fallen by as much as is left of it; and a weak least one."""
    beside = np.pad(weakness, 1, constant_values=np.inf)
    low = np.minimum(beside[:-2], beside[2:])
    before = np.pad(weakness, 1, mode="edge")
    fallen = np.maximum(before[:-2], before[2:]) - weakness
    least = (np.arange(len(weakness)) == weakness.argmin()) & (weakness < WEAK)
    return np.flatnonzero((weakness <= low) & (weakness <= fallen) | least)


def _closer(link: Linkage, along: Path, low: float, high: float) -> Path:
    """A closer look at the weakest position between two values of τ: the interval narrowed until it is level."""
    for _ in range(7):
        tau = np.linspace(low, high, 33)
        aim = aimed(link, along, tau)
        poses = closed(link, predicted(along, tau), aim, iterations=2)
        weakness, _ = _weakness(factored(link, features(link.rows, poses, aim.near)))
        k = int(weakness.argmin())
        low, high = tau[max(k - 1, 0)], tau[min(k + 1, 32)]
        if weakness[k] < along.weakest[0]:
            along = replace(along, weakest=(float(weakness[k]), float(tau[k])))
        if weakness[k] > LEVEL * weakness[max(k - 1, 0) : k + 2].max():
            break
    return along


def _weakness(factor: Factor | BlockFactor) -> tuple[Float[np.ndarray, " T"], Float[np.ndarray, " T"]]:
    """Least singular values of the scaled rows, 0 at a dead point: relative to the greatest, and absolute."""
    greatest, least = factor.extremes().T
    return least / greatest, least
