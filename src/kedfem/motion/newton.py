"""Poses that close all joints, and their derivatives by the path's parameter, at many of its values at once."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from kedfem.motion.blocks import Blocks
from kedfem.motion.constraints import Rows
from kedfem.motion.linkage import Linkage
from kedfem.motion.values import Features, Poses, Twists, convective, features, jacobian, residuals

SETTLED = 1e-9  # a Newton step, of the linkage's size [-, rad]: the next one would be rounding
NEARLY = 1e-8  # what is as far from a rotation is one to rounding after a step
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


@dataclass(frozen=True, slots=True)
class Target:
    """What the rows shall be at T time points.

    q : (T, D) values of the drives [rad or m]
    near : (T, A) turns of the angle rows, to within half a turn [rad]
    over : (T, m) what rows have gathered over whole periods of the path, to be added; None: nothing
    """

    q: Float[np.ndarray, "T D"]
    near: Float[np.ndarray, "T A"]
    over: Float[np.ndarray, "T m"] | None = None

    def __len__(self) -> int:
        return len(self.q)

    def at(self, which: slice | Bool[np.ndarray, " T"]) -> "Target":
        """Some of the time points."""
        return Target(self.q[which], self.near[which], None if self.over is None else self.over[which])


def remainder(rows: Rows, f: Features, aim: Target) -> Float[np.ndarray, "T m"]:
    """Values of the constraints."""
    rest = residuals(rows, f, aim.q)
    return rest if aim.over is None else rest + aim.over


def target(link: Linkage, tau: Float[np.ndarray, " T"], near: Float[np.ndarray, "T A"]) -> Target:
    """The drives' values at τ; turns of their own rows are these, those of others near given ones."""
    q, rows = link.drives.at(tau)[0], link.rows
    near = near.copy()
    for k, row in enumerate(rows.angles):
        if row < rows.count and rows.drive[row] >= 0:
            near[:, k] = q[:, rows.drive[row]]
    return Target(q, near)


class Factor:
    """QR of the scaled rows at T poses; least squares over all rows, so redundant ones need no choice."""

    def __init__(self, link: Linkage, f: Features) -> None:
        self.link, self.f = link, f
        self.row = link.rows.scale(link.size)[: link.rows.count]
        self.J = jacobian(link.rows, f, len(link.bodies), link.size)
        self.Q, self.U = np.linalg.qr(self.J)

    def twists(self, rhs: Float[np.ndarray, "T m"]) -> Twists:
        """Least-squares solution of J (v, ω) = rhs; the ground's are zero."""
        projected = np.swapaxes(self.Q, 1, 2) @ (rhs * self.row)[..., None]
        return twists(self.link, np.linalg.solve(self.U, projected)[..., 0])

    def extremes(self) -> Float[np.ndarray, "T 2"]:
        """Greatest and least singular value of the scaled rows; the latter is 0 at a dead point."""
        if not self.U.shape[-1]:
            return np.ones((len(self.U), 2))
        return np.asarray(np.linalg.svd(self.U, compute_uv=False)[:, [0, -1]])


class BlockFactor:
    """The same of a large linkage, entry by entry."""

    def __init__(self, link: Linkage, f: Features, blocks: Blocks) -> None:
        self.link, self.f, self.blocks = link, f, blocks
        self.row = link.rows.scale(link.size)[: link.rows.count]
        self.values = blocks.values(link.rows, f, link.size)

    def twists(self, rhs: Float[np.ndarray, "T m"]) -> Twists:
        """Least-squares solution of J (v, ω) = rhs; the ground's are zero."""
        found = self.blocks.least_squares(self.values, (rhs * self.row)[..., None])
        return twists(self.link, found[..., 0])

    def extremes(self) -> Float[np.ndarray, "T 2"]:
        """Greatest and least singular value of the scaled rows; the latter is 0 at a dead point."""
        return self.blocks.extremes(self.values)


def factored(link: Linkage, f: Features) -> Factor | BlockFactor:
    """The scaled rows at T poses, ready to be solved."""
    return Factor(link, f) if link.blocks is None else BlockFactor(link, f, link.blocks)


def agree(here: Factor | BlockFactor, there: Factor | BlockFactor) -> bool:
    """Whether no singular position lies between the first poses of two that are close by: det J₁ᵀ J₂ > 0."""
    if isinstance(here, BlockFactor) and isinstance(there, BlockFactor):
        return here.blocks.agree(here.values[0], there.values[0])
    if isinstance(here, Factor) and isinstance(there, Factor):
        return bool(np.linalg.slogdet(here.J[0].T @ there.J[0])[0] > 0)
    raise TypeError("both must be of one linkage")


def twists(
    link: Linkage, x: Float[np.ndarray, "... k"]
) -> tuple[Float[np.ndarray, "... B 3"], Float[np.ndarray, "... B 3"]]:
    """Twists of all bodies from the scaled ones of all but the ground."""
    full = np.zeros((*x.shape[:-1], len(link.bodies), 6))
    full[..., 1:, :] = x.reshape(*x.shape[:-1], -1, 6)
    return full[..., :3] * link.size, full[..., 3:]


def driven_rows(rows: Rows, rates: Float[np.ndarray, "T D"]) -> Float[np.ndarray, "T m"]:
    """Right-hand sides of the rows for rates of the drives."""
    out = np.zeros((len(rates), rows.count))
    driven = np.flatnonzero(rows.drive >= 0)
    out[:, driven] = rates[:, rows.drive[driven]]
    return out


def moved(poses: Poses, change: Twists) -> Poses:
    """Poses after small finite twists (v, θ)."""
    R, p = poses
    return rotation(change[1]) @ R, p + change[0]


def orthonormal(R: Float[np.ndarray, "... 3 3"]) -> Float[np.ndarray, "... 3 3"]:
    """The rotation next to a matrix that almost is one: Newton steps R (3 − Rᵀ R)/2 to it, one or two."""
    for _ in range(2):
        off = np.swapaxes(R, -1, -2) @ R - np.eye(3)
        R = R - 0.5 * (R @ off)
        if np.abs(off).max(initial=0.0) < NEARLY:
            break
    return np.asarray(R)


def closed(
    link: Linkage, poses: Poses, aim: Target, sweeps: int = 12
) -> tuple[Poses, Float[np.ndarray, " T"]]:
    """Newton: poses at which all rows vanish (redundant ones in the least squares), from poses close by.

    Parameters
    ----------
    poses : R (T, B, 3, 3), p (T, B, 3) first guess

    Returns
    -------
    poses, and (T,) the largest gap left, in units of size; infinite where Newton has not settled
    """
    step = np.full(len(aim), np.inf)
    for _ in range(sweeps):
        f = features(link.rows, poses, aim.near)
        try:
            change = factored(link, f).twists(-remainder(link.rows, f, aim))
        except np.linalg.LinAlgError:
            return poses, np.full(len(aim), np.inf)
        poses = moved(poses, change)
        step = stride(link, change)
        if (step <= SETTLED).all() or not (step < 1).any():
            break
    gap = gaps(link, poses, aim)
    return poses, np.where(step <= SETTLED, gap.max(axis=1, initial=0.0), np.inf)


def stride(link: Linkage, change: Twists) -> Float[np.ndarray, " T"]:
    """How far twists move the bodies: the farthest, in the linkage's size and radians."""
    v, theta = change
    return np.asarray(np.maximum(np.abs(v).max(axis=(1, 2)) / link.size, np.abs(theta).max(axis=(1, 2))))


def gaps(link: Linkage, poses: Poses, aim: Target) -> Float[np.ndarray, "T m"]:
    """How far rows are from zero, in units of size."""
    rest = remainder(link.rows, features(link.rows, poses, aim.near), aim)
    return np.asarray(np.abs(rest * link.rows.scale(link.size)[: link.rows.count]))


def derivatives(
    link: Linkage, poses: Poses, tau: Float[np.ndarray, " T"], aim: Target
) -> tuple[Twists, Twists, Factor | BlockFactor]:
    """First and second derivatives of the motion by τ, as twists: differentiated constraints."""
    _, q1, q2 = link.drives.at(tau)
    factor = factored(link, features(link.rows, poses, aim.near))
    first = factor.twists(driven_rows(link.rows, q1))
    second = factor.twists(driven_rows(link.rows, q2) - convective(link.rows, factor.f, first))
    return first, second, factor
