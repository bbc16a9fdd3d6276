"""Rows of joints over time: C(t) from the rigid motion, and what one time point needs of it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float, Int
from kedfem.dynamics.joints.constraint_joints import ConstraintJoint, Side
from kedfem.motion.constraints import cross
from kedfem.motion.rigid import RigidMotion

REPEATED = 1e-10  # of a row on ports: what is left on the interface unknowns if other joints hold the same already


@dataclass(frozen=True, slots=True)
class JointRows:
    """Rows e = C z of all joints at T time points, z the interface unknowns.

    entries : (T, n) of C, row by row [-, 1/m]
    row_at, columns : (r + 1,) where each row's begin, and (n,) the unknown of each
    unknowns : k of all z
    stiffness : (r,) of rows that are springs, infinite of those that hold, e = 0
    """

    entries: Float[np.ndarray, "T n"]
    row_at: Int[np.ndarray, " _"]
    columns: Int[np.ndarray, " n"]
    unknowns: int
    stiffness: Float[np.ndarray, " r"]

    def at(self, k: int) -> sp.csr_array:
        """C (r, k) at one time point."""
        return sp.csr_array((self.entries[k], self.columns, self.row_at), (len(self.stiffness), self.unknowns))


Directions = tuple[Float[np.ndarray, "T 3"], Float[np.ndarray, "T r 3"], Float[np.ndarray, "T r 3"]]
"""Where a joint's point is on link i [m], and the gap and turn of its rows, at T time points, world axes."""


def joint_rows(joints: Sequence[ConstraintJoint], motion: RigidMotion, unknowns: int) -> JointRows | None:
    """Rows of all joints, on so many interface unknowns, at the times of a motion; None without any."""
    if not joints:
        return None
    every = [(joint, _columns(joint)) for joint in joints]
    width = np.concatenate([np.full(len(joint.gap), len(columns)) for joint, columns in every])
    entries = [rows_over(joint, motion, x).reshape(len(motion.t), -1) for joint, x in every]
    columns = np.concatenate([np.tile(x, len(joint.gap)) for joint, x in every])
    stiffness = np.concatenate([joint.stiffness for joint in joints])
    return JointRows(np.concatenate(entries, axis=1), np.append(0, np.cumsum(width)), columns, unknowns, stiffness)


def rows_over(joint: ConstraintJoint, motion: RigidMotion, columns: Int[np.ndarray, " c"]) -> Float[np.ndarray, "T r c"]:
    """Rows of one joint, gap · (u_i − u_j) + turn · (θ_i − θ_j), on the interface unknowns given: all that it touches."""
    C = np.zeros((len(motion.t), len(joint.gap), len(columns)))
    shares = port_rows(joint, motion)
    for side, on in shares:
        C[:, :, np.searchsorted(columns, side.columns)] += np.tensordot(on, side.onto, ((2, 3), (0, 1)))
    size = np.sqrt(sum((on**2).sum(axis=(2, 3)) for _, on in shares))
    C[np.linalg.norm(C, axis=2) < REPEATED * size] = 0.0
    return C


def _columns(joint: ConstraintJoint) -> Int[np.ndarray, " c"]:
    """Interface unknowns that a joint's rows touch."""
    return np.unique(np.concatenate([side.columns for side in joint.all_sides]))


def port_rows(joint: ConstraintJoint, motion: RigidMotion) -> list[tuple[Side, Float[np.ndarray, "T r _ _"]]]:
    """Rows of one joint on the displacements at the ports of each of its sides that has any, world components."""
    along = directions(joint, motion)
    own = [
        (side, sign * _side_rows(side, joint, along, motion))
        for side, sign in zip(joint.sides, (1.0, -1.0), strict=True)
        if side is not None
    ]
    others = [(side, c * rows) for c, other in joint.plus for side, rows in port_rows(other, motion)]
    return own + others


def directions(joint: ConstraintJoint, motion: RigidMotion) -> Directions:
    """Where a joint is and what its rows are along: fixed in link j, but for a universal joint's last."""
    i, j = joint.bodies
    R = motion.R[:, j].transpose(0, 2, 1)
    gap, turn = joint.gap @ R, joint.turn @ R
    if joint.cross is not None:
        a, b = motion.R[:, i] @ joint.cross[0], motion.R[:, j] @ joint.cross[1]
        turn[:, -1] = cross(a, b)
    return motion.p[:, i] + motion.R[:, i] @ joint.at, gap, turn


def travel(joint: ConstraintJoint, motion: RigidMotion) -> Float[np.ndarray, " T"]:
    """How far a joint's point on link i has gone along the axis fixed in link j [m]."""
    return np.asarray(seen_from(motion, joint.bodies, joint.at) @ joint.axis)


def seen_from(motion: RigidMotion, bodies: tuple[int, int], at: Float[np.ndarray, "3"]) -> Float[np.ndarray, "T 3"]:
    """Where a point of body i is in the frame of body j, from where both are drawn (T, 3) [m]."""
    i, j = bodies
    point = motion.p[:, i] + motion.R[:, i] @ at
    return np.asarray(((point - motion.p[:, j])[:, None] @ motion.R[:, j])[:, 0] - at)


def _side_rows(
    side: Side, joint: ConstraintJoint, along: Directions, motion: RigidMotion
) -> Float[np.ndarray, "T r p d"]:
    """gap · u + turn · θ of one link at the joint's point: with r from the coupling surface, gap · u₀ + (r × gap + turn)
    · θ."""
    d, R, (point, gap, turn) = side.onto.shape[1], motion.R[:, side.body], along
    if side.stations is not None:
        N = side.stations.at(travel(joint, motion))
        c = np.einsum("tp,trb,pba->trpa", N, gap @ R, side.surface[:, :3])
    else:
        origin = motion.p[:, side.body] + R @ side.points[0]
        r = (point - origin)[:, None]
        on = np.concatenate([gap @ R, (cross(r, gap) + turn) @ R], axis=2)
        c = np.einsum("trb,pba->trpa", on, side.surface)
    return np.asarray(c @ R[:, None, :d, :d].transpose(0, 1, 3, 2))
