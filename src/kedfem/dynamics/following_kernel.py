"""The inner loop of small segments whose frames follow them, compiled by numba.

Coordinates and padding as in `dynamics.kernel`. k interface unknowns, ordered so that H = Σ Bᵀ R S Rᵀ B has its entries
near the diagonal: from column `first` of each row on. E points of a planar beam's segment, see `dynamics.beams_kernel`.

    coefficients : (13,) c_M, c_K, α_f, α_m; Newmark's acceleration (3); h, h γ, h (1 − γ); damping α, β; tolerance
    matrices : G (L, N, N), Yt (L, Q, N), S (L, Q, Q), B (L, Q, c)
    columns, count, first : (L, c), (L,), (k,)
    shapes : X (L, D, S) position, one (L, D, S)
    frames : bends (L,) whether a segment is a planar beam that knows its strains, follows (L,) whether the frame of any
        other does; fit (L, D, S) weights of the frame's rotation, K (L, N, N) of the others
    beams : rows, tangent, rigidity of those that know their strains
    kinds : (L,) 0: rows (u, v, w), 1: (u, v), 2: (u, v, ψ)
    state : u, v, a, F, f (L, D, S), C (3, L, D, S), force (L, Q) in world components; Q (L, 3, 3), angle (L,) of the
        frame; g (3, L, N) seen from it, and rates; strain (3, L, 3, E) and rates, direction (L, 2, E) of the tangents in
        the nominal frame, turn (L, E) from where they were drawn; turned (A,) coordinates of the actions
    acting : of `dynamics.acting.over_block`, whose forces are added to F; None without motors and springs, whose code is
        then not compiled
    history : u, v, a, g (T, L, D, S), strain (T, L, 3, E), R (T, L, D, D), port forces (T, L, Q) in that frame, strain
        energy (T, L)
    memory : pairs (2, m, L·D·S) of steps taken and of how the change asked for changed, products (m, m) of the latter;
        last step and change (2, L·D·S)
    counts : sweeps, square of what counts as a step, pairs that are known, the next pair to be forgotten, square of a
        step that is too far

Imported when it is first needed. Plain loops, so that nothing is allocated in a step.
"""

from typing import Any

import numpy as np
from numba import njit

from kedfem.dynamics.actions_kernel import external
from kedfem.dynamics.beams_kernel import bending_energy, bent, first_directions, kept_directions
from kedfem.dynamics.frames_kernel import SPACE, elastic_energy, held_together, mean_rotation, oriented

compiled: Any = njit(cache=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})

SWEEPS = 40
RIDGE = 1e-13  # of a pair's own square: pairs that repeat each other


@compiled
def follow_block(  # type: ignore[no-untyped-def]
    coefficients, matrices, unknowns, shapes, frames, beams, kinds, forcing, acting, state, history, memory, counts
):
    """Take up to T steps in place, [KED, eq. (20)]; the number that settled, and the segment that did not or -1."""
    G, Yt, S, B = matrices
    columns, count, first = unknowns
    Rs, Fs = forcing
    u, v, a, F0, f0, C, force0, Q0, angle0, g0, strain0, direction, turn0, turned = state
    bends = frames[0]
    T, L, D, n = Fs.shape
    Qn, c, k, E = B.shape[1], B.shape[2], len(first), direction.shape[2]
    h, tolerance = coefficients[7], coefficients[12]
    u1, v1, a1, f1, F = np.zeros((L, D, n)), np.zeros((L, D, n)), np.zeros((L, D, n)), np.zeros((L, D, n)), np.zeros((L, D, n))
    C1, Q1, angle1, g1 = np.zeros_like(C), Q0.copy(), angle0.copy(), np.zeros_like(g0)
    strain1, now, turn1, base = np.zeros_like(strain0), np.zeros_like(direction), turn0.copy(), np.zeros((L, 4, E))
    end = (u1, v1, a1, f1, C1, Q1, angle1, g1, strain1, now, turn1)
    Rp, rhs, change = np.zeros((L, D, D)), np.zeros((L, D * n)), np.zeros((L, D, n))
    RB, SRB = np.zeros((L, Qn, c)), np.zeros((L, Qn, c))
    reaction, force = np.zeros((L, Qn)), np.zeros((L, Qn))
    H, z = np.zeros((k, k)), np.zeros(k)
    work = (np.zeros((D, n)), np.zeros((D, n)), np.zeros(D * n), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3))
    points = np.zeros((7, E))
    parts = (G, Yt, RB, SRB, columns, count)
    for t in range(T):
        for i in range(L):
            for b in range(D):
                for j in range(n):
                    u1[i, b, j] = u[i, b, j] + h * v[i, b, j] + 0.5 * h * h * a[i, b, j]
        first_directions(bends, beams, Rs[t], direction, base)
        end_of_step(coefficients, shapes, frames, beams, kinds, Rs[t], base, state, end, work, points)
        mean_frames(shapes, frames, Rs[t], u1, Q1)
        oriented(kinds, Rs[t], Q1, Rp)
        for row in range(k):
            H[row, first[row] : row + 1] = 0.0
        turned_ports(Rp, B, count, RB)
        gathered(S, RB, columns, count, SRB, H)
        factored(H, first)
        settled, worst, reached = False, -1, 0.0
        for sweep in range(SWEEPS):
            counts[0] += 1
            F[:] = Fs[t]
            if acting is not None:
                external(acting, t, u1, v1, turned, F)
            residuals(coefficients, kinds, F, Rp, state, end, rhs)
            worst = swept(parts, kinds, Rp, rhs, H, first, z, reaction, force, change)
            moved = squares(change)
            settled = moved <= tolerance * tolerance * max(counts[1], reached)
            if not settled:
                mixed(memory, counts, sweep, change.ravel())
            for i in range(L):
                for b in range(D):
                    for j in range(n):
                        u1[i, b, j] += change[i, b, j]
            end_of_step(coefficients, shapes, frames, beams, kinds, Rs[t], base, state, end, work, points)
            reached = difference(u1, u)
            if settled or not reached <= counts[4]:
                break
        if not settled:
            counts[2] = counts[3] = 0.0
            return t, worst
        counts[1] = max(counts[1], reached)
        mean_frames(shapes, frames, Rs[t], u1, Q1)
        F[:] = Fs[t]
        if acting is not None:
            turned[:] = external(acting, t, u1, v1, turned, F)
            Fs[t] = F
        recorded(coefficients, t, frames, beams, kinds, Rs[t], F, Rp, force, state, end, history)
        kept_directions(bends, Rs[t], now, direction)
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
def swept(parts, kinds, Rp, rhs, H, first, z, reaction, force, change):  # type: ignore[no-untyped-def]
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
            for m in range(count[i]):
                z[columns[i, m]] += RB[i, q, m] * x
    solved(H, first, z)
    dg, most, worst = np.empty(N), -1.0, -1
    for i in range(L):
        for r in range(N):
            dg[r] = 0.0
        for m in range(N):
            x = rhs[i, m]
            for r in range(N):
                dg[r] += x * G[i, m, r]
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
        for j in range(n):
            if kinds[i] != SPACE:
                x = Rp[i, 0, 0] * dg[j] + Rp[i, 0, 1] * dg[n + j]
                y = Rp[i, 1, 0] * dg[j] + Rp[i, 1, 1] * dg[n + j]
                w = dg[2 * n + j] if D == 3 else 0.0
            else:
                x = Rp[i, 0, 0] * dg[j] + Rp[i, 0, 1] * dg[n + j] + Rp[i, 0, 2] * dg[2 * n + j]
                y = Rp[i, 1, 0] * dg[j] + Rp[i, 1, 1] * dg[n + j] + Rp[i, 1, 2] * dg[2 * n + j]
                w = Rp[i, 2, 0] * dg[j] + Rp[i, 2, 1] * dg[n + j] + Rp[i, 2, 2] * dg[2 * n + j]
            change[i, 0, j], change[i, 1, j] = x, y
            if D == 3:
                change[i, 2, j] = w
            own += x * x + y * y + w * w
        if not own <= most:
            most, worst = own, i
    return worst


@compiled
def mixed(memory, counts, sweep, change):  # type: ignore[no-untyped-def]
    """Anderson's mixing, see `dynamics.following.Mixing`: the change asked for becomes the step to take."""
    pairs, products, last = memory
    depth, N = pairs.shape[1:]
    known, slot = int(counts[2]), int(counts[3])
    if sweep > 0:
        known = min(depth, known + 1)
        for x in range(N):
            d = change[x] - last[1, x]
            pairs[0, slot, x], pairs[1, slot, x] = last[0, x] + d, d
        for p in range(known):
            total = 0.0
            for x in range(N):
                total += pairs[1, p, x] * pairs[1, slot, x]
            products[p, slot] = products[slot, p] = total
        counts[2], counts[3] = known, (slot + 1) % depth
    last[1] = change
    if known > 0:
        A, b = np.empty((known, known)), np.empty(known)
        for p in range(known):
            size = np.sqrt(products[p, p]) + 1e-300
            for q in range(p):
                A[p, q] = products[p, q] / (size * (np.sqrt(products[q, q]) + 1e-300))
            A[p, p] = 1 + RIDGE
            total = 0.0
            for x in range(N):
                total += pairs[1, p, x] * change[x]
            b[p] = total / size
        none = np.zeros(known, np.int64)
        factored(A, none)
        solved(A, none, b)
        for p in range(known):
            gamma = b[p] / (np.sqrt(products[p, p]) + 1e-300)
            for x in range(N):
                change[x] -= gamma * pairs[0, p, x]
    last[0] = change


@compiled
def end_of_step(  # type: ignore[no-untyped-def]
    coefficients, shapes, frames, beams, kinds, R, base, state, end, work, points
):
    """Rates, frames and internal force of all segments at the end of the step, from their displacement."""
    n0, n1, n2, _, h1, h0, alpha, beta = coefficients[4:12]
    u, v, a, C, g0, strain0, turn0 = state[0], state[1], state[2], state[5], state[9], state[10], state[12]
    u1, v1, a1, f1, C1, Q1, angle1, g1, strain1, now, turn1 = end
    bends, follows, fit, K = frames
    L, D, n = u.shape
    rates = (n0, n1, n2, h1, h0, beta)
    for i in range(L):
        for b in range(D):
            for j in range(n):
                x = n0 * (u1[i, b, j] - u[i, b, j]) - n1 * v[i, b, j] - n2 * a[i, b, j]
                a1[i, b, j] = x
                v1[i, b, j] = v[i, b, j] + h1 * x + h0 * a[i, b, j]
                f1[i, b, j] = 0.0
    if alpha != 0.0:
        resisted(alpha, rates, kinds, R, u1, C, C1, f1)
    for i in range(L):
        if bends[i]:
            bent(rates, i, beams, base, u1, strain0, turn0, strain1, now, turn1, f1, points)
        else:
            held_together(rates, i, kinds[i], follows[i], shapes, fit, K, R, u1, g0, g1, Q1, angle1, f1, work)


@compiled
def resisted(alpha, rates, kinds, R, u, C, C1, f):  # type: ignore[no-untyped-def]
    """Damping by mass: α M δ of the nominal frame, and its rate as force, added to f, world components."""
    n0, n1, n2, h1, h0, _ = rates
    L, D, n = u.shape
    for i in range(L):
        for b in range(D):
            for j in range(n):
                x = 0.0
                for m in range(D):
                    x += R[i, m, b] * u[i, m, j]
                x *= alpha
                x2 = n0 * (x - C[0, i, b, j]) - n1 * C[1, i, b, j] - n2 * C[2, i, b, j]
                x1 = C[1, i, b, j] + h1 * x2 + h0 * C[2, i, b, j]
                C1[0, i, b, j], C1[1, i, b, j], C1[2, i, b, j] = x, x1, x2
        for b in range(D):
            for j in range(n):
                for m in range(D):
                    f[i, b, j] += R[i, b, m] * C1[1, i, m, j]


@compiled
def mean_frames(shapes, frames, R, u1, Q1):  # type: ignore[no-untyped-def]
    """The mean rotations of the segments whose frames follow points."""
    for i in range(len(u1)):
        if frames[0][i]:
            mean_rotation(i, frames[2], shapes[0], R, u1, Q1)


@compiled
def residuals(coefficients, kinds, F, Rp, state, end, out):  # type: ignore[no-untyped-def]
    """What is missing to balance at the end of the step, in the predicted frames."""
    alpha_f, alpha_m = coefficients[2:4]
    a, F0, f0, a1, f1 = state[2], state[3], state[4], end[2], end[3]
    L, D, n = F.shape
    c_f, c_m = 1 - alpha_f, 1 - alpha_m
    x = np.empty((D, n))
    for i in range(L):
        for b in range(D):
            for j in range(n):
                x[b, j] = c_f * (F[i, b, j] - f1[i, b, j]) - c_m * a1[i, b, j] - alpha_m * a[i, b, j]
                x[b, j] += alpha_f * (F0[i, b, j] - f0[i, b, j])
        for j in range(n):
            if kinds[i] != SPACE:
                out[i, j] = Rp[i, 0, 0] * x[0, j] + Rp[i, 1, 0] * x[1, j]
                out[i, n + j] = Rp[i, 0, 1] * x[0, j] + Rp[i, 1, 1] * x[1, j]
                if D == 3:
                    out[i, 2 * n + j] = x[2, j]
            else:
                for b in range(3):
                    out[i, b * n + j] = Rp[i, 0, b] * x[0, j] + Rp[i, 1, b] * x[1, j] + Rp[i, 2, b] * x[2, j]


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
def recorded(  # type: ignore[no-untyped-def]
    coefficients, t, frames, beams, kinds, R, F, Rp, force, state, end, history
):
    """The settled end of a step becomes the state, and a row of the history."""
    alpha_f = coefficients[2]
    u, v, a, F0, f0, C, force0, Q0, angle0, g0, strain0, _, turn0, _ = state
    u1, v1, a1, f1, C1, Q1, angle1, g1, strain1, _, turn1 = end
    us, vs, as_, gs, strains, Rs, forces, energies = history
    bends, _, _, K = frames
    L, D, n = F.shape
    u[:], v[:], a[:], F0[:], f0[:], Q0[:], angle0[:] = u1, v1, a1, F, f1, Q1, angle1
    C[:], g0[:], strain0[:], turn0[:] = C1, g1, strain1, turn1
    us[t], vs[t], as_[t], strains[t] = u1, v1, a1, strain1[0]
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
        if bends[i]:
            energies[t, i] = bending_energy(i, beams[2], strain1)
        else:
            energies[t, i] = elastic_energy(i, K, g1)
            for b in range(D):
                for j in range(n):
                    gs[t, i, b, j] = g1[0, i, b * n + j]
