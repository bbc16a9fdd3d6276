"""The common system of all links' interface points, joints held or sprung by constraint equations that vary in time:

H z = f + Cᵀ m,   C z = target of a constraint,   m = −κ C z of a spring
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from kedfem.arrays import Float
from kedfem.dynamics.joints.constraint_matrices import JointRows
from kedfem.dynamics.matrices.bordered import Bordered
from kedfem.dynamics.matrices.cholesky import Cholesky
from kedfem.errors import SolveError

MANY = 400  # interface unknowns above which few links share each, and their matrix is sparse
Solver = Callable[[Float[np.ndarray, " k"]], tuple[Float[np.ndarray, " k"], Float[np.ndarray, " r"]]]
"""z and m for any f."""


@dataclass(frozen=True, slots=True)
class Tie:
    """What constraints ask of one solution of the interface system.

    C : (r, k); compliance : (r,) 1/κ, zero of constraints
    target : (r,) C z of constraints; zero of springs
    force : (k,) known forces on the interface
    """

    C: Any
    compliance: Float[np.ndarray, " r"]
    target: Float[np.ndarray, " r"]
    force: Float[np.ndarray, " k"]


def solver(H: Float[np.ndarray, "k k"] | sp.csr_array, tie: Tie | None) -> Solver:
    """What gives interface unknowns z and the constraints' forces m; without these H must be definite.

    Raises
    ------
    SolveError
        If H is not positive definite, or both together leave a motion free.
    """
    if tie is not None:
        bordered = Bordered(sp.csr_array(H), sp.csr_array(tie.C), tie.compliance)
        return lambda f: bordered.solved(f + tie.force, tie.target, closes=True)
    what = "joints: the joints' common system"
    if sp.issparse(H):
        sparse = Cholesky(sp.csr_array(H), what)
        return lambda f: (np.array(sparse.solve(f)), np.zeros(0))
    try:
        factor = scipy.linalg.cho_factor(H, lower=True, check_finite=False)
    except np.linalg.LinAlgError as error:
        raise SolveError(f"{what} must be definite, got {error}") from error
    return lambda f: (scipy.linalg.cho_solve(factor, f, check_finite=False), np.zeros(0))


def static_tie(rows: JointRows, at: int) -> Tie:
    """What the constraints ask of a linkage at rest."""
    none = np.zeros(len(rows.stiffness))
    return Tie(rows.at(at), 1 / rows.stiffness, none, np.zeros(rows.unknowns))
