"""Sparse Cholesky of a link's constant effective matrix: the only wall to CHOLMOD (through cvxopt).

docs/performance.md says why this library.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from cvxopt import cholmod, matrix, sparse, spmatrix

from kedfem.arrays import Float, Int
from kedfem.errors import SolveError

MANY = 32  # right-hand sides solved at once
LARGE = 5000  # unknowns from which right-hand sides go in fours
PERMUTED = 7  # of CHOLMOD's systems: P b


@dataclass(frozen=True, slots=True)
class Triangle:
    """A factor L of P A Pᵀ = L Lᵀ, column by column, as `triangle_kernel` takes it.

    first : (blocks + 1,) first columns of blocks, whose columns have the same rows below the block
    below_at, below : (blocks + 1,), rows below each block
    at, L : (N + 1,), columns of the lower triangle, of which the first number, the diagonal's, is inverted
    place : (N,) which unknown each of the factor's is
    """

    first: Int[np.ndarray, " _"]
    below_at: Int[np.ndarray, " _"]
    below: Int[np.ndarray, " _"]
    at: Int[np.ndarray, " _"]
    L: Float[np.ndarray, " _"]
    place: Int[np.ndarray, " N"]


class Cholesky:
    """A = L Lᵀ of a symmetric positive definite matrix, kept for any number of solves.

    Parameters
    ----------
    A : (N, N) symmetric positive definite
    what : names the matrix in messages

    Raises
    ------
    SolveError
        If A is not positive definite.
    """

    def __init__(self, A: sp.csr_array, what: str) -> None:
        lower = sp.coo_array(sp.tril(A))
        rows, columns = (matrix(index.astype(np.int64)) for index in lower.coords)
        columnwise = spmatrix(matrix(lower.data), rows, columns, size=A.shape)
        cholmod.options["supernodal"] = 2
        self._factor = cholmod.symbolic(columnwise)
        try:
            cholmod.numeric(columnwise, self._factor)
        except ArithmeticError as err:
            raise SolveError(f"{what}: effective matrix must be positive definite, got a pivot ≤ 0 ({err})") from err
        self._column = matrix(0.0, (A.shape[0], 1))
        self._view = np.asarray(self._column)[:, 0]

    def solve(self, b: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
        """x with A x = b; the result is overwritten by the next solve."""
        self._view[:] = b
        cholmod.solve(self._factor, self._column)
        return self._view

    def solve_many(self, B: Float[np.ndarray, "N k"]) -> Float[np.ndarray, "N k"]:
        """X with A X = B; of large A in half the time of as many single solves, as sparse right-hand sides go in fours.

        Those of small A are solved one by one: stiff hubs of beams leave few digits, and single solves keep more.
        """
        out = np.empty(B.shape)
        for k in range(0, B.shape[1], MANY):
            block = matrix(np.asfortranarray(B[:, k : k + MANY]))
            if len(B) >= LARGE:
                block = matrix(cholmod.spsolve(self._factor, sparse(block)))
            else:
                cholmod.solve(self._factor, block)
            out[:, k : k + MANY] = np.asarray(block)
        return out

    def taken(self) -> Triangle:
        """The factor itself, with which compiled code solves; what it was taken from solves no more."""
        place = matrix(np.arange(len(self._view), dtype=float))
        cholmod.solve(self._factor, place, sys=PERMUTED)
        at, rows, L = (np.array(x).ravel() for x in cholmod.getfactor(self._factor).CCS)
        counts = np.diff(at)
        # a column's rows are among those of the column that its first row below the diagonal names
        follows = (counts[1:] == counts[:-1] - 1) & (
            rows[np.minimum(at[:-2] + 1, len(rows) - 1)] == np.arange(1, len(counts))
        )
        first = np.append(np.flatnonzero(np.append(True, ~follows)), len(counts))
        last = first[1:] - 1
        sizes = counts[last] - 1
        below = np.concatenate([np.zeros(0, int), *(rows[at[k] + 1 : at[k + 1]] for k in last)])
        L[at[:-1]] = 1 / L[at[:-1]]
        return Triangle(first, np.append(0, np.cumsum(sizes)), below, at, L, np.array(place).ravel().astype(int))
