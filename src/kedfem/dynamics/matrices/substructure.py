"""Static condensation of links onto their ports, and the solution of all links by the common interface.

It is an exact block elimination of the coupled system, because T M Tᵀ = M and K = T K0 Tᵀ [KED, eqs. (12)(14)].
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from kedfem.arrays import Float, Int
from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.joints.ports import in_balance, port_columns, port_values
from kedfem.dynamics.matrices.cholesky import Cholesky
from kedfem.dynamics.stepping.scheme import Scheme
from kedfem.dynamics.stepping.state import Nodal, Rayleigh
from kedfem.errors import SolveError
from kedfem.links.record import Link

ANCHORAGE = 0.1  # κ, of the anchor nodes' own stiffness: 0.01 to 1 do equally well


@dataclass(frozen=True, slots=True)
class Substructure:
    """A link condensed onto its q port components and e anchors, all constant in the link frame.

    Only inertia makes A of a free link regular, so a long step would leave it nearly singular. The factored matrix is
    Ã = A + κ E Eᵀ, E a few components of nodes far apart (the anchors): A g = r + Wᵀ λ is Ã g = r + Wᵀ λ + E μ with
    μ = κ Eᵀ g. Exact for every κ. With C = [Wᵀ E] and y = Ã⁻¹ r,

        [λ; μ] = S ([W g; 0] − Cᵀ y),   S = (Cᵀ Ã⁻¹ C − diag(0, 1/κ))⁻¹,   g = y + Ã⁻¹ C [λ; μ].

    solve : (n, d) → (n, d), Ã⁻¹
    solve_many : the same of columns, (dn, k) → (dn, k)
    Y : (dn, q + e) Ã⁻¹ C
    S : (q + e, q + e)
    anchors : (e,) components of the state
    factor : what solves, if it is one sparse factor
    """

    solve: Callable[[Nodal], Nodal]
    solve_many: Callable[[np.ndarray], np.ndarray]
    attachment: Attachment
    Y: Float[np.ndarray, "k c"]
    S: Float[np.ndarray, "c c"]
    anchors: Int[np.ndarray, " e"]
    factor: Cholesky | None = None

    def seen(self, y: Nodal) -> Float[np.ndarray, " c"]:
        """Cᵀ y: values at ports and anchors."""
        return np.concatenate([port_values(self.attachment, y), y.ravel()[self.anchors]])


def substructure(
    link: Link, attachment: Attachment, solve: Callable[[Nodal], Nodal], solve_many: Callable[[np.ndarray], np.ndarray],
    anchors: Int[np.ndarray, " e"] | None = None, kappa: Float[np.ndarray, " e"] | None = None,
) -> Substructure:  # fmt: skip
    """Condense a link onto its ports and anchors.

    Parameters
    ----------
    solve, solve_many : Ã⁻¹ for one state (n, d) and for columns (dn, k)
    anchors, kappa : components that Ã holds in addition to A, none if not given, and how stiffly [N/m]
    """
    held = np.zeros(0, int) if anchors is None else anchors
    E = np.zeros((link.unknowns, len(held)))
    E[held, np.arange(len(held))] = 1.0
    C = np.concatenate([port_columns(attachment, link.n), E], axis=1)
    Y = solve_many(C)
    F = C.T @ Y
    if kappa is not None:
        at = np.arange(len(F) - len(held), len(F))
        F[at, at] -= 1 / kappa
    try:
        S = _stiffness(F, len(held))
    except np.linalg.LinAlgError as error:
        raise SolveError(
            f"links.{link.name}: must have a flexibility at its joints that is more than rounding beside its least stiff "
            "motion, got none: it may be very thin beside its length, or its sizes in other units than meant"
        ) from error
    return Substructure(solve, solve_many, attachment, Y, S, held)


def _stiffness(F: Float[np.ndarray, "c c"], anchored: int) -> Float[np.ndarray, "c c"]:
    """F⁻¹ = B⁻ᵀ J B⁻¹, F = B J Bᵀ, J = 1 of the ports and −1 of the last, the anchors, that are let go.

    A link that is stiff near its ports, as a beam in space at its rigid nodes, is 1e6 times as stiff there as heavy.
    Of that, B⁻¹ has the square root: joint forces keep four digits that an inverse by elimination would lose.
    """
    p = len(F) - anchored
    B = np.zeros_like(F)
    B[:p, :p] = np.linalg.cholesky(F[:p, :p])
    if anchored:
        Z = scipy.linalg.solve_triangular(B[:p, :p], F[:p, p:], lower=True, check_finite=False)
        B[p:, :p] = Z.T
        B[p:, p:] = np.linalg.cholesky(Z.T @ Z - F[p:, p:])
    inverse = scipy.linalg.solve_triangular(B, np.eye(len(F)), lower=True, check_finite=False)
    return np.asarray((inverse[:p].T @ inverse[:p]) - inverse[p:].T @ inverse[p:])


def factored(link: Link, joint: Attachment, c_M: float, c_K: float) -> Substructure:
    """A link with A = c_M M + c_K K0 held at its anchors, factored and condensed onto its ports."""
    made = _held(link, joint, c_M, c_K)
    return replace(made, S=in_balance(link, joint, made.S)) if link.rigid and c_M == 0.0 else made


def _held(link: Link, joint: Attachment, c_M: float, c_K: float) -> Substructure:
    factor, anchors, kappa = anchored(link, c_M, c_K)
    made = substructure(
        link, joint, lambda r: factor.solve(r.ravel()).reshape(r.shape), factor.solve_many, anchors, kappa
    )
    return replace(made, factor=factor if isinstance(factor, Cholesky) else None)


def anchored(
    link: Link, c_M: float, c_K: float
) -> tuple["Cholesky | _Dense", Int[np.ndarray, " e"], Float[np.ndarray, " e"]]:
    """Ã of a link, factored, its anchors, and how stiffly it holds each."""
    anchors, diagonal = anchors_of(link), link.K0.diagonal()
    mean = float((diagonal if link.full is not None else diagonal[anchors]).mean())
    kappa = np.full(len(anchors), ANCHORAGE * c_K * mean)
    springs = sp.coo_array((kappa, (anchors, anchors)), shape=link.K0.shape)
    A = sp.csr_array(effective_matrix(link, c_M, c_K) + springs)
    X = link.X if link.kind == "solid" else None
    return (_Dense(A, link.name) if link.full is not None else Cholesky(A, f"links.{link.name}", X)), anchors, kappa


class _Dense:
    """The same interface as `Cholesky`, for the dense matrices of a reduced link."""

    def __init__(self, A: sp.csr_array, name: str) -> None:
        try:
            self._factor = scipy.linalg.cho_factor(A.toarray(), check_finite=False)
        except np.linalg.LinAlgError as error:
            raise SolveError(f"links.{name}: effective matrix must be positive definite, got {error}") from error

    def solve(self, b: np.ndarray) -> np.ndarray:
        """x with A x = b, of vectors and columns."""
        return np.asarray(scipy.linalg.cho_solve(self._factor, b, check_finite=False))

    solve_many = solve


def mass_substructure(link: Link, joint: Attachment) -> Substructure:
    """The link condensed with A = M; the three components of a solid share one factor.

    Conjugate gradients would spare it, but a heavy body on a bore costs them their convergence.
    """
    of = {id(m): Cholesky(m, f"links.{link.name}: mass") for m in {id(m): m for m in link.mass}.values()}

    def solve(b: Nodal) -> Nodal:
        return np.stack([np.array(of[id(m)].solve(b[:, k])) for k, m in enumerate(link.mass)], axis=1)

    def solve_many(B: Float[np.ndarray, "k q"]) -> Float[np.ndarray, "k q"]:
        return np.stack([solve(b.reshape(-1, link.d)).ravel() for b in B.T], axis=1) if B.shape[1] else B

    return substructure(link, joint, solve, solve_many)


def anchors_of(link: Link) -> Int[np.ndarray, " e"]:
    """Components that prevent rigid motion of a link: those of a beam's middle node, else of d distant nodes."""
    if link.full is not None:
        # as functions are mass-orthonormal, those with most of 1 and x move the link most
        share = link.one**2 / (link.one**2).sum() + (link.X**2).sum(axis=1) / (link.X**2).sum()
        return (link.d * np.argsort(share)[::-1][: link.d + 1, None] + np.arange(link.d)).ravel()
    if link.kind == "beam":
        return np.arange(3) + 3 * (link.n // 2)
    if link.kind == "spatial_beam":
        # its nodes may be in line: the turn about it is held by the slopes of one
        values = np.flatnonzero(link.one)
        return np.asarray(np.arange(9) + 3 * values[len(values) // 2])
    nodes = np.flatnonzero(link.one)
    X = link.X[nodes]
    first = int(np.linalg.norm(X - X.mean(axis=0), axis=1).argmax())
    arms = X - X[first]
    second = int(np.linalg.norm(arms, axis=1).argmax())
    third = int(np.linalg.norm(np.cross(arms, arms[second]), axis=1).argmax())
    far = nodes[[first, second, third][: link.d]]
    return (link.d * far[:, None] + np.arange(link.d)).ravel()


def effective_coefficients(scheme: Scheme, damping: Rayleigh) -> tuple[float, float]:
    """c_M [1/s²] and c_K [-] of A = c_M M + c_K K0 = (1 − α_m) a0 M + (1 − α_f) (K0 + a1 C0)."""
    c_m, c_f = 1 - scheme.alpha_m, 1 - scheme.alpha_f
    return c_m * scheme.a0 + c_f * scheme.a1 * damping.alpha, c_f * (1 + scheme.a1 * damping.beta)


def effective_matrix(link: Link, c_M: float, c_K: float) -> sp.csr_array:
    """A = c_M M + c_K K0 in the link frame, (dn, dn): constant because of [KED, eqs. (12)(14)]."""
    return sp.csr_array(c_M * mass_matrix(link) + c_K * link.K0)


def mass_matrix(link: Link) -> sp.csr_array:
    """M = m ⊗ I, (dn, dn), [KED, eqs. (9)(11)]."""
    if all(m is link.mass[0] for m in link.mass):
        return sp.csr_array(sp.kron(link.mass[0], sp.eye_array(link.d), format="csr"))
    unit = np.eye(link.d)
    return sp.csr_array(sum(sp.kron(m, sp.diags_array(unit[k]), format="csr") for k, m in enumerate(link.mass)))
