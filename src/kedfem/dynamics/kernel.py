"""The inner loop of small links, compiled where numba is there; the same lines run without it, slower.

Coordinates are mass-orthonormal: M = 1. Every array has a row per link, padded to the largest: D components, S functions,
N = D·S coordinates (component first), P ports, Q = D·P port components, k interface unknowns. A padded zero stays zero.

    coefficients : (17,) c_M, c_K, α_f; factors of u, v, a and of the load in the right-hand side; Newmark's
        acceleration (3); h γ, h (1 − γ); damping α, β; the rate's factors (3) times 1 − α_f
    matrices : G (L, N, N), Yt (L, Q, N), S (L, Q, Q), Wt (L, N, Q), B (L, P, D, k)
    forcing : R (T, L, D, D), F (T, L, D, S)
    state : u, v, a, F, f (L, D, S), R (L, D, D), port forces (L, Q), C (3, L, D, S)
    history : u, v, a, g (T, L, D, S), port forces (T, L, Q), strain energy (T, L)

Imported when it is first needed: numba takes a while to load.
"""

from typing import Any

import numpy as np

try:
    from numba import njit

    compiled: Any = njit(cache=True, error_model="numpy")
except ImportError:

    def compiled(function: Any) -> Any:
        """Without numba: leave functions as they are."""
        return function


@compiled
def advance_block(coefficients, matrices, forcing, state, history):  # type: ignore[no-untyped-def]
    """Take T generalised-α steps of all links in place, [KED, eq. (20)].

    With g the displacement and r the right-hand side in the link frame, w = W g its ports:

        g = G r + Y w,   λ = S w − Yᵀ r,   Σ Bᵀ R λ = 0,   R w = B z

    G, Y, S are A⁻¹ with ports held, the shapes of moved ports, and the port stiffness of A = c_M + c_K K0.
    """
    Yt, S, B = matrices[1], matrices[2], matrices[4]
    Rs, Fs = forcing
    T, L, D, n = Fs.shape
    P, k = B.shape[1], B.shape[3]
    rhs, RB, SRB = np.zeros((L, D * n)), np.zeros((L, P * D, k)), np.zeros((L, P * D, k))
    reaction = np.zeros((L, P * D))
    for t in range(T):
        H, load = np.zeros((k, k)), np.zeros(k)
        for i in range(L):
            Rt = np.ascontiguousarray(Rs[t, i].T)
            rhs[i] = right_hand_side(coefficients, i, Rt, Fs[t, i], state)
            reaction[i] = np.dot(Yt[i], rhs[i])
            for p in range(P):
                RB[i, p * D : (p + 1) * D] = np.dot(Rt, B[i, p])
            SRB[i] = np.dot(S[i], RB[i])
            H += np.dot(RB[i].T, SRB[i])
            load += np.dot(RB[i].T, reaction[i])
        z = np.linalg.solve(H, load) if k else load
        for i in range(L):
            force = np.dot(SRB[i], z) - reaction[i]
            g = np.dot(matrices[0][i], rhs[i]) + np.dot(Yt[i].T, np.dot(RB[i], z))
            balance = rhs[i] + np.dot(matrices[3][i], force)
            end_of_step(
                coefficients,
                t,
                i,
                np.ascontiguousarray(Rs[t, i]),
                Fs[t, i],
                g,
                balance,
                force,
                state,
                history,
            )


@compiled
def right_hand_side(coefficients, i, Rt, F, state):  # type: ignore[no-untyped-def]
    """History + (P − M R0'') of link i, link frame at the end of the step."""
    alpha_f, from_u, from_v, from_a, from_F = coefficients[2:7]
    u, v, a, F0, f, R0, _, C = state
    total = from_u * u[i] + from_v * v[i] + from_a * a[i] + from_F * F
    if alpha_f != 0.0:
        total += alpha_f * (F0[i] - np.dot(R0[i], f[i]))
    r = np.dot(Rt, total)
    if coefficients[12] != 0.0 or coefficients[13] != 0.0:
        r += coefficients[14] * C[0, i] + coefficients[15] * C[1, i] + coefficients[16] * C[2, i]
    return r.ravel()


@compiled
def end_of_step(coefficients, t, i, R, F, g, balance, force, state, history):  # type: ignore[no-untyped-def] # noqa: PLR0913, PLR0917
    """State of link i from its displacement g, its balance r + Wᵀ λ = A g and λ; the rest by recurrence."""
    c_M, c_K, alpha_f = coefficients[:3]
    n0, n1, n2, h1, h0, alpha, beta = coefficients[7:14]
    u, v, a, F0, f, R0, port_forces, C = state
    us, vs, as_, gs, forces, strain = history
    D, n = F.shape
    Kg = (balance - c_M * g) / c_K
    shape, internal = g.reshape((D, n)), Kg.reshape((D, n)).copy()
    u1 = np.dot(R, shape)
    a1 = n0 * (u1 - u[i]) - n1 * v[i] - n2 * a[i]
    v1 = v[i] + h1 * a1 + h0 * a[i]
    if alpha != 0.0 or beta != 0.0:
        Cg = alpha * shape + beta * internal
        Ca = n0 * (Cg - C[0, i]) - n1 * C[1, i] - n2 * C[2, i]
        Cv = C[1, i] + h1 * Ca + h0 * C[2, i]
        C[0, i], C[1, i], C[2, i] = Cg, Cv, Ca
        internal += Cv
    if alpha_f != 0.0:
        turned = np.dot(np.ascontiguousarray(R.T), R0[i])
        for p in range(len(force) // D):
            force[p * D : (p + 1) * D] -= alpha_f * np.dot(turned, port_forces[i, p * D : (p + 1) * D])
        force /= 1.0 - alpha_f
    us[t, i], vs[t, i], as_[t, i], gs[t, i], forces[t, i] = u1, v1, a1, shape, force
    strain[t, i] = 0.5 * np.dot(g, Kg)
    u[i], v[i], a[i], f[i], F0[i], R0[i], port_forces[i] = u1, v1, a1, internal, F, R, force
