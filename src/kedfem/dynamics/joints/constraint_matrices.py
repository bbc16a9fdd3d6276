"""Constraint matrices C(t) of joints over time, from the rigid-body motion."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float, Int
from kedfem.dynamics.joints.constraint_joints import ConstraintJoint
from kedfem.dynamics.system.ends import end_on
from kedfem.dynamics.system.forces.poses import forces_in_place
from kedfem.dynamics.system.forces.supports import exerted
from kedfem.dynamics.system.record import Spring
from kedfem.motion.rigid import RigidMotion

REPEATED = 1e-10  # of a row on ports: what is left on the interface unknowns if other joints constrain the same


@dataclass(frozen=True, slots=True)
class ConstraintMatrices:
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


def constraint_matrices(joints: Sequence[ConstraintJoint], motion: RigidMotion, unknowns: int) -> ConstraintMatrices:
    """Rows of all joints, on so many interface unknowns, at the times of a motion."""
    none, T = np.zeros(0, int), len(motion.t)
    every = [(joint, _columns(joint)) for joint in joints]
    width = [none, *(np.full(len(joint.constraints), len(columns)) for joint, columns in every)]
    entries = [gradients_over_time(joint, motion, columns).reshape(T, -1) for joint, columns in every]
    columns = np.concatenate([none, *(np.tile(columns, len(joint.constraints)) for joint, columns in every)])
    laws = [each.law for joint in joints for each in joint.constraints]
    stiffness = np.array([law.stiffness if isinstance(law, Spring) else np.inf for law in laws], float)
    row_at = np.append(0, np.cumsum(np.concatenate(width)))
    return ConstraintMatrices(np.concatenate([np.zeros((T, 0)), *entries], axis=1), row_at, columns, unknowns, stiffness)


def gradients_over_time(
    joint: ConstraintJoint, motion: RigidMotion, columns: Int[np.ndarray, " c"]
) -> Float[np.ndarray, "T r c"]:
    """Gradients of a joint's constraints, with those that they are combined with, on the interface unknowns given."""
    T, r = len(motion.t), len(joint.constraints)
    C, size = np.zeros((T, r, len(columns))), np.zeros((T, r))
    for share, each in ((1.0, joint), *joint.plus):
        ends, pushed = (end_on(each, 0, each.at), end_on(each, 1, each.at)), np.zeros((2, 2, T, r, 3))
        for n, constraint in enumerate(each.constraints):
            for term in constraint.terms:
                sides = term.i, term.j
                acting = exerted(term, (ends[term.i], ends[term.j]), motion, None)
                for side, (_, _, force, moment) in zip(sides, acting, strict=True):
                    pushed[side, :, :, n] += share * term.factor * force, share * term.factor * moment
        for end, (force, moment) in zip(ends, pushed, strict=True):
            if len(end.columns):
                y = forces_in_place(end, motion, force, moment)
                C[:, :, np.searchsorted(columns, end.columns)] += np.tensordot(y, end.onto, 2)
                size += (y**2).sum(axis=(2, 3))
    C[np.linalg.norm(C, axis=2) < REPEATED * np.sqrt(size)] = 0.0
    return C


def _columns(joint: ConstraintJoint) -> Int[np.ndarray, " c"]:
    """Interface unknowns that a joint's rows touch."""
    return np.unique(np.concatenate([side.columns for side in joint.all_sides]))
