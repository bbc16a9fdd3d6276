"""One body in a step, compiled by numba: its right-hand side, its internal force, and its state at the end.

Body i has the coordinates `at[i]:at[i + 1]`, component first, in which its mass is one. Rotations act on components.
"""

import numpy as np

from kedfem.compiled import inner
from kedfem.dynamics.beams_kernel import bent
from kedfem.dynamics.frames_kernel import entry
from kedfem.dynamics.system.algebra_kernel import copied, frame_copied, rotated, state_of
from kedfem.dynamics.system.corotational_kernel import corotational_end, corotational_force, unforeseen
from kedfem.dynamics.system.follower_loads_kernel import add_follower_loads
from kedfem.dynamics.system.products_kernel import mass_times
from kedfem.dynamics.system.record import COROTATIONAL, RIGID_BODY, TANGENTIAL


@inner
def right_hand_side(c, bodies, i, R, F, state, out, room):  # type: ignore[no-untyped-def]
    """History + applied force of a body with the rigid-body frame, link frame at the end of the step."""
    first, last, d = bodies.at[i], bodies.at[i + 1], bodies.components[i]
    c_m, c_f = 1 - c.alpha_m, 1 - c.alpha_f
    n0, n1, n2 = c_m * c.acceleration[0], c_m * c.acceleration[1], c_m * c.acceleration[2] - c.alpha_m
    N = last - first
    u, v, a = state.u[first:last], state.v[first:last], state.a[first:last]
    if not bodies.dense[i]:
        u, v, a = state_of(state.momentum, first, last)
    F0, F1, f0, alpha_f = state.F[first:last], F[first:last], state.f[first:last], c.alpha_f
    for x in range(N):
        room[x] = n0 * u[x] + n1 * v[x] + n2 * a[x] + c_f * F1[x] + alpha_f * (F0[x] - f0[x])
    rotated(R.T, d, room[:N], out[first:last])
    if c.alpha != 0.0 or c.beta != 0.0:
        for m in range(3):
            for x in range(first, last):
                out[x] += c_f * c.rate[m] * state.damped[m, x]


@inner
def rigid_frame_end(c, bodies, i, F, trial, state, history, t, work):  # type: ignore[no-untyped-def]
    """End of the step of a body with the rigid-body frame, from g in work.y and its balance A g = r + Wᵀ λ in
    work.rotated."""
    first, last, d = bodies.at[i], bodies.at[i + 1], bodies.components[i]
    N = last - first
    R, g, Ag, u, Mg, c_M, c_K = trial.Rp[i], work.y[:N], work.rotated[:N], work.room[:N], work.strained[:N], c.c_M, c.c_K
    rotated(R, d, g, u)
    moved_to(c, first, last, u, F, state, history, t)
    copied(g, history.g[t, first:last])
    if bodies.dense[i]:
        copied(g, Mg)
    else:
        mass_times(bodies.mass, bodies, i, u, Mg)
        newmark_advanced(c, Mg, state_of(state.momentum, first, last))
        copied(state.momentum[1, first:last], history.Mv[t, first:last])
        rotated(R.T, d, Mg, u)
        copied(u, Mg)
    energy, Kg = 0.0, history.Kg[t, first:last]
    for x in range(N):
        y = (Ag[x] - c_M * Mg[x]) / c_K
        energy += g[x] * y
        Ag[x] = Kg[x] = y
    history.energy[t, i] = 0.5 * energy
    if c.alpha != 0.0 or c.beta != 0.0:
        for x in range(N):
            u[x] = c.alpha * Mg[x] + c.beta * Ag[x]
        newmark_advanced(c, u, state_of(state.damped, first, last))
        if not bodies.dense[i]:
            copied(u, history.Cg[t, first:last])
        for x in range(N):
            Ag[x] += state.damped[1, first + x]
    rotated(R, d, Ag, state.f[first:last])
    frame_copied(R, history.R[t, i])


@inner
def newmark_advanced(c, x, state):  # type: ignore[no-untyped-def]
    """Newmark's formulas for any quantity from x at the end of the step; state is it and its rates, each (N,)."""
    n0, n1, n2 = c.acceleration
    late, early = c.late, c.early
    own, rates, seconds = state
    for m in range(len(x)):
        second = n0 * (x[m] - own[m]) - n1 * rates[m] - n2 * seconds[m]
        rates[m] += late * second + early * seconds[m]
        own[m], seconds[m] = x[m], second


@inner
def moved_to(c, first, last, u, F, state, history, t):  # type: ignore[no-untyped-def]
    """Newmark's formulas from the displacement u at the end of the step; state and history."""
    n0, n1, n2 = c.acceleration
    u0, v0, a0, F0 = state.u[first:last], state.v[first:last], state.a[first:last], state.F[first:last]
    us, vs, as_ = history.u[t, first:last], history.v[t, first:last], history.a[t, first:last]
    F1, late, early = F[first:last], c.late, c.early
    for x in range(last - first):
        a = n0 * (u[x] - u0[x]) - n1 * v0[x] - n2 * a0[x]
        v0[x] += late * a + early * a0[x]
        u0[x], a0[x], F0[x] = u[x], a, F1[x]
        us[x], vs[x], as_[x] = u0[x], v0[x], a


@inner
def internal_forces(c, bodies, R, amounts, state, trial, work, first):  # type: ignore[no-untyped-def]
    """trial.f becomes the internal force of all bodies with frames of their own at trial.u, world components.

    Loads that turn with them are taken from it, their amounts being given.

    Parameters
    ----------
    first : whether no pass has foreseen what rigid bodies resist
    """
    f, beams = trial.f, bodies.beams
    for i in range(len(bodies.motion)):
        if bodies.frame[i] > RIGID_BODY:
            for x in range(bodies.at[i], bodies.at[i + 1]):
                f[x] = 0.0
    bent(1 + c.beta * c.late * c.acceleration[0], beams, trial.u, trial.base, trial.resisted, state.turn,
         trial.strained, f, work.points)  # fmt: skip
    for i in range(len(bodies.motion)):
        if bodies.frame[i] == COROTATIONAL:
            corotational_force(bodies.K, c, bodies, i, R, state, trial, work, first)
        if bodies.frame[i] > RIGID_BODY and c.alpha != 0.0:
            mass_damped(c, bodies, i, R[bodies.motion[i]], state, trial, work)
    add_follower_loads(bodies.turning, bodies, R, amounts, trial.u, f, work.frame)


@inner
def mass_damped(c, bodies, i, R, state, trial, work):  # type: ignore[no-untyped-def]
    """Add to trial.f the rate of α M δ in the rigid-body frame."""
    first, last, d = bodies.at[i], bodies.at[i + 1], bodies.components[i]
    N, u = last - first, trial.u[first:last]
    if bodies.dense[i]:
        rotated(R.T, d, u, work.y[:N])
    else:
        mass_times(bodies.mass, bodies, i, u, work.rotated)
        rotated(R.T, d, work.rotated[:N], work.y[:N])
    for x in range(N):
        work.y[x] *= c.alpha
    for m in range(3):
        copied(state.damped[m, first:last], trial.damped[m, first:last])
    newmark_advanced(c, work.y[:N], state_of(trial.damped, first, last))
    rotated(R, d, trial.damped[1, first:last], work.rotated[:N])
    for x in range(N):
        trial.f[first + x] += work.rotated[x]


@inner
def orientation(bodies, i, R, trial, out):  # type: ignore[no-untyped-def]
    """out becomes the mean orientation of a body with frames of its own, link to world; trial.Q known but of beams."""
    body = bodies.motion[i]
    if bodies.frame[i] == TANGENTIAL:
        beam_rotation(bodies, i, R[body], trial.u, trial.Q[i])
    for b in range(3):
        for m in range(3):
            x = 0.0
            for k in range(3):
                x += R[body, b, k] * entry(bodies.kind[i], trial.Q[i], k, m)
            out[b, m] = x


@inner
def beam_rotation(bodies, i, R, u, Q):  # type: ignore[no-untyped-def]
    """Q becomes the mean rotation of a planar beam in the rigid-body frame, that of Σ y_a ⊗ fit_a."""
    first, n, c, s = bodies.at[i], bodies.functions[i], 0.0, 0.0
    X, fit = bodies.X, bodies.fit
    for j in range(first, first + n):
        x = X[j] + R[0, 0] * u[j] + R[1, 0] * u[j + n]
        y = X[j + n] + R[0, 1] * u[j] + R[1, 1] * u[j + n]
        c += x * fit[j] + y * fit[j + n]
        s += y * fit[j] - x * fit[j + n]
    size = np.sqrt(c * c + s * s)
    c, s = c / size, s / size
    Q[0, 0], Q[0, 1], Q[1, 0], Q[1, 1] = c, -s, s, c


@inner
def residual(c, bodies, i, F, state, trial, work):  # type: ignore[no-untyped-def]
    """trial.r becomes what is missing to balance at the end of the step, without interface forces, in its frame."""
    first, last, d = bodies.at[i], bodies.at[i + 1], bodies.components[i]
    n0, n1, n2 = c.acceleration
    u, u0, v0, a0, F0, f0, f1 = trial.u, state.u, state.v, state.a, state.F, state.f, trial.f
    c_m, c_f, alpha_m, alpha_f = 1 - c.alpha_m, 1 - c.alpha_f, c.alpha_m, c.alpha_f
    room, out = work.room, trial.r
    if bodies.dense[i]:
        for x in range(first, last):
            a = n0 * (u[x] - u0[x]) - n1 * v0[x] - n2 * a0[x]
            r = c_f * (F[x] - f1[x]) - c_m * a
            room[x - first] = r + alpha_f * (F0[x] - f0[x]) - alpha_m * a0[x]
    else:
        mass_times(bodies.mass, bodies, i, u[first:last], out[first:last])
        momentum, rate, second = state.momentum
        for x in range(first, last):
            later = n0 * (out[x] - momentum[x]) - n1 * rate[x] - n2 * second[x]
            r = c_f * (F[x] - f1[x]) - c_m * later
            room[x - first] = r + alpha_f * (F0[x] - f0[x]) - alpha_m * second[x]
    rotated(trial.Rp[i].T, d, room[: last - first], out[first:last])


@inner
def own_end(c, bodies, i, R, F, state, trial, history, t, work):  # type: ignore[no-untyped-def]
    """End of the step of a body with frames of its own: what passes found becomes the state."""
    first, last = bodies.at[i], bodies.at[i + 1]
    N, u = last - first, trial.u[first:last]
    moved_to(c, first, last, u, F, state, history, t)
    if not bodies.dense[i]:
        mass_times(bodies.mass, bodies, i, u, work.y)
        newmark_advanced(c, work.y[:N], state_of(state.momentum, first, last))
    copied(trial.f[first:last], state.f[first:last])
    if bodies.rigid[i]:
        unforeseen(bodies, i, trial, work)
        for x in range(N):
            state.f[first + x] -= work.room[x]  # rounding, times K
    if c.alpha != 0.0:
        for m in range(3):
            copied(trial.damped[m, first:last], state.damped[m, first:last])
    if bodies.frame[i] == COROTATIONAL:
        corotational_end(bodies.K, bodies, i, trial, state, history, t, work)
    orientation(bodies, i, R, trial, history.R[t, i])
    frame_copied(trial.Q[i], state.Q[i])
    state.angle[i] = trial.angle[i]
