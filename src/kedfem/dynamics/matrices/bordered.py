"""One sparse factor of unknowns, constraints and force laws: H z = f + Cᵀ m, C z + m / κ = target."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from kedfem.arrays import Float, Int
from kedfem.dynamics.matrices.cholesky import Cholesky
from kedfem.errors import SolveError

DEPENDENT = 1e-9  # what is left of a constraint of unit size where others constrain the same
INDEPENDENT = 1e-10  # least eigenvalue of products of constraints of unit size: above, none repeats others
MANY = 100  # constraints from which that is asked first: a dense decomposition takes the time of their cube

Flat = Float[np.ndarray, " _"]


@dataclass(frozen=True, slots=True)
class ConstraintTerms:
    """What constraints and laws ask of one solution.

    C : (r, k) gradients by interface unknowns
    target : (r,) of C z; compliance : (r,) 1/κ, zero of constraints
    known : (k,) forces on the interface
    """

    C: Any
    target: Flat
    compliance: Flat
    known: Flat


class Bordered:
    """H with constraints and laws, factored; constraints that repeat others get no force.

    Parameters
    ----------
    H : (k, k), of the unknowns
    C : (r, k)
    compliance : (r,) 1/κ, zero of constraints

    Raises
    ------
    SolveError
        If both together leave a motion free.
    """

    def __init__(self, H: Any, C: sp.csr_array, compliance: Flat) -> None:
        self.kept, self.count = independent_rows(C, compliance), len(compliance)
        rows = C[self.kept]
        usual = np.abs(H.diagonal()).mean() if rows.shape[1] else 1.0
        size = row_sizes(rows)
        self.scale = usual / np.where(size > 0, size, 1.0)  # so that both parts are about as large
        rows = sp.diags_array(self.scale) @ rows
        diagonal = sp.diags_array(self.scale**2 * compliance[self.kept])
        # otherwise laid out, other digits are left beside stiff links: a rigid arm's start was not found
        self.matrix = sp.csc_array(sp.block_array([[H, -rows.T], [rows, diagonal]]))
        if not self.matrix.shape[0]:
            return
        try:
            self.factor = splu(self.matrix)
        except RuntimeError as error:
            raise SolveError(
                "joints: bodies must be constrained by joints or springs, got some that move freely"
            ) from error

    def solved(self, f: Flat, target: Flat, closes: bool = False) -> tuple[Flat, Flat]:
        """z and m, refined once.

        Parameters
        ----------
        closes : whether what constraints leave is mended alone: what forces leave is rounding where H is far stiffer
            along some unknowns than along others, and differs from one right-hand side to the next
        """
        right, m = np.concatenate([f, self.scale * target[self.kept]]), np.zeros(self.count)
        if len(right):
            found = self.factor.solve(right)
            left = right - self.matrix @ found
            left[: len(f) if closes else 0] = 0.0
            right = found + self.factor.solve(left)
        m[self.kept] = self.scale * right[len(f) :]
        return right[: len(f)], m


def independent_rows(C: sp.csr_array, compliance: Flat) -> Int[np.ndarray, " q"]:
    """Numbers of laws, and of constraints that do not repeat others."""
    size = row_sizes(C)
    hard = np.flatnonzero((compliance == 0.0) & (size > DEPENDENT))
    soft = np.flatnonzero(compliance != 0.0)
    unit = sp.csr_array((C.data / np.where(size > 0, size, 1.0)[row_of(C)], C.indices, C.indptr), C.shape)[hard]
    if len(hard) and not _independent(unit):
        _, upper, order = scipy.linalg.qr(unit.T.toarray(), mode="economic", pivoting=True)
        hard = hard[order[: int((np.abs(np.diag(upper)) > DEPENDENT).sum())]]
    return np.sort(np.concatenate([hard, soft]))


def row_sizes(C: sp.csr_array) -> Flat:
    """Length of each row."""
    return np.asarray(np.sqrt(np.bincount(row_of(C), C.data**2, C.shape[0])))


def row_of(C: sp.csr_array) -> Int[np.ndarray, " e"]:
    """The row of each entry."""
    return np.repeat(np.arange(C.shape[0]), np.diff(C.indptr))


def _independent(unit: sp.csr_array) -> bool:
    """Whether many rows of length one are surely independent, by a sparse factor of their products."""
    if unit.shape[0] < MANY:
        return False
    try:
        Cholesky(sp.csr_array(unit @ unit.T - INDEPENDENT * sp.eye_array(unit.shape[0])), "constraints")
    except SolveError:
        return False
    return True
