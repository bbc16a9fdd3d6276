"""What one body does in a step, compiled by numba: its right-hand side, its internal force, and its end of the step.

Of body i: coordinates `at[i]:at[i + 1]`, component first; mass one. Rotations act on components.
"""

import numpy as np

from kedfem.compiled import inner
from kedfem.dynamics.beams_kernel import begun, bent
from kedfem.dynamics.frames_kernel import entry, held_together, mean_rotation
from kedfem.dynamics.system.algebra_kernel import product, turned, turned_back

NOMINAL, COROTATIONAL, TANGENTIAL = range(3)


@inner
def right_hand_side(c, bodies, i, R, F, state, out, room):  # type: ignore[no-untyped-def]
    """History + applied force of a body with the nominal frame, link frame at the end of the step."""
    first, last, d = bodies.at[i], bodies.at[i + 1], bodies.components[i]
    c_m, c_f = 1 - c.alpha_m, 1 - c.alpha_f
    n0, n1, n2 = c_m * c.acceleration[0], c_m * c.acceleration[1], c_m * c.acceleration[2] - c.alpha_m
    for x in range(first, last):
        total = n0 * state.u[x] + n1 * state.v[x] + n2 * state.a[x] + c_f * F[x]
        room[x - first] = total + c.alpha_f * (state.F[x] - state.f[x])
    turned_back(R, d, room[: last - first], out[first:last])
    if c.alpha != 0.0 or c.beta != 0.0:
        N = last - first
        for m in range(3):
            of = 3 * first + m * N
            for x in range(N):
                out[first + x] += c_f * c.rate[m] * state.damped[of + x]


@inner
def nominal_end(c, bodies, i, R, F, g, Kg, state, history, t, room):  # type: ignore[no-untyped-def]
    """End of the step of a body with the nominal frame, from g and its balance K g = r + Wᵀ λ = A g."""
    first, last, d = bodies.at[i], bodies.at[i + 1], bodies.components[i]
    N = last - first
    n0, n1, n2 = c.acceleration
    energy, damped = 0.0, c.alpha != 0.0 or c.beta != 0.0
    for x in range(N):
        Kg[x] = (Kg[x] - c.c_M * g[x]) / c.c_K
        energy += g[x] * Kg[x]
        room[x] = Kg[x]
        if damped:
            of = 3 * first + x
            y, y0, y1, y2 = (
                c.alpha * g[x] + c.beta * Kg[x],
                state.damped[of],
                state.damped[of + N],
                state.damped[of + 2 * N],
            )
            second = n0 * (y - y0) - n1 * y1 - n2 * y2
            state.damped[of], state.damped[of + N], state.damped[of + 2 * N] = (
                y,
                y1 + c.late * second + c.early * y2,
                second,
            )
            room[x] += state.damped[of + N]
    turned(R, d, room[:N], state.f[first:last])
    turned(R, d, g[:N], room[:N])
    moved_to(c, first, last, room, F, state, history, t)
    history.energy[t, i] = 0.5 * energy
    history.R[t, i] = R
    for x in range(N):
        history.g[t, first + x] = g[x]


@inner
def moved_to(c, first, last, u, F, state, history, t):  # type: ignore[no-untyped-def]
    """Newmark's formulas from the displacement u at the end of the step; state and history."""
    n0, n1, n2 = c.acceleration
    for x in range(first, last):
        a = n0 * (u[x - first] - state.u[x]) - n1 * state.v[x] - n2 * state.a[x]
        state.v[x] += c.late * a + c.early * state.a[x]
        state.u[x], state.a[x], state.F[x] = u[x - first], a, F[x]
        history.u[t, x], history.v[t, x], history.a[t, x], history.F[t, x] = state.u[x], state.v[x], a, F[x]


@inner
def beam_views(bodies, i):  # type: ignore[no-untyped-def]
    """The tables of one planar beam, as `beams_kernel` takes them."""
    b, n = bodies.beam[i], bodies.functions[i]
    E = bodies.tangent.shape[2]
    rows = bodies.rows[bodies.rows_at[b] : bodies.rows_at[b + 1]].reshape(1, 3, E, n)
    return np.zeros(1, np.int64), rows, bodies.tangent[b : b + 1], bodies.rigidity[b : b + 1]


@inner
def internal_force(c, bodies, i, R, u, state, trial, work):  # type: ignore[no-untyped-def]
    """trial.f becomes the internal force of a body with frames of its own at the displacement u, world components."""
    first, last, d, n = bodies.at[i], bodies.at[i + 1], bodies.components[i], bodies.functions[i]
    N, body = last - first, bodies.motion[i]
    n0, n1, n2 = c.acceleration
    rates = (n0, n1, n2, c.late, c.early, c.beta)
    for x in range(first, last):
        trial.f[x] = 0.0
    moved, f = u[first:last].reshape(1, d, n), trial.f[first:last].reshape(1, d, n)
    frame = R[body : body + 1]
    if bodies.frame[i] == TANGENTIAL:
        b = bodies.beam[i]
        bent(1 + c.beta * c.late * n0, beam_views(bodies, i), moved, trial.base[b : b + 1], trial.resisted[b : b + 1],
             state.turn[b : b + 1], trial.strained[b : b + 1], f, work.points)  # fmt: skip
    else:
        X, one = bodies.X[first:last].reshape(1, d, n), bodies.one[first:last].reshape(1, d, n)
        fit = bodies.fit[first:last].reshape(1, d, n)
        K = bodies.K[bodies.G_at[i] : bodies.G_at[i + 1]].reshape(1, N, N)
        before = state.seen[3 * first : 3 * last].reshape(3, 1, N)
        now = trial.seen[3 * first : 3 * last].reshape(3, 1, N)
        rooms = (
            work.y[:N].reshape(d, n),
            work.turned[:N].reshape(d, n),
            work.strained[:N],
            work.A,
            work.U,
            work.change,
        )
        held_together(rates, 0, bodies.kind[i], True, (X, one), fit, K, frame, moved, before, now,
                      trial.Q[i : i + 1], trial.angle[i : i + 1], f, rooms)  # fmt: skip
    if c.alpha != 0.0:
        mass_damped(c, bodies, i, R[body], u, state, trial, work)


@inner
def mass_damped(c, bodies, i, R, u, state, trial, work):  # type: ignore[no-untyped-def]
    """Add to trial.f the rate of α M δ in the nominal frame."""
    first, last, d = bodies.at[i], bodies.at[i + 1], bodies.components[i]
    N = last - first
    turned_back(R, d, u[first:last], work.y[:N])
    for x in range(N):
        of = 3 * first + x
        y = c.alpha * work.y[x]
        trial.damped[of] = y
        second = (
            c.acceleration[0] * (y - state.damped[of])
            - c.acceleration[1] * state.damped[of + N]
            - c.acceleration[2] * state.damped[of + 2 * N]
        )
        trial.damped[of + N] = state.damped[of + N] + c.late * second + c.early * state.damped[of + 2 * N]
        trial.damped[of + 2 * N] = second
        work.y[x] = trial.damped[of + N]
    turned(R, d, work.y[:N], work.turned[:N])
    for x in range(N):
        trial.f[first + x] += work.turned[x]


@inner
def beam_begun(c, bodies, i, R, state, trial):  # type: ignore[no-untyped-def]
    """What stays for a step of a planar beam, see `beams_kernel.begun`."""
    b, body = bodies.beam[i], bodies.motion[i]
    rates = (c.acceleration[0], c.acceleration[1], c.acceleration[2], c.late, c.early, c.beta)
    begun(rates, beam_views(bodies, i), R[body : body + 1], state.strain[b], state.direction[b : b + 1],
          trial.base[b : b + 1], trial.resisted[b : b + 1])  # fmt: skip


@inner
def orientation(bodies, i, R, u, trial, out, work):  # type: ignore[no-untyped-def]
    """out becomes the mean orientation of a body with frames of its own, link to world; trial.Q known but of beams."""
    first, last, d, n = bodies.at[i], bodies.at[i + 1], bodies.components[i], bodies.functions[i]
    body = bodies.motion[i]
    if bodies.frame[i] == TANGENTIAL:
        X, fit = bodies.X[first:last].reshape(1, d, n), bodies.fit[first:last].reshape(1, d, n)
        own, moved = np.ones(1, np.bool_), u[first:last].reshape(1, d, n)
        mean_rotation(own, fit, X, R[body : body + 1], moved, trial.Q[i : i + 1])
    for b in range(3):
        for m in range(3):
            x = 0.0
            for k in range(3):
                x += R[body, b, k] * entry(bodies.kind[i], trial.Q[i], k, m)
            out[b, m] = x


@inner
def residual(c, bodies, i, R, F, u, state, trial, out, room):  # type: ignore[no-untyped-def]
    """out becomes what is missing to balance at the end of the step, without interface forces, in the frame R."""
    first, last, d = bodies.at[i], bodies.at[i + 1], bodies.components[i]
    n0, n1, n2 = c.acceleration
    for x in range(first, last):
        a = n0 * (u[x] - state.u[x]) - n1 * state.v[x] - n2 * state.a[x]
        r = (1 - c.alpha_f) * (F[x] - trial.f[x]) - (1 - c.alpha_m) * a
        room[x - first] = r + c.alpha_f * (state.F[x] - state.f[x]) - c.alpha_m * state.a[x]
    turned_back(R, d, room[: last - first], out[first:last])


@inner
def own_end(c, bodies, i, R, F, u, state, trial, history, t, work):  # type: ignore[no-untyped-def]
    """End of the step of a body with frames of its own: what passes found becomes the state."""
    first, last = bodies.at[i], bodies.at[i + 1]
    N = last - first
    moved_to(c, first, last, u[first:last], F, state, history, t)
    for x in range(first, last):
        state.f[x] = trial.f[x]
    if c.alpha != 0.0:
        state.damped[3 * first : 3 * last] = trial.damped[3 * first : 3 * last]
    if bodies.frame[i] == TANGENTIAL:
        beam_end(c, bodies, i, R, state, trial, history, t)
    else:
        state.seen[3 * first : 3 * last] = trial.seen[3 * first : 3 * last]
        history.g[t, first:last] = trial.seen[3 * first : 3 * first + N]
        energy = 0.0
        product(bodies.K, bodies.G_at[i], N, N, trial.seen[3 * first : 3 * first + N], work.y)
        for x in range(N):
            energy += 0.5 * trial.seen[3 * first + x] * work.y[x]
        history.energy[t, i] = energy
    orientation(bodies, i, R, u, trial, history.R[t, i], work)
    state.Q[i] = trial.Q[i]
    state.angle[i] = trial.angle[i]


@inner
def beam_end(c, bodies, i, R, state, trial, history, t):  # type: ignore[no-untyped-def]
    """End of the step of a planar beam: strains, their rates, directions of its tangents."""
    b, body = bodies.beam[i], bodies.motion[i]
    n0, n1, n2 = c.acceleration
    energy = 0.0
    for m in range(3):
        for e in range(bodies.tangent.shape[2]):
            s, s0 = trial.strained[b, m, e], state.strain[b, 0, 0, m, e]
            s1, s2 = state.strain[b, 1, 0, m, e], state.strain[b, 2, 0, m, e]
            second = n0 * (s - s0) - n1 * s1 - n2 * s2
            state.strain[b, 0, 0, m, e] = history.strain[t, b, m, e] = s
            state.strain[b, 1, 0, m, e] = s1 + c.late * second + c.early * s2
            state.strain[b, 2, 0, m, e] = second
            energy += bodies.rigidity[b, m, e] * s * s
    history.energy[t, i] = 0.5 * energy
    for e in range(bodies.tangent.shape[2]):
        x, y = trial.strained[b, 3, e], trial.strained[b, 4, e]
        state.direction[b, 0, e] = R[body, 0, 0] * x + R[body, 1, 0] * y
        state.direction[b, 1, e] = R[body, 0, 1] * x + R[body, 1, 1] * y
        state.turn[b, e] = trial.strained[b, 5, e]
