"""Segments with one co-rotational frame, compiled by numba: rotation, deformation and force, as in `dynamics.frames`."""

import numpy as np

from kedfem.compiled import inner

SPACE, PLANE, BEAM = 0, 1, 2
TURNS = 50


@inner
def strained(rates, kind, shapes, R, u, seen, frame, work):  # type: ignore[no-untyped-def]
    """Deformation of a segment in its frame at the displacement u (D, n), with its rates.

    Parameters
    ----------
    rates : (6,) Newmark's acceleration (3), h γ, h (1 − γ), damping β
    shapes : X, one and fit (D, n)
    seen : g (N,) and its two rates in the frame, at the beginning and at the end of the step
    frame : Q (3, 3) and angle (1,) of the frame in the rigid-body one; at the beginning an earlier one
    work : y (D, n) becomes its shape in the rigid-body frame, the third (N,) g + β g'
    """
    n0, n1, n2, h1, h0, beta = rates
    X, one, fit = shapes
    y, _, out, A, U, change = work
    (g0, v0, a0), (g, v, a) = seen
    Q, angle = frame
    D, n = u.shape
    d = 2 if kind == PLANE else D
    shaped(X, R, u, d, y)
    rotation(kind, fit, y, frame, A, U, change)
    deformation(kind, y, X, one, Q, angle[0], g)
    for r in range(D * n):
        x = g[r]
        out[r] = x
        if beta != 0.0:
            x2 = n0 * (x - g0[r]) - n1 * v0[r] - n2 * a0[r]
            x1 = v0[r] + h1 * x2 + h0 * a0[r]
            v[r], a[r] = x1, x2
            out[r] += beta * x1


@inner
def shaped(X, R, u, d, y):  # type: ignore[no-untyped-def]
    """y becomes the shape X + Rᵀ u (d, n) of a segment in the rigid-body frame."""
    for b in range(d):
        for j in range(u.shape[1]):
            x = X[b, j]
            for m in range(d):
                x += R[m, b] * u[m, j]
            y[b, j] = x


@inner
def balanced(kind, fit, R, g, Q, f, work):  # type: ignore[no-untyped-def]
    """Add to f (D, n), world components, the internal force of a segment, in balance.

    Parameters
    ----------
    work : y (D, n) the shape in the rigid-body frame; Kg (D, n) K of what is strained
    """
    y, Kg, _, _, U, change = work
    d, n = (2 if kind == PLANE else len(Kg)), Kg.shape[1]
    if kind == SPACE:
        balanced_space(fit, y, Q, g, Kg, U, change)
    else:
        balanced_plane(fit, y, Q, g, Kg)
    for b in range(d):  # R Q: from the frame to the world
        for m in range(d):
            x = 0.0
            for k in range(d):
                x += R[b, k] * entry(kind, Q, k, m)
            for j in range(n):
                f[b, j] += x * Kg[m, j]


@inner
def entry(kind, Q, b, m):  # type: ignore[no-untyped-def]
    """Entry of a frame's rotation on rows: ψ does not turn."""
    if kind == SPACE or (b < 2 and m < 2):
        return Q[b, m]
    return 1.0 if b == m else 0.0


@inner
def rotation(kind, fit, y, frame, A, U, change):  # type: ignore[no-untyped-def]
    """Q of Σ y_a ⊗ fit_a in place, from an earlier one; of a planar segment its angle, which counts turns."""
    n, (Q, angle) = y.shape[1], frame
    if kind != SPACE:
        c, s = 0.0, 0.0
        for j in range(n):
            c += y[0, j] * fit[0, j] + y[1, j] * fit[1, j]
            s += y[1, j] * fit[0, j] - y[0, j] * fit[1, j]
        turn = np.arctan2(s, c)
        turn += 2 * np.pi * np.round((angle[0] - turn) / (2 * np.pi))
        angle[0] = turn
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
    nearest(A, Q, U, change)


@inner
def nearest(A, Q, U, change):  # type: ignore[no-untyped-def]
    """Q of A = Q U in place, from an earlier one."""
    for _ in range(TURNS):
        for b in range(3):
            for m in range(3):
                U[b, m] = Q[0, b] * A[0, m] + Q[1, b] * A[1, m] + Q[2, b] * A[2, m]
        change[0], change[1], change[2] = U[2, 1] - U[1, 2], U[0, 2] - U[2, 0], U[1, 0] - U[0, 1]
        turn_of(U, change)
        size = max(abs(change[0]), abs(change[1]), abs(change[2]))
        if size > 0.5:  # a slender segment shows its twist by small numbers: Newton's step may be far too long
            for b in range(3):
                change[b] *= 0.5 / size
        rodrigues(change, Q, U)
        if size <= 1e-8:  # the next, quadratically smaller, is rounding
            break


@inner
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


@inner
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


@inner
def deformation(kind, y, X, one, Q, angle, g):  # type: ignore[no-untyped-def]
    """g = Qᵀ y − X without its mean, flat; ψ less the frame's angle."""
    n = y.shape[1]
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


@inner
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


@inner
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
