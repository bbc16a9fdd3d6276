"""The path of a linkage: poses on a grid of τ, and what lies between grid points.

τ is the drive's turn or travel; with several drives it is the time.
"""

from dataclasses import dataclass, replace

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.motion.linkage import Linkage
from kedfem.motion.newton import Target, orthonormal, target
from kedfem.motion.path.continuation import ROUNDING
from kedfem.motion.values import Poses, Twists


@dataclass(frozen=True, slots=True)
class Path:
    """Poses on a grid of τ, with derivatives by τ.

    phi : (G,) τ, increasing [rad or m; s with several drives]
    R, p : (G, B, 3, 3), (G, B, 3) poses of all bodies, ground first
    first, second : twists (v, ω) and their derivatives by τ, each a pair of (G, B, 3)
    near : (G, A) turns of the angle rows, counted on from the start [rad]
    period : τ after which the linkage returns to its pose; infinite if it does not
    over : (m,) what the rows gather over a period: gears whose ratio is not quite that of whole turns
    weakest : smallest singular value met on the way, relative, and τ there
    rows : numbers of rows that hold all motions, well conditioned all along
    curve : (G - 1, 6, 12 B) coefficients of the quintics between grid points, of R and p
    """

    phi: Float[np.ndarray, " G"]
    R: Float[np.ndarray, "G B 3 3"]
    p: Float[np.ndarray, "G B 3"]
    first: Twists
    second: Twists
    near: Float[np.ndarray, "G A"]
    period: float
    over: Float[np.ndarray, " m"]
    weakest: tuple[float, float]
    rows: Int[np.ndarray, " k"]
    curve: Float[np.ndarray, "I 6 C"]

    @property
    def periodic(self) -> bool:
        """Whether the linkage returns to its pose."""
        return bool(np.isfinite(self.period))

    def holds(self, low: float, high: float) -> bool:
        """Whether it reaches so far, up to rounding."""
        slack = ROUNDING * (1 + self.phi[-1] - self.phi[0])
        return self.periodic or bool(self.phi[0] - slack <= low and high <= self.phi[-1] + slack)


def place_on(along: Path, tau: Float[np.ndarray, " T"]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Interval of the grid (T,), place in it from 0 to 1 (T,), and number of periods before (T,)."""
    turns = np.zeros_like(tau)
    if along.periodic:
        turns = np.floor((tau - along.phi[0]) / along.period)
        tau = np.clip(tau - turns * along.period, along.phi[0], along.phi[-1])
    last = len(along.phi) - 1
    k = np.clip(np.searchsorted(along.phi, tau) - 1, 0, max(last - 1, 0))
    h = along.phi[np.minimum(k + 1, last)] - along.phi[k]
    return k, (tau - along.phi[k]) / np.where(h > 0, h, 1.0), turns


def predicted(along: Path, tau: Float[np.ndarray, " T"]) -> Poses:
    """Poses between grid points: quintic Hermite interpolation of R and p, R made a rotation again."""
    k, s, _ = place_on(along, tau)
    B = along.p.shape[1]
    if not len(along.curve):
        return np.tile(along.R, (len(tau), 1, 1, 1)), np.tile(along.p, (len(tau), 1, 1))
    x, s = along.curve[k, 5], s[:, None]
    for power in range(4, -1, -1):
        x *= s
        x += along.curve[k, power]
    return orthonormal(x[:, : 9 * B].reshape(-1, B, 3, 3)), x[:, 9 * B :].reshape(-1, B, 3)


def aimed(link: Linkage, along: Path, tau: Float[np.ndarray, " T"]) -> Target:
    """What the rows shall be: values of the drives, and turns of couplings from those on the grid."""
    k, s, turns = place_on(along, tau)
    there = np.minimum(k + 1, len(along.phi) - 1)
    near = along.near[k] + s[:, None] * (along.near[there] - along.near[k])
    aim = target(link, tau, near)
    return replace(aim, over=turns[:, None] * along.over) if along.over.any() else aim
