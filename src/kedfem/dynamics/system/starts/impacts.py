"""Impacts on stops with damping within a step: their times, and the states in which the force c e' begins.

`march` divides the step there. Before that time the stop is left out, so that both parts of the step are smooth;
between them the force changes the accelerations, with the matrix of the second part. At the end of a contact, and at
its beginning without damping, the force is continuous: such steps keep their order undivided.
"""

import numpy as np

from kedfem.arrays import Bool, Float
from kedfem.dynamics.matrices.bordered import ConstraintTerms
from kedfem.dynamics.system.arrays import Constraints
from kedfem.dynamics.system.ready import Motion, Ready
from kedfem.dynamics.system.sparse import SparsePart, momentum
from kedfem.dynamics.system.starts.accelerations import in_a_step
from kedfem.dynamics.system.starts.instant import Instant
from kedfem.dynamics.system.starts.internal_forces import own
from kedfem.dynamics.system.state import History, State, copied

Coordinates = Float[np.ndarray, " r"]


def apart_from(of: Constraints, e: Coordinates) -> Bool[np.ndarray, " r"]:
    """Stops with damping between whose limits a coordinate is."""
    return np.asarray(of.jumps & (of.numbers[:, 0] <= e) & (e <= of.numbers[:, 1]))


def without(of: Constraints, which: Bool[np.ndarray, " r"]) -> Constraints:
    """The same without some stops: their limits are out of reach."""
    numbers = of.numbers.copy()
    numbers[which, 0], numbers[which, 1] = -np.inf, np.inf
    return of._replace(numbers=numbers, jumps=of.jumps & ~which)


def met_at(of: Constraints, state: State, reached: History, h: float) -> Coordinates:
    """When each coordinate first passes a limit, of a step in which none pushes: on the cubic through both ends."""
    out = np.full(len(of.law), np.inf)
    for n in np.flatnonzero(of.jumps):
        e0, e1, v0, v1 = state.e[0, n], reached.e[-1, n], h * state.e[1, n], h * reached.rate[-1, n]
        for limit in of.numbers[n, :2]:
            if (limit - e0) * (e1 - limit) >= 0 and e1 != e0 and np.isfinite(limit):
                cubic = np.polynomial.Polynomial([e0 - limit, v0, 3 * (e1 - e0) - 2 * v0 - v1, 2 * (e0 - e1) + v0 + v1])
                roots = cubic.roots()
                real = roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real >= -1e-9) & (roots.real <= 1 + 1e-9)]
                out[n] = min(out[n], float(np.clip(real, 0.0, 1.0).min(initial=1.0)))
    return out


def pushed(of: Ready, state: State, between: Motion, met: Bool[np.ndarray, " r"]) -> State:
    """The state at which stops begin to push, with −c e' each."""
    state = copied(state)
    now = Instant(of, between, float(state.time[0]))
    z = state.z[:, now.always.number]
    C = now.gradients(z[0])
    m = np.where(met, -of.constraints.numbers[:, 3] * now.coordinates(z)[1], 0.0)
    hard = now.hard(C)
    none = np.zeros(int(hard.sum()))
    R = np.stack(
        [each.R for each in now.internal_states(state.u, state.v)]
    )  # links may have turned far from rigid-body motion
    found = in_a_step(now, np.zeros_like(state.u), ConstraintTerms(C[hard], none, none, C.T @ m), R)
    m[hard] += found.m
    state.a[:] += found.x
    if found.f is not None:
        state.f[:] += found.f
    state.port_force[:] += found.forces
    state.multiplier[:] += m
    state.z[2, now.always.number] += found.z
    state.e[2] += C @ found.z
    state.bearing[now.always.number] += C.T @ m
    for k, part in enumerate(of.parts):
        if isinstance(part, SparsePart):
            here = own(of, k)
            state.momentum[2, here] += momentum(of.system.model.links[k], found.x[here])
    return state
