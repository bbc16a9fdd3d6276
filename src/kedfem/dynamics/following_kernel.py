"""The inner loop of small segments whose frames follow them, compiled by numba.

Coordinates and padding as in `dynamics.kernel`. k interface unknowns, ordered so that H = Σ Bᵀ R S Rᵀ B has its entries
near the diagonal: from column `first` of each row on.

    coefficients : (13,) c_M, c_K, α_f, α_m; Newmark's acceleration (3); h, h γ, h (1 − γ); damping α, β; tolerance
    matrices : G (L, N, N), Yt (L, Q, N), S (L, Q, Q), B (L, Q, c)
    columns, count, first : (L, c), (L,), (k,)
    shapes : X (L, D, S) position, one (L, D, S)
    frames : bends (L,) whether a segment is a planar beam that knows its strains, follows (L,) whether the frame of any
        other does; fit (L, D, S) weights of the frame's rotation, K (L, N, N) of the others
    beams : those that know their strains, see `dynamics.beams_kernel`
    elements, element_room : of beams in space and for one of them at a time, see `dynamics.metric`
    kinds : (L,) 0: rows (u, v, w), 1: (u, v), 2: (u, v, ψ)
    state : u, v, a, F, f (L, D, S), C (3, L, D, S), force (L, Q) in world components; Q (L, 3, 3), angle (L,) of the
        frame; g (3, L, N) seen from it, and rates; strain, direction, turn of `beams`; turned (A,) coordinates of actions
    acting : of `dynamics.acting.over_block`, whose forces are added to F; None without motors, springs and loads that
        turn with links, whose code is then not compiled
    history : u, v, a, g (T, L, D, S), strain (T, b, 3, E), R (T, L, D, D), port forces (T, L, Q) in that frame, strain
        energy (T, L)
    memory : of `dynamics.mixing_kernel`
    counts : sweeps, square of what counts as a step, pairs that are known, the next pair to be forgotten, square of a
        step that is too far

Imported when it is first needed. Plain loops, so that nothing is allocated in a step; few calls, and what a step does not
change is found once in it.
"""

import numpy as np

from kedfem.compiled import compiled
from kedfem.dynamics.actions_kernel import external
from kedfem.dynamics.beams_kernel import begun, bent, ended
from kedfem.dynamics.frames_kernel import elastic_energy, held_together, mean_rotation, oriented
from kedfem.dynamics.metric_kernel import metric_force
from kedfem.dynamics.mixing_kernel import factored, mixed, solved

SWEEPS, PATIENCE, EASIER = 40, 12, 100.0  # as in `dynamics.following`


@compiled
def follow_block(  # type: ignore[no-untyped-def]
    coefficients,
    matrices,
    unknowns,
    shapes,
    frames,
    beams,
    elements,
    element_room,
    kinds,
    forcing,
    acting,
    state,
    history,
    memory,
    counts,
):
    """Take up to T steps in place, [KED, eq. (20)]; the number that settled, and the segment that did not or -1."""
    G, Yt, S, B = matrices
    columns, count, first = unknowns
    Rs, Fs = forcing
    u, v, a, _, _, _, _, Q0, angle0, g0, strain0, direction, turn0, turned = state
    bends, follows, fit, K = frames
    T, L, D, n = Fs.shape
    Qn, c, k, E = B.shape[1], B.shape[2], len(first), direction.shape[2]
    n0, n1, n2, _, h1, h0, _, beta, tolerance = coefficients[4:]
    rates = (n0, n1, n2, h1, h0, beta)
    u1, v1, f1, F, change = (
        np.zeros_like(u),
        np.zeros_like(u),
        np.zeros_like(u),
        np.zeros_like(u),
        np.zeros_like(u),
    )
    lasting, resisted = np.zeros_like(u), np.zeros_like(u)
    Q1, angle1, g1 = Q0.copy(), angle0.copy(), np.zeros_like(g0)
    base, damped = np.zeros((len(turn0), 4, E)), np.zeros((len(turn0), 3, E))
    seen, points = np.zeros((len(turn0), 6, E)), np.zeros((5, E))
    Rp, RB, SRB = np.zeros((L, D, D)), np.zeros((L, Qn, c)), np.zeros((L, Qn, c))
    force, H = np.zeros((L, Qn)), np.zeros((k, k))
    work = (
        np.zeros((D, n)),
        np.zeros((D, n)),
        np.zeros(D * n),
        np.zeros((3, 3)),
        np.zeros((3, 3)),
        np.zeros(3),
    )
    swept_work = (np.zeros(k), np.zeros((L, Qn)), np.zeros((D, n)), np.zeros((L, D * n)), np.zeros(D * n))
    parts = (G, Yt, RB, SRB, columns, count)
    others = not bends.all()
    number = elements.number
    for t in range(T):
        R = Rs[t]
        begin_step(coefficients, R, state, u1, lasting, resisted)
        begun(rates, beams, R, strain0, direction, base, damped)
        settled, worst, reached = False, -1, 0.0
        for sweep in range(SWEEPS + 1):
            f1[:] = 0.0
            bent(1 + beta * h1 * n0, beams, u1.ravel(), base, damped, turn0, seen, f1.ravel(), points)
            if others:
                for i in range(L):
                    if number[i] >= 0:
                        e, X = number[i], shapes[0]
                        metric_force(
                            rates, i, e, elements, X, fit, R, u1, g0, g1, Q1, angle1, f1, work, element_room
                        )  # fmt: skip
                    elif not bends[i]:
                        held_together(
                            rates, i, kinds[i], follows[i], shapes, fit, K, R, u1, g0, g1, Q1, angle1, f1, work
                        )  # fmt: skip
            if sweep == 0 or settled:
                mean_rotation(bends, fit, shapes[0], R, u1, Q1)
            if sweep == 0:
                oriented(kinds, R, Q1, Rp)
                coupled(S, B, Rp, columns, count, first, RB, SRB, H)
            if sweep == 0 or acting is not None:
                F[:] = Fs[t]
            if acting is not None:
                velocity(rates, u1, u, v, a, v1)
                where = external(acting, t, u1, v1, turned, F)
                if settled:
                    turned[:] = where
                    Fs[t] = F
            if settled or sweep == SWEEPS:
                break
            counts[0] += 1
            moved, worst = swept(
                coefficients, parts, Rp, F, f1, u1, lasting, H, first, force, change, swept_work
            )
            allowed = tolerance if sweep < PATIENCE else EASIER * tolerance
            settled = moved <= allowed * allowed * max(counts[1], reached)
            if settled and moved > tolerance * tolerance * max(counts[1], reached):
                counts[5] += 1
            if not settled:
                mixed(memory, counts, sweep, change.ravel())
            reached = advanced(change, u1, u)
            if not reached <= counts[4]:
                settled = False
                break
        if not settled:
            counts[2] = 0.0
            return t, worst
        counts[1] = max(counts[1], reached)
        ended(t, rates, beams, R, seen, strain0, direction, turn0, history[4], history[7])
        if others:
            for i in range(L):
                if not bends[i]:
                    history[7][t, i] = elastic_energy(i, K, g1)
            Q0[:], angle0[:], g0[:] = Q1, angle1, g1
            history[3][t] = g1[0].reshape(L, D, n)
        oriented(kinds, R, Q1, history[5][t])
        recorded(coefficients, t, R, F, f1, u1, resisted, Rp, force, state, history)
    return T, -1


@compiled
def begin_step(coefficients, R, state, u1, lasting, resisted):  # type: ignore[no-untyped-def]
    """What a step begins with: the displacement if the acceleration stayed, and what of the balance it does not change.

    Parameters
    ----------
    lasting : (L, D, S) becomes what of the balance is no force at the end of the step
    resisted : (L, D, S) becomes the share of the past in damping by mass at the end of the step, world components
    """
    alpha_f, alpha_m = coefficients[2:4]
    n0, n1, n2, h, h1, h0, alpha = coefficients[4:11]
    u, v, a, F0, f0, C = state[:6]
    L, D, n = u.shape
    c_f, c_m = 1 - alpha_f, 1 - alpha_m
    for i in range(L if alpha != 0.0 else 0):
        for b in range(D):
            for j in range(n):
                resisted[i, b, j] = 0.0
        for m in range(D):
            for j in range(n):
                x2 = n0 * C[0, i, m, j] + n1 * C[1, i, m, j] + n2 * C[2, i, m, j]
                x = C[1, i, m, j] - h1 * x2 + h0 * C[2, i, m, j]
                for b in range(D):
                    resisted[i, b, j] += R[i, b, m] * x
    for i in range(L):
        for b in range(D):
            for j in range(n):
                x = n0 * u[i, b, j] + n1 * v[i, b, j] + n2 * a[i, b, j]
                x = c_m * x - alpha_m * a[i, b, j] + alpha_f * (F0[i, b, j] - f0[i, b, j])
                lasting[i, b, j] = x - c_f * resisted[i, b, j]
                u1[i, b, j] = u[i, b, j] + h * v[i, b, j] + 0.5 * h * h * a[i, b, j]


@compiled
def velocity(rates, u1, u, v, a, v1):  # type: ignore[no-untyped-def]
    """δ' at the end of the step, from δ there."""
    n0, n1, n2, h1, h0, _ = rates
    L, D, n = u.shape
    for i in range(L):
        for b in range(D):
            for j in range(n):
                x = n0 * (u1[i, b, j] - u[i, b, j]) - n1 * v[i, b, j] - n2 * a[i, b, j]
                v1[i, b, j] = v[i, b, j] + h1 * x + h0 * a[i, b, j]


@compiled
def coupled(S, B, R, columns, count, first, RB, SRB, H):  # type: ignore[no-untyped-def]
    """Rᵀ B, S Rᵀ B of each segment, and the factor of H = Σ Bᵀ R S Rᵀ B, of which the lower half is kept."""
    L, Q = S.shape[:2]
    D = R.shape[1]
    for row in range(len(H)):
        for m in range(first[row], row + 1):
            H[row, m] = 0.0
    for i in range(L):
        for p in range(Q // D):
            for a in range(D):
                for c in range(count[i]):
                    x = 0.0
                    for b in range(D):
                        x += R[i, b, a] * B[i, p * D + b, c]
                    RB[i, p * D + a, c] = x
        for q in range(Q):
            for c in range(count[i]):
                x = 0.0
                for p in range(Q):
                    x += S[i, q, p] * RB[i, p, c]
                SRB[i, q, c] = x
        for c in range(count[i]):
            for d in range(count[i]):
                if columns[i, d] <= columns[i, c]:
                    x = 0.0
                    for q in range(Q):
                        x += RB[i, q, c] * SRB[i, q, d]
                    H[columns[i, c], columns[i, d]] += x
    factored(H, first)


@compiled
def swept(  # type: ignore[no-untyped-def]
    coefficients, parts, Rp, F, f, u, lasting, H, first, force, change, work
):
    """The change that the residuals ask for, world components, and port forces.

    Returns
    -------
    sum of squares of the change, and the segment that it moves most
    """
    G, Yt, RB, SRB, columns, count = parts
    z, reaction, x, rhs, dg = work
    c_f, c_m = 1 - coefficients[2], 1 - coefficients[3]
    at_u = coefficients[4] * (c_m + c_f * coefficients[10] * coefficients[8])  # of a1, and of damping by mass
    L, D, n = change.shape
    N, Q = D * n, reaction.shape[1]
    for m in range(len(z)):
        z[m] = 0.0
    for i in range(L):
        for b in range(D):
            for j in range(n):
                x[b, j] = lasting[i, b, j] + c_f * (F[i, b, j] - f[i, b, j]) - at_u * u[i, b, j]
        for m in range(D):
            for j in range(n):
                y = 0.0
                for b in range(D):
                    y += Rp[i, b, m] * x[b, j]
                rhs[i, m * n + j] = y
        for q in range(Q):
            y = 0.0
            for r in range(N):
                y += Yt[i, q, r] * rhs[i, r]
            reaction[i, q] = y
            for m in range(count[i]):
                z[columns[i, m]] += RB[i, q, m] * y
    solved(H, first, z)
    total, most, worst = 0.0, -1.0, -1
    for i in range(L):
        for r in range(N):
            dg[r] = 0.0
        for m in range(N):
            y = rhs[i, m]
            for r in range(N):
                dg[r] += y * G[i, m, r]
        for q in range(Q):
            y, w = -reaction[i, q], 0.0
            for m in range(count[i]):
                y += SRB[i, q, m] * z[columns[i, m]]
                w += RB[i, q, m] * z[columns[i, m]]
            force[i, q] = y
            for r in range(N):
                dg[r] += Yt[i, q, r] * w
        own = 0.0
        for b in range(D):
            for j in range(n):
                y = 0.0
                for m in range(D):
                    y += Rp[i, b, m] * dg[m * n + j]
                change[i, b, j] = y
                own += y * y
        total += own
        if not own <= most:
            most, worst = own, i
    return total, worst


@compiled
def advanced(change, u, before):  # type: ignore[no-untyped-def]
    """u moves by the change; the sum of squares of what it has moved by since `before`."""
    total = 0.0
    L, D, n = u.shape
    for i in range(L):
        for b in range(D):
            for j in range(n):
                u[i, b, j] += change[i, b, j]
                total += (u[i, b, j] - before[i, b, j]) ** 2
    return total


@compiled
def recorded(  # type: ignore[no-untyped-def]
    coefficients, t, R, F, f, u1, resisted, Rp, force, state, history
):
    """The settled end of a step becomes the state, and row t of the history; but for what frames see."""
    alpha_f = coefficients[2]
    n0, n1, n2, _, h1, h0, alpha = coefficients[4:11]
    u, v, a, F0, f0, C, force0 = state[:7]
    us, vs, as_, _, _, Rs, forces, _ = history
    L, D, n = F.shape
    for i in range(L):
        for b in range(D):
            for j in range(n):
                x = u1[i, b, j]
                x2 = n0 * (x - u[i, b, j]) - n1 * v[i, b, j] - n2 * a[i, b, j]
                x1 = v[i, b, j] + h1 * x2 + h0 * a[i, b, j]
                u[i, b, j], v[i, b, j], a[i, b, j], F0[i, b, j] = x, x1, x2, F[i, b, j]
                us[t, i, b, j], vs[t, i, b, j], as_[t, i, b, j] = x, x1, x2
                f0[i, b, j] = f[i, b, j] + alpha * h1 * n0 * x + resisted[i, b, j]
        for b in range(D if alpha != 0.0 else 0):
            for j in range(n):
                x = 0.0
                for m in range(D):
                    x += R[i, m, b] * u1[i, m, j]
                x *= alpha
                x2 = n0 * (x - C[0, i, b, j]) - n1 * C[1, i, b, j] - n2 * C[2, i, b, j]
                C[1, i, b, j] += h1 * x2 + h0 * C[2, i, b, j]
                C[0, i, b, j], C[2, i, b, j] = x, x2
        for p in range(force.shape[1] // D):  # λ of the balance is (1 − α_f) λ1 + α_f λ0, in world components
            for b in range(D):
                x = 0.0
                for m in range(D):
                    x += Rp[i, b, m] * force[i, p * D + m]
                force0[i, p * D + b] = (x - alpha_f * force0[i, p * D + b]) / (1.0 - alpha_f)
            for b in range(D):
                x = 0.0
                for m in range(D):
                    x += Rs[t, i, m, b] * force0[i, p * D + m]
                forces[t, i, p * D + b] = x
