"""The inner loop of small segments whose frames follow them, compiled by numba.

Coordinates and padding as in `dynamics.kernel`; a segment has up to E frames. k interface unknowns, ordered so that
H = Σ Bᵀ R S Rᵀ B has its entries near the diagonal: from column `first` of each row on.

    coefficients : (13,) c_M, c_K, α_f, α_m; Newmark's acceleration (3); h, h γ, h (1 − γ); damping α, β; tolerance
    matrices : G (L, N, N), Yt (L, Q, N), S (L, Q, Q), B (L, Q, c)
    columns, count, first : (L, c), (L,), (k,)
    shapes : X (L, D, S) position, one (L, D, S), mean (L, D, S) weights of the segment's mean rotation
    frames : number (L,), fit (L, E, D, S), K (L, E, N, N), share (L, E, N, N)
    kinds : (L,) 0: rows (u, v, w), 1: (u, v), 2: (u, v, ψ)
    state : u, v, a, F, f (L, D, S), C (3, L, D, S), force (L, Q) in world components, Q (L, E + 1, 3, 3), angle (L, E + 1),
        g (3, L, E, N): deformation seen from each frame and its rates; the last frame is the segment's mean one;
        turned (A,) coordinates of the actions
    acting : of `dynamics.acting.over_block`, whose forces are added to F; None without motors and springs, whose code is then not compiled
    history : u, v, a, g (T, L, D, S), R (T, L, D, D), port forces (T, L, Q) in that frame, strain energy (T, L)
    memory : pairs (2, m, L·D·S) of steps taken and of how the change asked for changed; last step and change (2, L·D·S)
    counts : sweeps, square of what counts as a step, pairs that are known

Imported when it is first needed. Plain loops, so that nothing is allocated in a step.
"""

from typing import Any

import numpy as np
from numba import njit

from kedfem.dynamics.actions_kernel import external

compiled: Any = njit(cache=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})

SPACE, PLANE, BEAM = 0, 1, 2
SWEEPS = 15
RIDGE = 1e-13  # of a pair's own square: pairs that repeat each other
TURNS = 20


@compiled
def follow_block(  # type: ignore[no-untyped-def]
    coefficients, matrices, unknowns, shapes, frames, kinds, forcing, acting, state, history, memory, counts
):
    """Take up to T steps in place, [KED, eq. (20)]; the number that settled, and the segment that did not or -1."""
    G, Yt, S, B = matrices
    columns, count, first = unknowns
    Rs, Fs = forcing
    F = np.zeros(Fs.shape[1:])
    u, v, a, F0, f0, C, force0, Q0, angle0, g0, turned = state
    T, L, D, n = Fs.shape
    Qn, c, k = B.shape[1], B.shape[2], len(first)
    h, tolerance = coefficients[7], coefficients[12]
    u1, v1, a1, f1 = np.zeros((L, D, n)), np.zeros((L, D, n)), np.zeros((L, D, n)), np.zeros((L, D, n))
    C1, Q1, angle1, g1 = np.zeros_like(C), Q0.copy(), angle0.copy(), np.zeros_like(g0)
    end = (u1, v1, a1, f1, C1, Q1, angle1, g1)
    Rp, rhs, change = np.zeros((L, D, D)), np.zeros((L, D * n)), np.zeros((L, D, n))
    RB, SRB = np.zeros((L, Qn, c)), np.zeros((L, Qn, c))
    reaction, force = np.zeros((L, Qn)), np.zeros((L, Qn))
    H, z = np.zeros((k, k)), np.zeros(k)
    work = (np.zeros((D, n)), np.zeros((D, n)), np.zeros((D, n)), np.zeros(D * n), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3))
    parts = (G, Yt, RB, SRB, columns, count)
    for t in range(T):
        for i in range(L):
            for b in range(D):
                for j in range(n):
                    u1[i, b, j] = u[i, b, j] + h * v[i, b, j] + 0.5 * h * h * a[i, b, j]
        Q1[:] = Q0
        angle1[:] = angle0
        end_of_step(coefficients, shapes, frames, kinds, Rs[t], state, end, work)
        mean_frames(shapes, frames, kinds, Rs[t], u1, Q1, angle1, work)
        oriented(kinds, Rs[t], Q1, Rp)
        for row in range(k):
            H[row, first[row] : row + 1] = 0.0
        turned_ports(Rp, B, count, RB)
        gathered(S, RB, columns, count, SRB, H)
        factored(H, first)
        settled, worst = False, -1
        for sweep in range(SWEEPS):
            counts[0] += 1
            F[:] = Fs[t]
            if acting is not None:
                external(acting, t, u1, v1, turned, F)
            residuals(coefficients, F, Rp, state, end, rhs)
            worst = swept(parts, Rp, rhs, H, first, z, reaction, force, change)
            moved = squares(change)
            mixed(memory, counts, sweep, change.ravel())
            for i in range(L):
                for b in range(D):
                    for j in range(n):
                        u1[i, b, j] += change[i, b, j]
            end_of_step(coefficients, shapes, frames, kinds, Rs[t], state, end, work)
            if not np.isfinite(moved):
                break
            counts[1] = max(counts[1], difference(u1, u))
            if moved <= tolerance * tolerance * counts[1]:
                settled = True
                break
        if not settled:
            return t, worst
        mean_frames(shapes, frames, kinds, Rs[t], u1, Q1, angle1, work)
        F[:] = Fs[t]
        if acting is not None:
            turned[:] = external(acting, t, u1, v1, turned, F)
            Fs[t] = F
        recorded(coefficients, t, frames, kinds, Rs[t], F, Rp, force, state, end, history)
    return T, -1


@compiled
def squares(x):  # type: ignore[no-untyped-def]
    """Sum of squares of (L, D, S)."""
    total = 0.0
    for i in range(x.shape[0]):
        for b in range(x.shape[1]):
            for j in range(x.shape[2]):
                total += x[i, b, j] * x[i, b, j]
    return total


@compiled
def difference(x, y):  # type: ignore[no-untyped-def]
    """Sum of squares of x − y, (L, D, S)."""
    total = 0.0
    for i in range(x.shape[0]):
        for b in range(x.shape[1]):
            for j in range(x.shape[2]):
                total += (x[i, b, j] - y[i, b, j]) ** 2
    return total


@compiled
def swept(parts, Rp, rhs, H, first, z, reaction, force, change):  # type: ignore[no-untyped-def]
    """The change that the residuals ask for, world components, and port forces; the segment that it moves most."""
    G, Yt, RB, SRB, columns, count = parts
    L, D, n = change.shape
    N, Q = D * n, reaction.shape[1]
    z[:] = 0.0
    for i in range(L):
        for q in range(Q):
            x = 0.0
            for r in range(N):
                x += Yt[i, q, r] * rhs[i, r]
            reaction[i, q] = x
        for q in range(Q):
            for m in range(count[i]):
                z[columns[i, m]] += RB[i, q, m] * reaction[i, q]
    solved(H, first, z)
    dg, most, worst = np.empty(N), -1.0, -1
    for i in range(L):
        for r in range(N):
            x = 0.0
            for m in range(N):
                x += G[i, r, m] * rhs[i, m]
            dg[r] = x
        for q in range(Q):
            x, w = -reaction[i, q], 0.0
            for m in range(count[i]):
                x += SRB[i, q, m] * z[columns[i, m]]
                w += RB[i, q, m] * z[columns[i, m]]
            force[i, q] = x
            if w != 0.0:
                for r in range(N):
                    dg[r] += Yt[i, q, r] * w
        own = 0.0
        for b in range(D):
            for j in range(n):
                x = 0.0
                for m in range(D):
                    x += Rp[i, b, m] * dg[m * n + j]
                change[i, b, j] = x
                own += x * x
        if not own <= most:
            most, worst = own, i
    return worst


@compiled
def mixed(memory, counts, sweep, change):  # type: ignore[no-untyped-def]
    """Anderson's mixing, see `dynamics.following.Mixing`: the change asked for becomes the step to take."""
    pairs, last = memory
    depth, N = pairs.shape[1:]
    if sweep > 0:
        for m in range(depth - 1, 0, -1):
            pairs[:, m] = pairs[:, m - 1]
        for x in range(N):
            pairs[0, 0, x], pairs[1, 0, x] = last[0, x], change[x] - last[1, x]
        counts[2] = min(depth, counts[2] + 1)
    known = int(counts[2])
    last[1] = change
    if known > 0:
        A, b, norm = np.zeros((known, known)), np.zeros(known), np.zeros(known)
        for p in range(known):
            for q in range(p + 1):
                for x in range(N):
                    A[p, q] += pairs[1, p, x] * pairs[1, q, x]
            for x in range(N):
                b[p] += pairs[1, p, x] * change[x]
            norm[p] = np.sqrt(A[p, p]) + 1e-300
        for p in range(known):
            b[p] /= norm[p]
            for q in range(p + 1):
                A[p, q] /= norm[p] * norm[q]
            A[p, p] = 1 + RIDGE
        factored(A, np.zeros(known, np.int64))
        solved(A, np.zeros(known, np.int64), b)
        for p in range(known):
            gamma = b[p] / norm[p]
            for x in range(N):
                change[x] -= gamma * (pairs[0, p, x] + pairs[1, p, x])
    last[0] = change


@compiled
def end_of_step(coefficients, shapes, frames, kinds, R, state, end, work):  # type: ignore[no-untyped-def]
    """Rates, frames and internal force of all segments at the end of the step, from their displacement."""
    n0, n1, n2, _, h1, h0, alpha, beta = coefficients[4:12]
    u, v, a, C, g0 = state[0], state[1], state[2], state[5], state[9]
    u1, v1, a1, f1, C1, Q1, angle1, g1 = end
    X, one, _ = shapes
    number, fit, K, _ = frames
    y, f, turned, strained, A, U, change = work
    L, D, n = u.shape
    for i in range(L):
        kind = kinds[i]
        d = 2 if kind == PLANE else D
        for b in range(d):
            for j in range(n):
                x = n0 * (u1[i, b, j] - u[i, b, j]) - n1 * v[i, b, j] - n2 * a[i, b, j]
                a1[i, b, j] = x
                v1[i, b, j] = v[i, b, j] + h1 * x + h0 * a[i, b, j]
                f[b, j] = 0.0
        for b in range(d):
            for j in range(n):
                x = 0.0
                for m in range(d):
                    x += R[i, m, b] * u1[i, m, j]
                y[b, j] = X[i, b, j] + x
                if alpha != 0.0:
                    x *= alpha
                    x2 = n0 * (x - C[0, i, b, j]) - n1 * C[1, i, b, j] - n2 * C[2, i, b, j]
                    x1 = C[1, i, b, j] + h1 * x2 + h0 * C[2, i, b, j]
                    C1[0, i, b, j], C1[1, i, b, j], C1[2, i, b, j] = x, x1, x2
                    f[b, j] = x1
        for e in range(max(1, number[i])):
            if number[i]:
                rotation(kind, fit[i, e], y, Q1[i, e], angle1[i], e, A, U, change)
            deformation(kind, y, X[i], one[i], Q1[i, e], angle1[i, e], g1[0, i, e], number[i] > 0)
            g = g1[0, i, e]
            if beta == 0.0:
                for r in range(D * n):
                    strained[r] = g[r]
            else:
                for r in range(D * n):
                    x2 = n0 * (g[r] - g0[0, i, e, r]) - n1 * g0[1, i, e, r] - n2 * g0[2, i, e, r]
                    x1 = g0[1, i, e, r] + h1 * x2 + h0 * g0[2, i, e, r]
                    g1[1, i, e, r], g1[2, i, e, r] = x1, x2
                    strained[r] = g[r] + beta * x1
            for b in range(d):
                for j in range(n):
                    x = 0.0
                    for r in range(D * n):
                        x += K[i, e, b * n + j, r] * strained[r]
                    turned[b, j] = x
            if number[i] == 0:
                for b in range(d):
                    for j in range(n):
                        f[b, j] += turned[b, j]
            elif kind == SPACE:
                balanced_space(fit[i, e], y, Q1[i, e], g, turned, U, change)
                for b in range(3):
                    for j in range(n):
                        f[b, j] += (
                            Q1[i, e, b, 0] * turned[0, j] + Q1[i, e, b, 1] * turned[1, j] + Q1[i, e, b, 2] * turned[2, j]
                        )
            else:
                balanced_plane(fit[i, e], y, Q1[i, e], g, turned)
                c, s = Q1[i, e, 0, 0], Q1[i, e, 1, 0]
                for j in range(n):
                    f[0, j] += c * turned[0, j] - s * turned[1, j]
                    f[1, j] += s * turned[0, j] + c * turned[1, j]
                if kind == BEAM:
                    for j in range(n):
                        f[2, j] += turned[2, j]
        for b in range(d):
            for j in range(n):
                x = 0.0
                for m in range(d):
                    x += R[i, b, m] * f[m, j]
                f1[i, b, j] = x


@compiled
def element(kind, Q, b, m):  # type: ignore[no-untyped-def]
    """Entry of a frame's rotation on rows: ψ does not turn."""
    if kind == 0 or (b < 2 and m < 2):
        return Q[b, m]
    return 1.0 if b == m else 0.0


@compiled
def rotation(kind, fit, y, Q, angles, e, A, U, change):  # type: ignore[no-untyped-def]
    """Q of Σ y_a ⊗ fit_a in place, from an earlier one; of a planar segment its angle, which counts turns."""
    n = y.shape[1]
    if kind != SPACE:
        c, s = 0.0, 0.0
        for j in range(n):
            c += y[0, j] * fit[0, j] + y[1, j] * fit[1, j]
            s += y[1, j] * fit[0, j] - y[0, j] * fit[1, j]
        turn = np.arctan2(s, c)
        turn += 2 * np.pi * np.round((angles[e] - turn) / (2 * np.pi))
        angles[e] = turn
        size = np.sqrt(c * c + s * s)
        c, s = c / size, s / size
        Q[0, 0], Q[0, 1], Q[1, 0], Q[1, 1] = c, -s, s, c
        return
    for b in range(3):
        for m in range(3):
            x = 0.0
            for j in range(n):
                x += y[b, j] * fit[m, j]
            A[b, m] = x
    for _ in range(TURNS):
        for b in range(3):
            for m in range(3):
                U[b, m] = Q[0, b] * A[0, m] + Q[1, b] * A[1, m] + Q[2, b] * A[2, m]
        change[0], change[1], change[2] = U[2, 1] - U[1, 2], U[0, 2] - U[2, 0], U[1, 0] - U[0, 1]
        turn_of(U, change)
        size = max(abs(change[0]), abs(change[1]), abs(change[2]))
        rodrigues(change, Q, U)
        if size <= 1e-8:  # the next, quadratically smaller, is rounding
            break


@compiled
def turn_of(U, x):  # type: ignore[no-untyped-def]
    """x becomes (tr(U) 1 − sym U)⁻¹ x."""
    trace = U[0, 0] + U[1, 1] + U[2, 2]
    a, b, c = trace - U[0, 0], trace - U[1, 1], trace - U[2, 2]
    d, e, f = -(U[0, 1] + U[1, 0]) / 2, -(U[1, 2] + U[2, 1]) / 2, -(U[2, 0] + U[0, 2]) / 2
    A, B, C = b * c - e * e, e * f - d * c, d * e - b * f
    det = a * A + d * B + f * C
    x0, x1, x2 = x[0], x[1], x[2]
    x[0] = (A * x0 + B * x1 + C * x2) / det
    x[1] = (B * x0 + (a * c - f * f) * x1 + (d * f - a * e) * x2) / det
    x[2] = (C * x0 + (d * f - a * e) * x1 + (a * b - d * d) * x2) / det


@compiled
def rodrigues(w, Q, W):  # type: ignore[no-untyped-def]
    """Q becomes Q times the rotation by w."""
    x, y, z = w
    t = np.sqrt(x * x + y * y + z * z)
    a, b = 1.0, 0.5
    if t > 1e-8:
        a, b = np.sin(t) / t, (1 - np.cos(t)) / (t * t)
    W[0, 0], W[1, 1], W[2, 2] = 1 - b * (y * y + z * z), 1 - b * (x * x + z * z), 1 - b * (x * x + y * y)
    W[0, 1], W[1, 0] = b * x * y - a * z, b * x * y + a * z
    W[0, 2], W[2, 0] = b * x * z + a * y, b * x * z - a * y
    W[1, 2], W[2, 1] = b * y * z - a * x, b * y * z + a * x
    for r in range(3):
        p, q, s = Q[r, 0], Q[r, 1], Q[r, 2]
        for m in range(3):
            Q[r, m] = p * W[0, m] + q * W[1, m] + s * W[2, m]


@compiled
def deformation(kind, y, X, one, Q, angle, g, follows):  # type: ignore[no-untyped-def]
    """g = Qᵀ y − X without its mean, flat; ψ less the frame's angle. In the nominal frame y − X."""
    D, n = y.shape
    if not follows:
        for b in range(D):
            for j in range(n):
                g[b * n + j] = y[b, j] - X[b, j]
        return
    k = 3 if kind == SPACE else 2
    for b in range(k):
        mean, total = 0.0, 0.0
        for j in range(n):
            x = -X[b, j]
            for m in range(k):
                x += Q[m, b] * y[m, j]
            g[b * n + j] = x
            mean += x * one[b, j]
            total += one[b, j] * one[b, j]
        mean /= total
        for j in range(n):
            g[b * n + j] -= mean * one[b, j]
    if kind == BEAM:
        for j in range(n):
            g[2 * n + j] = y[2, j] - angle * one[2, j]


@compiled
def balanced_plane(fit, y, Q, g, f):  # type: ignore[no-untyped-def]
    """f becomes the gradient of the energy in a plane: F_a = f_a − (τ / tr U) e_z × fit_a, τ = Σ g_a × f_a."""
    n = y.shape[1]
    torque, trace = 0.0, 0.0
    for j in range(n):
        torque += g[j] * f[1, j] - g[n + j] * f[0, j]
        trace += (Q[0, 0] * y[0, j] + Q[1, 0] * y[1, j]) * fit[0, j]
        trace += (Q[0, 1] * y[0, j] + Q[1, 1] * y[1, j]) * fit[1, j]
    torque /= trace
    for j in range(n):
        f[0, j] += torque * fit[1, j]
        f[1, j] -= torque * fit[0, j]


@compiled
def balanced_space(fit, y, Q, g, f, U, w):  # type: ignore[no-untyped-def]
    """f becomes the gradient of the energy: F_a = f_a − (G⁻¹ τ) × fit_a, τ = Σ g_a × f_a."""
    n = y.shape[1]
    U[:] = 0.0
    w[:] = 0.0
    for j in range(n):
        gx, gy, gz = g[j], g[n + j], g[2 * n + j]
        w[0] += gy * f[2, j] - gz * f[1, j]
        w[1] += gz * f[0, j] - gx * f[2, j]
        w[2] += gx * f[1, j] - gy * f[0, j]
        for b in range(3):
            x = Q[0, b] * y[0, j] + Q[1, b] * y[1, j] + Q[2, b] * y[2, j]
            for m in range(3):
                U[b, m] += x * fit[m, j]
    turn_of(U, w)
    for j in range(n):
        f[0, j] -= w[1] * fit[2, j] - w[2] * fit[1, j]
        f[1, j] -= w[2] * fit[0, j] - w[0] * fit[2, j]
        f[2, j] -= w[0] * fit[1, j] - w[1] * fit[0, j]


@compiled
def mean_frames(shapes, frames, kinds, R, u1, Q1, angle1, work):  # type: ignore[no-untyped-def]
    """The segments' mean rotations, kept behind those of their frames."""
    X, _, mean = shapes
    y, _, _, _, A, U, change = work
    L, D, n = u1.shape
    last = Q1.shape[1] - 1
    for i in range(L):
        number = frames[0][i]
        if number == 1:
            for b in range(3):
                for m in range(3):
                    Q1[i, last, b, m] = Q1[i, 0, b, m]
            angle1[i, last] = angle1[i, 0]
        elif number > 1:
            for b in range(D):
                for j in range(n):
                    x = X[i, b, j]
                    for m in range(D):
                        x += R[i, m, b] * u1[i, m, j]
                    y[b, j] = x
            rotation(kinds[i], mean[i], y, Q1[i, last], angle1[i], last, A, U, change)


@compiled
def oriented(kinds, R, Q1, out):  # type: ignore[no-untyped-def]
    """R Q of each segment's mean frame: link to world."""
    L, D = R.shape[:2]
    last = Q1.shape[1] - 1
    for i in range(L):
        for b in range(D):
            for m in range(D):
                x = 0.0
                for k in range(D):
                    x += R[i, b, k] * element(kinds[i], Q1[i, last], k, m)
                out[i, b, m] = x


@compiled
def residuals(coefficients, F, Rp, state, end, out):  # type: ignore[no-untyped-def]
    """What is missing to balance at the end of the step, in the predicted frames."""
    alpha_f, alpha_m = coefficients[2:4]
    a, F0, f0, a1, f1 = state[2], state[3], state[4], end[2], end[3]
    L, D, n = F.shape
    for i in range(L):
        for m in range(D * n):
            out[i, m] = 0.0
        for b in range(D):
            for j in range(n):
                x = (1 - alpha_f) * (F[i, b, j] - f1[i, b, j]) - (1 - alpha_m) * a1[i, b, j] - alpha_m * a[i, b, j]
                x += alpha_f * (F0[i, b, j] - f0[i, b, j])
                for m in range(D):
                    out[i, m * n + j] += Rp[i, b, m] * x


@compiled
def turned_ports(R, B, count, out):  # type: ignore[no-untyped-def]
    """Rᵀ B, port by port."""
    L, D = R.shape[:2]
    for i in range(L):
        for p in range(B.shape[1] // D):
            for a in range(D):
                for c in range(count[i]):
                    x = 0.0
                    for b in range(D):
                        x += R[i, b, a] * B[i, p * D + b, c]
                    out[i, p * D + a, c] = x


@compiled
def gathered(S, RB, columns, count, SRB, H):  # type: ignore[no-untyped-def]
    """S Rᵀ B of each segment, and its share in H, of which the lower half is kept."""
    L, Q = S.shape[:2]
    for i in range(L):
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


@compiled
def factored(H, first):  # type: ignore[no-untyped-def]
    """Cholesky factor in place, entries of each row from its first column on."""
    for i in range(len(H)):
        for j in range(first[i], i + 1):
            total = H[i, j]
            for m in range(max(first[i], first[j]), j):
                total -= H[i, m] * H[j, m]
            H[i, j] = np.sqrt(total) if i == j else total / H[j, j]


@compiled
def solved(H, first, x):  # type: ignore[no-untyped-def]
    """x becomes the solution, by the factor."""
    k = len(x)
    for i in range(k):
        for j in range(first[i], i):
            x[i] -= H[i, j] * x[j]
        x[i] /= H[i, i]
    for i in range(k - 1, -1, -1):
        x[i] /= H[i, i]
        for j in range(first[i], i):
            x[j] -= H[i, j] * x[i]


@compiled
def recorded(coefficients, t, frames, kinds, R, F, Rp, force, state, end, history):  # type: ignore[no-untyped-def]
    """The settled end of a step becomes the state, and a row of the history."""
    alpha_f = coefficients[2]
    u, v, a, F0, f0, C, force0, Q0, angle0, g0, _ = state
    u1, v1, a1, f1, C1, Q1, angle1, g1 = end
    us, vs, as_, gs, Rs, forces, energies = history
    number, _, K, share = frames
    L, D, n = F.shape
    N = D * n
    u[:], v[:], a[:], F0[:], f0[:], Q0[:], angle0[:] = u1, v1, a1, F, f1, Q1, angle1
    C[:], g0[:] = C1, g1
    us[t], vs[t], as_[t] = u1, v1, a1
    oriented(kinds, R, Q1, Rs[t])
    for i in range(L):
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
        energy = 0.0
        for e in range(max(1, number[i])):
            for r in range(N):
                x = 0.0
                for m in range(N):
                    x += K[i, e, r, m] * g1[0, i, e, m]
                energy += 0.5 * x * g1[0, i, e, r]
        energies[t, i] = energy
        for b in range(D):
            for j in range(n):
                x = 0.0
                if number[i] < 2:
                    x = g1[0, i, 0, b * n + j]
                else:
                    for e in range(number[i]):
                        for m in range(N):
                            x += share[i, e, b * n + j, m] * g1[0, i, e, m]
                gs[t, i, b, j] = x
