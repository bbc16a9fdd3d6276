"""The inner loop of small links, compiled by numba.

Coordinates are mass-orthonormal: M = 1. Every array has a row per link, padded to the largest: D components, S functions,
N = D·S coordinates (component first), P ports, Q = D·P port components; k interface unknowns. A padded zero stays zero.

    coefficients : (17,) c_M, c_K, α_f; factors of u, v, a and of the load in the right-hand side; Newmark's
        acceleration (3); h γ, h (1 − γ); damping α, β; the rate's factors (3) times 1 − α_f
    matrices : G (L, N, N), Yt (L, Q, N), S (L, Q, Q), W (L, Q, N), B (L, Q, k)
    columns, count : (L, k), (L,) which interface unknowns a link knows, and how many
    forcing : R (T, L, D, D), F (T, L, D, S)
    ties : C (T, r, k), 1/κ (r,), (1 − α_f) c (r,) and Newmark's rate (3) of joints enforced by constraint equations, e =
    C z
    state : u, v, a, F, f (L, D, S), R (L, D, D), port forces (L, Q), C (3, L, D, S), rows' forces on z (k,), e (3, r)
    history : u, v, a, g (T, L, D, S), port forces (T, L, Q), strain energy (T, L); K0 g (T, L, D, S), or none

Imported when it is first needed: numba takes a while to load. Plain loops, so that nothing is allocated in a step.
"""

import numpy as np

from kedfem.compiled import compiled
from kedfem.dynamics.anderson_kernel import definite_solved, partly_factored


@compiled
def advance_block(coefficients, matrices, columns, count, forcing, ties, every, history):  # type: ignore[no-untyped-def]
    """Take T generalised-α steps of all links in place, [KED, eq. (20)].

    With g the displacement and r the right-hand side in the link frame, w = W g its ports:

        g = G r + Y w,   λ = S w − Yᵀ r,   Σ Bᵀ R λ = 0,   R w = B z

    but for what rows of joints exert on z (`tied`).
    G, Y, S are A⁻¹ with ports held, the shapes of moved ports, and the port stiffness of A = c_M + c_K K0.
    """
    G, Yt, S, W, B = matrices
    state, (known, e) = every[:8], every[8:]
    Cs, compliance, dampers, rate = ties
    r = len(compliance)
    CH, CGC, m, left = np.zeros((r, B.shape[2])), np.zeros((r, r)), np.zeros(r), np.zeros(r)
    room = (CH, CGC, np.zeros(r), m, left, np.zeros(B.shape[2]), np.zeros(r), np.zeros(r))
    Rs, Fs = forcing
    T, L, D, n = Fs.shape
    Q, k = B.shape[1], B.shape[2]
    rhs, g, Kg = np.zeros((L, D * n)), np.zeros(D * n), np.zeros(D * n)
    RB, SRB = np.zeros((L, Q, k)), np.zeros((L, Q, k))
    reaction, w, force = np.zeros((L, Q)), np.zeros(Q), np.zeros(Q)
    H, z = np.zeros((k, k)), np.zeros(k)
    for t in range(T):
        H[:] = 0.0
        z[:] = 0.0
        for i in range(L):
            right_hand_side(coefficients, i, Rs[t, i], Fs[t, i], state, rhs[i])
            times(Yt[i], rhs[i], reaction[i])
            turned_ports(Rs[t, i], B[i], count[i], RB[i])
            gathered(S[i], RB[i], reaction[i], columns[i], count[i], SRB[i], H, z)
        if r:
            tied(coefficients, Cs[t], (compliance, dampers, rate), room, H, z, known, e)
        else:
            definite_solved(H, z)
        for i in range(L):
            for q in range(Q):
                force[q], w[q] = -reaction[i, q], 0.0
                for c in range(count[i]):
                    force[q] += SRB[i, q, c] * z[columns[i, c]]
                    w[q] += RB[i, q, c] * z[columns[i, c]]
            times(G[i], rhs[i], g)
            add_transposed(Yt[i], w, g)
            Kg[:] = rhs[i]
            add_transposed(W[i], force, Kg)
            end_of_step(coefficients, t, i, Rs[t, i], Fs[t, i], g, Kg, force, state, history)


@compiled
def right_hand_side(coefficients, i, R, F, state, out):  # type: ignore[no-untyped-def]
    """History + (P − M R0'') of link i, link frame at the end of the step."""
    alpha_f, from_u, from_v, from_a, from_F = coefficients[2:7]
    u, v, a, F0, f, R0, _, C = state
    damped = coefficients[12] != 0.0 or coefficients[13] != 0.0
    D, n = F.shape
    out[:] = 0.0
    for b in range(D):
        for j in range(n):
            x = from_u * u[i, b, j] + from_v * v[i, b, j] + from_a * a[i, b, j] + from_F * F[b, j]
            if alpha_f != 0.0:
                inner = 0.0
                for c in range(D):
                    inner += R0[i, b, c] * f[i, c, j]
                x += alpha_f * (F0[i, b, j] - inner)
            for c in range(D):
                out[c * n + j] += R[b, c] * x
    if damped:
        for b in range(D):
            for j in range(n):
                for m in range(3):
                    out[b * n + j] += coefficients[14 + m] * C[m, i, b, j]


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
def gathered(S, RB, reaction, columns, count, SRB, H, z):  # type: ignore[no-untyped-def]
    """S Rᵀ B of a link, and its share in the interface equations H z = Σ Bᵀ R Yᵀ r."""
    for q in range(len(S)):
        for c in range(count):
            SRB[q, c] = 0.0
        for p in range(len(S)):
            s = S[q, p]
            for c in range(count):
                SRB[q, c] += s * RB[p, c]
    for q in range(len(S)):
        for c in range(count):
            x = RB[q, c]
            z[columns[c]] += x * reaction[q]
            for d in range(count):
                H[columns[c], columns[d]] += x * SRB[q, d]


@compiled
def end_of_step(coefficients, t, i, R, F, g, Kg, force, state, history):  # type: ignore[no-untyped-def]
    """State of link i from its displacement g, its balance Kg = r + Wᵀ λ = A g and λ; the rest by recurrence."""
    c_M, c_K, alpha_f = coefficients[:3]
    n0, n1, n2, h1, h0, alpha, beta = coefficients[7:14]
    u, v, a, F0, f, R0, port_forces, C = state
    us, vs, as_, gs, forces, strain, Kgs = history
    kept = len(Kgs) > 0
    damped = alpha != 0.0 or beta != 0.0
    D, n = F.shape
    energy = 0.0
    for b in range(D):
        for j in range(n):
            m = b * n + j
            Kg[m] = (Kg[m] - c_M * g[m]) / c_K
            energy += g[m] * Kg[m]
            if kept:
                Kgs[t, i, b, j] = Kg[m]
            inner = Kg[m]
            if damped:
                x = alpha * g[m] + beta * Kg[m]
                x2 = n0 * (x - C[0, i, b, j]) - n1 * C[1, i, b, j] - n2 * C[2, i, b, j]
                x1 = C[1, i, b, j] + h1 * x2 + h0 * C[2, i, b, j]
                C[0, i, b, j], C[1, i, b, j], C[2, i, b, j] = x, x1, x2
                inner += x1
            f[i, b, j] = inner
            u1 = 0.0
            for c in range(D):
                u1 += R[b, c] * g[c * n + j]
            a1 = n0 * (u1 - u[i, b, j]) - n1 * v[i, b, j] - n2 * a[i, b, j]
            v[i, b, j] += h1 * a1 + h0 * a[i, b, j]
            u[i, b, j], a[i, b, j], F0[i, b, j] = u1, a1, F[b, j]
            us[t, i, b, j], vs[t, i, b, j], as_[t, i, b, j], gs[t, i, b, j] = u1, v[i, b, j], a1, g[m]
    strain[t, i] = 0.5 * energy
    if alpha_f != 0.0:
        earlier_forces(R, R0[i], alpha_f, port_forces[i], force)
    R0[i] = R
    port_forces[i] = force
    forces[t, i] = force


@compiled
def earlier_forces(R, R0, alpha_f, before, force):  # type: ignore[no-untyped-def]
    """λ at the end of a step from the λ of its balance, (1 − α_f) λ1 + α_f λ0, in the link frame at the end."""
    D = len(R)
    for p in range(len(force) // D):
        for a in range(D):
            x = 0.0
            for b in range(D):
                for c in range(D):
                    x += R[b, a] * R0[b, c] * before[p * D + c]
            force[p * D + a] = (force[p * D + a] - alpha_f * x) / (1.0 - alpha_f)


@compiled
def times(A, x, out):  # type: ignore[no-untyped-def]
    """A x."""
    for i in range(len(A)):
        total = 0.0
        for j in range(len(x)):
            total += A[i, j] * x[j]
        out[i] = total


@compiled
def add_transposed(A, x, out):  # type: ignore[no-untyped-def]
    """out + Aᵀ x."""
    for i in range(len(A)):
        if x[i] != 0.0:
            for j in range(len(out)):
                out[j] += x[i] * A[i, j]


@compiled
def tied(coefficients, C, springs, room, H, z, known, e):  # type: ignore[no-untyped-def]
    """z becomes the solution of H z = z + Cᵀ m + known forces, C z + m / κ = 0: `interface.solved` and `after_step`.

    Rows that depend on others, pivots nearly zero, exert nothing.
    """
    compliance, dampers, rate = springs
    CH, G, pivots, m, left, change, beside, rest = room
    alpha_f = coefficients[2]
    n0, n1, n2, h1, h0 = coefficients[7:12]
    r, k = C.shape
    for c in range(k):
        known[c] *= alpha_f
    for a in range(r):
        x = dampers[a] * (rate[0] * e[0, a] + rate[1] * e[1, a] + rate[2] * e[2, a])
        for c in range(k):
            known[c] += x * C[a, c]
    for c in range(k):
        z[c] += known[c]
    trace = 0.0
    for c in range(k):
        trace += H[c, c]
    for a in range(r):
        size = 0.0
        for c in range(k):
            size += C[a, c] ** 2
        usual = trace / k / size if size > 0.0 else 0.0
        beside[a] = usual / (1.0 + 2.0 * usual * compliance[a])
        rest[a] = compliance[a] / (1.0 - beside[a] * compliance[a])
        for c in range(k):
            for d in range(c + 1):
                H[c, d] += beside[a] * C[a, c] * C[a, d]
    factor(H)
    forward(H, z)
    for a in range(r):
        CH[a] = C[a]
        forward(H, CH[a])
        m[a] = 0.0
    backward(H, z)
    for a in range(r):
        for b in range(a + 1):
            x = 0.0
            for c in range(k):
                x += CH[a, c] * CH[b, c]
            G[a, b] = x
        G[a, a] += rest[a]
        pivots[a] = 1.0
    partly_factored(G, pivots)
    for _ in range(2):  # the second closes joints to rounding
        for a in range(r):
            left[a] = -rest[a] * m[a]
            for c in range(k):
                left[a] -= C[a, c] * z[c]
            for b in range(a):
                left[a] -= G[a, b] * left[b]
            left[a] = left[a] / G[a, a] if pivots[a] != 0.0 else 0.0
        for a in range(r - 1, -1, -1):
            for b in range(a + 1, r):
                left[a] -= G[b, a] * left[b]
            left[a] = left[a] / G[a, a] if pivots[a] != 0.0 else 0.0
            m[a] += left[a]
        change[:] = 0.0
        for a in range(r):
            for c in range(k):
                change[c] += left[a] * CH[a, c]
        backward(H, change)
        z += change
    # forces at the end of the step, along the new rows alone
    share = 1.0 / (1.0 - alpha_f)
    known[:] = 0.0
    for a in range(r):
        now = 0.0
        for c in range(k):
            now += C[a, c] * z[c]
        x = m[a] - beside[a] * now
        x += dampers[a] * (rate[0] * e[0, a] + rate[1] * e[1, a] + rate[2] * e[2, a])
        for c in range(k):
            known[c] += share * x * C[a, c]
        second = n0 * (now - e[0, a]) - n1 * e[1, a] - n2 * e[2, a]
        e[1, a] += h1 * second + h0 * e[2, a]
        e[0, a], e[2, a] = now, second


@compiled
def factor(H):  # type: ignore[no-untyped-def]
    """H becomes its Cholesky factor, below the diagonal."""
    k = len(H)
    for i in range(k):
        for j in range(i + 1):
            total = H[i, j]
            for m in range(j):
                total -= H[i, m] * H[j, m]
            H[i, j] = np.sqrt(total) if i == j else total / H[j, j]


@compiled
def forward(H, x):  # type: ignore[no-untyped-def]
    """x becomes L⁻¹ x."""
    for i in range(len(x)):
        for j in range(i):
            x[i] -= H[i, j] * x[j]
        x[i] /= H[i, i]


@compiled
def backward(H, x):  # type: ignore[no-untyped-def]
    """x becomes L⁻ᵀ x."""
    k = len(x)
    for i in range(k - 1, -1, -1):
        for j in range(i + 1, k):
            x[i] -= H[j, i] * x[j]
        x[i] /= H[i, i]
