"""Joints enforced by constraint equations at the first time point: C z = 0 differentiated, C z' = −C' z, C z'' = −2 C' z'
− C'' z."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import lsqr

from kedfem.arrays import Float
from kedfem.dynamics.joints.attachments import Attachment, interface_matrix
from kedfem.dynamics.joints.constraint_matrices import JointRows
from kedfem.dynamics.joints.ports import port_rotation, port_values
from kedfem.dynamics.matrices.interface import MANY, Tie
from kedfem.dynamics.stepping.state import LinkState, NodalOf

# differences of fourth and third order at the first of five instants
FIRST = np.array([-25, 48, -36, 16, -3]) / 12
SECOND = np.array([35, -104, 114, -56, 11]) / 12
INSTANTS = len(FIRST)
ROUNDING = 1e-15


@dataclass(frozen=True, slots=True)
class FirstRows:
    """Rows at the first time point: C, C', C'' (r, k), and which are springs."""

    rows: JointRows
    C: sp.csr_array
    C1: sp.csr_array
    C2: sp.csr_array

    def _hard(self, target: Float[np.ndarray, " r"], force: Float[np.ndarray, " k"]) -> Tie:
        hard = ~self.rows.soft
        return Tie(self.C[hard], np.zeros(int(hard.sum())), target[hard], force)

    def rate_tie(self, z: Float[np.ndarray, " k"], z1: Float[np.ndarray, " k"]) -> Tie:
        """Of changes of the rates that close the rows."""
        return self._hard(-self.C1 @ z - self.C @ z1, np.zeros(len(z)))

    def acceleration_tie(self, z: Float[np.ndarray, " k"], z1: Float[np.ndarray, " k"]) -> Tie:
        """Of accelerations; springs push as they are deflected."""
        e, e1 = self.C @ z, self.C1 @ z + self.C @ z1
        soft, of = self.rows.soft, self.rows
        push = -of.stiffness[soft] * e[soft] - of.damping[soft] * e1[soft]
        return self._hard(-2 * self.C1 @ z1 - self.C2 @ z, self.C[soft].T @ push)


def first_rows(rows: JointRows, h: float) -> FirstRows:
    """From rows at five instants, each h after the other [s]."""
    every = rows.entries[0], FIRST @ rows.entries / h, SECOND @ rows.entries / h**2
    return FirstRows(rows.part(0, 1), *(rows.matrix(entries) for entries in every))


def interface_values(joints: Sequence[Attachment], u: Sequence[NodalOf]) -> Float[np.ndarray, " k"]:
    """z from states with joints closed, world components: W u = B z."""
    w = np.concatenate([port_values(joint, x) for joint, x in zip(joints, u, strict=True)])
    B = interface_matrix(joints)
    if B.shape[1] > MANY:
        return np.asarray(lsqr(B, w, atol=ROUNDING, btol=ROUNDING, conlim=0.0)[0])
    return np.asarray(np.linalg.lstsq(B.toarray(), w, rcond=None)[0])


def interface_forces(joints: Sequence[Attachment], states: Sequence[LinkState]) -> Float[np.ndarray, " k"]:
    """Σ Bᵀ R λ: what rows exert."""
    each = [port_rotation(joint, s.R) @ s.port_forces for joint, s in zip(joints, states, strict=True)]
    return np.asarray(interface_matrix(joints).T @ np.concatenate(each))
