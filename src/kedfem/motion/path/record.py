"""The path of a linkage: poses on a grid of τ, interpolated between grid points.

τ is the drive's angle or travel; with several drives it is the time.
"""

from dataclasses import dataclass, replace

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.motion.batch import RowSelection
from kedfem.motion.linkage import Linkage
from kedfem.motion.newton import Target, target
from kedfem.motion.path.continuation import ROUNDING, on_curves, quintics, split
from kedfem.motion.values import Poses, Twists


@dataclass(frozen=True, slots=True)
class Path:
    """Poses on a grid of τ, with derivatives by τ.

    phi : (G,) τ, increasing [rad or m; s with several drives]
    shape : (3, G, 12 B) R and p of all bodies, ground first, and their two derivatives by τ
    near : (G, A) angles of the angle rows, unwrapped from the start [rad]
    period : τ after which the linkage returns to its pose; infinite if it does not
    over : (m,) change of the rows over a period, of gears whose ratio is not exactly that of whole revolutions
    nearest_singularity : smallest reciprocal condition number of the rows on the path, and τ there
    rows : independent rows, well conditioned on all of the path
    curve : (G - 1, 6, 12 B) coefficients of the quintics between grid points, of R and p
    """

    phi: Float[np.ndarray, " G"]
    shape: Float[np.ndarray, "3 G C"]
    near: Float[np.ndarray, "G A"]
    period: float
    over: Float[np.ndarray, " m"]
    nearest_singularity: tuple[float, float]
    rows: RowSelection
    curve: Float[np.ndarray, "I 6 C"]

    @property
    def R(self) -> Float[np.ndarray, "G B 3 3"]:
        """Orientations."""
        return split(self.shape[0])[0]

    @property
    def p(self) -> Float[np.ndarray, "G B 3"]:
        """Displacements."""
        return split(self.shape[0])[1]

    @property
    def first(self) -> Twists:
        """Twists (v, ω) by τ, each (G, B, 3)."""
        W, v = split(self.shape[1])
        W = W @ np.swapaxes(self.R, -1, -2)
        return v, np.stack([W[..., 2, 1], W[..., 0, 2], W[..., 1, 0]], axis=-1)

    @property
    def periodic(self) -> bool:
        """Whether the linkage returns to its pose."""
        return bool(np.isfinite(self.period))

    def holds(self, low: float, high: float) -> bool:
        """Whether it covers a range, up to rounding."""
        slack = ROUNDING * (1 + self.phi[-1] - self.phi[0])
        return self.periodic or bool(self.phi[0] - slack <= low and high <= self.phi[-1] + slack)


def with_points(
    along: Path, phi: Float[np.ndarray, " T"], shape: Float[np.ndarray, "3 T C"], near: Float[np.ndarray, "T A"]
) -> tuple[Path, Int[np.ndarray, " G"]]:
    """The path with more grid points, and numbers of its points in the sequence of old points and then these."""
    order = np.argsort(np.concatenate([along.phi, phi]))
    phi = np.concatenate([along.phi, phi])[order]
    shape = np.concatenate([along.shape, shape], axis=1)[:, order]
    near = np.concatenate([along.near, near])[order]
    return replace(along, phi=phi, shape=shape, near=near, curve=quintics(shape, np.diff(phi))), order


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
    """Poses between grid points by quintic Hermite interpolation of R and p, with R orthonormalised."""
    k, s, _ = place_on(along, tau)
    if not len(along.curve):
        return np.tile(along.R, (len(tau), 1, 1, 1)), np.tile(along.p, (len(tau), 1, 1))
    return on_curves((along.curve[k, power] for power in range(5, -1, -1)), s)


def target_on_path(link: Linkage, along: Path, tau: Float[np.ndarray, " T"]) -> Target:
    """Required values of the rows: those of the drives, and angles of couplings interpolated on the grid."""
    k, s, turns = place_on(along, tau)
    there = np.minimum(k + 1, len(along.phi) - 1)
    near = along.near[k] + s[:, None] * (along.near[there] - along.near[k])
    aim = target(link, tau, near)
    return replace(aim, over=turns[:, None] * along.over) if along.over.any() else aim
