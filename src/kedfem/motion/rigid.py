"""Rigid motion R, p, R'', p'' of all links at many times at once, [KED, eqs. (2)(3)]."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.errors import MotionError
from kedfem.motion.batch import SolvedMotion, solved_motion
from kedfem.motion.linkage import Linkage
from kedfem.motion.messages import position_in_words
from kedfem.motion.newton import OPEN, cross_matrix
from kedfem.motion.path import Path, predicted, target_on_path
from kedfem.vectors import cross


@dataclass(frozen=True, slots=True)
class RigidMotion:
    """Poses and accelerations of all bodies (ground first) at T times.

    t, phi : (T,) time [s] and drive angle [rad]
    R, p : (T, B, 3, 3), (T, B, 3): the point with reference position X is at p + R X
    omega, alpha : (T, B, 3) angular velocity and acceleration, world components [rad/s, rad/s²]
    v : (T, B, 3) p' [m/s]
    R2, p2 : (T, B, 3, 3), (T, B, 3): R'' and p'' [1/s², m/s²]
    drives : (T, D) angle or travel of each drive [rad or m]; phi is the first of them
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
    drives: Float[np.ndarray, "T D"]

    def position(self, body: int, X: Float[np.ndarray, "3"]) -> Float[np.ndarray, "T 3"]:
        """Position of a body's point with the reference position X [m]."""
        return np.asarray(self.p[:, body] + self.R[:, body] @ X)

    def velocity(self, body: int, X: Float[np.ndarray, "3"]) -> Float[np.ndarray, "T 3"]:
        """Velocity of the same point [m/s]."""
        return np.asarray(self.v[:, body] + cross(self.omega[:, body], self.R[:, body] @ X))

    def acceleration(self, body: int, X: Float[np.ndarray, "3"]) -> Float[np.ndarray, "T 3"]:
        """Acceleration of the same point [m/s²]."""
        return np.asarray(self.p2[:, body] + self.R2[:, body] @ X)

    def part(self, first: int, end: int) -> "RigidMotion":
        """The time points from one number up to another."""
        return self.at(slice(first, end))

    def at(self, which: slice | Int[np.ndarray, " k"]) -> "RigidMotion":
        """Some of the time points."""
        return RigidMotion(*(getattr(self, field.name)[which] for field in fields(self)))


def joined(parts: Sequence["RigidMotion"]) -> "RigidMotion":
    """Successive time points, one after the other."""
    names = [field.name for field in fields(RigidMotion)]
    return RigidMotion(*(np.concatenate([getattr(p, name) for p in parts]) for name in names))


def seen_from(motion: RigidMotion, bodies: tuple[int, int], at: Float[np.ndarray, "3"]) -> Float[np.ndarray, "T 3"]:
    """Displacement of a point of body i in the frame of body j, from the reference position (T, 3) [m]."""
    i, j = bodies
    point = motion.p[:, i] + motion.R[:, i] @ at
    return np.asarray(((point - motion.p[:, j])[:, None] @ motion.R[:, j])[:, 0] - at)


def resting(bodies: int, t: Float[np.ndarray, " T"]) -> RigidMotion:
    """Rigid-body motion of a linkage without a drive, at rest in the reference position, at given times (T,) [s]."""
    R = np.broadcast_to(np.eye(3), (len(t), bodies, 3, 3)).copy()
    p, omega, alpha, v, p2 = np.zeros((5, len(t), bodies, 3))
    phi, none = np.zeros(len(t)), np.zeros((len(t), 0))
    return RigidMotion(t, phi, R, p, omega, alpha, v, np.zeros_like(R), p2, none)


Along = tuple[Float[np.ndarray, " T"], Float[np.ndarray, " T"], Float[np.ndarray, " T"]]


def rigid_motion(link: Linkage, along: Path, t: Float[np.ndarray, " T"], drive: Along) -> RigidMotion:
    """The rigid part of [KED, eqs. (2)(3)] at given times, by Newton's method from the path.

    Parameters
    ----------
    along : path that covers the drive
    t : (T,) [s]
    drive : place on the path and its derivatives, each (T,): angle or travel of the drive; with several t, 1, 0

    Raises
    ------
    MotionError
        If a joint is left open, with time and drive angle.
    """
    if link.drive is None:
        return resting(len(link.bodies), t)
    tau, speed, acceleration = (x[:, None] for x in drive)
    q, q1, q2 = link.drives.at(drive[0])
    rates = (q1 * speed, q2 * speed**2 + q1 * acceleration)
    got = solved_motion(link, along.rows, predicted(along, drive[0]), target_on_path(link, along, drive[0]), rates)
    if got.gap.size and got.gap.max() > OPEN:
        k = int(got.gap.argmax())
        raise MotionError(
            f"joints: the linkage must close at all times, got an open joint ({got.gap[k] * link.size:.3g} m) "
            f"at t = {t[k]:.6g} s, {position_in_words(link, float(tau[k, 0]), '.6g')}"
        )
    return _about_origin(link, t, q, got)


def _about_origin(link: Linkage, t: Float[np.ndarray, " T"], q: np.ndarray, got: SolvedMotion) -> RigidMotion:
    """Motion of bodies in their poses about the linkage's centre c: reference position X goes to p + c + R (X − c)."""
    (R, p), (v, omega), (v2, alpha) = got.poses, got.first, got.second
    W, c = cross_matrix(omega), link.centre
    R2 = (cross_matrix(alpha) + W @ W) @ R
    c_now = R @ c
    v_origin = v - cross(omega, c_now)
    return RigidMotion(t, q[:, 0], R, p + c - c_now, omega, alpha, v_origin, R2, v2 - R2 @ c, q)
