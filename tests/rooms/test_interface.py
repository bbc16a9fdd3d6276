"""The joints' common system: dense or sparse, rows that hold, springs, and rows that repeat others."""

import numpy as np
import pytest
import scipy.sparse as sp

from kedfem.dynamics.matrices.bordered import MANY, Asked, independent_rows
from kedfem.dynamics.matrices.interface import solver


def chain(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness of n unknowns in a row, of very different springs, and loads."""
    random = np.random.default_rng(3)
    springs = 10.0 ** random.uniform(3, 8, n)
    H = np.diag(springs + np.append(springs[1:], 0.0)) - np.diag(springs[1:], 1) - np.diag(springs[1:], -1)
    return H, random.standard_normal(n)


def tie(n: int) -> Asked:
    """Rows that hold neighbours together, one of them twice, one that moves by a given amount, and a spring."""
    C = np.zeros((5, n))
    for row, (i, j) in enumerate(((1, 2), (7, 5), (1, 2), (10, 4), (3, 9))):
        C[row, i], C[row, j] = 1.0, -0.7
    C[2] *= -2.0
    return Asked(C, np.array([0, 0, 0, 1e-4, 0]), np.array([0, 0, 0, 0, 1e-5]), np.linspace(0, 1, n))


def test_sparse_systems_give_what_dense_ones_do() -> None:
    H, f = chain(12)
    for of in (tie(12), None):
        (z, m), (again, forces) = solver(H, of)(f), solver(sp.csr_array(H), of)(f)
        assert again == pytest.approx(z, rel=1e-10, abs=1e-12 * np.abs(z).max())
        assert forces == pytest.approx(m, rel=1e-8, abs=1e-8)


def test_forces_balance_and_rows_close() -> None:
    """H z = f + force + Cᵀ m, C z of rows that hold what is asked, m = −κ e of the spring; a repeated row has none."""
    H, f = chain(12)
    of = tie(12)
    for matrix in (H, sp.csr_array(H)):
        z, m = solver(matrix, of)(f)
        assert H @ z - f - of.known - of.C.T @ m == pytest.approx(np.zeros(12), abs=1e-8 * np.abs(m).max())
        assert (of.C @ z)[:4] == pytest.approx(of.target[:4], abs=1e-13)
        assert m[4] == pytest.approx(-1e5 * (of.C @ z)[4], rel=1e-9)
        assert m[2] == pytest.approx(0.0, abs=1e-6 * np.abs(m).max())


@pytest.mark.parametrize("repeated", [False, True])
def test_many_constraints_are_independent_but_for_those_that_repeat_others(repeated: bool) -> None:
    """As many as a sparse factor is asked of first; one that is the sum of two others is left out, laws never are."""
    n = 3 * MANY
    C = sp.lil_array((MANY + 2, n))
    for row in range(MANY + 2):
        C[row, [row, row + 1, 2 * row]] = 1.0, -0.7, 0.3
    if repeated:
        C[MANY] = C[[2]] + C[[5]]
    C[MANY + 1] = C[[7]]
    compliance = np.append(np.zeros(MANY + 1), 1e-5)
    kept = independent_rows(sp.csr_array(C), compliance)
    assert len(kept) == MANY + 2 - repeated
    assert MANY + 1 in kept
    assert np.linalg.matrix_rank(C.toarray()[kept[:-1]]) == len(kept) - 1
