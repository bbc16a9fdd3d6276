"""One step of a system, compiled by numba: begin, passes over the interface, finish; and the loop over a block of steps.

    r = history + c_f (F − f),   g = G Rᵀ r + Y w,   λ = S w − Yᵀ Rᵀ r,   w = Rᵀ B z − W Rᵀ b

A linear system is done after one pass. Otherwise frames, constraints and laws are evaluated where the pass has led,
Anderson acceleration chooses the step to take, and again.
"""

import numpy as np

from kedfem.compiled import compiled, inner
from kedfem.dynamics.beams_kernel import begun, ended
from kedfem.dynamics.mixing_kernel import mixed
from kedfem.dynamics.system.algebra_kernel import (
    add_transposed,
    copied,
    frame_copied,
    ports_turned,
    product,
    turned,
    turned_back,
)
from kedfem.dynamics.system.bodies_kernel import (
    internal_forces,
    newmark,
    nominal_end,
    orientation,
    own_end,
    residual,
    right_hand_side,
)
from kedfem.dynamics.system.constraints_kernel import coordinate
from kedfem.dynamics.system.ends_kernel import on_lines, placed
from kedfem.dynamics.system.interface_kernel import (
    evaluated,
    gathered,
    interface_solved,
    newmark_rate,
    offset,
    pushed,
)
from kedfem.dynamics.system.record import NOMINAL
from kedfem.dynamics.system.reference import reference

PASSES = 40  # in a step, of which it takes 2 to 6
PATIENCE, EASIER = 14, 100.0  # after so many a larger change is taken, and counted


@compiled
def marched(c, bodies, ends, of, driving, state, trial, work, history, solved):  # type: ignore[no-untyped-def]
    """Take T steps in place; how many converged, and the body that moved most in the one that did not.

    Parameters
    ----------
    solved : called with the number of a sparse body, see `sparse.solver`
    """
    c, bodies, ends, of, driving = (
        reference(c),
        reference(bodies),
        reference(ends),
        reference(of),
        reference(driving),
    )
    state, trial, work, history = reference(state), reference(trial), reference(work), reference(history)
    for t in range(len(driving.t)):
        begin(c, bodies, ends, of, driving, t, state, trial, work, solved)
        converged, worst = passes(c, bodies, ends, of, driving, t, state, trial, work, solved)
        if not converged:
            return t, worst
        finish(c, bodies, ends, of, driving, t, state, trial, work, history)
    return len(driving.t), -1


@inner
def begin(c, bodies, ends, of, driving, t, state, trial, work, solved):  # type: ignore[no-untyped-def]
    """The predictor, right-hand sides of bodies with nominal frames, the common matrix of z."""
    R, h = driving.R[t], c.h
    copied(state.turned, trial.turned)
    for m in range(len(trial.z)):
        later = state.z[0, m] + h * state.z[1, m] + h * h / 2 * state.z[2, m]
        trial.z[m] = 0.0 if c.single else later
    for i in range(len(bodies.motion)):
        first, last = bodies.at[i], bodies.at[i + 1]
        q, N = bodies.port_at[i + 1] - bodies.port_at[i], last - first
        if bodies.frame[i] == NOMINAL:
            frame_copied(R[bodies.motion[i]], trial.Rp[i])
            right_hand_side(c, bodies, i, trial.Rp[i], driving.F[t], state, trial.r, work.room)
            if not bodies.dense[i]:
                solved(i)
            else:
                reaction = trial.reaction[bodies.port_at[i] : bodies.port_at[i + 1]]
                product(bodies.Y, bodies.Y_at[i], q, N, trial.r[first:last], reaction)
            continue
        for x in range(first, last):
            trial.u[x] = state.u[x] + h * state.v[x] + h * h / 2 * state.a[x]
        frame_copied(state.Q[i], trial.Q[i])
        trial.angle[i] = state.angle[i]
    if not c.single:
        begun(newmark(c), bodies.beams, R, state.strain, state.direction, trial.base, trial.resisted)
        internal_forces(c, bodies, R, driving.amounts[t], state, trial, work)
        for i in range(len(bodies.motion)):
            if bodies.frame[i] != NOMINAL:
                orientation(bodies, i, R, trial.u, trial, trial.Rp[i])
    gathered(bodies, trial)
    if of.linear.any():
        on_lines(ends, driving.stations[t])
        trial.part[:] = 0.0
        placed(ends, R, driving.p[t], trial.part, trial.fixed, work.end, work.vectors)


@inner
def passes(c, bodies, ends, of, driving, t, state, trial, work, solved):  # type: ignore[no-untyped-def]
    """Pass after pass, until none asks for a change; whether that came, and the body that moved most."""
    memory = (state.pairs, state.products, state.last, trial.mixing)
    R, worst, count = driving.R[t], -1, 0
    for sweep in range(PASSES):
        count = sweep + 1
        asked(c, bodies, ends, of, driving, t, sweep, state, trial, work, solved)
        size, reached, worst = sizes(c, bodies, state, trial)
        allowed = c.tolerance if sweep < PATIENCE else EASIER * c.tolerance
        settled = c.single or size <= allowed * allowed * reached + c.floor * c.floor
        if not settled:
            mixed(memory, state.counts, sweep, trial.change)
        taken(c, bodies, trial)
        if not np.isfinite(size) or size > 1e30:
            break
        if not c.single:
            internal_forces(c, bodies, R, driving.amounts[t], state, trial, work)
        if settled:
            state.passes[0] += count
            state.passes[1] += 1 if sweep >= PATIENCE else 0
            state.passes[2] = max(state.passes[2], count)
            return True, worst
    state.passes[0] += count
    state.counts[:] = 0.0
    return False, worst


@inner
def asked(c, bodies, ends, of, driving, t, sweep, state, trial, work, solved):  # type: ignore[no-untyped-def]
    """The change of bodies with frames of their own, and of z, that a pass asks for."""
    trial.right[:] = 0.0
    for m in range(len(trial.z)):
        trial.right[m] = c.alpha_f * state.bearing[m]
    for i in range(len(bodies.motion)):
        first, last, d = bodies.at[i], bodies.at[i + 1], bodies.components[i]
        q, N, own = bodies.port_at[i + 1] - bodies.port_at[i], last - first, bodies.frame[i] != NOMINAL
        if own:
            residual(c, bodies, i, trial.Rp[i], driving.F[t], trial.u, state, trial, trial.r, work.room)
            if bodies.dense[i]:
                reaction = trial.reaction[bodies.port_at[i] : bodies.port_at[i + 1]]
                product(bodies.Y, bodies.Y_at[i], q, N, trial.r[first:last], reaction)
            else:
                solved(i)
            turned_back(trial.Rp[i], d, trial.u[first:last], work.y[:N])
        offset(bodies, i, work.y, trial, own)
        pushed(bodies, i, trial)
    evaluated(c, ends, of, driving, t, state, trial, work)
    interface_solved(bodies, trial, sweep == 0)
    for i in range(len(bodies.motion)):
        ported(bodies, i, trial)
        if bodies.frame[i] != NOMINAL:
            first, last, d = bodies.at[i], bodies.at[i + 1], bodies.components[i]
            q, N, to = bodies.port_at[i + 1] - bodies.port_at[i], last - first, bodies.passed[i]
            if bodies.dense[i]:
                product(bodies.G, bodies.G_at[i], N, N, trial.r[first:last], work.y)
            else:
                copied(trial.held[first:last], work.y[:N])
            add_transposed(
                bodies.Y, bodies.Y_at[i], q, N, trial.w[bodies.port_at[i] : bodies.port_at[i + 1]], work.y
            )
            turned(trial.Rp[i], d, work.y[:N], trial.change[to : to + N])
            for x in range(to, to + N):
                trial.change[x] *= bodies.size[i]
    k = len(trial.z)
    for m in range(k):
        trial.change[len(trial.change) - k + m] = c.weight * trial.dz[m]


@inner
def ported(bodies, i, trial):  # type: ignore[no-untyped-def]
    """trial.w and trial.force become displacements and forces at a body's interface points, in its frame."""
    first, last, c = bodies.port_at[i], bodies.port_at[i + 1], bodies.column_at[i + 1] - bodies.column_at[i]
    q, at = last - first, bodies.B_at[i]
    RB, w, dz, columns = (
        trial.RB,
        trial.w,
        trial.dz,
        bodies.columns[bodies.column_at[i] : bodies.column_at[i + 1]],
    )
    for r in range(q):
        for m in range(c):
            w[first + r] += RB[at + r * c + m] * dz[columns[m]]
    product(bodies.S, bodies.S_at[i], q, q, trial.w[first:last], trial.force[first:last])
    for r in range(first, last):
        trial.force[r] -= trial.reaction[r]


@inner
def sizes(c, bodies, state, trial):  # type: ignore[no-untyped-def]
    """Squares of the change asked for, and of what a step has moved; the body that changes most."""
    size, reached, most, worst, k = 0.0, 0.0, -1.0, -1, len(trial.z)
    change, u, u0 = trial.change, trial.u, state.u
    for i in range(len(bodies.motion)):
        if bodies.frame[i] == NOMINAL:
            continue
        own, to = 0.0, bodies.passed[i]
        for x in range(bodies.at[i], bodies.at[i + 1]):
            own += change[to + x - bodies.at[i]] ** 2
            reached += (bodies.size[i] * (u[x] - u0[x])) ** 2
        size += own
        if own > most:
            most, worst = own, i
    alone = worst < 0
    for m in range(k):
        size += trial.change[len(trial.change) - k + m] ** 2
        reached += (c.weight * (trial.z[m] + (trial.dz[m] if alone else -state.z[0, m]))) ** 2
    return size, reached, worst


@inner
def taken(c, bodies, trial):  # type: ignore[no-untyped-def]
    """The change becomes part of the end of the step."""
    u, change = trial.u, trial.change
    for i in range(len(bodies.motion)):
        if bodies.frame[i] != NOMINAL:
            for x in range(bodies.at[i + 1] - bodies.at[i]):
                u[bodies.at[i] + x] += change[bodies.passed[i] + x] / bodies.size[i]
    k = len(trial.z)
    for m in range(k):
        trial.z[m] += trial.change[len(trial.change) - k + m] / c.weight


@inner
def finish(c, bodies, ends, of, driving, t, state, trial, work, history):  # type: ignore[no-untyped-def]
    """What the passes found becomes the state, and row t of the history."""
    R, F = driving.R[t], driving.F[t]
    for i in range(len(bodies.motion)):
        first, last = bodies.at[i], bodies.at[i + 1]
        q, N, of_ports = bodies.port_at[i + 1] - bodies.port_at[i], last - first, bodies.port_at[i]
        if bodies.frame[i] != NOMINAL:
            own_end(c, bodies, i, R, F, trial.u, state, trial, history, t, work)
        else:
            if bodies.dense[i]:
                product(bodies.G, bodies.G_at[i], N, N, trial.r[first:last], work.y)
            else:
                copied(trial.held[first:last], work.y[:N])
            add_transposed(bodies.Y, bodies.Y_at[i], q, N, trial.w[of_ports:], work.y)
            copied(trial.r[first:last], work.turned[:N])
            add_transposed(bodies.W, bodies.Y_at[i], q, N, trial.force[of_ports:], work.turned)
            nominal_end(
                c, bodies, i, trial.Rp[i], F, work.y, work.turned, state, history, t, work.room, work.strained
            )
        ports_turned(bodies, i, trial.Rp[i], trial.force[of_ports : of_ports + q], work.room)
        for r in range(q):
            x = (work.room[r] - c.alpha_f * state.port_force[of_ports + r]) / (1 - c.alpha_f)
            state.port_force[of_ports + r] = history.port_force[t, of_ports + r] = x
    if not c.single:
        ended(t, newmark(c), bodies.beams, R, trial.strained, state.strain, state.direction, state.turn, history.strain,
              history.energy)  # fmt: skip
    constraints_end(c, ends, of, driving, t, state, trial, work, history)
    n0, n1, n2 = c.acceleration
    for m in range(len(trial.z)):
        second = n0 * (trial.z[m] - state.z[0, m]) - n1 * state.z[1, m] - n2 * state.z[2, m]
        state.z[1, m] += c.late * second + c.early * state.z[2, m]
        state.z[0, m], state.z[2, m] = trial.z[m], second
        history.z[t, m] = trial.z[m]
    state.time[0] = driving.t[t]


@inner
def constraints_end(c, ends, of, driving, t, state, trial, work, history):  # type: ignore[no-untyped-def]
    """Coordinates with their rates, forces along them, and their sum on z, at the end of the step."""
    share = 1 - c.alpha_f
    n0, n1, n2 = c.acceleration
    if not of.linear.all():
        placed(ends, driving.R[t], driving.p[t], trial.z, trial.moving, work.end, work.vectors)
    state.bearing[:] = 0.0
    for a in range(len(of.law)):
        e, rate = 0.0, 0.0
        if of.linear[a]:
            for m in range(len(trial.z)):
                e += trial.C[a, m] * trial.z[m]
        else:
            trial.part[:] = 0.0
            nominal = (driving.R[t], driving.v[t], driving.omega[t])
            e, rate = coordinate(
                ends, of, a, nominal, trial.moving, trial.turned, trial.part, work.end, work.vectors
            )
            if of.drive[a] >= 0:
                e -= driving.drives[t, of.drive[a]]
        second = n0 * (e - state.e[0, a]) - n1 * state.e[1, a] - n2 * state.e[2, a]
        state.e[1, a] += c.late * second + c.early * state.e[2, a]
        state.e[0, a], state.e[2, a] = e, second
        history.rate[t, a] = state.e[1, a]
        if not of.linear[a] and of.drive[a] < 0:
            history.rate[t, a] = rate
            for m in range(len(trial.z)):
                z0, z1, z2 = state.z[0, m], state.z[1, m], state.z[2, m]
                history.rate[t, a] += trial.part[m] * newmark_rate(c, trial.z[m], z0, z1, z2)
        state.multiplier[a] = trial.m[a] / share
        for m in range(len(trial.z)):
            state.bearing[m] += state.multiplier[a] * trial.C[a, m]
        history.e[t, a], history.multiplier[t, a] = e, state.multiplier[a]
    copied(trial.turned, state.turned)
