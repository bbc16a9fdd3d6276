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
        D, n, _ = self._sizes
        most = max(len(modes.states) for modes in stiffening.modes)
        self._k, self._P = np.zeros((len(self.links), most, n, n)), np.zeros((len(self.links), D, D))
        for i, (link, modes) in enumerate(zip(self.links, stiffening.modes, strict=True)):
            T = self.parts[i].T[0]
            self._k[i, : len(modes.states), : link.n, : link.n] = T.T @ _dense(modes) @ T
            self._P[i, : link.d, : link.d] = modes.P

    def _loop(
        self,
        forcing: Sequence[Forcing],
        padded: tuple[np.ndarray, np.ndarray],
        state: tuple[np.ndarray, ...],
        history: tuple[np.ndarray, ...],
    ) -> None:
        from kedfem.dynamics.stiffened_kernel import advance_stiffened

        s = np.zeros((len(padded[0]), *self._k.shape[:2]))
        for i, each in enumerate(self.stiffening.stressed(forcing)):
            if each.stress is not None:
                s[:, i, : each.stress.shape[1]] = each.stress
        limits = (self.scheme.h, SETTLED, SWEEPS)
        stressed = (s, self._k, self._P)
        advance_stiffened(
            self.coefficients, limits, self._matrices, *self._unknowns, padded, stressed, state, history
        )


def predicted(s: LinkState, h: float) -> Nodal:
    """δ one step later with constant δ''."""
    return s.u + h * s.v + h**2 / 2 * s.a


def _dense(modes: StressModes) -> Float[np.ndarray, "m n n"]:
    """The stress stiffness of all modes."""
    found = [modes.stiffness(s) for s in np.eye(len(modes.states))]
    return np.array([k.toarray() if sp.issparse(k) else k for k in found])
