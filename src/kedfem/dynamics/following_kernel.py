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
        g (3, L, E, N): deformation seen from each frame and its rates; the last frame is the segment's mean one
    history : u, v, a, g (T, L, D, S), R (T, L, D, D), port forces (T, L, Q) in that frame, strain energy (T, L)
    memory : pairs (2, m, L·D·S) of steps taken and of how the change asked for changed; last step and change (2, L·D·S)
    counts : sweeps, scale², pairs that are known

Imported when it is first needed. Plain loops, so that nothing is allocated in a step.
"""

from typing import Any

import numpy as np
from numba import njit

from kedfem.dynamics.kernel import add_transposed, times

compiled: Any = njit(cache=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})

SPACE, PLANE, BEAM = 0, 1, 2
SWEEPS = 15
RIDGE = 1e-13  # of a pair's own square: pairs that repeat each other
TURNS = 20


@compiled
def follow_block(  # type: ignore[no-untyped-def]
    coefficients, matrices, unknowns, shapes, frames, kinds, forcing, state, history, memory, counts
):
    """Take up to T steps in place, [KED, eq. (20)]; the number that settled, and the segment that did not or -1."""
    G, Yt, S, B = matrices
    columns, count, first = unknowns
    Rs, Fs = forcing
    u, v, a, F0, f0, C, force0, Q0, angle0, g0 = state
    T, L, D, n = Fs.shape
    Qn, c, k = B.shape[1], B.shape[2], len(first)
    h, tolerance = coefficients[7], coefficients[12]
    u1, v1, a1, f1 = np.zeros((L, D, n)), np.zeros((L, D, n)), np.zeros((L, D, n)), np.zeros((L, D, n))
    C1, Q1, angle1, g1 = np.zeros_like(C), Q0.copy(), angle0.copy(), np.zeros_like(g0)
    Rp, rhs, dg = np.zeros((L, D, D)), np.zeros((L, D * n)), np.zeros(D * n)
    RB, SRB = np.zeros((L, Qn, c)), np.zeros((L, Qn, c))
    reaction, w, force = np.zeros((L, Qn)), np.zeros(Qn), np.zeros((L, Qn))
    H, z, strain = np.zeros((k, k)), np.zeros(k), np.zeros(L)
    work, change = np.zeros((4, D, n)), np.zeros((L, D, n))
    worst = -1
    for t in range(T):
        for i in range(L):
            for b in range(D):
                for j in range(n):
                    u1[i, b, j] = u[i, b, j] + h * v[i, b, j] + 0.5 * h * h * a[i, b, j]
            Q1[i], angle1[i] = Q0[i], angle0[i]
            strain[i] = end_of_step(
                coefficients, i, shapes, frames, kinds[i], Rs[t, i], state, (u1, v1, a1, f1, C1, Q1, angle1, g1), work
            )
            mean_frame(i, shapes, frames, kinds[i], Rs[t, i], u1, Q1, angle1, work)
            oriented(kinds[i], Rs[t, i], Q1[i, -1], Rp[i])
        for row in range(k):
            H[row, first[row] : row + 1] = 0.0
        for i in range(L):
            turned_ports(Rp[i], B[i], count[i], RB[i])
            gathered(S[i], RB[i], columns[i], count[i], SRB[i], H)
        factored(H, first)
        settled = False
        for sweep in range(SWEEPS):
            counts[0] += 1
            z[:] = 0.0
            for i in range(L):
                residual(coefficients, i, Fs[t, i], Rp[i], state, (u1, a1, f1), rhs[i])
                times(Yt[i], rhs[i], reaction[i])
                for q in range(Qn):
                    for m in range(count[i]):
                        z[columns[i, m]] += RB[i, q, m] * reaction[i, q]
            solved(H, first, z)
            moved, size, most = 0.0, 0.0, -1.0
            for i in range(L):
                for q in range(Qn):
                    force[i, q], w[q] = -reaction[i, q], 0.0
                    for m in range(count[i]):
                        force[i, q] += SRB[i, q, m] * z[columns[i, m]]
                        w[q] += RB[i, q, m] * z[columns[i, m]]
                times(G[i], rhs[i], dg)
                add_transposed(Yt[i], w, dg)
                own = 0.0
                for b in range(D):
                    for j in range(n):
                        x = 0.0
                        for m in range(D):
                            x += Rp[i, b, m] * dg[m * n + j]
                        change[i, b, j] = x
                        own += x * x
                moved += own
                if not own <= most:
                    most, worst = own, i
            mixed(memory, counts, sweep, change.ravel())
            for i in range(L):
                for b in range(D):
                    for j in range(n):
                        u1[i, b, j] += change[i, b, j]
                        size += u1[i, b, j] * u1[i, b, j]
                strain[i] = end_of_step(
                    coefficients, i, shapes, frames, kinds[i], Rs[t, i], state,
                    (u1, v1, a1, f1, C1, Q1, angle1, g1), work,
                )  # fmt: skip
            if not np.isfinite(moved):
                break
            counts[1] = max(counts[1], size)
            if moved <= tolerance * tolerance * counts[1]:
                settled = True
                break
        if not settled:
            return t, worst
        for i in range(L):
            mean_frame(i, shapes, frames, kinds[i], Rs[t, i], u1, Q1, angle1, work)
            recorded(
                coefficients, t, i, frames, kinds[i], Rs[t, i], Fs[t, i], Rp[i], force[i], strain[i], state,
                (u1, v1, a1, f1, C1, Q1, angle1, g1), history,
            )  # fmt: skip
    return T, -1


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
def end_of_step(coefficients, i, shapes, frames, kind, R, state, end, work):  # type: ignore[no-untyped-def]
    """Rates, frames and internal force of segment i at the end of the step, from its displacement; its strain energy."""
    n0, n1, n2, _, h1, h0, alpha, beta = coefficients[4:12]
    u, v, a, _, _, C, _, _, _, g0 = state
    u1, v1, a1, f1, C1, Q1, angle1, g1 = end
    X, one, _ = shapes
    number, fit, K, _ = frames
    y, f, g, turned = work
    D, n = u.shape[1:]
    for b in range(D):
        for j in range(n):
            x = n0 * (u1[i, b, j] - u[i, b, j]) - n1 * v[i, b, j] - n2 * a[i, b, j]
            a1[i, b, j] = x
            v1[i, b, j] = v[i, b, j] + h1 * x + h0 * a[i, b, j]
            f[b, j] = 0.0
    for b in range(D):
        for j in range(n):
            x = 0.0
            for m in range(D):
                x += R[m, b] * u1[i, m, j]
            y[b, j] = X[i, b, j] + x
            if alpha != 0.0:
                x *= alpha
                x2 = n0 * (x - C[0, i, b, j]) - n1 * C[1, i, b, j] - n2 * C[2, i, b, j]
                x1 = C[1, i, b, j] + h1 * x2 + h0 * C[2, i, b, j]
                C1[0, i, b, j], C1[1, i, b, j], C1[2, i, b, j] = x, x1, x2
                f[b, j] = x1
    energy = 0.0
    if number[i] == 0:  # the nominal frame
        for b in range(D):
            for j in range(n):
                g[b, j] = y[b, j] - X[i, b, j]
        energy += frame_force(coefficients, i, 0, K[i, 0], g, g0, g1, turned)
        for b in range(D):
            for j in range(n):
                f[b, j] += turned[b, j]
    for e in range(number[i]):
        rotation(kind, fit[i, e], y, Q1[i, e], angle1[i], e)
        deformation(kind, y, X[i], one[i], Q1[i, e], angle1[i, e], g)
        energy += frame_force(coefficients, i, e, K[i, e], g, g0, g1, turned)
        balanced(kind, fit[i, e], y, Q1[i, e], g, turned)
        for b in range(D):
            for j in range(n):
                for m in range(D):
                    f[b, j] += element(kind, Q1[i, e], b, m) * turned[m, j]
    for b in range(D):
        for j in range(n):
            x = 0.0
            for m in range(D):
                x += R[b, m] * f[m, j]
            f1[i, b, j] = x
    return energy


@compiled
def element(kind, Q, b, m):  # type: ignore[no-untyped-def]
    """Entry of a frame's rotation on rows: ψ does not turn."""
    if kind == 0 or (b < 2 and m < 2):
        return Q[b, m]
    return 1.0 if b == m else 0.0


@compiled
def rotation(kind, fit, y, Q, angles, e):  # type: ignore[no-untyped-def]
    """Q of Σ y_a ⊗ fit_a in place, from an earlier one; of a planar segment its angle, which counts turns."""
    n = y.shape[1]
    if kind != 0:
        c, s = 0.0, 0.0
        for j in range(n):
            c += y[0, j] * fit[0, j] + y[1, j] * fit[1, j]
            s += y[1, j] * fit[0, j] - y[0, j] * fit[1, j]
        turn = np.arctan2(s, c)
        turn += 2 * np.pi * np.round((angles[e] - turn) / (2 * np.pi))
        angles[e] = turn
        size = np.sqrt(c * c + s * s)
        Q[0, 0], Q[0, 1], Q[1, 0], Q[1, 1] = c / size, -s / size, s / size, c / size
        return
    A, U, change, W = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3), np.zeros((3, 3))
    for b in range(3):
        for m in range(3):
            for j in range(n):
                A[b, m] += y[b, j] * fit[m, j]
    for _ in range(TURNS):
        for b in range(3):
            for m in range(3):
                U[b, m] = Q[0, b] * A[0, m] + Q[1, b] * A[1, m] + Q[2, b] * A[2, m]
        change[0], change[1], change[2] = U[2, 1] - U[1, 2], U[0, 2] - U[2, 0], U[1, 0] - U[0, 1]
        turn_of(U, change)
        rodrigues(change, Q, W)
        if max(abs(change[0]), abs(change[1]), abs(change[2])) <= 1e-15:
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
def deformation(kind, y, X, one, Q, angle, g):  # type: ignore[no-untyped-def]
    """g = Qᵀ y − X without its mean; ψ less the frame's angle."""
    D, n = y.shape
    k = 3 if kind == 0 else 2
    for b in range(k):
        mean, total = 0.0, 0.0
        for j in range(n):
            x = -X[b, j]
            for m in range(k):
                x += Q[m, b] * y[m, j]
            g[b, j] = x
            mean += x * one[b, j]
            total += one[b, j] * one[b, j]
        mean /= total
        for j in range(n):
            g[b, j] -= mean * one[b, j]
    for b in range(k, D):
        for j in range(n):
            g[b, j] = y[b, j] - angle * one[b, j] if kind == 2 else 0.0


@compiled
def frame_force(coefficients, i, e, K, g, g0, g1, f):  # type: ignore[no-untyped-def]
    """f = K (g + β g') of frame e of segment i, g' by the scheme's own formulas; its strain energy."""
    n0, n1, n2, _, h1, h0, _, beta = coefficients[4:12]
    D, n = g.shape
    energy = 0.0
    for m in range(D * n):
        x = g[m // n, m % n]
        g1[0, i, e, m] = x
        if beta != 0.0:
            x2 = n0 * (x - g0[0, i, e, m]) - n1 * g0[1, i, e, m] - n2 * g0[2, i, e, m]
            g1[1, i, e, m] = g0[1, i, e, m] + h1 * x2 + h0 * g0[2, i, e, m]
            g1[2, i, e, m] = x2
    for r in range(D * n):
        s, d = 0.0, 0.0
        for m in range(D * n):
            s += K[r, m] * g1[0, i, e, m]
        if beta != 0.0:
            for m in range(D * n):
                d += K[r, m] * g1[1, i, e, m]
        energy += 0.5 * g1[0, i, e, r] * s
        f[r // n, r % n] = s + beta * d
    return energy


@compiled
def balanced(kind, fit, y, Q, g, f):  # type: ignore[no-untyped-def]
    """f becomes the gradient of the energy: F_a = f_a − (G⁻¹ τ) × fit_a, τ = Σ g_a × f_a."""
    n = y.shape[1]
    if kind != 0:
        torque, trace = 0.0, 0.0
        for j in range(n):
            torque += g[0, j] * f[1, j] - g[1, j] * f[0, j]
            for b in range(2):
                trace += (Q[0, b] * y[0, j] + Q[1, b] * y[1, j]) * fit[b, j]
        torque /= trace
        for j in range(n):
            f[0, j] += torque * fit[1, j]
            f[1, j] -= torque * fit[0, j]
        return
    U, w = np.zeros((3, 3)), np.zeros(3)
    for j in range(n):
        w[0] += g[1, j] * f[2, j] - g[2, j] * f[1, j]
        w[1] += g[2, j] * f[0, j] - g[0, j] * f[2, j]
        w[2] += g[0, j] * f[1, j] - g[1, j] * f[0, j]
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
def mean_frame(i, shapes, frames, kind, R, u1, Q1, angle1, work):  # type: ignore[no-untyped-def]
    """The segment's mean rotation, kept behind those of its frames."""
    X, _, mean = shapes
    number = frames[0][i]
    if number == 1:
        Q1[i, -1], angle1[i, -1] = Q1[i, 0], angle1[i, 0]
    elif number > 1:
        y = work[0]
        D, n = y.shape
        for b in range(D):
            for j in range(n):
                y[b, j] = X[i, b, j]
                for m in range(D):
                    y[b, j] += R[m, b] * u1[i, m, j]
        rotation(kind, mean[i], y, Q1[i, -1], angle1[i], Q1.shape[1] - 1)


@compiled
def oriented(kind, R, Q, out):  # type: ignore[no-untyped-def]
    """R Q: link to world."""
    D = len(R)
    for b in range(D):
        for m in range(D):
            out[b, m] = 0.0
            for k in range(D):
                out[b, m] += R[b, k] * element(kind, Q, k, m)


@compiled
def residual(coefficients, i, F, Rp, state, end, out):  # type: ignore[no-untyped-def]
    """What is missing to balance at the end of the step, in the predicted frame."""
    alpha_f, alpha_m = coefficients[2:4]
    _, _, a, F0, f0 = state[:5]
    _, a1, f1 = end
    D, n = F.shape
    out[:] = 0.0
    for b in range(D):
        for j in range(n):
            x = (1 - alpha_f) * (F[b, j] - f1[i, b, j]) - (1 - alpha_m) * a1[i, b, j] - alpha_m * a[i, b, j]
            x += alpha_f * (F0[i, b, j] - f0[i, b, j])
            for m in range(D):
                out[m * n + j] += Rp[b, m] * x


@compiled
def turned_ports(R, B, count, out):  # type: ignore[no-untyped-def]
    """Rᵀ B, port by port."""
    D = len(R)
    for p in range(len(B) // D):
        for a in range(D):
            for c in range(count):
                x = 0.0
                for b in range(D):
                    x += R[b, a] * B[p * D + b, c]
                out[p * D + a, c] = x


@compiled
def gathered(S, RB, columns, count, SRB, H):  # type: ignore[no-untyped-def]
    """S Rᵀ B of a segment, and its share in H, of which the lower half is kept."""
    for q in range(len(S)):
        for c in range(count):
            SRB[q, c] = 0.0
        for p in range(len(S)):
            s = S[q, p]
            for c in range(count):
                SRB[q, c] += s * RB[p, c]
    for c in range(count):
        for d in range(count):
            if columns[d] <= columns[c]:
                x = 0.0
                for q in range(len(S)):
                    x += RB[q, c] * SRB[q, d]
                H[columns[c], columns[d]] += x


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
def recorded(coefficients, t, i, frames, kind, R, F, Rp, force, strain, state, end, history):  # type: ignore[no-untyped-def]
    """The settled end of a step becomes the state, and a row of the history."""
    alpha_f = coefficients[2]
    u, v, a, F0, f0, C, force0, Q0, angle0, g0 = state
    u1, v1, a1, f1, C1, Q1, angle1, g1 = end
    us, vs, as_, gs, Rs, forces, energies = history
    number, _, _, share = frames
    D, n = F.shape
    u[i], v[i], a[i], F0[i], f0[i], Q0[i], angle0[i] = u1[i], v1[i], a1[i], F, f1[i], Q1[i], angle1[i]
    for m in range(3):
        C[m, i], g0[m, i] = C1[m, i], g1[m, i]
    oriented(kind, R, Q1[i, -1], Rs[t, i])
    for p in range(len(force) // D):  # λ of the balance is (1 − α_f) λ1 + α_f λ0, in world components
        for b in range(D):
            x = 0.0
            for m in range(D):
                x += Rp[b, m] * force[p * D + m]
            force0[i, p * D + b] = (x - alpha_f * force0[i, p * D + b]) / (1.0 - alpha_f)
        for b in range(D):
            x = 0.0
            for m in range(D):
                x += Rs[t, i, m, b] * force0[i, p * D + m]
            forces[t, i, p * D + b] = x
    us[t, i], vs[t, i], as_[t, i] = u1[i], v1[i], a1[i]
    energies[t, i] = strain
    for r in range(D * n):
        x = 0.0
        if number[i] < 2:
            x = g1[0, i, 0, r]
        else:
            for e in range(number[i]):
                for m in range(D * n):
                    x += share[i, e, r, m] * g1[0, i, e, m]
        gs[t, i, r // n, r % n] = x
