"""Strains and forces of elements of beams in space by the formulas of `links.beams.metric`, compiled by numba.

`dynamics.metric.Elements` describes the arrays, `dynamics.metric.room_for` the work arrays.
"""

import numpy as np

from kedfem.compiled import inner
from kedfem.dynamics.frames_kernel import SPACE, nearest, rotation, shaped, turn_of


@inner
def metric_force(rates, e, elements, shapes, R, u, seen, frame, f, work, room):  # type: ignore[no-untyped-def]
    """Internal force of a segment, element e, at the displacement u (3, n), added to f (3, n), world components.

    Parameters
    ----------
    shapes, seen, frame, work : as in `frames_kernel.strained`; g is a displacement that has the strains
    """
    if elements is None:
        return
    n0, n1, n2, h1, h0, beta = rates
    X, _, fit = shapes
    y, forces, strained, A, U, change = work
    (g0, v0, a0), (g, v, a) = seen
    rows, share, tangents, gradients = elements.rows, elements.share, elements.tangents, elements.gradients
    E, M, K, P = elements.sizes[e]
    rotations, s, stress, on_g, on_x = room[0], room[7], room[8], room[5], room[6]
    n, width, S = u.shape[1], tangents.shape[2], 6 * E + P
    shaped(X, R, u, 3, y)
    rotation(SPACE, fit, y, frame, A, U, change)
    for node in range(M):
        for b in range(3):
            for m in range(3):
                rotations[node, b, m] = frame[0][b, m]
    strains(e, elements, y, room, A, U, change)
    for b in range(3):
        for j in range(n):
            r, x = b * n + j, 0.0
            for m in range(S):
                x += share[e, b * width + j, m] * s[m]
            g[r] = x
            if beta != 0.0:
                x2 = n0 * (x - g0[r]) - n1 * v0[r] - n2 * a0[r]
                x1 = v0[r] + h1 * x2 + h0 * a0[r]
                v[r], a[r] = x1, x2
                strained[r] = beta * x1
    for m in range(S):
        x = s[m]
        if beta != 0.0:
            for b in range(3):
                for j in range(n):
                    x += rows[e, m, b * width + j] * strained[b * n + j]
        stress[m] = elements.stiffness[e, m] * x
    pulled_back(e, elements, room, U, change)
    for b in range(3):
        for j in range(n):
            x = 0.0
            for k in range(K):
                x += gradients[e, k, j] * on_g[k, b]
            for p in range(E):
                x += tangents[e, p, j] * on_x[p, b]
            forces[b, j] = x
    for b in range(3):
        for m in range(3):
            for j in range(n):
                f[b, j] += R[b, m] * forces[m, j]


@inner
def strains(e, elements, y, room, A, U, change):  # type: ignore[no-untyped-def]
    """Strains of element e at the position y (3, S) in the rigid-body frame; x', g, d and rotations of its nodes."""
    tangents, gradients, node, drawn = elements.tangents, elements.gradients, elements.node, elements.drawn
    directors, N, D, bend, pairs = elements.directors, elements.N, elements.D, elements.bend, elements.pairs
    E, M, K, P = elements.sizes[e]
    rotations, x, d, g, s = room[0], room[1], room[2], room[3], room[7]
    n = y.shape[1]
    for k in range(K):
        for b in range(3):
            total = 0.0
            for j in range(n):
                total += gradients[e, k, j] * y[b, j]
            g[k, b] = total
    for a in range(M):
        A[:] = 0.0
        for k in range(K):
            if node[e, k] == a:
                for b in range(3):
                    for m in range(3):
                        A[b, m] += g[k, b] * drawn[e, k, m]
        nearest(A, rotations[a], U, change)
        for c in range(2):
            for b in range(3):
                total = 0.0
                for m in range(3):
                    total += rotations[a, b, m] * directors[e, a, c, m]
                d[a, c, b] = total
    for p in range(E):
        xx, x1, x2, xs1, xs2, d11, d12, d22, twist = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for b in range(3):
            total = 0.0
            for j in range(n):
                total += tangents[e, p, j] * y[b, j]
            x[p, b] = total
            d1, d2, s1, s2 = 0.0, 0.0, 0.0, 0.0
            for a in range(M):
                d1 += N[e, p, a] * d[a, 0, b]
                d2 += N[e, p, a] * d[a, 1, b]
                s1 += D[e, p, a] * d[a, 0, b]
                s2 += D[e, p, a] * d[a, 1, b]
            xx += total * total
            x1 += total * d1
            x2 += total * d2
            xs1 += total * s1
            xs2 += total * s2
            d11 += d1 * d1
            d12 += d1 * d2
            d22 += d2 * d2
            twist += d2 * s1 - d1 * s2
        eps = np.sqrt(xx) - 1
        a11, a12, a22 = (d11 - 1) / 2, d12 / 2, (d22 - 1) / 2
        b1, b2, b3, b4 = bend[e, p, 0], bend[e, p, 1], bend[e, p, 2], bend[e, p, 3]
        s[6 * p], s[6 * p + 1], s[6 * p + 2] = eps, x1, x2
        s[6 * p + 3] = xs1 - b1 * (eps + a11) - b3 * x2 - b2 * a12
        s[6 * p + 4] = xs2 - b2 * (eps + a22) - b4 * x1 - b1 * a12
        s[6 * p + 5] = twist / 2 - b3 * (a11 + a22)
    for q in range(P):
        i, j = pairs[e, q, 0], pairs[e, q, 1]
        total = 0.0
        for b in range(3):
            total += g[i, b] * g[j, b] - drawn[e, i, b] * drawn[e, j, b]
        s[6 * E + q] = total * (0.5 if i == j else np.sqrt(0.5))
    for m in range(6 * E + P):
        s[m] -= elements.drawn_strains[e, m]


@inner
def pulled_back(e, elements, room, U, w):  # type: ignore[no-untyped-def]
    """Forces on x' and on the gradient functions of element e from its stresses."""
    node, drawn, N, D = elements.node, elements.drawn, elements.N, elements.D
    bend, pairs = elements.bend, elements.pairs
    E, M, K, P = elements.sizes[e]
    rotations, x, d, g, on_d, on_g, on_x, _, stress = room
    on_d[:] = 0.0
    for p in range(E):
        b1, b2, b3, b4 = bend[e, p, 0], bend[e, p, 1], bend[e, p, 2], bend[e, p, 3]
        m1, m2, t = stress[6 * p + 3], stress[6 * p + 4], stress[6 * p + 5]
        axial = stress[6 * p] - b1 * m1 - b2 * m2
        v1, v2 = stress[6 * p + 1] - b4 * m2, stress[6 * p + 2] - b3 * m1
        a11, a12, a22 = -b1 * m1 - b3 * t, -(b2 * m1 + b1 * m2) / 2, -b2 * m2 - b3 * t
        axial /= np.sqrt(x[p, 0] ** 2 + x[p, 1] ** 2 + x[p, 2] ** 2)
        for b in range(3):
            d1, d2, s1, s2 = 0.0, 0.0, 0.0, 0.0
            for a in range(M):
                d1 += N[e, p, a] * d[a, 0, b]
                d2 += N[e, p, a] * d[a, 1, b]
                s1 += D[e, p, a] * d[a, 0, b]
                s2 += D[e, p, a] * d[a, 1, b]
            y = x[p, b]
            on_x[p, b] = axial * y + v1 * d1 + v2 * d2 + m1 * s1 + m2 * s2
            f1, f2 = v1 * y + a11 * d1 + a12 * d2 - t / 2 * s2, v2 * y + a22 * d2 + a12 * d1 + t / 2 * s1
            g1, g2 = m1 * y + t / 2 * d2, m2 * y - t / 2 * d1
            for a in range(M):
                on_d[a, 0, b] += N[e, p, a] * f1 + D[e, p, a] * g1
                on_d[a, 1, b] += N[e, p, a] * f2 + D[e, p, a] * g2
    for a in range(M):
        Q = rotations[a]
        t0, t1, t2 = 0.0, 0.0, 0.0
        for c in range(2):
            t0 += d[a, c, 1] * on_d[a, c, 2] - d[a, c, 2] * on_d[a, c, 1]
            t1 += d[a, c, 2] * on_d[a, c, 0] - d[a, c, 0] * on_d[a, c, 2]
            t2 += d[a, c, 0] * on_d[a, c, 1] - d[a, c, 1] * on_d[a, c, 0]
        U[:] = 0.0
        for b in range(3):
            w[b] = Q[0, b] * t0 + Q[1, b] * t1 + Q[2, b] * t2
        for k in range(K):
            if node[e, k] == a:
                for b in range(3):
                    y = Q[0, b] * g[k, 0] + Q[1, b] * g[k, 1] + Q[2, b] * g[k, 2]
                    for m in range(3):
                        U[b, m] += y * drawn[e, k, m]
        turn_of(U, w)
        for k in range(K):
            if node[e, k] == a:
                y0 = w[1] * drawn[e, k, 2] - w[2] * drawn[e, k, 1]
                y1 = w[2] * drawn[e, k, 0] - w[0] * drawn[e, k, 2]
                y2 = w[0] * drawn[e, k, 1] - w[1] * drawn[e, k, 0]
                for b in range(3):
                    on_g[k, b] = Q[b, 0] * y0 + Q[b, 1] * y1 + Q[b, 2] * y2
    for q in range(P):
        i, j = pairs[e, q, 0], pairs[e, q, 1]
        y = stress[6 * E + q] * (0.5 if i == j else np.sqrt(0.5))
        for b in range(3):
            on_i, on_j = y * g[j, b], y * g[i, b]
            on_g[i, b] += on_i
            on_g[j, b] += on_j
