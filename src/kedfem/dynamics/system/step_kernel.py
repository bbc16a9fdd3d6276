"""One step of a system, compiled by numba: begin, passes over the interface, finish; and the loop over a block of steps.

    r = history + c_f (F − f),   g = G Rᵀ r + Y w,   λ = S w − Yᵀ Rᵀ r,   w = Rᵀ B z − W Rᵀ b

Each pass evaluates frames, constraints and laws at the last iterate, and Anderson acceleration gives the next one. A
linear system needs one pass: `linear_kernel`.
"""

import numpy as np

from kedfem.compiled import compiled, inner
from kedfem.dynamics.anderson_kernel import accelerated
from kedfem.dynamics.beams_kernel import begun, ended
from kedfem.dynamics.system.algebra_kernel import copied, frame_copied, product, rotated
from kedfem.dynamics.system.bodies_kernel import internal_forces, orientation, own_end, residual
from kedfem.dynamics.system.corotational_kernel import foresee, newmark
from kedfem.dynamics.system.ends_kernel import unmoved
from kedfem.dynamics.system.interface_kernel import evaluated, gathered, interface_solved, offset, pushed
from kedfem.dynamics.system.products_kernel import displaced, sparse_held
from kedfem.dynamics.system.record import NOMINAL, RIGID_BODY, STRESSED
from kedfem.dynamics.system.rigid_frame_kernel import (
    constraints_end,
    interface_end,
    ported,
    ports_end,
    rigid_frame_begin,
    rigid_frame_finish,
)
from kedfem.dynamics.system.stress_kernel import combined, stressed_begin, stressed_end, stressed_side

MET = -2  # instead of a body: a stop was met, and the step is to be divided
LEFT = -3  # the same, and less by the number of a line that its pin leaves
SLACK = 1e-6  # of a line: a pin so far off its ends is on it
PASSES = 40  # in a step, of which it takes 2 to 6
PATIENCE, EASIER = 14, 100.0  # after so many a larger change is taken, and counted
STALLED = 4  # passes in which changes do not halve: they may be rounding
ROUNDING = 1e-8  # of a stiffened deflection: changes below are rounding then


@compiled
def marched(c, bodies, ends, of, driving, state, trial, work, history, solved):  # type: ignore[no-untyped-def]
    """Take T steps in place; how many were taken, and the body that moved most in one that did not converge, MET or LEFT.

    Parameters
    ----------
    solved : called with the number of a sparse body, see `sparse.solver`
    """
    for t in range(len(driving.t)):
        begin(c, bodies, ends, of, driving, t, state, trial, work, solved)
        converged, worst = passes(c, bodies, ends, of, driving, t, state, trial, work, solved)
        if not converged:
            return t, worst
        if meets(of, state, trial):
            return t, MET
        line = left(ends, of)
        if line >= 0:
            return t, LEFT - line
        finish(c, bodies, ends, of, driving, t, state, trial, work, history)
    return len(driving.t), -1


@inner
def meets(of, state, trial):  # type: ignore[no-untyped-def]
    """Whether a stop's push begins at once in a step."""
    if of is None:
        return False
    for a in range(len(of.jumps)):
        if of.jumps[a] and state.multiplier[a] == 0.0:
            lower, upper, e0, e1 = of.numbers[a, 0], of.numbers[a, 1], state.e[0, a], trial.e[a]
            if lower <= e0 <= upper and not lower <= e1 <= upper:
                return True
    return False


@inner
def left(ends, of):  # type: ignore[no-untyped-def]
    """The first line whose pin is beyond its ends, −1 without any."""
    if of is None:
        return -1
    return beyond(ends.knots, ends)


@inner
def beyond(knots, ends):  # type: ignore[no-untyped-def]
    """The same where there are constraints."""
    if knots is None:
        return -1
    for n in range(len(ends.line)):
        first, last = ends.knots[ends.line_at[n]], ends.knots[ends.line_at[n + 1] - 1]
        slack = SLACK * (last - first)
        if ends.free[n] and not first - slack <= ends.pin[n] <= last + slack:
            return n
    return -1


@inner
def begin(c, bodies, ends, of, driving, t, state, trial, work, solved):  # type: ignore[no-untyped-def]
    """The predictor, right-hand sides of bodies with rigid-body frames, the common matrix of z."""
    R, h = driving.R[t], c.h
    copied(state.term_angles, trial.term_angles)
    combined(bodies.stresses, driving, t, trial.stress)
    for m in range(len(trial.z)):
        trial.z[m] = state.z[0, m] + h * state.z[1, m] + h * h / 2 * state.z[2, m]
    for i in range(len(bodies.motion)):
        if bodies.frame[i] == NOMINAL:
            rigid_frame_begin(c, bodies, i, R[bodies.motion[i]], driving.F[t], state, trial, work, solved)
            continue
        for x in range(bodies.at[i], bodies.at[i + 1]):
            trial.u[x] = state.u[x] + h * state.v[x] + h * h / 2 * state.a[x]
        if bodies.frame[i] == STRESSED:
            stressed_begin(bodies.stresses, c, bodies, i, R[bodies.motion[i]], driving.F[t], state, trial, work.room)
            continue
        frame_copied(state.Q[i], trial.Q[i])
        trial.angle[i] = state.angle[i]
    begun(newmark(c), bodies.beams, R, state.strain, state.direction, trial.base, trial.resisted)
    internal_forces(c, bodies, R, driving.amounts[t], state, trial, work, True)
    for i in range(len(bodies.motion)):
        if bodies.frame[i] > RIGID_BODY:
            orientation(bodies, i, R, trial, trial.Rp[i])
    gathered(bodies, trial)
    unmoved(ends, of, driving, t, trial, work)


@inner
def passes(c, bodies, ends, of, driving, t, state, trial, work, solved):  # type: ignore[no-untyped-def]
    """Pass after pass, until none asks for a change; whether that came, and the body that moved most."""
    memory = (state.pairs, state.products, state.last, trial.memory)
    R, worst, count, least, stalled = driving.R[t], -1, 0, np.inf, 0
    for iteration in range(PASSES):
        count = iteration + 1
        asked(c, bodies, ends, of, driving, t, iteration, state, trial, work, solved)
        size, reached, worst = sizes(c, bodies, state, trial)
        allowed = c.tolerance if iteration < PATIENCE else EASIER * c.tolerance
        settled = size <= allowed * allowed * reached + c.floor * c.floor
        stalled = 0 if size < least / 4 else stalled + 1
        least = min(least, size)
        if not settled and stalled >= STALLED and bodies.frame[max(worst, 0)] == STRESSED:
            settled = size <= ROUNDING * ROUNDING * deflected(bodies, trial)
            if settled:
                state.counts[:] = 0.0  # what is kept of rounding would be much of the next step
        if not settled:
            accelerated(memory, state.counts, iteration, trial.change)
        taken(c, bodies, trial)
        if not np.isfinite(size) or size > 1e30:
            break
        internal_forces(c, bodies, R, driving.amounts[t], state, trial, work, False)
        if settled:
            state.passes[0] += count
            state.passes[1] += 1 if iteration >= PATIENCE else 0
            state.passes[2] = max(state.passes[2], count)
            return True, worst
    state.passes[0] += count
    state.counts[:] = 0.0
    return False, worst


@inner
def asked(c, bodies, ends, of, driving, t, iteration, state, trial, work, solved):  # type: ignore[no-untyped-def]
    """The change of bodies with frames of their own, and of z, that a pass asks for."""
    trial.right[:] = 0.0
    for m in range(len(trial.z)):
        trial.right[m] = c.alpha_f * state.bearing[m]
    for i in range(len(bodies.motion)):
        first, last, d = bodies.at[i], bodies.at[i + 1], bodies.components[i]
        q, N, own = bodies.port_at[i + 1] - bodies.port_at[i], last - first, bodies.frame[i] > RIGID_BODY
        if own:
            residual(c, bodies, i, driving.F[t], state, trial, work)
        elif bodies.frame[i] == STRESSED:
            stressed_side(bodies.stresses, c, bodies, i, trial, work)
        if bodies.frame[i] != NOMINAL:
            if bodies.dense[i]:
                reaction = trial.reaction[bodies.port_at[i] : bodies.port_at[i + 1]]
                product(bodies.Y, bodies.Y_at[i], q, N, trial.r[first:last], reaction)
            else:
                sparse_held(bodies.arrays, bodies, i, trial, solved)
        if own:
            rotated(trial.Rp[i].T, d, trial.u[first:last], work.y[:N])
        offset(bodies, i, work.y, trial, own)
        pushed(bodies, i, trial)
    evaluated(c, ends, of, driving, t, state, trial, work, iteration == 0)
    interface_solved(bodies, of, trial, iteration == 0)
    for i in range(len(bodies.motion)):
        ported(bodies, i, trial)
        if bodies.frame[i] != NOMINAL:
            first, last, d = bodies.at[i], bodies.at[i + 1], bodies.components[i]
            N, to = last - first, bodies.passed[i]
            displaced(bodies, i, trial, work.y)
            change, size = trial.change[to : to + N], bodies.size[i]
            rotated(trial.Rp[i], d, work.y[:N], change)
            if bodies.frame[i] == STRESSED:
                before = trial.u[first:last]
                for x in range(N):
                    change[x] -= before[x]
            if size != 1.0:
                for x in range(N):
                    change[x] *= size
            if bodies.rigid[i]:
                foresee(bodies.K, c, bodies, i, work.y, trial, work)
    k = len(trial.z)
    for m in range(k):
        trial.change[len(trial.change) - k + m] = c.weight * trial.dz[m]


@inner
def sizes(c, bodies, state, trial):  # type: ignore[no-untyped-def]
    """Squares of the change asked for, and of what a step has moved; the body that changes most."""
    size, reached, most, worst, k = 0.0, 0.0, -1.0, -1, len(trial.z)
    change, u, u0 = trial.change, trial.u, state.u
    for i in range(len(bodies.motion)):
        if bodies.frame[i] == NOMINAL:
            continue
        own, moved, to, first, last = 0.0, 0.0, bodies.passed[i], bodies.at[i], bodies.at[i + 1]
        asks, now, before = change[to : to + last - first], u[first:last], u0[first:last]
        for x in range(last - first):
            own += asks[x] ** 2
            moved += (now[x] - before[x]) ** 2
        reached += bodies.size[i] ** 2 * moved
        size += own
        if own > most:
            most, worst = own, i
    alone = worst < 0
    for m in range(k):
        size += trial.change[len(trial.change) - k + m] ** 2
        reached += (c.weight * (trial.z[m] + (trial.dz[m] if alone else -state.z[0, m]))) ** 2
    return size, reached, worst


@inner
def deflected(bodies, trial):  # type: ignore[no-untyped-def]
    """Square of the deflection of all bodies, as changes are measured."""
    total = 0.0
    for i in range(len(bodies.motion)):
        for x in range(bodies.at[i], bodies.at[i + 1]):
            total += (bodies.size[i] * trial.u[x]) ** 2
    return total


@inner
def taken(c, bodies, trial):  # type: ignore[no-untyped-def]
    """The change becomes part of the end of the step."""
    u, change = trial.u, trial.change
    for i in range(len(bodies.motion)):
        if bodies.frame[i] != NOMINAL:
            own, by = u[bodies.at[i] : bodies.at[i + 1]], 1.0 / bodies.size[i]
            step = change[bodies.passed[i] : bodies.passed[i] + len(own)]
            for x in range(len(own)):
                own[x] += by * step[x]
    k = len(trial.z)
    for m in range(k):
        trial.z[m] += trial.change[len(trial.change) - k + m] / c.weight


@inner
def finish(c, bodies, ends, of, driving, t, state, trial, work, history):  # type: ignore[no-untyped-def]
    """What the passes found becomes the state, and row t of the history."""
    R, F = driving.R[t], driving.F[t]
    for i in range(len(bodies.motion)):
        if bodies.frame[i] > RIGID_BODY:
            own_end(c, bodies, i, R, F, state, trial, history, t, work)
        else:
            rigid_frame_finish(c, bodies, i, F, trial, state, history, t, work)
        if bodies.frame[i] == STRESSED:
            stressed_end(bodies.stresses, bodies, i, trial, state, history.g[t], work)
        ports_end(c, bodies, i, trial, state, history, t, work.room)
    ended(t, newmark(c), bodies.beams, R, trial.strained, state.strain, state.direction, state.turn, history.strain,
          history.energy)  # fmt: skip
    constraints_end(c, ends, of, driving, t, state, trial, work, history)
    interface_end(c, driving, t, trial, state, history)
