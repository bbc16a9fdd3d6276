"""Planar beams whose frames follow the tangent at each Gauss point, compiled by numba: their strains and internal force.

At a point, with x' the derivative of the position by arc length in the reference position, where |x'| = 1, and θ its
rotation,

    ε = |x'| − 1,   γ = θ − ψ,   κ = ψ'

These equal the strains of `dynamics.frames` with a frame at each point (`links.segments.beam_segments`). Components are
in world axes; ψ and θ count from the rigid-body motion, so x' = R t + u' with t the tangent in the reference position.

    segment, body : (b,) number of each, and of its rotation
    at, stride : (b,) where its coordinates begin, and the number of one component
    rows (b, 3, E, S) : x' from u, ψ and ψ' from ψ, at the E points
    tangent (b, 2, E) : t
    rigidity (b, 3, E) : EA, κGA, EI times the length that belongs to a point; 0 where a segment has fewer points
    strain (3, b, 3, E) and rates, direction (b, 2, E) of the tangents in the rigid-body frame, turn (b, E) : state

One call evaluates all segments, as a call costs as much as a short beam. Without such beams `beams` may be None; this
module is then not compiled.
"""

import numpy as np

from kedfem.compiled import inner

SMALL_TURN = 0.05  # tan of half the angle: up to here the series is exact to rounding


@inner
def begun(rates, beams, R, strain, direction, base, resisted):  # type: ignore[no-untyped-def]
    """What stays for a step: R t, and where tangents would point had they turned as the rigid-body motion; damped
    strains.

    Parameters
    ----------
    rates : (6,) Newmark's acceleration (3), h γ, h (1 − γ), damping β
    base : (b, 4, E) becomes R t and the directions, world
    resisted : (b, 3, E) becomes β times the rate of strains that vanish at the end of the step
    """
    if beams is None:
        return
    _, body, _, _, _, tangent, _ = beams
    n0, n1, n2, h1, h0, beta = rates
    E = tangent.shape[2]
    for b in range(len(body)):
        i = body[b]
        c, s, z, w = R[i, 0, 0], R[i, 1, 0], R[i, 0, 1], R[i, 1, 1]
        for e in range(E):
            x, y = tangent[b, 0, e], tangent[b, 1, e]
            base[b, 0, e], base[b, 1, e] = c * x + z * y, s * x + w * y
            x, y = direction[b, 0, e], direction[b, 1, e]
            base[b, 2, e], base[b, 3, e] = c * x + z * y, s * x + w * y
        for m in range(3):
            for e in range(E):
                x2 = n0 * strain[0, b, m, e] + n1 * strain[1, b, m, e] + n2 * strain[2, b, m, e]
                resisted[b, m, e] = beta * (strain[1, b, m, e] - h1 * x2 + h0 * strain[2, b, m, e])


@inner
def counted(beams, u, direction, turn):  # type: ignore[no-untyped-def]
    """Have turns of tangents counted from the rotations ψ of sections: any number of revolutions in static balance."""
    if beams is None:
        return
    _, _, begin, stride, rows, tangent, _ = beams
    for b in range(len(begin)):
        at, n = begin[b] + 2 * stride[b], stride[b]
        for e in range(tangent.shape[2]):
            psi = 0.0
            for j in range(n):
                psi += rows[b, 1, e, j] * u[at + j]
            c, s, x, y = np.cos(psi), np.sin(psi), tangent[b, 0, e], tangent[b, 1, e]
            direction[b, 0, e], direction[b, 1, e], turn[b, e] = c * x - s * y, s * x + c * y, psi


@inner
def bent(stiffer, beams, u, base, resisted, turn0, seen, f, w):  # type: ignore[no-untyped-def]
    """Internal force of all these segments at the displacement u, added to f; flat, component first, world components.

    Parameters
    ----------
    stiffer : factor of the strains, for their share in their rates
    turn0 : (b, E) at the beginning of the step
    seen : (b, 6, E) becomes ε, γ, κ, the tangent (2) and the turn at u
    w : (5, E)
    """
    if beams is None:
        return
    _, _, begin, stride, rows, _, rigidity = beams
    E = rows.shape[2]
    for b in range(len(begin)):
        at, n = begin[b], stride[b]
        for e in range(E):
            x, y, psi, kappa = base[b, 0, e], base[b, 1, e], 0.0, 0.0
            for j in range(n):
                r = rows[b, 0, e, j]
                x += r * u[at + j]
                y += r * u[at + n + j]
                psi += rows[b, 1, e, j] * u[at + 2 * n + j]
                kappa += rows[b, 2, e, j] * u[at + 2 * n + j]
            w[0, e], w[1, e], w[2, e], seen[b, 2, e] = x, y, psi, kappa
        largest = 0.0
        for e in range(E):
            x, y = w[0, e], w[1, e]
            length = np.sqrt(x * x + y * y)
            x, y = x / length, y / length
            t = (base[b, 2, e] * y - base[b, 3, e] * x) / (1 + base[b, 2, e] * x + base[b, 3, e] * y)
            q = t * t
            arc = 2 * t * (1 - q * (1 / 3 - q * (1 / 5 - q * (1 / 7 - q * (1 / 9 - q / 11)))))
            largest = max(largest, q)
            w[3, e], w[4, e] = length, t
            seen[b, 0, e], seen[b, 3, e], seen[b, 4, e], seen[b, 5, e] = length - 1, x, y, turn0[b, e] + arc
        if not largest <= SMALL_TURN * SMALL_TURN:
            for e in range(E):
                seen[b, 5, e] = turn0[b, e] + 2 * np.arctan(w[4, e])
        for e in range(E):
            seen[b, 1, e] = seen[b, 5, e] - w[2, e]
            N = rigidity[b, 0, e] * (stiffer * seen[b, 0, e] + resisted[b, 0, e])
            V = rigidity[b, 1, e] * (stiffer * seen[b, 1, e] + resisted[b, 1, e])
            w[2, e], w[4, e] = V, rigidity[b, 2, e] * (stiffer * seen[b, 2, e] + resisted[b, 2, e])
            V /= w[3, e]
            x, y = seen[b, 3, e], seen[b, 4, e]
            w[0, e], w[1, e] = N * x - V * y, N * y + V * x
        for j in range(n):
            x, y, moment = 0.0, 0.0, 0.0
            for e in range(E):
                r = rows[b, 0, e, j]
                x += r * w[0, e]
                y += r * w[1, e]
                moment += rows[b, 2, e, j] * w[4, e] - rows[b, 1, e, j] * w[2, e]
            f[at + j] += x
            f[at + n + j] += y
            f[at + 2 * n + j] += moment


@inner
def ended(t, rates, beams, R, seen, strain, direction, turn, strains, energies):  # type: ignore[no-untyped-def]
    """The settled end of a step becomes the state, and row t of the history: strains (T, b, 3, E), energies (T, L)."""
    if beams is None:
        return
    segment, body, _, _, _, _, rigidity = beams
    n0, n1, n2, h1, h0, _ = rates
    E = turn.shape[1]
    for b in range(len(segment)):
        i = body[b]
        energy = 0.0
        for m in range(3):
            for e in range(E):
                s, s1, s2 = seen[b, m, e], strain[1, b, m, e], strain[2, b, m, e]
                now = n0 * (s - strain[0, b, m, e]) - n1 * s1 - n2 * s2
                strain[0, b, m, e], strain[1, b, m, e], strain[2, b, m, e] = s, s1 + h1 * now + h0 * s2, now
                strains[t, b, m, e] = s
                energy += rigidity[b, m, e] * s * s
        energies[t, segment[b]] = 0.5 * energy
        c, s, z, w = R[i, 0, 0], R[i, 1, 0], R[i, 0, 1], R[i, 1, 1]
        for e in range(E):
            x, y = seen[b, 3, e], seen[b, 4, e]
            direction[b, 0, e], direction[b, 1, e], turn[b, e] = c * x + s * y, z * x + w * y, seen[b, 5, e]
