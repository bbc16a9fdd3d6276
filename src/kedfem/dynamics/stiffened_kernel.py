"""The compiled inner loop with geometric stiffening; see `kernel`, whose parts and arrays it shares.

limits : h; the remainder of the iterations, of the displacement; the most iterations
stressed : factors s (T, L, m); stress stiffness k (L, m, S, S); P (L, D, D)
"""

import numpy as np

from kedfem.compiled import compiled
from kedfem.dynamics.anderson_kernel import definite_solved
from kedfem.dynamics.kernel import (
    add_transposed,
    end_of_step,
    gathered,
    right_hand_side,
    times,
    turned_ports,
)


@compiled
def advance_stiffened(coefficients, limits, matrices, columns, count, forcing, stressed, state, history):  # type: ignore[no-untyped-def]
    """Take T generalised-α steps of all links in place with f = K δ + C δ' + K_σ δ.

    What k g P is at the end of the step goes to the right-hand side and is found by iterations; from where they do not
    settle the history is nan.
    """
    S, W, B = matrices[2:]
    Rs, Fs = forcing
    s, stress, P = stressed
    T, L, D, n = Fs.shape
    Q, k = B.shape[1:]
    base, rhs, g = np.zeros((L, D * n)), np.zeros((L, D * n)), np.zeros((L, D * n))
    RB, SRB = np.zeros((L, Q, k)), np.zeros((L, Q, k))
    none, force = np.zeros(Q), np.zeros((L, Q))
    H, z, K, Kg = np.zeros((k, k)), np.zeros(k), np.zeros((L, n, n)), np.zeros(D * n)
    for t in range(T):
        H[:] = 0.0
        for i in range(L):
            right_hand_side(coefficients, i, Rs[t, i], Fs[t, i], state, base[i])
            turned_ports(Rs[t, i], B[i], count[i], RB[i])
            gathered(S[i], RB[i], none, columns[i], count[i], SRB[i], H, z)
            combined(s[t, i], stress[i], K[i])
            predicted(limits[0], i, Rs[t, i], state, g[i])
        effect = (1.0 - coefficients[2], K, P)
        if not settled(limits, matrices, columns, count, (H, RB, SRB), effect, base, rhs, g, force):
            unsettled(t, history)
            return
        for i in range(L):
            Kg[:] = rhs[i]
            add_transposed(W[i], force[i], Kg)
            end_of_step(coefficients, t, i, Rs[t, i], Fs[t, i], g[i], Kg, force[i], state, history)
            Kg[:] = 0.0
            add_turned(1.0, K[i], P[i], g[i], Kg)
            for b in range(D):
                for j in range(n):
                    state[4][i, b, j] += Kg[b * n + j]


@compiled
def settled(limits, matrices, columns, count, interface, effect, base, rhs, g, force):  # type: ignore[no-untyped-def]
    """Sweep until g does not change any more; whether that was reached."""
    _, left, most = limits
    before = 0.0
    for _ in range(most):
        change, size = sweep(matrices, columns, count, interface, effect, base, rhs, g, force)
        ratio = change / before if before > 0.0 else 1.0
        if change == 0.0 or (ratio < 1.0 and change * ratio <= left * size * (1.0 - ratio)):
            return True
        before = change
    return False


@compiled
def sweep(matrices, columns, count, interface, effect, base, rhs, g, force):  # type: ignore[no-untyped-def]
    """g and port forces from base − share · k g P; the largest change of g, and its size."""
    G, Yt = matrices[:2]
    H, RB, SRB = interface
    share, K, P = effect
    L, Q, k = RB.shape
    reaction, w, z = np.zeros((L, Q)), np.zeros(Q), np.zeros(k)
    new = np.zeros(g.shape[1])
    for i in range(L):
        rhs[i] = base[i]
        add_turned(-share, K[i], P[i], g[i], rhs[i])
        times(Yt[i], rhs[i], reaction[i])
        for q in range(Q):
            for c in range(count[i]):
                z[columns[i, c]] += RB[i, q, c] * reaction[i, q]
    definite_solved(H.copy(), z)
    change, size = 0.0, 0.0
    for i in range(L):
        for q in range(Q):
            force[i, q], w[q] = -reaction[i, q], 0.0
            for c in range(count[i]):
                force[i, q] += SRB[i, q, c] * z[columns[i, c]]
                w[q] += RB[i, q, c] * z[columns[i, c]]
        times(G[i], rhs[i], new)
        add_transposed(Yt[i], w, new)
        for m in range(len(new)):
            size, change = max(size, abs(new[m])), max(change, abs(new[m] - g[i, m]))
        g[i] = new
    return change, size


@compiled
def unsettled(t, history):  # type: ignore[no-untyped-def]
    """No more history."""
    us, vs, as_, gs, forces, strain, Kgs = history
    us[t:], vs[t:], as_[t:], gs[t:], forces[t:], strain[t:] = np.nan, np.nan, np.nan, np.nan, np.nan, np.nan
    Kgs[t:] = np.nan


@compiled
def combined(s, stress, out):  # type: ignore[no-untyped-def]
    """k = Σ s_i k_i."""
    out[:] = 0.0
    for m in range(len(s)):
        if s[m] != 0.0:
            for a in range(len(out)):
                for b in range(len(out)):
                    out[a, b] += s[m] * stress[m, a, b]


@compiled
def add_turned(factor, k, P, g, out):  # type: ignore[no-untyped-def]
    """out + factor k g P."""
    D, n = len(P), len(k)
    row = np.zeros(n)
    for b in range(D):
        row[:] = 0.0
        present = False
        for c in range(D):
            if P[c, b] != 0.0:
                present = True
                for j in range(n):
                    row[j] += P[c, b] * g[c * n + j]
        if present:
            for a in range(n):
                total = 0.0
                for j in range(n):
                    total += k[a, j] * row[j]
                out[b * n + a] += factor * total


@compiled
def predicted(h, i, R, state, out):  # type: ignore[no-untyped-def]
    """Rᵀ δ of link i one step later with constant δ''."""
    u, v, a = state[:3]
    D, n = u.shape[1:]
    for b in range(D):
        for j in range(n):
            x = 0.0
            for c in range(D):
                x += R[c, b] * (u[i, c, j] + h * v[i, c, j] + 0.5 * h * h * a[i, c, j])
            out[b * n + j] = x
