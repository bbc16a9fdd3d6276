"""Steps of diagonally implicit Runge-Kutta schemes with co-rotational frames, compiled: stages by the system's passes.

A stage has u = û + (g h)² u'' and u' = û' + g h u'', with û, û' of the stages before: what a pass solves with
generalised-α's numbers set so. Rates of strains are those of u and u' themselves, by differences, as a stage has no
history to take them from.
"""

import numpy as np

from kedfem.compiled import compiled, inner
from kedfem.dynamics.anderson_kernel import accelerated
from kedfem.dynamics.beams_kernel import begun
from kedfem.dynamics.matrices.profile_kernel import profile_solved
from kedfem.dynamics.system.algebra_kernel import add_transposed, frame_copied, product, rotated
from kedfem.dynamics.system.bodies_kernel import internal_forces, orientation
from kedfem.dynamics.system.corotational_kernel import newmark
from kedfem.dynamics.system.interface_kernel import gathered, offset, pushed
from kedfem.dynamics.system.rigid_frame_kernel import ported
from kedfem.dynamics.system.step_kernel import asked, taken

PASSES = 40
NUDGE = 1e-5  # by which a body moves to show rates, of its size (`dynamics.frames`)


@compiled
def staged(c, c_inside, bodies, ends, of, driving, tableau, size, seen_every, state, trial, work, solved):  # type: ignore[no-untyped-def]
    """March from a state; displacements after every so many steps, passes, stages that did not converge.

    Parameters
    ----------
    c, c_inside : of the stages' matrix, `acceleration` and `late` those of a stage; the same with zeros there
    driving : at all stages, one after the other
    tableau : A (s, s), b (s,), times (s,), the step h
    size : of a body, for differences
    """
    A, b, times, h = tableau
    s, N, k, steps = len(b), len(state.u), len(trial.z), len(driving.t) // len(b)
    x, v, base, rate = np.zeros((4, N + k))
    V, a, last = np.zeros((s, N + k)), np.zeros((s, N + k)), np.zeros((2, N + k))
    when = np.array([-h, 0.0])  # of the two accelerations known last
    x[:N], v[:N], last[0, :N], last[1, :N] = state.u, state.v, state.a, state.a
    x[N:], v[N:], last[0, N:], last[1, N:] = state.z[0], state.z[1], state.z[2], state.z[2]
    found, passes, failed = np.zeros((steps // seen_every, N)), 0, 0
    for n in range(steps):
        for i in range(s):
            t, g = n * s + i, h * A[i, i]
            for m in range(N + k):
                base[m], rate[m] = x[m], v[m]
                for j in range(i):
                    base[m] += h * A[i, j] * V[j, m]
                    rate[m] += h * A[i, j] * a[j, m]
                base[m] += g * rate[m]
            if A[i, i] == 0.0:
                a[i], V[i] = last[1], rate
                continue
            now = (n + times[i]) * h
            span = when[1] - when[0]
            ahead = (now - when[1]) / span if abs(span) > 0.05 * h else 0.0
            ahead = min(max(ahead, -2.0), 2.0)
            for m in range(N + k):
                a[i, m] = last[1, m] + ahead * (last[1, m] - last[0, m])
            state.u[:], state.v[:] = base[:N], rate[:N]
            trial.u[:] = base[:N] + g * g * a[i, :N]
            trial.z[:] = base[N:] + g * g * a[i, N:]
            count = stage(c, c_inside, bodies, ends, of, driving, t, x, size, state, trial, work, solved)
            passes += count
            failed += 1 if count >= PASSES else 0
            for m in range(N + k):
                moved = trial.u[m] if m < N else trial.z[m - N]
                a[i, m] = (moved - base[m]) / (g * g)
                V[i, m] = rate[m] + g * a[i, m]
            last[0], last[1], when[0], when[1] = last[1], a[i], when[1], now
            if not np.isfinite(trial.u).all():
                found[n // seen_every :] = np.nan
                return found, passes, failed
        for m in range(N + k):
            for j in range(s):
                x[m] += h * b[j] * V[j, m]
                v[m] += h * b[j] * a[j, m]
        if (n + 1) % seen_every == 0:
            found[(n + 1) // seen_every - 1] = x[:N]
    return found, passes, failed


@inner
def stage(c, c_inside, bodies, ends, of, driving, t, before, size, state, trial, work, solved):  # type: ignore[no-untyped-def]
    """Pass after pass from trial.u; how many."""
    R, memory = driving.R[t], (state.pairs, state.products, state.last, trial.memory)
    inside(c, c_inside, bodies, driving, t, size, state, trial, work)
    for i in range(len(bodies.motion)):
        orientation(bodies, i, R, trial, trial.Rp[i])
    gathered(bodies, trial)
    for iteration in range(PASSES):
        asked(c, bodies, ends, of, driving, t, iteration, state, trial, work, solved)
        change, reached = 0.0, 0.0
        for m in range(len(trial.change)):
            change += trial.change[m] ** 2
        for i in range(len(bodies.motion)):
            for m in range(bodies.at[i], bodies.at[i + 1]):
                reached += (bodies.size[i] * (trial.u[m] - before[m])) ** 2
        for m in range(len(trial.z)):
            reached += (c.weight * (trial.z[m] - before[len(trial.u) + m])) ** 2
        settled = change <= c.tolerance**2 * reached + c.floor**2
        if not settled:
            accelerated(memory, state.counts, iteration, trial.change)
        taken(c, bodies, trial)
        if settled or not np.isfinite(change):
            break
        inside(c, c_inside, bodies, driving, t, size, state, trial, work)
    for i in range(len(bodies.motion)):
        frame_copied(trial.Q[i], state.Q[i])
        state.angle[i] = trial.angle[i]
    tangents_kept(bodies, R, trial.strained, state)
    return iteration + 1


@inner
def inside(c, c_inside, bodies, driving, t, size, state, trial, work):  # type: ignore[no-untyped-def]
    """trial.f becomes the internal force at trial.u and its rate u' = û' + (u − û) late / (late)², damping included."""
    R, N = driving.R[t], len(trial.u)
    if c.beta != 0.0 or c.alpha != 0.0:
        for x in range(N):
            trial.r[x] = state.v[x] + (trial.u[x] - state.u[x]) / c.late
        fastest = rates_within(bodies, driving, t, trial.u, trial.r)
        part = NUDGE * size / fastest if fastest > 0.0 else 0.0
        for sign in (1.0, -1.0):
            for x in range(N):
                trial.held[x] = trial.u[x]
                trial.u[x] += sign * part * trial.r[x]
            seen(c_inside, bodies, driving, t, state, trial, work)
            for x in range(N):
                trial.u[x] = trial.held[x]
            scale = sign / (2 * part) if part > 0.0 else 0.0
            if sign > 0.0:
                state.seen[:] = 0.0
                state.strain[:] = 0.0
            for i in range(len(bodies.motion)):
                for x in range(bodies.at[i], bodies.at[i + 1]):
                    state.seen[1, x] += scale * trial.seen[0, x]
            for beam in range(len(bodies.beams.segment)):
                for m in range(3):
                    for e in range(state.strain.shape[3]):
                        state.strain[1, beam, m, e] += scale * trial.strained[beam, m, e]
        for i in range(len(bodies.motion)):
            first, own = bodies.at[i], bodies.at[i + 1] - bodies.at[i]
            rotated(R[bodies.motion[i]].T, bodies.components[i], trial.r[first : first + own], work.room[:own])
            for x in range(own):
                state.damped[1, first + x] = c.alpha * work.room[x]
    seen(c_inside, bodies, driving, t, state, trial, work)


@inner
def rates_within(bodies, driving, t, u, v):  # type: ignore[no-untyped-def]
    """v becomes the rate in the rigid-body frame, in world components: v − ω × u; the largest entry."""
    fastest = 0.0
    for i in range(len(bodies.motion)):
        first, n, d, body = bodies.at[i], bodies.functions[i], bodies.components[i], bodies.motion[i]
        w = driving.omega[t, body]
        planar_beam = bodies.kind[i] == 2
        for x in range(first, first + n):
            p, q = u[x], u[x + n]
            if d == 3 and not planar_beam:
                r = u[x + 2 * n]
                v[x] -= w[1] * r - w[2] * q
                v[x + n] -= w[2] * p - w[0] * r
                v[x + 2 * n] -= w[0] * q - w[1] * p
            else:
                v[x] += w[2] * q
                v[x + n] -= w[2] * p
        for x in range(first, first + d * n):
            fastest = max(fastest, abs(v[x]))
    return fastest


@inner
def seen(c, bodies, driving, t, state, trial, work):  # type: ignore[no-untyped-def]
    """What frames see at trial.u, and the force; rates as the state has them."""
    R = driving.R[t]
    if len(bodies.beams.segment):
        begun(newmark(c), bodies.beams, R, state.strain, state.direction, trial.base, trial.resisted)
    internal_forces(c, bodies, R, driving.amounts[t], state, trial, work, True)


@inner
def tangents_kept(bodies, R, seen, state):  # type: ignore[no-untyped-def]
    """Directions and turns of planar beams' points become those that were seen."""
    beams = bodies.beams
    for beam in range(len(beams.segment)):
        i = beams.body[beam]
        for e in range(state.turn.shape[1]):
            x, y = seen[beam, 3, e], seen[beam, 4, e]
            state.direction[beam, 0, e] = R[i, 0, 0] * x + R[i, 1, 0] * y
            state.direction[beam, 1, e] = R[i, 0, 1] * x + R[i, 1, 1] * y
            state.turn[beam, e] = seen[beam, 5, e]


@compiled
def force_at(c, bodies, driving, t, size, state, trial, work):  # type: ignore[no-untyped-def]
    """trial.f becomes the internal force at trial.u with the rates state.v, trial.Rp the bodies' orientations."""
    inside(c, c, bodies, driving, t, size, state, trial, work)
    for i in range(len(bodies.motion)):
        orientation(bodies, i, driving.R[t], trial, trial.Rp[i])


@compiled
def solved_often(bodies, count, trial, y):  # type: ignore[no-untyped-def]
    """The solves of a pass for given residuals, so many times: to be timed, with real or complex matrices.

    Parameters
    ----------
    y : (N,) room
    """
    for _ in range(count):
        trial.right[:] = 0.0
        for i in range(len(bodies.motion)):
            first, last, p0, p1 = bodies.at[i], bodies.at[i + 1], bodies.port_at[i], bodies.port_at[i + 1]
            rotated(trial.Rp[i].T, bodies.components[i], trial.r[first:last], y[first:last])
            product(bodies.Y, bodies.Y_at[i], p1 - p0, last - first, y[first:last], trial.reaction[p0:p1])
            offset(bodies, i, y[first:last], trial, True)
            pushed(bodies, i, trial)
        for m in range(len(trial.dz)):
            trial.x[bodies.place[m]] = trial.right[m]
        profile_solved(trial.K, bodies.first, bodies.row_at, trial.inverse, trial.x)
        for m in range(len(trial.dz)):
            trial.dz[m] = trial.x[bodies.place[m]]
        for i in range(len(bodies.motion)):
            first, last, p0, p1 = bodies.at[i], bodies.at[i + 1], bodies.port_at[i], bodies.port_at[i + 1]
            ported(bodies, i, trial)
            product(bodies.G, bodies.G_at[i], last - first, last - first, trial.r[first:last], y[first:last])
            add_transposed(bodies.Y, bodies.Y_at[i], p1 - p0, last - first, trial.w[p0:p1], y[first:last])
            rotated(trial.Rp[i], bodies.components[i], y[first:last], trial.held[first:last])
