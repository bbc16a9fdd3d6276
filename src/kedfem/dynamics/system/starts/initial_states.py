"""Initial states without deflection: given rates, and accelerations that balance forces and satisfy all constraints.

Rates of constraints are exact (`coordinate_rates`), those of the bars of rigid links too.
"""

from collections.abc import Callable, Sequence

import numpy as np
import scipy.sparse as sp

from kedfem.dynamics.matrices.bordered import ConstraintTerms
from kedfem.dynamics.matrices.dense import coordinates, work_on
from kedfem.dynamics.system.ready import Ready
from kedfem.dynamics.system.starts.accelerations import accelerations
from kedfem.dynamics.system.starts.instant import Flat, Instant, Motion, term_angles
from kedfem.dynamics.system.starts.internal_forces import own, put_momenta, store_internal_state
from kedfem.dynamics.system.starts.linear_equations import LinearEquations, Solved
from kedfem.dynamics.system.state import State, empty_state

Accelerated = Callable[[Instant, Flat, Flat, Flat, ConstraintTerms], Solved]


def rest(
    of: Ready, motion_at: Motion, rates: Sequence[np.ndarray] | None = None, time: float = 0.0,
    accelerated: Accelerated = accelerations,
) -> State:  # fmt: skip
    """The state at a time without elastic displacement.

    Parameters
    ----------
    motion_at : rigid-body motion at given times
    rates : per body (n, d) δ', world components; none if not given. They are changed as little as can be, in kinetic
        energy, to keep all constraints
    accelerated : accelerations under given forces, `accelerated_in_a_step` where springs or motors pull at once
    """
    now = Instant(of, motion_at, time)
    v = as_coordinates(of, rates or [])
    return begun(now, np.zeros_like(v), v, accelerated)


def as_coordinates(of: Ready, given: Sequence[np.ndarray]) -> Flat:
    """Nodal rows (n, d) of all bodies as coordinates; zero if not given."""
    out = np.zeros(int(of.bodies.at[-1]))
    for k, each in enumerate(given):
        out[own(of, k)] = coordinates(of.system.model.links[k], of.parts[k], each).ravel()
    return out


def as_work(of: Ready, forces: Sequence[np.ndarray]) -> Flat:
    """Nodal forces (n, d) of all bodies on their coordinates."""
    return np.concatenate([work_on(part, each).ravel() for part, each in zip(of.parts, forces, strict=True)])


def begun(
    now: Instant, u: Flat, v: Flat, accelerated: Accelerated = accelerations, strained: Flat | None = None
) -> State:
    """The state with given displacements, rates made to keep all constraints, and accelerations, [KED, eq. (20)].

    Parameters
    ----------
    strained : the rates as bodies are strained by them, if these are known to more digits
    """
    of = now.of
    z, none = now.interface(u), np.zeros(of.system.unknowns)
    now.check_lines(z)
    C = now.gradients(z)
    hard = now.hard(C)
    closing = _closing(now, C[hard], now.coordinates(np.stack([z, now.interface(v), none]))[1, hard])
    strained, v = (v if strained is None else strained) + closing, v + closing
    z1 = now.interface(v)
    e = now.coordinates(np.stack([z, z1, none]))
    m = np.where(hard, 0.0, now.forces(e)[:, 0])
    asked = ConstraintTerms(C[hard], -e[2, hard], np.zeros(int(hard.sum())), C.T @ m)
    inside = now.internal_states(u, strained)
    found = accelerated(now, now.F - np.concatenate([x.f for x in inside]), u, v, asked)
    m[hard] = found.m
    e[2] += C @ found.z
    state = empty_state(of.bodies, of.constraints)
    for k, each in enumerate(inside):
        store_internal_state(of, k, each, state)
    if found.f is not None:
        state.f[:] += found.f
    state.time[0], state.F[:], state.u[:], state.v[:] = now.time, now.F, u, v
    state.z[:, now.always.number] = np.stack([z, z1, found.z])
    state.a[:], state.port_force[:] = found.x, found.forces
    state.e[:], state.multiplier[:], state.bearing[now.always.number] = e, m, C.T @ m
    state.term_angles[:] = term_angles(now, z)
    put_momenta(of, state)
    return state


def _closing(now: Instant, C: sp.csr_array, open_: Flat) -> Flat:
    """The smallest change of rates, in kinetic energy, that closes constraints."""
    of = now.of
    none = np.zeros(int(of.bodies.at[-1]))
    if not np.abs(open_).max(initial=0.0):
        return none
    held = [now.always.mass(k) for k in range(len(of.parts))]
    asked = ConstraintTerms(C, -open_, np.zeros(len(open_)), np.zeros(of.system.unknowns))
    return LinearEquations(of, held, now.R, asked).solved(none).x
