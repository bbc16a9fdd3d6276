"""Forces of all joints and drives of rigid links: Jᵀ λ balances the forces on the bodies, at many times at once.

Redundant equations leave part of λ undetermined: the least λ in scaled equations is taken, and `open_directions` shows
which components of a joint's force depend on that choice. λ is linear in the forces, with factors that depend on the
pose.
"""

from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Bool, Float, Int
from kedfem.motion.blocks import Blocks
from kedfem.motion.linkage import Linkage
from kedfem.motion.rigid import RigidMotion
from kedfem.motion.values import features, jacobian
from kedfem.vectors import cross


@dataclass(frozen=True, slots=True)
class Reactions:
    """Forces of rows on bodies at T times, with moments about the bodies' points at the linkage's centre.

    motion : the rigid motion
    each : (T, m, B − 1, 6) force and moment on each body of a unit of scaled λ, world components; without the ground
    Q, U : QR of the scaled rows J
    column : (k,) what the columns of J have been multiplied by
    """

    linkage: Linkage
    motion: RigidMotion
    each: Float[np.ndarray, "T m b 6"]
    Q: Float[np.ndarray, "T m k"]
    U: Float[np.ndarray, "T k k"]
    column: Float[np.ndarray, " k"]

    def on(self, joint: str, body: int, at: Float[np.ndarray, "3"]) -> Float[np.ndarray, "2 T m 3"]:
        """Force and moment that a joint, with its drive, exerts on a body, from scaled λ.

        Parameters
        ----------
        at : the body's point that the moment is about, in the reference position [m]
        """
        rows = rows_of(self.linkage, joint)
        out = np.zeros((2, *self.Q.shape[:2], 3))
        own = self.each[:, rows, body - 1]
        arm = (self.motion.R[:, body] @ (at - self.linkage.centre))[:, None]
        out[0][:, rows] = own[..., :3]
        out[1][:, rows] = own[..., 3:] - cross(arm, own[..., :3])
        return out

    def responses(self, A: Float[np.ndarray, "T m c"]) -> Float[np.ndarray, "T c k"]:
        """What is A λ of forces and moments on all bodies but the ground, with the least λ that balances them.

        Jᵀ λ = −(force, moment), λ = −Q U⁻ᵀ (force, moment).
        """
        at_rows = np.swapaxes(self.Q, 1, 2) @ A
        return np.asarray(-self.column * np.swapaxes(np.linalg.solve(self.U, at_rows), 1, 2))

    def open_directions(self, A: Float[np.ndarray, "T m c"]) -> tuple[Float[np.ndarray, "c c"], Float[np.ndarray, "c c"]]:
        """Along which directions A λ is open, and along which there is any at all.

        Returns
        -------
        Σ D Dᵀ and Σ A Aᵀ over the times, D being A on the null space of Jᵀ
        """
        D = A - self.Q @ (np.swapaxes(self.Q, 1, 2) @ A)
        return np.einsum("tmx,tmy->xy", D, D), np.einsum("tmx,tmy->xy", A, A)


@dataclass(frozen=True, slots=True)
class BlockReactions:
    """The same of a large linkage, entry by entry.

    values : (T, e, 6) entries of the scaled rows J
    column : (6,) what those of each body have been multiplied by
    """

    linkage: Linkage
    motion: RigidMotion
    blocks: Blocks
    values: Float[np.ndarray, "T e 6"]
    column: Float[np.ndarray, "6"]

    def on(self, joint: str, body: int, at: Float[np.ndarray, "3"]) -> Float[np.ndarray, "2 T m 3"]:
        """Force and moment that a joint, with its drive, exerts on a body, from scaled λ."""
        out = np.zeros((2, len(self.values), self.blocks.rows, 3))
        rows, own = self._own(joint, body, at)
        for k, row in enumerate(rows):
            out[:, :, row] += own[:, :, k]
        return out

    def multipliers(self, wrench: Float[np.ndarray, "T b 6"]) -> Float[np.ndarray, "T m"]:
        """The least scaled λ that balance forces and moments on all bodies but the ground."""
        return self.blocks.least_norm(self.values, -self.column * wrench)

    def joint_wrench(
        self, joint: str, body: int, at: Float[np.ndarray, "3"], multipliers: Float[np.ndarray, "T m"]
    ) -> Float[np.ndarray, "2 T 3"]:
        """Force and moment that a joint, with its drive, exerts on a body, from its multipliers."""
        rows, own = self._own(joint, body, at)
        return np.asarray(np.einsum("wtek,te->wtk", own, multipliers[:, rows]))

    def open_directions(self, A: Float[np.ndarray, "T m c"]) -> tuple[Float[np.ndarray, "c c"], Float[np.ndarray, "c c"]]:
        """Along which directions A λ is open, and along which there is any at all."""
        repeated = self.blocks.rows > 6 * self.blocks.count  # else rows hold every motion once
        D = self.blocks.left(self.values, A) if repeated else np.zeros_like(A)
        return np.einsum("tmx,tmy->xy", D, D), np.einsum("tmx,tmy->xy", A, A)

    def _own(
        self, joint: str, body: int, at: Float[np.ndarray, "3"]
    ) -> tuple[Int[np.ndarray, " e"], Float[np.ndarray, "2 T e 3"]]:
        """Rows of a joint with a share on a body, and force and moment there of their scaled λ."""
        blocks, rows = self.blocks, rows_of(self.linkage, joint)
        first, end = np.searchsorted(blocks.row, np.flatnonzero(rows)[[0, -1]] + [0, 1])
        here = first + np.flatnonzero(blocks.body[first:end] == blocks.place[body - 1])
        here = here[rows[blocks.row[here]]]
        own = self.values[:, here] / self.column
        arm = (self.motion.R[:, body] @ (at - self.linkage.centre))[:, None]
        force = own[..., :3]
        return blocks.row[here], np.stack([force, own[..., 3:] - cross(arm, force)])


def effort(linkage: Linkage, drive: int) -> Float[np.ndarray, " m"]:
    """Torque of a drive on a hinge, or force of that on a slide, from scaled λ: its row is the joint's coordinate."""
    rows = linkage.rows
    return np.where(rows.drive == drive, rows.scale(linkage.size)[: rows.count], 0.0)


def rows_of(linkage: Linkage, joint: str) -> Bool[np.ndarray, " m"]:
    """The rows of a joint."""
    return np.array([name == joint for name in linkage.joints], bool)


def reactions(linkage: Linkage, motion: RigidMotion) -> Reactions | BlockReactions:
    """Forces of all joints and drives on the bodies at the times of a motion."""
    bodies, c = len(linkage.bodies), linkage.centre
    poses = (motion.R, motion.p + motion.R @ c - c)
    f = features(linkage.rows, poses)
    each = np.repeat([linkage.size, 1.0], 3)
    if linkage.blocks is not None:
        values = linkage.blocks.values(linkage.rows, f, linkage.size)
        return BlockReactions(linkage, motion, linkage.blocks, values, each)
    J = jacobian(linkage.rows, f, bodies, linkage.size)
    column = np.tile(each, bodies - 1)
    Q, U = np.linalg.qr(J)
    return Reactions(linkage, motion, (J / column).reshape(*J.shape[:2], -1, 6), Q, U, column)
