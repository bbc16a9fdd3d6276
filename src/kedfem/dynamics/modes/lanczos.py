"""Lowest modes by a block Lanczos run on an inverse; all vectors are kept, so that no repeated frequency is missed."""

from collections.abc import Callable

import numpy as np

from kedfem.arrays import Bool, Float
from kedfem.errors import SceneError

Block = Float[np.ndarray, "N _"]
Product = Callable[[Block], Block]

CONVERGED = 1e-9  # residual of a vector, of its eigenvalue, which is right to about the square of that
REPEATED = 1e-12  # of the size of a new vector: what is left of it beside those before is rounding
MOST = 480  # vectors of a run
_TOO_MANY = (
    "--modes: must be so few that iterations with {} vectors find them, got {} with rigid-body modes, of which {} are "
    "found: ask for {} at the most"
)


def lanczos(
    answer: Product, momentum: Product, size: int, count: int, block: int
) -> tuple[Float[np.ndarray, " f"], Float[np.ndarray, "N f"]]:
    """Largest eigenvalues θ of A⁻¹ M in falling order, and their vectors, orthonormal in M.

    Parameters
    ----------
    answer : A⁻¹ of columns, with all constraints kept
    momentum : M of columns, definite
    size : N
    count : eigenvalues that are wanted; where there are fewer, all
    block : vectors to begin with: of so many equal eigenvalues each is found

    Raises
    ------
    SceneError
        Not all converge within MOST vectors.

    Source: block Lanczos with full orthogonalisation, Golub and Van Loan, Matrix Computations, section 10.3.
    """
    first = np.random.default_rng(0).standard_normal((size, min(block, size)))
    V, MV, T = np.zeros((size, 0)), np.zeros((size, 0)), np.zeros((0, 0))
    theta, Z = np.zeros(0), np.zeros((0, 0))
    x = answer(momentum(first))
    while True:
        new, R = _beside(V, MV, x, momentum)
        accurate = _accurate(theta, Z, R)
        if not new.shape[1] or (len(theta) >= count and accurate[:count].all()):
            break
        if V.shape[1] >= MOST:
            raise SceneError(_TOO_MANY.format(MOST, count, n := int(accurate.argmin()), max(1, n - block)))
        V, MV = np.hstack([V, new]), np.hstack([MV, momentum(new)])
        x = answer(MV[:, -new.shape[1] :])
        column, known = MV.T @ x, len(T)
        T = np.block([[T, column[:known]], [column[:known].T, column[known:]]])
        theta, Z = (each[..., ::-1] for each in np.linalg.eigh((T + T.T) / 2))
    kept = np.flatnonzero(theta > REPEATED * theta.max(initial=0.0))[:count]
    return theta[kept], V @ Z[:, kept]


def _beside(V: Block, MV: Block, x: Block, momentum: Product) -> tuple[Block, Float[np.ndarray, "_ _"]]:
    """An orthonormal basis Q of what columns x have beside those of V, and R with x = V (…) + Q R.

    Column by column, each of its own size: of columns together, whose products show sizes to 1e-8 only, rounding that
    is left where no further direction exists would be taken for one.
    """
    Q, MQ = np.zeros((len(x), 0)), np.zeros((len(x), 0))
    for column in x.T[:, :, None]:
        size, new = _norm(column, momentum(column)), column
        for _ in range(2):
            new = new - V @ (MV.T @ new) - Q @ (MQ.T @ new)
        momentum_of = momentum(new)
        left = _norm(new, momentum_of)
        if left > REPEATED * size:
            Q, MQ = np.hstack([Q, new / left]), np.hstack([MQ, momentum_of / left])
    return Q, MQ.T @ x


def _norm(x: Block, momentum_of: Block) -> float:
    """√(xᵀ M x) of one column."""
    return float(np.sqrt(max((x * momentum_of).sum(), 0.0)))


def _accurate(
    theta: Float[np.ndarray, " m"], Z: Float[np.ndarray, "m m"], R: Float[np.ndarray, "_ _"]
) -> Bool[np.ndarray, " m"]:
    """Whether residuals of eigenvectors, ‖R z‖ with their part z in the last block, are small."""
    left = np.linalg.norm(R @ Z[len(Z) - R.shape[1] :], axis=0) if len(Z) else np.zeros(0)
    return np.asarray(left <= CONVERGED * theta)
