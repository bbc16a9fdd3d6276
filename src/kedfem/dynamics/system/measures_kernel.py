"""Rotation vectors, tilts and distances from lines between two ends, compiled by numba.

Rates of rotation vectors: with R = Q_jᵀ Q_i = exp [θ]× and w the angular velocity of i against j, in components of j,

    θ' = w − ½ θ × w + c θ × (θ × w),   c = (1 − θ/2 cot θ/2) / θ²

The tilt of an axis is the shortest rotation from n, its direction in j, to a, that in i: θ = f(a · n) n × a with
f(cos t) = t / sin t.

The distance of a point x from a line c(s) = Σ N_k(s) x_k through stations, in one direction, is n · d with d = x − c and
t · d = 0, t = c'. The direction n is that of the reference position, rotated with the line's body and then from
its axis a to the tangent: n = b − 2 h (h · b) / h · h, h = a + t/|t|. With g = ∂(n · d)/∂h

    q = (1 − t tᵀ/t·t) g / |t|,   κ = q · c'' / (t · t − c'' · d),   F = n + κ t

    δ(n · d) = F · δx + Σ (N'_k (q + κ d) − N_k F) · δx_k

On the line d, q and κ are zero: no force does work as the pin slides and as n rotates. The change of the place s is

    δs = (t · δx + Σ (N'_k d − N_k t) · δx_k) / (t · t − c'' · d)

so a force along the line acts on the pin along the tangent, and on the line's link in the opposite direction at the pin.
"""

import numpy as np

from kedfem.compiled import inner
from kedfem.dynamics.system.ends_kernel import cross, dot, times
from kedfem.dynamics.system.record import CLOSE, FEET, TURNED

SMALL = 1e-2  # squares of angles below which series are exact to rounding


@inner
def rotation_along(Qi, Qj, b, w):  # type: ignore[no-untyped-def]
    """Component along b of the rotation vector, less than half a turn; w[7] becomes its gradient by the rotation of i."""
    trace = 0.0
    for m in range(3):
        w[4, m] = 0.0
    for k in range(3):
        cross(Qi[k], Qj[k], w[5])
        trace += dot(Qi[k], Qj[k])
        for m in range(3):
            w[4, m] += w[5, m]
    size = np.sqrt(dot(w[4], w[4]))
    t = np.arctan2(size, trace - 1.0)
    share, c = 0.5, 0.0
    if size > 1e-12:
        share = t / size
    for m in range(3):
        w[4, m] *= share
    t2 = t * t
    if t2 < SMALL:
        c = 1 / 12 + t2 * (1 / 720 + t2 * (1 / 30240 + t2 / 1209600))
    else:
        c = (1.0 - 0.5 * t / np.tan(0.5 * t)) / t2
    cross(w[4], b, w[5])
    cross(w[4], w[5], w[6])
    for m in range(3):
        w[5, m] = b[m] + 0.5 * w[5, m] + c * w[6, m]
    times(Qj, w[5], w[7])
    return dot(w[4], b)


@inner
def tilt_along(Qi, Qj, axis, b, w):  # type: ignore[no-untyped-def]
    """Component along b, across an axis, of the rotation vector of the axis' tilt; w[7] as in `rotation_along`."""
    times(Qi, axis, w[4])
    times(Qj, axis, w[5])
    times(Qj, b, w[6])
    cross(w[6], w[5], w[8])
    cross(w[4], w[5], w[9])
    cosine, along, square = dot(w[4], w[5]), dot(w[4], w[8]), dot(w[9], w[9])
    if cosine > 0.0 and square < SMALL * SMALL:
        y = 1.0 - cosine
        f = 1.0 + y * (1 / 3 + y * (2 / 15 + y * 2 / 35))
        slope = -(1 / 3 + y * (4 / 15 + y * 6 / 35))
    else:
        size = np.sqrt(square)
        f = np.arctan2(size, cosine) / size
        slope = (cosine * f - 1.0) / square
    cross(w[4], w[8], w[7])
    for m in range(3):
        w[7, m] = f * w[7, m] + slope * along * w[9, m]
    return f * along


@inner
def off_line(knots, ends, of, t, rigid_motion, place, w):  # type: ignore[no-untyped-def]
    """How far the pin i is off the line of j, and the rate of that as the direction turns with the line's body.

    w[6:8] become the force F and its moment on i, w[8] what the line's slopes bear, q + κ d.
    """
    if knots is None:
        return 0.0, 0.0
    R, _, omega = rigid_motion
    j = of.j[t]
    n, body = ends.number[j], ends.body[j]
    pin_placed(ends, of, t, n, place, w)
    d, tangent, bend = w[9], w[5], w[8]
    size = np.sqrt(dot(tangent, tangent))
    times(R[body], of.b[t], w[6])
    times(R[body], ends.axis[n], w[7])
    cross(omega[body], w[7], w[3])
    cross(omega[body], w[6], w[2])
    for m in range(3):
        w[4, m] = w[7, m] + tangent[m] / size
    twice, on_b, on_d = dot(w[4], w[4]), dot(w[4], w[6]), dot(w[4], d)
    share = 1.0 / twice if twice > TURNED else 0.0
    along = 4.0 * on_b * on_d * share
    for m in range(3):
        w[11, m] = (along * w[4, m] - 2.0 * (w[6, m] * on_d + d[m] * on_b)) * share
    turning = dot(d, w[2]) - 2.0 * on_d * share * dot(w[4], w[2]) + dot(w[11], w[3])
    for m in range(3):
        w[6, m] -= 2.0 * on_b * share * w[4, m]
    value, along = dot(w[6], d), dot(w[11], tangent) / (size * size)
    for m in range(3):
        w[11, m] = (w[11, m] - along * tangent[m]) / size
    kappa = dot(w[11], bend) / (size * size - dot(bend, d))
    for m in range(3):
        w[6, m] += kappa * tangent[m]
        w[8, m] = w[11, m] + kappa * d[m]
    cross(w[10], w[6], w[7])
    return value, turning


@inner
def along_line(knots, ends, of, t, place, w):  # type: ignore[no-untyped-def]
    """The place of the pin i on the line of j; w[6:9] as in `off_line`, of δs."""
    if knots is None:
        return 0.0
    n = ends.number[of.j[t]]
    pin_placed(ends, of, t, n, place, w)
    d, tangent, bend = w[9], w[5], w[8]
    steep = dot(tangent, tangent) - dot(bend, d)
    for m in range(3):
        w[6, m], w[8, m] = tangent[m] / steep, d[m] / steep
    cross(w[10], w[6], w[7])
    return ends.pin[n]


@inner
def pin_placed(ends, of, t, n, place, w):  # type: ignore[no-untyped-def]
    """ends.pin becomes the place of a term's pin on line n, w[10] its arm from its end; the rest as in `spline_at`."""
    x, Q, _, _, X = place
    i = of.i[t]
    for m in range(3):
        w[4, m] = of.a[t, m] - ends.origin[i, m]
    times(Q[i], w[4], w[10])
    for m in range(3):
        w[11, m] = x[i, m] + w[10, m]
    ends.pin[n] = foot(ends, n, X, w)


@inner
def foot(ends, n, X, w):  # type: ignore[no-untyped-def]
    """Place on line n at which a point w[11] stands square to it, sought from its nearest station on; see `spline_at`."""
    first, last = ends.line_at[n], ends.line_at[n + 1]
    least, s = np.inf, 0.0
    for k in range(first, last):
        away = (X[k, 0] - w[11, 0]) ** 2 + (X[k, 1] - w[11, 1]) ** 2 + (X[k, 2] - w[11, 2]) ** 2
        if away < least:
            least, s = away, ends.knots[k]
    whole = ends.knots[last - 1] - ends.knots[first]
    for _ in range(FEET):
        spline_at(ends, n, s, X, w)
        steep = dot(w[5], w[5]) - dot(w[8], w[9])
        change = dot(w[5], w[9]) / (steep if steep > 0.0 else dot(w[5], w[5]))
        if abs(change) <= CLOSE * whole:
            break
        s += change
    return s


@inner
def spline_at(ends, n, s, X, w):  # type: ignore[no-untyped-def]
    """w[5] and w[8] become c' and c'' of line n at s, beyond its ends those of its tangents there, w[9] the way from c to
    w[11], and ends.weights and ends.slopes N and N'."""
    first, last = ends.line_at[n], ends.line_at[n + 1]
    inside = min(max(s, ends.knots[first]), ends.knots[last - 1])
    p, k = last - first, first
    while k < last - 2 and inside >= ends.knots[k + 1]:
        k += 1
    x, at = inside - ends.knots[k], ends.cubic_at[n] + 4 * p * (k - first)
    for m in range(3):
        w[5, m], w[8, m], w[9, m] = 0.0, 0.0, w[11, m]
    for o in range(p):
        c0, c1 = ends.cubics[at + o], ends.cubics[at + p + o]
        c2, c3 = ends.cubics[at + 2 * p + o], ends.cubics[at + 3 * p + o]
        slope = c1 + x * (2.0 * c2 + x * 3.0 * c3)
        bend = 2.0 * c2 + 6.0 * x * c3 if s == inside else 0.0
        weight = c0 + x * (c1 + x * (c2 + x * c3)) + (s - inside) * slope
        ends.weights[first + o], ends.slopes[first + o] = weight, slope
        for m in range(3):
            w[5, m] += slope * X[first + o, m]
            w[8, m] += bend * X[first + o, m]
            w[9, m] -= weight * X[first + o, m]


@inner
def borne_by_line(knots, ends, e, factor, rigid_motion, row, w):  # type: ignore[no-untyped-def]
    """As `ends_kernel.borne`: what the stations of the line of end e bear, N' w[8] − N w[6]."""
    if knots is None:
        return 0.0
    (R, v, omega), force, slope = rigid_motion, w[6], w[8]
    n, d, body = ends.number[e], ends.components[e], ends.body[e]
    first, column, c = ends.line_at[n], ends.column_at[e], ends.column_at[e + 1] - ends.column_at[e]
    for m in range(3):
        w[0, m] = ends.origin[e, m] + (ends.pin[n] - ends.knots[first]) * ends.axis[n, m]
    times(R[body], w[0], w[1])
    cross(omega[body], w[1], w[2])
    power = -dot(force, v[body]) - dot(force, w[2])
    times(R[body], ends.axis[n], w[1])
    cross(omega[body], w[1], w[2])
    power += dot(slope, w[2])
    at = ends.full_at[n]
    for k in range(first, ends.line_at[n + 1]):
        for m in range(d):
            share = factor * (ends.slopes[k] * slope[m] - ends.weights[k] * force[m])
            for o in range(c):
                row[ends.columns[column + o]] += share * ends.full[at + o]
            at += c
    return factor * power
