"""Steps of small links: dense constant matrices and one compiled loop over a block of time points."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from jaxtyping import Float, Int

from kedfem.dynamics.constraint_matrices import JointRows
from kedfem.dynamics.coupling import Attachment
from kedfem.dynamics.history import Forcing, LinkHistory, Products
from kedfem.dynamics.interface import RowState
from kedfem.dynamics.ports import port_columns, port_vectors
from kedfem.dynamics.scheme import Scheme
from kedfem.dynamics.state import LinkState, Rayleigh
from kedfem.dynamics.stiffened import stress_terms
from kedfem.dynamics.stiffening import SETTLED, SWEEPS, Stiffening
from kedfem.dynamics.substructure import effective_coefficients
from kedfem.links.record import Link

SMALL = 360  # unknowns of a link: up to here dense matrices beat a sparse factor (docs/performance)
UNIT = 1e-10  # a mass of mass-orthonormal functions differs from 1 by their rounding


@dataclass(frozen=True, slots=True)
class DensePart:
    """One link with its ports held, in mass-orthonormal coordinates x, component first: row c of δ is T[c] x[c].

    T : per component (n, n); unit: whether it is 1, as of reduced links
    G : (N, N) A⁻¹ with ports held; Y : (N, q) shape of the link as its ports move; S : (q, q) port stiffness of A
    W : (q, N) ports; q counts all components of all ports, those that are not held are zero
    """

    T: tuple[Float[np.ndarray, "n n"], ...]
    G: Float[np.ndarray, "N N"]
    Y: Float[np.ndarray, "N q"]
    S: Float[np.ndarray, "q q"]
    W: Float[np.ndarray, "q N"]
    unit: bool = False


class Coordinates(Protocol):
    """How coordinates of a part are its nodal rows: row c is T[c] x[c]; without any T they are these themselves."""

    @property
    def T(self) -> tuple[np.ndarray, ...]:
        """Per component (n, n)."""

    @property
    def unit(self) -> bool:
        """Whether each is 1."""


class DenseSteps:
    """Advances all links by generalised-α steps, block by block; everything constant is made here, once."""

    def __init__(
        self, links: Sequence[Link], joints: Sequence[Attachment], scheme: Scheme, damping: Rayleigh,
        stiffening: Stiffening | None = None,
    ) -> None:  # fmt: skip
        self.links, self.joints, self.scheme, self.damping = links, joints, scheme, damping
        c_m, c_f = 1 - scheme.alpha_m, 1 - scheme.alpha_f
        c_M, c_K = effective_coefficients(scheme, damping)
        b = c_m * scheme.acceleration
        self.coefficients = np.array([
            c_M, c_K, scheme.alpha_f, b[0], b[1], b[2] - scheme.alpha_m, c_f, *scheme.acceleration,
            scheme.h * scheme.gamma, scheme.h * (1 - scheme.gamma), damping.alpha, damping.beta, *(c_f * scheme.rate),
        ])  # fmt: skip
        self.parts = [dense_part(link, joint, c_M, c_K) for link, joint in zip(links, joints, strict=True)]
        self.factorisations = len(self.parts)
        self._sizes = (
            max(link.d for link in links), max(link.n for link in links), max(len(j.weights) for j in joints)
        )  # fmt: skip
        self._unknowns = _known([joint.B for joint in joints])
        self.stiffening = stiffening
        T = [part.T for part in self.parts]
        self._stress = None if stiffening is None else stress_terms(links, T, stiffening)
        self._matrices = self._padded()

    def begin(self, states: Sequence[LinkState], rows: RowState | None = None) -> tuple[np.ndarray, ...]:
        """The loop's own state, from link states; last the forces of rows of joints, and their e, e', e''."""
        D, n, P = self._sizes
        L = len(self.links)
        u, v, a, F, f = (np.zeros((L, D, n)) for _ in range(5))
        R, forces, C = np.zeros((L, D, D)), np.zeros((L, D * P)), np.zeros((3, L, D, n))
        for i, (link, joint, part, s) in enumerate(
            zip(self.links, self.joints, self.parts, states, strict=True)
        ):
            for out, x in ((u, s.u), (v, s.v), (a, s.a)):
                out[i, : link.d, : link.n] = coordinates(link, part, x)
            for out, x in ((F, s.F), (f, s.f)):
                out[i, : link.d, : link.n] = work_on(part, x)
            for k in range(3 if s.C is not None else 0):
                C[k, i, : link.d, : link.n] = work_on(part, s.C[k])  # type: ignore[index]
            R[i, : link.d, : link.d] = s.R
            forces[i] = self._ports_padded(joint, s.port_forces)
        p, e = np.zeros(self.joints[0].B.shape[1]), np.zeros((3, 0))
        return u, v, a, F, f, R, forces, C, *((p, e) if rows is None else (rows.p.copy(), rows.e.copy()))

    def advance(
        self, state: tuple[np.ndarray, ...], forcing: Sequence[Forcing], rows: JointRows | None = None
    ) -> tuple[list[LinkHistory], tuple[np.ndarray, ...]]:
        """All time points of a block, one step after the other, [KED, eq. (20)].

        Parameters
        ----------
        state : of `begin` or of the block before; it is used up
        forcing : per link over the block
        rows : of joints enforced by constraint equations, over the block

        Returns
        -------
        histories per link, and the state at the end
        """
        D, n, P = self._sizes
        T, L = len(forcing[0].R), len(self.links)
        R, F = np.zeros((T, L, D, D)), np.zeros((T, L, D, n))
        for i, (link, part, each) in enumerate(zip(self.links, self.parts, forcing, strict=True)):
            R[:, i, : link.d, : link.d] = each.R
            F[:, i, : link.d, : link.n] = work_over_time(part, each.F)
        u, v, a, g = (np.empty((T, L, D, n)) for _ in range(4))
        Kg = np.empty((T if any(part.unit for part in self.parts) else 0, L, D, n))
        forces, strain = np.empty((T, L, D * P)), np.empty((T, L))
        history = (u, v, a, g, forces, strain, Kg)
        self._loop(forcing, rows, (R, F), state, history)
        return [self._history(i, each, history) for i, each in enumerate(forcing)], state

    def _loop(
        self,
        forcing: Sequence[Forcing],
        rows: JointRows | None,
        padded: tuple[np.ndarray, np.ndarray],
        state: tuple[np.ndarray, ...],
        history: tuple[np.ndarray, ...],
    ) -> None:
        """Advance the state and fill the history in place."""
        known = (self._matrices, *self._unknowns, padded)
        if self._stress is None:
            from kedfem.dynamics.kernel import advance_block

            advance_block(self.coefficients, *known, self._ties(len(padded[0]), rows), state, history)
            return
        from kedfem.dynamics.stiffened_kernel import advance_stiffened

        limits, stressed = (self.scheme.h, SETTLED, SWEEPS), self._stress.over_block(forcing)
        advance_stiffened(self.coefficients, limits, *known, stressed, state[:8], history)

    def _ties(self, steps: int, rows: JointRows | None) -> tuple[np.ndarray, ...]:
        """Rows over time, their compliance 1/κ and the damping that acts on e', times 1 − α_f; Newmark's rate."""
        s, k = self.scheme, self.joints[0].B.shape[1]
        share = 1 - s.alpha_f
        if rows is None:
            return np.zeros((steps, 0, k)), np.zeros(0), np.zeros(0), s.rate
        kappa = share * (rows.stiffness + rows.damping * s.a1)
        return rows.C, 1 / kappa, share * rows.damping, s.rate

    def _history(self, i: int, forcing: Forcing, history: tuple[np.ndarray, ...]) -> LinkHistory:
        link, joint, part = self.links[i], self.joints[i], self.parts[i]
        u, v, a, g = (rows_of(link, part, x[:, i]) for x in history[:4])
        forces, strain = history[4][:, i, self._held(joint)], history[5][:, i].copy()
        products = Products(v, rows_of(link, part, history[6][:, i]), None) if part.unit else None
        return LinkHistory(u, v, a, g, forcing.R, forcing.F, forces, strain, products)

    def _padded(self) -> tuple[np.ndarray, ...]:
        D, n, P = self._sizes
        columns, count = self._unknowns
        L, k = len(self.links), columns.shape[1]
        G, Yt = np.zeros((L, D * n, D * n)), np.zeros((L, D * P, D * n))
        S, W = np.zeros((L, D * P, D * P)), np.zeros((L, D * P, D * n))
        B = np.zeros((L, D * P, k))
        for i, (link, joint, part) in enumerate(zip(self.links, self.joints, self.parts, strict=True)):
            x = (n * np.arange(link.d)[:, None] + np.arange(link.n)).ravel()
            held = self._held(joint)
            G[i][np.ix_(x, x)] = part.G
            Yt[i][np.ix_(held, x)] = part.Y.T
            S[i][np.ix_(held, held)] = part.S
            W[i][np.ix_(held, x)] = part.W
            B[i][held, : count[i]] = joint.B[:, columns[i, : count[i]]]
        return G, Yt, S, W, B

    def _held(self, joint: Attachment) -> np.ndarray:
        """Where the held components of a link stand among the padded ones."""
        port, component = np.divmod(joint.keep, joint.components)
        return np.asarray(self._sizes[0] * port + component)

    def _ports_padded(self, joint: Attachment, force: np.ndarray) -> np.ndarray:
        out = np.zeros((self._sizes[2], self._sizes[0]))
        vectors = port_vectors(joint, force)
        out[: len(vectors), : vectors.shape[1]] = vectors
        return out.ravel()


def _known(B: Sequence[Float[np.ndarray, "_ k"]]) -> tuple[Int[np.ndarray, "L k"], Int[np.ndarray, " L"]]:
    """Which interface unknowns each link knows, and how many."""
    columns, count = np.zeros((len(B), B[0].shape[1]), int), np.zeros(len(B), int)
    for i, each in enumerate(B):
        found = np.flatnonzero(each.any(axis=0))
        columns[i, : len(found)], count[i] = found, len(found)
    return columns, count


def dense_part(link: Link, joint: Attachment, c_M: float, c_K: float) -> DensePart:
    """A link in mass-orthonormal coordinates; its ports are held by a null-space basis, so that a long step, where A
    nearly lets a free link go, does no harm."""
    T = tuple(_mass_orthonormal(_dense(m)) for m in link.mass)
    n, unit = link.n, all(np.array_equal(t, np.eye(link.n)) for t in T)
    A = c_K * _symmetric(component_first(T, link.K0))
    A[np.diag_indices(len(A))] += c_M
    W = port_rows(T, joint, n)
    if not len(W):
        return DensePart(T, _symmetric(np.linalg.inv(A)), W.T, np.zeros((0, 0)), W, unit)
    V, L = scipy.linalg.qr(W.T)
    V1, Z = V[:, : len(W)], V[:, len(W) :]
    factor = scipy.linalg.cho_factor(_symmetric(Z.T @ A @ Z))
    G = Z @ scipy.linalg.cho_solve(factor, Z.T)
    moved = V1 @ np.linalg.inv(L[: len(W)]).T  # W moved = 1
    Y = moved - G @ (A @ moved)
    return DensePart(T, _symmetric(G), Y, _symmetric(Y.T @ A @ Y), W, unit)


def port_rows(T: Sequence[Float[np.ndarray, "n n"]], joint: Attachment, n: int) -> Float[np.ndarray, "q N"]:
    """What held components of ports have of coordinates x."""
    W = port_columns(joint, n).T.reshape(-1, n, len(T)).transpose(0, 2, 1)
    return np.concatenate([W[:, c] @ t for c, t in enumerate(T)], axis=1)


def _mass_orthonormal(m: Float[np.ndarray, "n n"]) -> Float[np.ndarray, "n n"]:
    """T with Tᵀ m T = 1."""
    if np.abs(m - np.eye(len(m))).max() < UNIT:
        return np.eye(len(m))
    return np.asarray(np.linalg.inv(np.linalg.cholesky(m)).T)


def component_first(T: Sequence[Float[np.ndarray, "n n"]], K: Any) -> Float[np.ndarray, "N N"]:
    """Tᵀ K T of a matrix on states, component by component."""
    n, d = len(T[0]), len(T)
    blocks = _dense(K).reshape(n, d, n, d).transpose(1, 0, 3, 2)
    return np.concatenate(
        [np.concatenate([T[i].T @ blocks[i, :, j] @ T[j] for j in range(d)], axis=1) for i in range(d)]
    )


def coordinates(link: Link, part: Coordinates, rows: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "d n"]:
    """x of a state: T⁻¹ = Tᵀ m."""
    if not part.T:
        return np.ascontiguousarray(rows.T)
    return np.stack([part.T[c].T @ (link.mass[c] @ rows[:, c]) for c in range(link.d)])


def work_on(part: Coordinates, rows: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "d n"]:
    """Nodal forces on x."""
    if not part.T:
        return np.ascontiguousarray(rows.T)
    return np.stack([T.T @ rows[:, c] for c, T in enumerate(part.T)])


def work_over_time(part: Coordinates, rows: Float[np.ndarray, "T n d"]) -> Float[np.ndarray, "T d n"]:
    """Nodal forces on x over time."""
    if part.unit:
        return rows.transpose(0, 2, 1)
    return np.stack([rows[:, :, c] @ T for c, T in enumerate(part.T)], axis=1)


def rows_of(link: Link, part: Coordinates, x: Float[np.ndarray, "T D n"]) -> Float[np.ndarray, "T _ d"]:
    """States of x over time."""
    if part.unit:
        return np.array(x[:, : link.d, : link.n].transpose(0, 2, 1), order="C")
    return np.stack([x[:, c, : link.n] @ part.T[c].T for c in range(link.d)], axis=2)


def _symmetric(A: Float[np.ndarray, "k k"]) -> Float[np.ndarray, "k k"]:
    return np.asarray((A + A.T) / 2)


def _dense(matrix: Any) -> np.ndarray:
    return matrix.toarray() if sp.issparse(matrix) else np.asarray(matrix)
