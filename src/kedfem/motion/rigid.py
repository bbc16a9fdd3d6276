"""Rigid motion R, p, R'', p'' of all links at many times at once, [KED, eqs. (2)(3)]."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float, Int

from kedfem.errors import MotionError
from kedfem.motion.linkage import Linkage
from kedfem.motion.newton import OPEN, closed, cross_matrix, derivatives
from kedfem.motion.path import Path, predicted
from kedfem.motion.rows import cross


@dataclass(frozen=True, slots=True)
class RigidMotion:
    """Poses and accelerations of all bodies (ground first) at T times.

    t, phi : (T,) time [s] and drive angle [rad]
    R, p : (T, B, 3, 3), (T, B, 3): a point drawn at X is at p + R X
    omega, alpha : (T, B, 3) angular velocity and acceleration, world components [rad/s, rad/s²]
    v : (T, B, 3) p' [m/s]
    R2, p2 : (T, B, 3, 3), (T, B, 3): R'' and p'' [1/s², m/s²]
    omega_phi, v_phi : (T, B, 3) rotation and displacement of the origin per drive angle [-, m]
    """

    t: Float[np.ndarray, " T"]
    phi: Float[np.ndarray, " T"]
    R: Float[np.ndarray, "T B 3 3"]
    p: Float[np.ndarray, "T B 3"]
    omega: Float[np.ndarray, "T B 3"]
    alpha: Float[np.ndarray, "T B 3"]
    v: Float[np.ndarray, "T B 3"]
    R2: Float[np.ndarray, "T B 3 3"]
    p2: Float[np.ndarray, "T B 3"]
    omega_phi: Float[np.ndarray, "T B 3"]
    v_phi: Float[np.ndarray, "T B 3"]

    def part(self, first: int, end: int) -> "RigidMotion":
        """The time points from one number up to another."""
        return self.at(slice(first, end))

    def at(self, which: slice | Int[np.ndarray, " k"]) -> "RigidMotion":
        """Some of the time points."""
        return RigidMotion(*(getattr(self, field.name)[which] for field in fields(self)))


def joined(parts: Sequence["RigidMotion"]) -> "RigidMotion":
    """Successive time points, one after the other."""
    return RigidMotion(
        *(np.concatenate([getattr(p, field.name) for p in parts]) for field in fields(RigidMotion))
    )


def resting(bodies: int, t: Float[np.ndarray, " T"]) -> RigidMotion:
    """Nominal motion of a linkage that nothing drives: all bodies rest as drawn, at given times (T,) [s]."""
    R = np.broadcast_to(np.eye(3), (len(t), bodies, 3, 3)).copy()
    p, omega, alpha, v, p2, omega_phi, v_phi = np.zeros((7, len(t), bodies, 3))
    return RigidMotion(t, np.zeros(len(t)), R, p, omega, alpha, v, np.zeros_like(R), p2, omega_phi, v_phi)


Drive = tuple[Float[np.ndarray, " T"], Float[np.ndarray, " T"], Float[np.ndarray, " T"]]


def rigid_motion(link: Linkage, along: Path, t: Float[np.ndarray, " T"], drive: Drive) -> RigidMotion:
    """The rigid part of [KED, eqs. (2)(3)] at given times.

    Newton from the nearest point of the path, then differentiated constraints.

    Parameters
    ----------
    along : path that covers the drive angles
    t : (T,) [s]
    drive : angle, speed and acceleration of the drive at those times, each (T,) [rad, rad/s, rad/s²]

    Raises
    ------
    MotionError
        If a joint is left open, with time and drive angle.
    """
    if link.drive is None:
        return resting(len(link.bodies), t)
    phi, speed, acceleration = drive
    poses, worst = closed(link, predicted(along, phi), phi)
    if worst.size and worst.max() > OPEN:
        k = int(worst.argmax())
        raise MotionError(
            f"joints: the linkage must close at all times, got an open joint ({worst[k] * link.size:.3g} m) "
            f"at t = {t[k]:.6g} s, drive angle {np.degrees(phi[k]):.6g} deg"
        )
    first, second, _ = derivatives(link, poses, phi)
    s, ss, a = speed[:, None, None], speed[:, None, None] ** 2, acceleration[:, None, None]
    R, (v1, w1), (v2, w2) = poses[0], first, second
    omega, alpha = w1 * s, w2 * ss + w1 * a
    W, c = cross_matrix(omega), link.centre
    R2 = (cross_matrix(alpha) + W @ W) @ R
    # bodies turn about the linkage's centre c in their poses: a point is at p + c + R (X − c)
    c_now = R @ c
    p, v_phi = poses[1] + c - c_now, v1 - cross(w1, c_now)
    p2 = v2 * ss + v1 * a - R2 @ c
    return RigidMotion(t, phi, R, p, omega, alpha, v_phi * s, R2, p2, w1, v_phi)
