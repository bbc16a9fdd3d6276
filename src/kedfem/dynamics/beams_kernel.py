"""Planar beams whose frames follow the tangent at each Gauss point, compiled by numba: strains, and the force they make.

At a point, with x' the derivative of the position by arc length as drawn, |x'| = 1 there, and θ the angle that it has turned,

    ε = |x'| − 1,   γ = θ − ψ,   κ = ψ'

exactly what `dynamics.frames` finds with a frame at each point, see `links.segments.beam_segments`. World components:
ψ and θ count from the nominal motion, so that x' = R t + u' with t the tangent as drawn.

    rows (L, 3, S, E) : x' from u, ψ and ψ' from ψ, at the E points
    tangent (L, 2, E) : t
    rigidity (L, 3, E) : EA, κGA, EI times the length that belongs to a point; 0 where a segment has fewer points
"""

from typing import Any

import numpy as np
from numba import njit

compiled: Any = njit(cache=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})

SMALL_TURN = 0.05  # tan of half the angle: up to here the series is exact to rounding


@compiled
def first_directions(strain_of, beams, R, direction, base):  # type: ignore[no-untyped-def]
    """Where the tangents would point had only the nominal motion turned since the last step, and R t; world."""
    _, tangent, _ = beams
    L, _, E = tangent.shape
    for i in range(L):
        if strain_of[i]:
            a, b, c, d = R[i, 0, 0], R[i, 0, 1], R[i, 1, 0], R[i, 1, 1]
            for e in range(E):
                base[i, 0, e] = a * tangent[i, 0, e] + b * tangent[i, 1, e]
                base[i, 1, e] = c * tangent[i, 0, e] + d * tangent[i, 1, e]
                x, y = direction[i, 0, e], direction[i, 1, e]
                base[i, 2, e] = a * x + b * y
                base[i, 3, e] = c * x + d * y


@compiled
def kept_directions(strain_of, R, now, direction):  # type: ignore[no-untyped-def]
    """The tangents at the end of a step, seen from the nominal frame."""
    L, _, E = direction.shape
    for i in range(L):
        if strain_of[i]:
            a, b, c, d = R[i, 0, 0], R[i, 0, 1], R[i, 1, 0], R[i, 1, 1]
            for e in range(E):
                direction[i, 0, e] = a * now[i, 0, e] + c * now[i, 1, e]
                direction[i, 1, e] = b * now[i, 0, e] + d * now[i, 1, e]


@compiled
def bent(rates, i, beams, base, u, before, angle0, now, tangents, angles, f, work):  # type: ignore[no-untyped-def]
    """Internal force of segment i at the displacement u, added to f, world components.

    Parameters
    ----------
    rates : (6,) Newmark's acceleration (3), h γ, h (1 − γ), damping β
    base : (L, 4, E) of `first_directions`
    before, now : (3, L, 3, E) strains and their rates at the beginning and at the end of the step
    angle0, angles : (L, E) at the beginning, at the end
    tangents : (L, 2, E) at the end, world
    work : (7, E)
    """
    rows, _, rigidity = beams
    n0, n1, n2, h1, h0, beta = rates
    n, E = rows.shape[2:]
    for e in range(E):
        work[0, e], work[1, e], work[2, e], work[3, e] = base[i, 0, e], base[i, 1, e], 0.0, 0.0
    for j in range(n):
        x, y, psi = u[i, 0, j], u[i, 1, j], u[i, 2, j]
        for e in range(E):
            work[0, e] += rows[i, 0, j, e] * x
            work[1, e] += rows[i, 0, j, e] * y
            work[2, e] += rows[i, 1, j, e] * psi
            work[3, e] += rows[i, 2, j, e] * psi
    largest = 0.0
    for e in range(E):
        x, y = work[0, e], work[1, e]
        length = np.sqrt(x * x + y * y)
        x, y = x / length, y / length
        t = (base[i, 2, e] * y - base[i, 3, e] * x) / (1 + base[i, 2, e] * x + base[i, 3, e] * y)
        work[4, e], work[5, e], work[6, e] = length, t, np.float64(0.0)
        tangents[i, 0, e], tangents[i, 1, e] = x, y
        largest = max(largest, abs(t))
    for e in range(E):
        t = work[5, e]
        q = t * t
        turn = 2 * t * (1 - q * (1 / 3 - q * (1 / 5 - q * (1 / 7 - q * (1 / 9 - q / 11)))))
        angles[i, e] = angle0[i, e] + turn
    if not largest <= SMALL_TURN:
        for e in range(E):
            angles[i, e] = angle0[i, e] + 2 * np.arctan(work[5, e])
    for e in range(E):
        now[0, i, 0, e] = work[4, e] - 1
        now[0, i, 1, e] = angles[i, e] - work[2, e]
        now[0, i, 2, e] = work[3, e]
    if beta != 0.0:
        for m in range(3):
            for e in range(E):
                s = now[0, i, m, e]
                x2 = n0 * (s - before[0, i, m, e]) - n1 * before[1, i, m, e] - n2 * before[2, i, m, e]
                x1 = before[1, i, m, e] + h1 * x2 + h0 * before[2, i, m, e]
                now[1, i, m, e], now[2, i, m, e] = x1, x2
                work[m, e] = rigidity[i, m, e] * (s + beta * x1)
    else:
        for m in range(3):
            for e in range(E):
                work[m, e] = rigidity[i, m, e] * now[0, i, m, e]
    for e in range(E):
        N, V, x, y = work[0, e], work[1, e] / work[4, e], tangents[i, 0, e], tangents[i, 1, e]
        work[5, e], work[6, e] = N * x - V * y, N * y + V * x
    for j in range(n):
        x, y, psi = 0.0, 0.0, 0.0
        for e in range(E):
            x += rows[i, 0, j, e] * work[5, e]
            y += rows[i, 0, j, e] * work[6, e]
            psi += rows[i, 2, j, e] * work[2, e] - rows[i, 1, j, e] * work[1, e]
        f[i, 0, j] += x
        f[i, 1, j] += y
        f[i, 2, j] += psi


@compiled
def bending_energy(i, rigidity, strain):  # type: ignore[no-untyped-def]
    """½ Σ rigidity · strain² of segment i."""
    total = 0.0
    for m in range(3):
        for e in range(rigidity.shape[2]):
            total += rigidity[i, m, e] * strain[0, i, m, e] ** 2
    return 0.5 * total
