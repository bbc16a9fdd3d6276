"""Estimated distance of a linkage from a dead point over the drive's range."""

from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.motion.linkage import Linkage
from kedfem.motion.newton import moved
from kedfem.motion.path import Path, predicted, target_on_path
from kedfem.motion.values import Poses, features, jacobian
from kedfem.scene import Scene

SEARCHED = np.radians(60.0)  # joints, and drives beyond their range (slides by size, times by a quarter of the path)
INWARD = 0.01  # of a step of the path: distance of places from which it is extrapolated
FOLD, CROSSING = 0.5, 1.0  # powers of the distance with which the least singular value vanishes


@dataclass(frozen=True, slots=True)
class DeadPoint:
    """The position of the drive's range at which a linkage is nearest to a dead point.

    reciprocal_condition : smallest singular value of the rows there, of the largest
    tau : place on the path: angle or travel of the drive, of several drives the time [rad, m or s]
    joint, off : the joint with the largest rotation to the dead point, and that rotation [rad], estimated; None if far
    outside : τ of the dead point of the path extrapolated beyond that end, estimated; None if the position is not at an
        end, or the dead point is far
    """

    reciprocal_condition: float
    tau: float
    joint: str | None = None
    off: float = 0.0
    outside: float | None = None


def nearest_dead_point(scene: Scene, link: Linkage, along: Path) -> DeadPoint:
    """The weakest position on a path, and the dead point beside it."""
    reciprocal_condition, tau = along.nearest_singularity
    k = int(np.abs(along.phi - tau).argmin())
    joint, off = _off(scene, link, (along.R[k : k + 1], along.p[k : k + 1]), along.near[k : k + 1])
    ends = not along.periodic and k in {0, len(along.phi) - 1}
    return DeadPoint(reciprocal_condition, tau, joint, off, _outside(link, along, k) if ends else None)


def _rows(link: Linkage, poses: Poses, near: Float[np.ndarray, "T A"]) -> Float[np.ndarray, "T m k"]:
    """Scaled derivatives of the rows."""
    return jacobian(link.rows, features(link.rows, poses, near), len(link.bodies), link.size)


def _off(scene: Scene, link: Linkage, poses: Poses, near: Float[np.ndarray, "1 A"]) -> tuple[str | None, float]:
    """The joint with the largest rotation to the singular position, and that rotation.

    All bodies are moved along the right singular vector v of the smallest singular value uᵀ J v until that is zero, with
    joints closed to first order.
    """
    U, _, Vt = np.linalg.svd(_rows(link, poses, near)[0], full_matrices=False)
    u, v = U[:, -1], Vt[-1]
    twist = np.concatenate([np.zeros((1, 6)), v.reshape(-1, 6)])
    number = {name: k for k, name in enumerate(link.bodies)}
    turns = {
        name: float(np.linalg.norm(np.subtract(*(twist[number[each], 3:] for each in joint.links))))
        for name, joint in scene.joints.items()
    }
    joint = max(turns, key=lambda name: turns[name], default=None)
    if joint is None or turns[joint] < 1e-3:
        return None, 0.0
    s = np.arange(-120, 121) / 120 * SEARCHED / turns[joint]
    there = (np.repeat(poses[0], len(s), 0), np.repeat(poses[1], len(s), 0))
    there = moved(there, (s[:, None, None] * twist[:, :3] * link.size, s[:, None, None] * twist[:, 3:]))
    held = np.einsum("m,tmk,k->t", u, _rows(link, there, np.repeat(near, len(s), 0)), v)
    change = np.flatnonzero(held[:-1] * held[1:] <= 0)
    if not len(change):
        return None, 0.0
    zeros = s[change] + held[change] / (held[change] - held[change + 1]) * (s[1] - s[0])
    return joint, float(np.abs(zeros).min() * turns[joint])


def _outside(link: Linkage, along: Path, k: int) -> float | None:
    """τ beyond an end of the path at which the least singular value σ vanishes.

    With x inward from the end, d to the dead point: σ² = c (d + x) at a limit of the drive, σ = c (d + x) where two
    branches meet; whichever fits three points of the path better.
    """
    low, high = float(along.phi[0]), float(along.phi[-1])
    if high <= low:
        return None
    x = min(INWARD * link.drives.step(low, high), (high - low) / 2) * np.arange(3)
    tau = along.phi[k] + (x if k == 0 else -x)
    s = np.linalg.svd(_rows(link, predicted(along, tau), target_on_path(link, along, tau).near), compute_uv=False)
    sigma = s[:, -1] / s[:, 0]
    trials = []
    for power in (FOLD, CROSSING):
        y = sigma ** (1 / power)
        slope = (y[1] - y[0]) / x[1]
        change = abs(y[2] - y[0])  # zero for a linkage whose drives do not change its shape
        misfit = abs(y[0] + slope * x[2] - y[2]) / change if change > 0.0 else np.inf
        trials.append((misfit, y[0] / slope if slope > 0 else np.inf))
    distance = float(min(trials)[1])
    far = SEARCHED * link.drives.units[0] if len(link.drives) == 1 else np.ptp(along.phi) / 4
    return float(along.phi[k]) + (-distance if k == 0 else distance) if distance < far else None
