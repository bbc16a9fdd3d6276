"""The condensed step: one constant factorisation per link, joints solved on a dozen unknowns.

With geometric stiffening what K_σ δ is at the end of a step goes to the right-hand side, and iterations make it right.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from kedfem.dynamics.constraint_matrices import JointRows
from kedfem.dynamics.coupling import Attachment
from kedfem.dynamics.history import Forcing, LinkHistory, stepwise
from kedfem.dynamics.interface import RowState, Tie
from kedfem.dynamics.ports import Rotation, add_port_forces, port_rotation
from kedfem.dynamics.scheme import Scheme
from kedfem.dynamics.state import LinkState, Nodal, Nominal, Rayleigh, accelerated
from kedfem.dynamics.stiffening import Stiffening, Turning, predicted, swept, with_turnings
from kedfem.dynamics.substructure import effective_coefficients, factored, tied
from kedfem.dynamics.tied import Begun, stepwise_tied
from kedfem.links.record import Link, mass_times


class CondensedSteps:
    """Advances all links by generalised-α steps; the effective matrices are factored once, here.

    Everything but one mass product and one pair of triangular solves per link follows by recurrence.
    """

    def __init__(
        self, links: Sequence[Link], joints: Sequence[Attachment], scheme: Scheme, damping: Rayleigh,
        stiffening: Stiffening | None = None,
    ) -> None:  # fmt: skip
        self.links, self.scheme, self.damping, self.stiffening = links, scheme, damping, stiffening
        self.c_M, self.c_K = effective_coefficients(scheme, damping)
        self.parts = [
            factored(link, joint, self.c_M, self.c_K) for link, joint in zip(links, joints, strict=True)
        ]
        self.factorisations = len(self.parts)

    def begin(self, states: Sequence[LinkState], rows: RowState | None = None) -> Begun:
        """The state of the first time point."""
        return Begun(list(states), rows)

    def advance(
        self, state: Begun, forcing: Sequence[Forcing], rows: JointRows | None = None
    ) -> tuple[list[LinkHistory], Begun]:
        """All time points of a block; see `DenseSteps.advance`."""
        if self.stiffening is not None:
            forcing = self.stiffening.stressed(forcing)
        if rows is None:
            links, last = stepwise(self.step, state.links, forcing)
            return links, Begun(last)
        return stepwise_tied(self.tied_step, state, forcing, rows, self.scheme)

    def step(self, states: Sequence[LinkState], at: Sequence[Nominal]) -> list[LinkState]:
        """States of all links one step later, [KED, eq. (20)].

        Parameters
        ----------
        states : now
        at : orientation and P − M R0'' of each link at the end of the step
        """
        if self.stiffening is not None:
            rhs = [self._rhs(s, nominal) for s, nominal in zip(states, at, strict=True)]
            return self._stiffened(states, at, rhs, self.stiffening.turnings(at))
        return self.tied_step(states, at, None)[0]

    def tied_step(
        self, states: Sequence[LinkState], at: Sequence[Nominal], tie: Tie | None
    ) -> tuple[list[LinkState], Float[np.ndarray, " k"], Float[np.ndarray, " r"]]:
        """The same where joints are enforced by constraint equations; also the interface unknowns and the rows'
        forces."""
        rhs = [self._rhs(s, nominal) for s, nominal in zip(states, at, strict=True)]
        g, forces, z, m = tied(self.parts, [nominal.R for nominal in at], rhs, tie)
        return (
            [self._next(k, states[k], at[k], g[k], rhs[k], forces[k]) for k in range(len(self.links))],
            z,
            m,
        )

    def _stiffened(
        self, states: Sequence[LinkState], at: Sequence[Nominal], rhs: Sequence[Nodal],
        turnings: Sequence[Turning],
    ) -> list[LinkState]:  # fmt: skip
        """The same with K_σ δ in the internal force; each iteration is one more pair of triangular solves per link."""
        first = [predicted(s, self.scheme.h) @ nominal.R for s, nominal in zip(states, at, strict=True)]
        share = 1 - self.scheme.alpha_f
        full, g, forces = swept(self.parts, [now.R for now in at], rhs, first, turnings, share)
        new = [self._next(k, states[k], at[k], g[k], full[k], forces[k]) for k in range(len(self.links))]
        return with_turnings(new, turnings)

    def _rhs(self, s: LinkState, at: Nominal) -> Nodal:
        """History + (P − M R0''), link frame at the end of the step."""
        scheme = self.scheme
        c_m, c_f = 1 - scheme.alpha_m, 1 - scheme.alpha_f
        b = c_m * scheme.acceleration
        total = b[0] * s.Mu
        total += b[1] * s.Mv
        total += (b[2] - scheme.alpha_m) * s.Ma
        total += c_f * at.F if scheme.alpha_f else at.F
        if scheme.alpha_f:
            total += scheme.alpha_f * (s.F - s.f @ s.R.T)
        out = total @ at.R
        if s.C is not None:
            out += c_f * np.tensordot(scheme.rate, s.C, 1)
        return np.asarray(out)

    def _next(
        self, k: int, s: LinkState, at: Nominal, g: Nodal, rhs: Nodal, port_force: Float[np.ndarray, " q"]
    ) -> LinkState:
        """State of link k at the end of the step; δ = T g, [KED, eq. (5)], and the rest by recurrence."""
        link, scheme = self.links[k], self.scheme
        u = g @ at.R.T
        Mu = mass_times(link.mass, u)
        v, a = accelerated(scheme, u, s.u, s.v, s.a)
        Mv, Ma = accelerated(scheme, Mu, s.Mu, s.Mv, s.Ma)
        # A g = r + Wᵀ λ is known, so K0 g needs no product: c_K K0 g = r + Wᵀ λ − c_M M g
        Kg = Mu @ at.R  # M g
        Cg = self.damping.alpha * Kg if s.C is not None else None
        Kg *= -self.c_M
        Kg += rhs
        add_port_forces(Kg, self.parts[k].attachment, port_force)
        Kg /= self.c_K
        C, f = s.C, Kg
        if s.C is not None and Cg is not None:
            Cg += self.damping.beta * Kg
            C = np.stack([Cg, *accelerated(scheme, Cg, *s.C)])
            f = Kg + C[1]
        end_force = end_forces(scheme, self.parts[k].attachment, s, at.R, port_force)
        return LinkState(u, v, a, Mu, Mv, Ma, g, at.R, Kg, f, C, at.F, end_force)


def end_forces(
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
