"""Sparse Cholesky of a link's constant effective matrix: the only wall to CHOLMOD (through cvxopt).

docs/performance.md says why this library.
"""

import ctypes
from contextlib import nullcontext
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from cvxopt import cholmod, matrix, sparse, spmatrix

from kedfem.arrays import Float, Int
from kedfem.dynamics.matrices.dissection import dissected
from kedfem.errors import SolveError
from kedfem.mesh.memory_forecast import free_memory, unknowns_that_fit
from kedfem.processes import ended_at_once

MANY = 32  # right-hand sides solved at once
LARGE = 5000  # unknowns from which right-hand sides go in fours
SLOW = 20_000  # unknowns from which factoring may take a second, during which Python hears of no interruption
SLOW_SOLVES = 100_000  # unknowns from which so many right-hand sides as go at once take seconds
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


def laid_out(factor: object, N: int) -> float:
    """Bytes of the numbers of a supernodal factor, from the record that CHOLMOD's symbolic analysis leaves.

    Its words: N, a column, two arrays, ..., at 15 the count of all numbers. 0 where it is not that record.
    """
    pointer, name = ctypes.pythonapi.PyCapsule_GetPointer, ctypes.pythonapi.PyCapsule_GetName
    pointer.restype, pointer.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    name.restype, name.argtypes = ctypes.c_char_p, [ctypes.py_object]
    words = (ctypes.c_size_t * 16).from_address(pointer(factor, name(factor)))
    return 8.0 * words[15] if words[0] == words[1] == N and N <= words[15] <= N * (N + 1) else 0.0


def _check_room(what: str, N: int, factor: float) -> None:
    if N >= SLOW and factor > (free := free_memory()):
        fits = unknowns_that_fit(N, factor, free)
        raise SolveError(
            f"{what}: must have a factor that fits in the free memory of {free / 1e9:.3g} GB, got {N:,} unknowns, whose "
            f"factor takes {factor / 1e9:.3g} GB; take larger elements: about {fits:,.0f} unknowns would fit"
        )


class Cholesky:
    """A = L Lᵀ of a symmetric positive definite matrix, kept for any number of solves.

    Parameters
    ----------
    A : (N, N) symmetric positive definite
    what : names the matrix in messages
    X : (n, 3) nodes of a solid [m], whose unknowns follow each other in A. Of a large and thick one their order by nested
        dissection is offered to CHOLMOD, which takes it where the factor has less fill than by minimum degree.

    Raises
    ------
    SolveError
        If A is not positive definite, or its factor does not fit in the free memory.
    """

    def __init__(self, A: sp.csr_array, what: str, X: Float[np.ndarray, "n 3"] | None = None) -> None:
        lower = sp.coo_array(sp.tril(A))
        rows, columns = (matrix(index.astype(np.int64)) for index in lower.coords)
        columnwise = spmatrix(matrix(lower.data), rows, columns, size=A.shape)
        cholmod.options["supernodal"] = 2
        slow = A.shape[0] >= SLOW
        order = dissected(A, X) if slow and X is not None else None
        offered = {} if order is None else {"p": matrix(order)}
        try:
            with ended_at_once("interrupted while a large matrix was factored") if slow else nullcontext():
                self.factor = cholmod.symbolic(columnwise, **offered)
                _check_room(what, A.shape[0], laid_out(self.factor, A.shape[0]))
                cholmod.numeric(columnwise, self.factor)
        except ArithmeticError as err:
            raise SolveError(f"{what}: effective matrix must be positive definite, got a pivot ≤ 0 ({err})") from err
        self._column = matrix(0.0, (A.shape[0], 1))
        self._view = np.asarray(self._column)[:, 0]

    def solve(self, b: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
        """x with A x = b; the result is overwritten by the next solve."""
        self._view[:] = b
        cholmod.solve(self.factor, self._column)
        return self._view

    def solve_many(self, B: Float[np.ndarray, "N k"]) -> Float[np.ndarray, "N k"]:
        """X with A X = B; of large A in half the time of as many single solves, as sparse right-hand sides go in fours.

        Those of small A are solved one by one: rigid nodes of beams leave few digits, and single solves keep more.
        """
        out = np.empty(B.shape)
        many = MANY if len(B) < SLOW_SOLVES else 4
        for k in range(0, B.shape[1], many):
            block = matrix(np.asfortranarray(B[:, k : k + many]))
            if len(B) >= LARGE:
                block = matrix(cholmod.spsolve(self.factor, sparse(block)))
            else:
                cholmod.solve(self.factor, block)
            out[:, k : k + many] = np.asarray(block)
        return out

    def taken(self) -> Triangle:
        """The factor itself, with which compiled code solves; what it was taken from solves no more."""
        place = matrix(np.arange(len(self._view), dtype=float))
        cholmod.solve(self.factor, place, sys=PERMUTED)
        at, rows, L = (np.array(x).ravel() for x in cholmod.getfactor(self.factor).CCS)
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
