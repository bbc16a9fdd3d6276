"""Stiffness of bodies with the inertia of their rotation, condensed onto their interface points."""

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from kedfem.arrays import Float
from kedfem.dynamics.system.sparse import SparsePart, momentum
from kedfem.dynamics.system.starts.instant import Flat, Instant
from kedfem.dynamics.system.starts.internal_forces import own
from kedfem.dynamics.system.starts.linear_equations import HeldBody, LinearEquations, held_body
from kedfem.motion.newton import cross_matrix

KRYLOV = 60
LEFT = 1e-4  # of a residual, by GMRES: iterations of the deflection go on, and rounding may leave 1e-8
CONVERGED = 1e-10  # change of an iteration, of the deflection

Spins = Float[np.ndarray, "L 3 3"]


def spins_of(now: Instant) -> Spins:
    """[α]× + [ω]×² of all bodies, world components."""
    alpha = cross_matrix(now.motion.alpha[0][now.of.bodies.motion])
    omega = cross_matrix(now.omega)
    return np.asarray(alpha + omega @ omega)


class RotatingBodies:
    """Bodies with K0 and the inertia of turning, held at their interface points."""

    def __init__(self, now: Instant, spins: Spins | None) -> None:
        self.now, self.spins, self._made = now, spins, list[HeldBody]()
        self.static = now.always.static
        self.sparse = [isinstance(part, SparsePart) for part in now.of.parts]

    def held(self, R: Float[np.ndarray, "L 3 3"]) -> list[HeldBody]:
        """All bodies, the inertia of those that turn as their frames first were: iterations take out the rest."""
        for k in range(len(self._made), len(R)):
            link = self.now.of.system.model.links[k]
            if self.sparse[k] or self.spins is None or not self.spins[k].any():
                self._made.append(self.now.always.held(k))
                continue
            S = (R[k].T @ self.spins[k] @ R[k])[: link.d, : link.d] + self.now.always.least(k) * np.eye(link.d)
            self._made.append(held_body(self.static.K[k] + np.kron(S, np.eye(link.n)), self.now.of.parts[k].W))
        return self._made

    def change(self, balance: LinearEquations, r: Flat, exact: bool = False) -> Flat:
        """What a residual asks for: GMRES puts in the inertia of turning of sparse bodies, and takes out their mass.

        It puts in the stiffness that stresses of the rigid-body motion give, too.

        Parameters
        ----------
        exact : whether it takes out the mass of dense bodies too
        """
        direct = balance.solved(r).x
        if not any(self.sparse) and not exact and self.now.of.stressed is None:
            return direct

        def applied(x: Flat) -> Flat:
            return np.asarray(x + balance.solved(self.left_out(x, exact), alone=True).x)

        whole = LinearOperator((len(r),) * 2, applied, dtype=float)
        return np.asarray(gmres(whole, direct, rtol=LEFT, restart=KRYLOV, maxiter=4)[0])

    def inertia(self, u: Flat) -> Flat:
        """M ([α]× + [ω]×²) u of all bodies."""
        out = np.zeros_like(u)
        for k, S in enumerate(() if self.spins is None else self.spins):
            out[own(self.now.of, k)] = self._momentum(k, S, u)
        return out

    def left_out(self, u: Flat, dense: bool) -> Flat:
        """What matrices of sparse bodies leave out of that, less what they have of mass, and stress stiffness of all.

        Parameters
        ----------
        dense : whether what matrices of dense bodies have of mass is taken off too
        """
        out, none = self.now.stress(u), np.zeros((3, 3))
        for k, sparse in enumerate(self.sparse):
            if sparse or dense:
                S = self.spins[k] if sparse and self.spins is not None else none
                out[own(self.now.of, k)] += self._momentum(k, S - self.now.always.least(k) * np.eye(3), u)
        return out

    def _momentum(self, k: int, S: Float[np.ndarray, "3 3"], u: Flat) -> Flat:
        """M S u of body k; the mass of dense ones is one."""
        link = self.now.of.system.model.links[k]
        along = np.asarray(S[: link.d, : link.d] @ u[own(self.now.of, k)].reshape(link.d, -1)).ravel()
        return momentum(link, along) if self.sparse[k] else along
