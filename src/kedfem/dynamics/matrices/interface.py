"""The common system of all links' port points, where joints hold or spring by rows that vary in time.

    H z = f + Cᵀ m,   e = C z,   e_r = 0 of a row that holds,   m_r = −κ_r e_r of a spring

Without its rows a linkage at rest may be one that moves, H singular. So a part σ < κ of every spring, and as much of a
spring beside each row that holds, is put into H' = H + Cᵀ σ C; with m' = m + σ e the rest is

    (C H'⁻¹ Cᵀ + diag 1/(κ − σ)) m' = target − C H'⁻¹ f

exact for every σ, one equation of springs and of what holds (1/κ = 0), and well conditioned however stiff springs are.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from kedfem.arrays import Float
from kedfem.dynamics.joints.constraint_matrices import JointRows
from kedfem.dynamics.matrices.bordered import Asked, Bordered
from kedfem.dynamics.matrices.cholesky import Cholesky
from kedfem.errors import SolveError

MANY = 400  # interface unknowns above which few links share each, and their matrix is sparse
DEPENDENT = 1e-11  # what is left of a row's own compliance where other rows hold what it holds


def solver(
    H: Float[np.ndarray, "k k"] | sp.csr_array, tie: Asked | None
) -> Callable[[Float[np.ndarray, " k"]], tuple[Float[np.ndarray, " k"], Float[np.ndarray, " r"]]]:
    """What gives interface unknowns z and the rows' forces m for any f; of a sparse H by a sparse factor of both.

    Raises
    ------
    SolveError
        If H is not positive definite.
    """
    if tie is None:
        alone = _factor(H)
        return lambda f: (alone(f), np.zeros(0))
    if sp.issparse(H):
        bordered = Bordered(H, sp.csr_array(tie.C), tie.compliance)
        return lambda f: bordered.solved(f + tie.known, tie.target, closes=True)
    C: Any = tie.C.toarray() if sp.issparse(tie.C) else tie.C
    beside = _beside(H, C, tie.compliance)
    inverse = _factor(H + (C.T * beside) @ C)
    compliance = tie.compliance / (1 - beside * tie.compliance)
    G = C @ inverse(C.T)
    L, kept = semidefinite_factor((G + G.T) / 2 + np.diag(compliance))

    def of(f: Float[np.ndarray, " k"]) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, " r"]]:
        z, m = inverse(f + tie.known), np.zeros(len(compliance))
        for _ in range(2):  # the second closes joints to rounding
            left = tie.target - C @ z - compliance * m
            change = np.zeros(len(m))
            change[kept] = scipy.linalg.cho_solve((L, True), left[kept], check_finite=False)
            m += change
            z += inverse(C.T @ change)
        return z, m - beside * (C @ z)

    return of


def _factor(
    H: Float[np.ndarray, "k k"] | sp.csr_array,
) -> Callable[[Float[np.ndarray, "k *n"]], Float[np.ndarray, "k *n"]]:
    """H⁻¹, times vectors or matrices."""
    what = "joints: the joints' common system"
    if sp.issparse(H):
        sparse = Cholesky(sp.csr_array(H), what)
        return lambda f: sparse.solve_many(f) if f.ndim == 2 else np.array(sparse.solve(f))
    try:
        factor = scipy.linalg.cho_factor(H, lower=True, check_finite=False)
    except np.linalg.LinAlgError as error:
        raise SolveError(f"{what} must be definite, got {error}") from error
    return lambda f: np.asarray(scipy.linalg.cho_solve(factor, f, check_finite=False))


def _beside(
    H: Float[np.ndarray, "k k"], C: Float[np.ndarray, "r k"], compliance: Float[np.ndarray, " r"]
) -> Float[np.ndarray, " r"]:
    """σ of each row: about as stiff as the interface is, at most half of a spring; links alone may bear nothing there."""
    mean = float(H.trace()) / H.shape[0]
    size = (C * C).sum(axis=1)
    usual = np.where(size > 0, (mean if mean > 0.0 else 1.0) / np.where(size > 0, size, 1.0), 0.0)
    return np.asarray(usual / (1 + 2 * usual * compliance))


def semidefinite_factor(G: Float[np.ndarray, "r r"]) -> tuple[Float[np.ndarray, "q q"], np.ndarray]:
    """Cholesky factor of the rows that do not depend on those before them, and which these are."""
    L = np.zeros_like(G)
    kept: list[int] = []
    for i in range(len(G)):
        n = len(kept)
        row = scipy.linalg.solve_triangular(L[:n, :n], G[i, kept], lower=True, check_finite=False) if n else G[i, :0]
        left = G[i, i] - row @ row
        if left > DEPENDENT * G[i, i]:
            L[n, :n], L[n, n] = row, np.sqrt(left)
            kept.append(i)
    return L[: len(kept), : len(kept)], np.array(kept, int)


def static_tie(rows: JointRows, at: int) -> Asked:
    """What the rows ask of a linkage at rest."""
    none = np.zeros(len(rows.stiffness))
    return Asked(rows.at(at), none, 1 / rows.stiffness, np.zeros(rows.unknowns))
