"""Steps with geometric stiffening: the term (K_σ δ) varies, the factored matrices do not.

It is part of the internal force, f = K δ + C δ' + K_σ δ, and so of all that the scheme says of f. What it is at the end
of a step goes to the right-hand side with a predicted δ, and sweeps make it right; the literal step assembles it.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float

from kedfem.dynamics.condensed import CondensedSteps
from kedfem.dynamics.dense import DenseSteps
from kedfem.dynamics.history import Forcing, LinkHistory
from kedfem.dynamics.literal import LiteralSteps
from kedfem.dynamics.model import Model
from kedfem.dynamics.scheme import Scheme
from kedfem.dynamics.state import LinkState, Nodal, Nominal
from kedfem.dynamics.stiffening import SETTLED, SWEEPS, Stiffening, StressModes, swept

ROUNDING = 1e-15  # of the largest eigenvalue


class StiffenedCondensed(CondensedSteps):
    """Condensed steps; each sweep is one more pair of triangular solves per link."""

    def __init__(self, model: Model, scheme: Scheme, stiffening: Stiffening) -> None:
        super().__init__(model.links, model.joints, scheme, model.damping)
        self.stiffening = stiffening

    def advance(
        self, state: list[LinkState], forcing: Sequence[Forcing]
    ) -> tuple[list[LinkHistory], list[LinkState]]:
        """All time points of a block; see `DenseSteps.advance`."""
        return super().advance(state, self.stiffening.stressed(forcing))

    def step(self, states: Sequence[LinkState], at: Sequence[Nominal]) -> list[LinkState]:
        """States of all links one step later; see `CondensedSteps.step`."""
        turnings = self.stiffening.turnings(at)
        rhs = [self._rhs(s, nominal) for s, nominal in zip(states, at, strict=True)]
        first = [predicted(s, self.scheme.h) @ nominal.R for s, nominal in zip(states, at, strict=True)]
        full, g, forces = swept(
            self.parts, [now.R for now in at], rhs, first, turnings, 1 - self.scheme.alpha_f
        )
        new = [self._next(k, states[k], at[k], g[k], full[k], forces[k]) for k in range(len(self.links))]
        return [replace(s, f=s.f + k(s.g)) for s, k in zip(new, turnings, strict=True)]


class StiffenedLiteral(LiteralSteps):
    """Literal steps with K_σ in the assembled matrix."""

    def __init__(self, model: Model, scheme: Scheme, stiffening: Stiffening) -> None:
        super().__init__(model.links, model.joints, scheme, model.damping)
        self.stiffening = stiffening

    def advance(
        self, state: list[LinkState], forcing: Sequence[Forcing]
    ) -> tuple[list[LinkHistory], list[LinkState]]:
        """All time points of a block; see `DenseSteps.advance`."""
        return super().advance(state, self.stiffening.stressed(forcing))

    def step(self, states: Sequence[LinkState], at: Sequence[Nominal]) -> list[LinkState]:
        """States of all links one step later; see `CondensedSteps.step`."""
        new = super().step(states, at)
        return [replace(s, f=s.f + k(s.g)) for s, k in zip(new, self.stiffening.turnings(at), strict=True)]

    def _matrices(self, at: Sequence[Nominal]) -> list[sp.csr_array]:
        share = 1 - self.scheme.alpha_f
        return [
            sp.csr_array(A + share * k)
            for A, k in zip(super()._matrices(at), self.stiffening.stiffness(at), strict=True)
        ]


class StiffenedDense(DenseSteps):
    """Steps of small links in one compiled loop."""

    def __init__(self, model: Model, scheme: Scheme, stiffening: Stiffening) -> None:
        super().__init__(model.links, model.joints, scheme, model.damping)
        self.stiffening = stiffening
        T = [part.T[0] for part in self.parts]
        dense = [t.T @ _dense(modes) @ t for t, modes in zip(T, stiffening.modes, strict=True)]
        # k_i = Σ_j r_ji q_j, q_j orthonormal as vectors of entries
        self._qr = [np.linalg.qr(k.reshape(len(k), -1).T) for k in dense]
        D, L = self._sizes[0], len(self.links)
        self._P = np.zeros((L, D, D))
        for i, (link, modes) in enumerate(zip(self.links, stiffening.modes, strict=True)):
            self._P[i, : link.d, : link.d] = modes.P

    def _loop(
        self,
        forcing: Sequence[Forcing],
        padded: tuple[np.ndarray, np.ndarray],
        state: tuple[np.ndarray, ...],
        history: tuple[np.ndarray, ...],
    ) -> None:
        from kedfem.dynamics.stiffened_kernel import advance_stiffened

        s, k = self._terms(forcing)
        limits = (self.scheme.h, SETTLED, SWEEPS)
        stressed = (s, k, self._P)
        advance_stiffened(
            self.coefficients, limits, self._matrices, *self._unknowns, padded, stressed, state, history
        )

    def _terms(self, forcing: Sequence[Forcing]) -> tuple[np.ndarray, np.ndarray]:
        """Factors (T, L, m) and matrices (L, m, S, S) of k over a block, as few as it takes."""
        few = [
            fewer_terms(each.stress @ r.T)
            for each, (_, r) in zip(self.stiffening.stressed(forcing), self._qr, strict=True)
            if each.stress is not None
        ]
        n, L, most = self._sizes[1], len(self.links), max(s.shape[1] for s, _ in few)
        s, k = np.zeros((len(few[0][0]), L, most)), np.zeros((L, most, n, n))
        for i, (link, (factors, V), (q, _)) in enumerate(zip(self.links, few, self._qr, strict=True)):
            s[:, i, : factors.shape[1]] = factors
            k[i, : factors.shape[1], : link.n, : link.n] = (q @ V).T.reshape(-1, link.n, link.n)
        return s, k


def fewer_terms(
    a: Float[np.ndarray, "T m"],
) -> tuple[Float[np.ndarray, "T r"], Float[np.ndarray, "m r"]]:
    """Factors s and V with a = s Vᵀ, but for rounding of aᵀ a: what a few turns of a linkage need is little."""
    values, vectors = np.linalg.eigh(a.T @ a)
    V = vectors[:, values > ROUNDING * values[-1]]
    return a @ V, V


def predicted(s: LinkState, h: float) -> Nodal:
    """δ one step later with constant δ''."""
    return s.u + h * s.v + h**2 / 2 * s.a


def _dense(modes: StressModes) -> Float[np.ndarray, "m n n"]:
    """The stress stiffness of all modes."""
    found = [modes.stiffness(s) for s in np.eye(len(modes.states))]
    return np.array([k.toarray() if sp.issparse(k) else k for k in found])
