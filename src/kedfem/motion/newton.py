"""Poses that close all joints, and their derivatives by the drive angle, at many drive angles at once."""

import numpy as np
from jaxtyping import Float

from kedfem.motion.linkage import Linkage, scaled
from kedfem.motion.rows import (
    Features,
    Poses,
    Twists,
    convective,
    drive_derivative,
    features,
    jacobian,
    residuals,
)

SETTLED = 1e-9  # a Newton step, of the linkage's size [-, rad]: the next one would be rounding
OPEN = 1e-6  # of the size: what joints of a redundant linkage may be out of true, far below any bearing's clearance


def rotation(theta: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3 3"]:
    """exp([θ]×), Rodrigues' formula, for stacks of rotation vectors [rad]."""
    angle2 = np.einsum("...k,...k->...", theta, theta)[..., None, None]
    angle = np.sqrt(angle2)
    W = cross_matrix(theta)
    small = angle2 < 1e-8
    safe = np.where(small, 1.0, angle)
    s = np.where(small, 1 - angle2 / 6, np.sin(safe) / safe)
    c = np.where(small, 0.5 - angle2 / 24, (1 - np.cos(safe)) / safe**2)
    return np.asarray(np.eye(3) + s * W + c * (W @ W))


def cross_matrix(w: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3 3"]:
    """[w]×, so that [w]× x = w × x."""
    out = np.zeros((*w.shape, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -w[..., 2], w[..., 1], -w[..., 0]
    return out - np.swapaxes(out, -1, -2)


class Factor:
    """QR of the scaled rows at T poses; least squares over all rows, so redundant ones need no choice."""

    def __init__(self, link: Linkage, f: Features) -> None:
        self.link, self.f, self.bodies = link, f, len(link.bodies)
        self.row = np.where(link.rows.kind == 0, 1 / link.size, 1.0)
        self.J = scaled(jacobian(link.rows, f, self.bodies), link.rows, link.size)
        self.Q, self.U = np.linalg.qr(self.J)

    def twists(self, rhs: Float[np.ndarray, "T m"]) -> Twists:
        """Least-squares solution of J (v, ω) = rhs; the ground's are zero."""
        projected = np.swapaxes(self.Q, 1, 2) @ (rhs * self.row)[..., None]
        x = np.linalg.solve(self.U, projected)[..., 0].reshape(len(rhs), -1, 6)
        full = np.zeros((len(rhs), self.bodies, 6))
        full[:, 1:] = x
        return full[..., :3] * self.link.size, full[..., 3:]


def moved(poses: Poses, change: Twists) -> Poses:
    """Poses after small finite twists (v, θ)."""
    R, p = poses
    return rotation(change[1]) @ R, p + change[0]


def orthonormal(R: Float[np.ndarray, "... 3 3"]) -> Float[np.ndarray, "... 3 3"]:
    """The rotation next to a matrix that almost is one: one Newton step R (3 − Rᵀ R)/2 of the polar decomposition."""
    return np.asarray(R @ (1.5 * np.eye(3) - 0.5 * np.swapaxes(R, -1, -2) @ R))


def closed(
    link: Linkage, poses: Poses, phi: Float[np.ndarray, " T"], sweeps: int = 12
) -> tuple[Poses, Float[np.ndarray, " T"]]:
    """Newton: poses at which all rows vanish (redundant ones in the least squares), from poses close by.

    Parameters
    ----------
    poses : R (T, B, 3, 3), p (T, B, 3) first guess
    phi : (T,) drive angles [rad]

    Returns
    -------
    poses, and (T,) the largest gap left, in units of size; infinite where Newton has not settled
    """
    step = np.full(len(phi), np.inf)
    for _ in range(sweeps):
        f = features(link.rows, poses, phi)
        try:
            change = Factor(link, f).twists(-residuals(f))
        except np.linalg.LinAlgError:
            return poses, np.full(len(phi), np.inf)
        poses = moved(poses, change)
        step = np.maximum(np.abs(change[0]).max(axis=(1, 2)) / link.size, np.abs(change[1]).max(axis=(1, 2)))
        if (step <= SETTLED).all() or not (step < 1).any():
            break
    unit = np.where(link.rows.kind == 0, 1 / link.size, 1.0)
    gap = np.abs(residuals(features(link.rows, poses, phi)) * unit)
    return poses, np.where(step <= SETTLED, gap.max(axis=1), np.inf)


def derivatives(link: Linkage, poses: Poses, phi: Float[np.ndarray, " T"]) -> tuple[Twists, Twists, Factor]:
    """First and second derivatives of the motion by the drive angle, as twists: differentiated constraints."""
    f = features(link.rows, poses, phi)
    factor = Factor(link, f)
    first = factor.twists(-drive_derivative(f))
    second = factor.twists(-convective(link.rows, f, first, np.ones_like(phi)))
    return first, second, factor
