"""The monolithic step: assemble T K0 Tᵀ, share nodes, factor, at every step. Oracle for tests, baseline for the
benchmark.

It follows [KED, eqs. (14)-(20)] word by word and shares no shortcut with the system's step.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp
import scipy.sparse.linalg

from kedfem.arrays import Float
from kedfem.dynamics.history import Forcing, LinkHistory, history
from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.joints.constraint_matrices import JointRows
from kedfem.dynamics.joints.ports import Rotation, port_columns, port_rotation, port_vectors
from kedfem.dynamics.matrices.interface import RowState, Tie, after_step, step_tie
from kedfem.dynamics.matrices.substructure import mass_matrix
from kedfem.dynamics.stepping.scheme import Scheme
from kedfem.dynamics.stepping.state import ForcingAt, LinkState, Nodal, Rayleigh, accelerated
from kedfem.dynamics.stiffening import Stiffening, with_turnings
from kedfem.links.record import Link

DEPENDENT = 1e-9  # rows of length one


def rotated_stiffness(K0: sp.csr_array, R: Rotation) -> sp.csr_array:
    """K = T K0 Tᵀ, [KED, eq. (14)], block by block.

    Parameters
    ----------
    K0 : (dn, dn) in the link frame
    R : link to world

    Returns
    -------
    (dn, dn) in the world frame
    """
    blocks = sp.bsr_array(K0, blocksize=R.shape)
    return sp.csr_array(sp.bsr_array((R @ blocks.data @ R.T, blocks.indices, blocks.indptr), shape=K0.shape))


def shared_nodes(
    links: Sequence[Link], joints: Sequence[Attachment]
) -> tuple[sp.csr_array, list[np.ndarray]]:
    """The constant map T from free unknowns to all nodal displacements that keeps every joint closed.

    [KED, eq. (19)]: joints make shared nodes move together.
    Per link, as many components near each joint as it holds are expressed by the others: Ws u_s = B z − Wm u_m.

    Returns
    -------
    T (3N, free), and per link the dependent components
    """
    blocks, interface, dependent = [], [], []
    for link, joint in zip(links, joints, strict=True):
        W = port_columns(joint, link.n).T
        s = scipy.linalg.qr(W, pivoting=True, mode="r")[1][: len(W)] if len(W) else np.zeros(0, int)
        m = np.setdiff1d(np.arange(link.unknowns), s)
        inverse = np.linalg.inv(W[:, s]) if len(W) else np.zeros((0, 0))
        T = sp.lil_array((link.unknowns, len(m)))
        T[m, np.arange(len(m))] = 1.0
        Tz = np.zeros((link.unknowns, joint.B.shape[1]))
        if len(s):
            near = np.flatnonzero(W[:, m].any(axis=0))
            T[np.ix_(s, near)] = -inverse @ W[:, m[near]]
            Tz[s] = inverse @ joint.B
        blocks.append(sp.csr_array(T))
        interface.append(sp.csr_array(Tz))
        dependent.append(s)
    return sp.csr_array(sp.hstack([sp.block_diag(blocks), sp.vstack(interface)])), dependent


Solution = tuple[Float[np.ndarray, " n"], Float[np.ndarray, " r"]]


def _symmetric_solution(system: sp.csc_array, f: Float[np.ndarray, " n"]) -> Solution:
    """By one sparse LU; no rows."""
    lu = scipy.sparse.linalg.splu(
        system, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    return np.asarray(lu.solve(f)), np.zeros(0)


def _bordered_solution(system: sp.csc_array, f: Float[np.ndarray, " n"], tie: Tie) -> Solution:
    """With the rows' forces m as unknowns: A x − Cᵀ m = f, C z + m / κ = target; z are the last unknowns.

    Rows that depend on others (found by rank-revealing QR) are left out, their forces zero.
    """
    n, k = system.shape[0], tie.C.shape[1]
    hard = np.flatnonzero(tie.compliance == 0)
    kept = np.setdiff1d(np.arange(len(tie.C)), hard)
    if len(hard):
        size = np.linalg.norm(tie.C[hard], axis=1)
        R, order = scipy.linalg.qr(
            (tie.C[hard] / np.where(size > 0, size, 1)[:, None]).T, mode="r", pivoting=True
        )
        kept = np.sort(np.concatenate([kept, hard[order[: int((np.abs(np.diag(R)) > DEPENDENT).sum())]]]))
    scale = float(np.abs(system.diagonal()).mean())
    C = sp.hstack([sp.csr_array((len(kept), n - k)), sp.csr_array(tie.C[kept])])
    bordered = sp.block_array(
        [[system / scale, -C.T], [C, sp.diags_array(scale * tie.compliance[kept])]], format="csc"
    )
    right = np.concatenate([f / scale, tie.target[kept]])
    right[n - k : n] += tie.force / scale
    lu = scipy.sparse.linalg.splu(bordered)
    x = lu.solve(right)
    x += lu.solve(right - bordered @ x)
    m = np.zeros(len(tie.C))
    m[kept] = scale * x[n:]
    return np.asarray(x[:n]), m


@dataclass(frozen=True, slots=True)
class Begun:
    """What a solver carries from block to block: states of all links, and of joints enforced by constraint equations."""

    links: list[LinkState]
    rows: RowState | None = None


class MonolithicSteps:
    """Advances all links by generalised-α steps of the assembled system; one sparse LU each step."""

    def __init__(
        self, links: Sequence[Link], joints: Sequence[Attachment], scheme: Scheme, damping: Rayleigh,
        stiffening: Stiffening | None = None,
    ) -> None:  # fmt: skip
        self.links, self.joints, self.scheme, self.damping = links, joints, scheme, damping
        self.stiffening = stiffening
        self.T, self.dependent = shared_nodes(links, joints)
        self.Wt = [port_columns(joint, link.n) for link, joint in zip(links, joints, strict=True)]
        self.M = [mass_matrix(link) for link in links]
        self.factorisations = 0

    def begin(self, states: Sequence[LinkState], rows: RowState | None = None) -> Begun:
        """The state of the first time point."""
        return Begun(list(states), rows)

    def advance(
        self, state: Begun, forcing: Sequence[Forcing], rows: JointRows | None = None
    ) -> tuple[list[LinkHistory], Begun]:
        """All time points of a block, one step after the other."""
        if self.stiffening is not None:
            forcing = self.stiffening.stressed(forcing, None, rows)
        links, held, taken = state.links, state.rows, []
        for k in range(len(forcing[0].R)):
            at = [each.at(k) for each in forcing]
            if rows is None:
                links = self.step(links, at)
            elif held is None:
                raise ValueError("the rows' state at the first time point must be given, got none")
            else:
                tie = step_tie(rows.C[k], rows, self.scheme, held)
                links, z, m = self.tied_step(links, at, tie)
                held = after_step(tie, z, m, self.scheme, held)
            taken.append(links)
        return [history([links[i] for links in taken]) for i in range(len(forcing))], Begun(links, held)

    def step(self, states: Sequence[LinkState], at: Sequence[ForcingAt]) -> list[LinkState]:
        """States of all links one step later, [KED, eq. (20)]."""
        return self.tied_step(states, at, None)[0]

    def tied_step(
        self, states: Sequence[LinkState], at: Sequence[ForcingAt], tie: Tie | None
    ) -> tuple[list[LinkState], Float[np.ndarray, " k"], Float[np.ndarray, " r"]]:
        """The same where joints are enforced by constraint equations, which border the system; also the interface
        unknowns and the equations' forces."""
        A = self._matrices(at)
        rhs = [self._rhs(k, states[k], at[k]) for k in range(len(self.links))]
        system = sp.csc_array(self.T.T @ sp.csr_array(sp.block_diag(A)) @ self.T)
        f = self.T.T @ np.concatenate([r.ravel() for r in rhs])
        self.factorisations += 1
        free, m = _symmetric_solution(system, f) if tie is None else _bordered_solution(system, f, tie)
        u = self.T @ free
        parts = np.split(u, np.cumsum([link.unknowns for link in self.links])[:-1])
        new = [
            self._next(k, states[k], at[k], parts[k].reshape(rhs[k].shape), A[k], rhs[k])
            for k in range(len(self.links))
        ]
        if self.stiffening is not None:
            new = with_turnings(new, self.stiffening.turnings(at))
        return new, free[len(free) - self.joints[0].B.shape[1] :], m

    def _matrices(self, at: Sequence[ForcingAt]) -> list[sp.csr_array]:
        """Effective matrices of all links, world frame; stress stiffness is assembled like the rest."""
        K = [rotated_stiffness(link.K0, now.R) for link, now in zip(self.links, at, strict=True)]
        A = [self._effective(M, K_) for M, K_ in zip(self.M, K, strict=True)]
        if self.stiffening is None:
            return A
        share = 1 - self.scheme.alpha_f
        return [sp.csr_array(x + share * k) for x, k in zip(A, self.stiffening.stiffness(at), strict=True)]

    def _effective(self, M: sp.csr_array, K: sp.csr_array) -> sp.csr_array:
        s, d = self.scheme, self.damping
        C = d.alpha * M + d.beta * K
        return sp.csr_array((1 - s.alpha_m) * s.a0 * M + (1 - s.alpha_f) * (K + s.a1 * C))

    def _rhs(self, k: int, s: LinkState, at: ForcingAt) -> Nodal:
        scheme = self.scheme
        b0, b1, b2 = scheme.acceleration
        history = (1 - scheme.alpha_m) * (b0 * s.u + b1 * s.v + b2 * s.a) - scheme.alpha_m * s.a
        out = (self.M[k] @ history.ravel()).reshape(history.shape)
        out = out + (1 - scheme.alpha_f) * at.F + scheme.alpha_f * (s.F - s.f @ s.R.T)
        if s.C is not None:
            out = out + (1 - scheme.alpha_f) * np.tensordot(scheme.rate, s.C, 1) @ at.R.T
        return np.asarray(out)

    def _next(self, k: int, s: LinkState, at: ForcingAt, u: Nodal, A: sp.csr_array, rhs: Nodal) -> LinkState:
        """State of link k at the end of the step; δ = T g, [KED, eq. (5)]."""
        v, a = accelerated(self.scheme, u, s.u, s.v, s.a)
        g = u @ at.R
        Kg = (self.links[k].K0 @ g.ravel()).reshape(g.shape)
        Mu, Mv, Ma = ((self.M[k] @ x.ravel()).reshape(x.shape) for x in (u, v, a))
        C, f = s.C, Kg
        if s.C is not None:
            Cg = self.damping.alpha * Mu @ at.R + self.damping.beta * Kg
            C = np.stack([Cg, *accelerated(self.scheme, Cg, *s.C)])
            f = Kg + C[1]
        port_forces = _end_forces(self.scheme, self.joints[k], s, at.R, self._port_forces(k, A, u, rhs, at.R))
        return LinkState(u, v, a, Mu, Mv, Ma, g, at.R, Kg, f, C, at.F, port_forces)

    def _port_forces(
        self, k: int, A: sp.csr_array, u: Nodal, rhs: Nodal, R: Rotation
    ) -> Float[np.ndarray, " q"]:
        """λ from the residual at the dependent components: A u − r = Wᵀ λ; turned into the link frame."""
        s = self.dependent[k]
        if not len(s):
            return np.zeros(0)
        world = np.linalg.solve(self.Wt[k][s], (A @ u.ravel() - rhs.ravel())[s])
        joint = self.joints[k]
        return np.asarray((port_vectors(joint, world) @ R).ravel()[joint.keep])


def _end_forces(
    scheme: Scheme, joint: Attachment, s: LinkState, R: Rotation, force: Float[np.ndarray, " q"]
) -> Float[np.ndarray, " q"]:
    """λ at the end of a step from the λ of its balance, (1 − α_f) λ1 + α_f λ0, all in the link frame at the end.

    Parameters
    ----------
    s : state at the beginning
    R : orientation at the end
    """
    if not scheme.alpha_f:
        return force
    before = port_rotation(joint, R.T @ s.R) @ s.port_forces
    return np.asarray((force - scheme.alpha_f * before) / (1 - scheme.alpha_f))
