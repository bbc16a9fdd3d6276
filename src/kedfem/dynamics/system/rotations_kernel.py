"""Rotation vectors of one end against another, and how they change; compiled by numba.

With R = Q_jᵀ Q_i = exp [θ]× and w the rate of rotation of i against j, seen from j,

    θ' = w − ½ θ × w + c θ × (θ × w),   c = (1 − θ/2 cot θ/2) / θ²

The tilt of an axis is the shortest rotation that takes n, its direction in j, to a, that in i: θ = f(a · n) n × a with
f(cos t) = t / sin t.
"""

import numpy as np

from kedfem.compiled import inlined
from kedfem.dynamics.system.ends_kernel import cross, dot, times

SMALL = 1e-2  # squares of angles below which series are exact to rounding


@inlined
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


@inlined
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
