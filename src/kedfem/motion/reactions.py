"""Forces of all joints and drives of rigid links: Jᵀ λ balances the forces on the bodies, at many times at once.

With redundant equations part of λ is indeterminate: it is the λ of least norm in scaled equations, and `open_directions`
gives the components of a joint's force that depend on that choice. λ is linear in the forces, with factors that depend on
the pose.
"""

from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Bool, Float, Int
from kedfem.motion.linkage import Linkage
from kedfem.motion.newton import BlockFactor, Factor, factored
from kedfem.motion.rigid import RigidMotion
from kedfem.motion.values import features
from kedfem.vectors import cross


@dataclass(frozen=True, slots=True)
class Reactions:
    """Forces of rows on bodies at T times, with moments about the bodies' points at the linkage's centre.

    motion : the rigid motion
    factor : the scaled rows J at its poses
    column : (6,) factors by which their entries for each body are scaled
    """

    linkage: Linkage
    motion: RigidMotion
    factor: Factor | BlockFactor
    column: Float[np.ndarray, "6"]

    def on(self, joint: str, body: int, at: Float[np.ndarray, "3"]) -> Float[np.ndarray, "2 T m 3"]:
        """Force and moment that a joint, with its drive, exerts on a body, from scaled λ.

        Parameters
        ----------
        at : the body's point that the moment is about, in the reference position [m]
        """
        rows, own = self._own(joint, body, at)
        out = np.zeros((*own.shape[:2], self.linkage.rows.count, 3))
        for k, row in enumerate(rows):
            out[:, :, row] += own[:, :, k]
        return out

    def multipliers(self, wrench: Float[np.ndarray, "T b 6"]) -> Float[np.ndarray, "T m"]:
        """The scaled λ of least norm that balance forces and moments on all moving bodies: Jᵀ λ = −(force, moment)."""
        return self.factor.least_norm(-self.column * wrench)

    def joint_wrench(
        self, joint: str, body: int, at: Float[np.ndarray, "3"], multipliers: Float[np.ndarray, "T m"]
    ) -> Float[np.ndarray, "2 T 3"]:
        """Force and moment that a joint, with its drive, exerts on a body, from its multipliers."""
        rows, own = self._own(joint, body, at)
        return np.asarray(np.einsum("wtek,te->wtk", own, multipliers[:, rows]))

    def responses(self, A: Float[np.ndarray, "T m c"]) -> Float[np.ndarray, "T c k"]:
        """A λ as a linear function of forces and moments on all moving bodies, λ of least norm."""
        x = np.swapaxes(self.factor.solve(A), 1, 2)
        return np.asarray(-np.tile(self.column, x.shape[2] // 6) * x)

    def open_directions(self, A: Float[np.ndarray, "T m c"]) -> tuple[Float[np.ndarray, "c c"], Float[np.ndarray, "c c"]]:
        """Directions in which A λ is indeterminate, and directions of all A λ.

        Returns
        -------
        Σ D Dᵀ and Σ A Aᵀ over the times, D being A on the null space of Jᵀ
        """
        D = self.factor.left(A)
        return np.einsum("tmx,tmy->xy", D, D), np.einsum("tmx,tmy->xy", A, A)

    def _own(
        self, joint: str, body: int, at: Float[np.ndarray, "3"]
    ) -> tuple[Int[np.ndarray, " e"], Float[np.ndarray, "2 T e 3"]]:
        """Rows of a joint with a share on a body, and force and moment there of their scaled λ."""
        rows, entries = self.factor.of_body(body)
        here = rows_of(self.linkage, joint)[rows]
        own = entries[:, here] / self.column
        arm = (self.motion.R[:, body] @ (at - self.linkage.centre))[:, None]
        return rows[here], np.stack([own[..., :3], own[..., 3:] - cross(arm, own[..., :3])])


def effort(linkage: Linkage, drive: int) -> Float[np.ndarray, " m"]:
    """Torque of a drive on a hinge, or force of that on a slide, from scaled λ: its row is the joint's coordinate."""
    rows = linkage.rows
    return np.where(rows.drive == drive, rows.scale(linkage.size)[: rows.count], 0.0)


def rows_of(linkage: Linkage, joint: str) -> Bool[np.ndarray, " m"]:
    """The rows of a joint."""
    return np.array([name == joint for name in linkage.joints], bool)


def reactions(linkage: Linkage, motion: RigidMotion) -> Reactions:
    """Forces of all joints and drives on the bodies at the times of a motion."""
    c = linkage.centre
    f = features(linkage.rows, (motion.R, motion.p + motion.R @ c - c))
    return Reactions(linkage, motion, factored(linkage, f), np.repeat([linkage.size, 1.0], 3))
