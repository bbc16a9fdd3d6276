"""Sparse Cholesky of a link's constant effective matrix: the only wall to CHOLMOD (through cvxopt).

docs/performance.md says why this library.
"""

import numpy as np
import scipy.sparse as sp
from cvxopt import cholmod, matrix, sparse, spmatrix
from jaxtyping import Float

from kedfem.errors import SolveError

MANY = 32  # right-hand sides solved at once
LARGE = 5000  # unknowns from which right-hand sides go in fours


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
            raise SolveError(
                f"{what}: effective matrix must be positive definite, got a pivot ≤ 0 ({err})"
            ) from err
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
