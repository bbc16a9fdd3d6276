"""Poses that close all joints, and their derivatives by the path's parameter, at many values of it at once."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from kedfem.arrays import Bool, Float, Inexact, Int
from kedfem.motion.blocks import Blocks
from kedfem.motion.constraints import Rows
from kedfem.motion.linkage import Linkage
from kedfem.motion.values import Features, Poses, Twists, features, jacobian, residuals

SETTLED = 1e-9  # a Newton step, of the linkage's size [-, rad], after which the next one is rounding
NEARLY = 1e-8  # deviation from a rotation that one step reduces to rounding
I3 = np.eye(3)
TINY = 1e-100  # rad: sin x / x is 1 there
OPEN = 1e-6  # of the size: tolerated gaps of joints of a redundant linkage, far below any bearing's clearance


def rotation(theta: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3 3"]:
    """exp([θ]×), Rodrigues' formula, for stacks of rotation vectors [rad]."""
    angle = np.sqrt(np.einsum("...k,...k->...", theta, theta))[..., None, None]
    angle, W = np.maximum(angle, TINY), cross_matrix(theta)
    return np.asarray(I3 + np.sin(angle) / angle * W + 2 * (np.sin(angle / 2) / angle) ** 2 * (W @ W))


def cross_matrix(w: Inexact[np.ndarray, "... 3"]) -> Inexact[np.ndarray, "... 3 3"]:
    """[w]×, so that [w]× x = w × x."""
    out = np.zeros((*w.shape, 3), np.result_type(w, float))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -w[..., 2], w[..., 1], -w[..., 0]
    return out - np.swapaxes(out, -1, -2)


@dataclass(frozen=True, slots=True)
class Target:
    """The required values of the rows at T time points.

    q : (T, D) values of the drives [rad or m]
    near : (T, A) angles of the angle rows, to within half a revolution [rad]
    over : (T, m) change of the rows over whole periods of the path, to be added; None: zero
    """

    q: Float[np.ndarray, "T D"]
    near: Float[np.ndarray, "T A"]
    over: Float[np.ndarray, "T m"] | None = None

    def __len__(self) -> int:
        return len(self.q)

    def at(self, which: slice | Bool[np.ndarray, " T"]) -> "Target":
        """Some of the time points."""
        return Target(self.q[which], self.near[which], None if self.over is None else self.over[which])


def constraint_values(rows: Rows, f: Features, aim: Target) -> Float[np.ndarray, "T m"]:
    """Values of the constraints."""
    rest = residuals(rows, f, aim.q)
    return rest if aim.over is None else rest + aim.over


def target(link: Linkage, tau: Float[np.ndarray, " T"], near: Float[np.ndarray, "T A"]) -> Target:
    """The drives' values at τ, which are the angles of their own rows; those of other rows are near given ones."""
    q, rows = link.drives.at(tau)[0], link.rows
    near = near.copy()
    for k, row in enumerate(rows.angles):
        if row < rows.count and rows.drive[row] >= 0:
            near[:, k] = q[:, rows.drive[row]]
    return Target(q, near)


class Factor:
    """The scaled rows J at T poses, with their QR for least squares if there are more rows than unknowns."""

    def __init__(self, link: Linkage, f: Features, rows: Rows | None = None) -> None:
        self.f = f
        self.J = self.U = jacobian(rows or link.rows, f, len(link.bodies), link.size)
        self.Q = None
        if self.J.shape[1] > self.J.shape[2]:
            self.Q, self.U = np.linalg.qr(self.J)

    def solve(self, rhs: Float[np.ndarray, "T m c"]) -> Float[np.ndarray, "T k c"]:
        """x of the least squares of J x − rhs."""
        return np.linalg.solve(self.U, rhs if self.Q is None else np.swapaxes(self.Q, 1, 2) @ rhs)

    def left(self, rhs: Float[np.ndarray, "T m c"]) -> Float[np.ndarray, "T m c"]:
        """Residual of the least squares of J x − rhs: the part of rhs in the null space of Jᵀ."""
        return np.zeros_like(rhs) if self.Q is None else np.asarray(rhs - self.Q @ (np.swapaxes(self.Q, 1, 2) @ rhs))

    def least_norm(self, rhs: Float[np.ndarray, "T b 6"]) -> Float[np.ndarray, "T m"]:
        """The y of least norm with Jᵀ y = rhs."""
        y = np.linalg.solve(np.swapaxes(self.U, 1, 2), rhs.reshape(len(rhs), -1, 1))
        return np.asarray((y if self.Q is None else self.Q @ y)[..., 0])

    def extremes(self) -> Float[np.ndarray, "T 2"]:
        """Greatest and least singular value of the scaled rows; the latter is 0 at a dead point."""
        if not self.U.shape[-1]:
            return np.ones((len(self.U), 2))
        return np.asarray(np.linalg.svd(self.U, compute_uv=False)[:, [0, -1]])

    def of_body(self, body: int) -> tuple[Int[np.ndarray, " r"], Float[np.ndarray, "T r 6"]]:
        """Rows that may have entries for a body other than the ground, and these entries."""
        return np.arange(self.J.shape[1]), self.J[:, :, 6 * body - 6 : 6 * body]


class BlockFactor:
    """`Factor` of a large linkage, with sparse rows."""

    def __init__(self, link: Linkage, f: Features, blocks: Blocks) -> None:
        self.f, self.blocks = f, blocks
        self.J = blocks.values(link.rows, f, link.size)

    def solve(self, rhs: Float[np.ndarray, "T m c"]) -> Float[np.ndarray, "T k c"]:
        """x of the least squares of J x − rhs."""
        return self.blocks.least_squares(self.J, rhs)

    def left(self, rhs: Float[np.ndarray, "T m c"]) -> Float[np.ndarray, "T m c"]:
        """Residual of the least squares of J x − rhs; zero without redundant rows."""
        return self.blocks.left(self.J, rhs) if self.blocks.rows > 6 * self.blocks.count else np.zeros_like(rhs)

    def least_norm(self, rhs: Float[np.ndarray, "T b 6"]) -> Float[np.ndarray, "T m"]:
        """The y of least norm with Jᵀ y = rhs."""
        return self.blocks.least_norm(self.J, rhs)

    def extremes(self) -> Float[np.ndarray, "T 2"]:
        """Greatest and least singular value of the scaled rows; the latter is 0 at a dead point."""
        return self.blocks.extremes(self.J)

    def of_body(self, body: int) -> tuple[Int[np.ndarray, " r"], Float[np.ndarray, "T r 6"]]:
        """Rows that have entries for a body other than the ground, and these entries; a row may occur twice."""
        here = np.flatnonzero(self.blocks.plan.body == self.blocks.place[body - 1])
        return self.blocks.row[here], self.J[:, here]


def factored(link: Linkage, f: Features, rows: Rows | None = None) -> Factor | BlockFactor:
    """The factored rows at T poses: all of them, or some of a small linkage."""
    return Factor(link, f, rows) if link.blocks is None else BlockFactor(link, f, link.blocks)


def same_branch(link: Linkage, J: Float[np.ndarray, "T ..."]) -> Bool[np.ndarray, " I"]:
    """Whether successive poses are on the same assembly branch, without a singular position between: det J₁ᵀ J₂ > 0."""
    if link.blocks is not None:
        return np.array([link.blocks.agree(*pair) for pair in pairwise(J)])
    return np.asarray(np.linalg.slogdet(np.swapaxes(J[:-1], 1, 2) @ J[1:])[0] > 0)


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
    out[:, rows.driven] = rates[:, rows.drive[rows.driven]]
    return out


def moved(poses: Poses, change: Twists) -> Poses:
    """Poses after small finite twists (v, θ)."""
    R, p = poses
    return rotation(change[1]) @ R, p + change[0]


def orthonormal(R: Float[np.ndarray, "... 3 3"]) -> Float[np.ndarray, "... 3 3"]:
    """The rotation nearest to a matrix close to one, by Newton steps R (3 − Rᵀ R)/2."""
    for _ in range(5):
        off = np.swapaxes(R, -1, -2) @ R - I3
        R = R - 0.5 * (R @ np.clip(off, -1.0, 1.0))  # bounds the step far from a rotation
        if np.abs(off).max(initial=0.0) < NEARLY:
            break
    return np.asarray(R)


def corrected(link: Linkage, poses: Poses, aim: Target, iterations: int) -> Poses:
    """Poses after at most so many Newton steps towards those at which all rows are zero."""
    for _ in range(iterations):
        f = features(link.rows, poses, aim.near)
        rest = scaled(link, link.rows, constraint_values(link.rows, f, aim))
        try:
            change = twists(link, factored(link, f).solve(-rest[..., None])[..., 0])
        except np.linalg.LinAlgError:
            return poses
        poses, step = moved(poses, change), step_size(link, change)
        if (step <= SETTLED).all() or not (step < 1).any():
            break
    return poses


def step_size(link: Linkage, change: Twists) -> Float[np.ndarray, " T"]:
    """Largest displacement or rotation of the bodies by twists, in units of size and radians."""
    v, theta = change
    return np.asarray(np.maximum(np.abs(v).max(axis=(1, 2)) / link.size, np.abs(theta).max(axis=(1, 2))))


def scaled(link: Linkage, rows: Rows, values: Float[np.ndarray, "T m"]) -> Float[np.ndarray, "T m"]:
    """Values of rows in units of size."""
    return np.asarray(values * rows.scale(link.size)[: rows.count])
