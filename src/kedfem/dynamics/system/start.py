"""Where a march begins: rates as given, and accelerations that balance forces and keep all constraints."""

from collections.abc import Callable, Sequence

import numpy as np
import scipy.linalg
from jaxtyping import Float

from kedfem.dynamics.dense import coordinates
from kedfem.dynamics.system.arrays import Bodies, Constraints, Driving, State
from kedfem.dynamics.system.blank import empty_state, empty_trial, room
from kedfem.dynamics.system.layout import as_arrays, factored
from kedfem.dynamics.system.march import Ready, driving
from kedfem.motion.rigid import RigidMotion

INSTANTS = 5  # of one-sided differences of fourth and third order over a step
FIRST = np.array([-25.0, 48.0, -36.0, 16.0, -3.0]) / 12
SECOND = np.array([35.0, -104.0, 114.0, -56.0, 11.0]) / 12


def rest(
    of: Ready, motion_at: Callable[[Float[np.ndarray, " T"]], RigidMotion], rates: Sequence[np.ndarray] | None = None,
    time: float = 0.0,
) -> State:  # fmt: skip
    """The state at a time without elastic displacement.

    Parameters
    ----------
    motion_at : nominal motion at given times
    rates : per body (n, d) δ', world components, joints closed; none if not given
    """
    bodies, constraints = of.bodies, of.constraints
    state = empty_state(bodies, constraints)
    model, h = of.system.model, of.c.h / INSTANTS
    along = driving(of, motion_at(time + h * np.arange(INSTANTS)))
    state.time[0] = time
    state.F[:] = along.F[0]
    for k, rows in enumerate(rates or []):
        state.v[bodies.at[k] : bodies.at[k + 1]] = coordinates(model.links[k], of.parts[k], rows).ravel()
    _accelerated(of, along, h, state)
    return state


def _accelerated(of: Ready, along: Driving, h: float, state: State) -> None:
    """Interface rates, coordinates with their rates, accelerations and all forces, in place."""
    constraints = of.constraints
    z1 = _interface(of, state.v)
    values, C = _coordinates(of, along, h, z1, state)
    state.e[0], state.e[1] = values[0], FIRST @ values / h
    conv = SECOND @ values / h**2
    parts = factored(of.system.model.links, of.system.model.joints)
    still = as_arrays(of.system, parts)[0]
    hard = np.flatnonzero((constraints.law <= 1) & (np.abs(C).max(axis=1, initial=0.0) > 1e-10))
    m = np.zeros(len(constraints.law))
    for a in np.setdiff1d(np.flatnonzero(constraints.law > 1), hard):
        m[a] = _force(constraints, a, state)
    R = along.R[0][of.bodies.motion]
    a, z2, found, forces = _solved(still, R, state.F - state.f, C[hard], -conv[hard], C.T @ m)
    m[hard] = found
    state.a[:], state.port_force[:] = a, forces
    state.z[1], state.z[2] = z1, z2
    state.e[2] = conv + C @ z2
    state.multiplier[:] = m
    state.bearing[:] = C.T @ m


def _interface(of: Ready, x: Float[np.ndarray, " N"]) -> Float[np.ndarray, " k"]:
    """Interface unknowns from coordinates whose joints are closed: B z = W x."""
    bodies = of.bodies
    k = len(bodies.first)
    B, w = [], []
    for i, part in enumerate(of.parts):
        c = bodies.columns[bodies.column_at[i] : bodies.column_at[i + 1]]
        q = int(bodies.port_at[i + 1] - bodies.port_at[i])
        full = np.zeros((q, k))
        full[:, c] = bodies.B[bodies.B_at[i] : bodies.B_at[i + 1]].reshape(q, len(c))
        B.append(full)
        w.append(part.W @ x[bodies.at[i] : bodies.at[i + 1]])
    if not k:
        return np.zeros(0)
    return np.asarray(np.linalg.lstsq(np.concatenate(B), np.concatenate(w), rcond=None)[0])


def _coordinates(
    of: Ready, along: Driving, h: float, z1: np.ndarray, state: State
) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates at a few instants, the interface moving on at its rate, (T, r); their gradients at the first (r, k)."""
    from kedfem.dynamics.system.interface_kernel import evaluated_at

    bodies, ends, constraints = of.bodies, of.ends, of.constraints
    trial, work = empty_trial(bodies, ends, constraints, state), room(bodies)
    values, C = np.zeros((len(along.t), len(constraints.law))), np.zeros((len(constraints.law), len(z1)))
    for t in range(len(along.t)):
        trial.z[:] = h * t * z1
        evaluated_at(of.c, ends, constraints, along, t, state, trial, work)
        values[t] = trial.e
        if t == 0:
            C[:] = trial.C
            state.turned[:] = trial.turned
    return values, C


def _force(constraints: Constraints, a: int, state: State) -> float:
    """Force of a law along its coordinate as it is."""
    from kedfem.dynamics.system.constraints_kernel import law

    out = np.zeros(3)
    law(constraints, a, state.time[0], state.e[0, a], state.e[1, a], out)
    return -float(out[0])


def _solved(
    bodies: Bodies, R: np.ndarray, r: np.ndarray, C: np.ndarray, target: np.ndarray, known: np.ndarray
) -> tuple[np.ndarray, ...]:
    """x of A x = r + Wᵀ λ with joints closed, z, multipliers and port forces; C z = target, world components."""
    k = len(bodies.first)
    H, f, kept = np.zeros((k, k)), known.copy(), []
    for i in range(len(bodies.motion)):
        N, q = int(np.diff(bodies.at)[i]), int(np.diff(bodies.port_at)[i])
        d, c = int(bodies.components[i]), bodies.columns[bodies.column_at[i] : bodies.column_at[i + 1]]
        turn = np.kron(R[i][:d, :d], np.eye(N // d))
        G, Y, S = (bodies.G[bodies.G_at[i] :][: N * N].reshape(N, N), bodies.Y[bodies.Y_at[i] :][: q * N].reshape(q, N),
                   bodies.S[bodies.S_at[i] :][: q * q].reshape(q, q))  # fmt: skip
        B = bodies.B[bodies.B_at[i] :][: q * len(c)].reshape(q, len(c))
        at = slice(int(bodies.port_at[i]), int(bodies.port_at[i + 1]))
        comp, group = bodies.component[at], bodies.group[at]
        RT = np.where(group[:, None] == group, R[i][comp[:, None], comp], 0.0)
        local = turn.T @ r[bodies.at[i] : bodies.at[i + 1]]
        RB = RT.T @ B
        H[np.ix_(c, c)] += RB.T @ S @ RB
        f[c] += RB.T @ (Y @ local)
        kept.append((turn, G, Y, S, RB, RT, c, local))
    z, m = np.zeros(k), np.zeros(len(C))
    if k:
        beside = np.trace(H) / k / np.maximum((C**2).sum(axis=1), 1e-300)
        system = np.block([[H + (C.T * beside) @ C, C.T], [C, np.zeros((len(C), len(C)))]])
        right = np.concatenate([f + C.T @ (beside * target), target])
        found = scipy.linalg.lstsq(system, right)[0] if len(C) else np.linalg.solve(H, f)
        z, m = found[:k], -found[k:]
    x, forces = np.zeros(len(r)), np.zeros(int(bodies.port_at[-1]))
    for i, (turn, G, Y, S, RB, RT, c, local) in enumerate(kept):
        w = RB @ z[c]
        x[bodies.at[i] : bodies.at[i + 1]] = turn @ (G @ local + Y.T @ w)
        forces[bodies.port_at[i] : bodies.port_at[i + 1]] = RT @ (S @ w - Y @ local)
    return x, z, m, forces
