"""Coordinates of constraints, their gradients on the interface unknowns, and their laws; compiled by numba.

A coordinate is a sum of terms, each a function of the positions x and orientations Q of two ends; see `record.Term`.
"""

import numpy as np

from kedfem.compiled import inner
from kedfem.dynamics.system.ends_kernel import borne, cross, dot, times
from kedfem.dynamics.system.measures_kernel import along_line, borne_by_line, off_line, rotation_along, tilt_along
from kedfem.dynamics.system.record import (
    ARC,
    CURVE,
    DISTANCE,
    DRIVEN,
    GAP,
    HELD,
    OFFSET,
    RATE,
    ROTATION,
    SPRING,
    TILT,
    TIME,
    TURN,
)


@inner
def coordinate(ends, of, r, rigid_motion, place, angles, row, y, w):  # type: ignore[no-untyped-def]
    """Value of coordinate r, its gradient added to a row on z; and its rate in the rigid-body motion, z constant.

    Parameters
    ----------
    rigid_motion : R (M, 3, 3), v and ω (M, 3) of all bodies of the linkage
    angles : (terms,) those of terms as they were, replaced by those they are
    y, w : (16,), (12, 3) room
    """
    total, rate = 0.0, 0.0
    x, Q, _, _, _ = place
    for t in range(of.term_at[r], of.term_at[r + 1]):
        i, j, kind, factor = of.i[t], of.j[t], of.kind[t], of.factor[t]
        if kind in (OFFSET, ARC):
            if kind == OFFSET:
                value, turning = off_line(ends.knots, ends, of, t, rigid_motion, place, w)
            else:
                value, turning = along_line(ends.knots, ends, of, t, place, w), 0.0
            total += factor * value
            rate += factor * turning
            rate += borne(ends, i, w[6], w[7], factor, rigid_motion, place, row, y, w)
            rate += borne_by_line(ends.knots, ends, j, factor, rigid_motion, row, w)
            continue
        if kind in (GAP, DISTANCE):
            value = between(kind, ends, of, t, x, Q, w)
        elif kind == TURN:
            times(Q[i], of.a[t], w[4])
            times(Q[j], of.b[t], w[5])
            value = dot(w[4], w[5])
            cross(w[4], w[5], w[7])
        elif kind == ROTATION:
            value = rotation_along(Q[i], Q[j], of.b[t], w)
        elif kind == TILT:
            value = tilt_along(Q[i], Q[j], of.a[t], of.b[t], w)
        else:
            value = angle(of, t, Q, angles[t], w)
            angles[t] = value
        if kind not in (GAP, DISTANCE):
            for m in range(3):
                w[6, m], w[8, m], w[9, m] = 0.0, 0.0, -w[7, m]
        total += factor * value
        rate += borne(ends, i, w[6], w[7], factor, rigid_motion, place, row, y, w)
        rate += borne(ends, j, w[8], w[9], factor, rigid_motion, place, row, y, w)
    return total, rate


@inner
def between(kind, ends, of, t, x, Q, w):  # type: ignore[no-untyped-def]
    """Gap along a direction fixed in j, or distance; w[6:10] becomes force and moment of unit size on i and on j."""
    i, j = of.i[t], of.j[t]
    for m in range(3):
        w[4, m], w[5, m] = of.a[t, m] - ends.origin[i, m], of.a_j[t, m] - ends.origin[j, m]
    times(Q[i], w[4], w[10])
    times(Q[j], w[5], w[11])
    for m in range(3):
        w[4, m] = x[i, m] + w[10, m] - x[j, m] - w[11, m]
    if kind == GAP:
        times(Q[j], of.b[t], w[6])
        value = dot(w[4], w[6])
        for m in range(3):
            w[11, m] += w[4, m]
    else:
        value = np.sqrt(dot(w[4], w[4]))
        for m in range(3):
            w[6, m] = w[4, m] / value if value > 0.0 else 0.0
    cross(w[10], w[6], w[7])
    cross(w[6], w[11], w[9])
    for m in range(3):
        w[8, m] = -w[6, m]
    return value


@inner
def angle(of, t, Q, near, w):  # type: ignore[no-untyped-def]
    """Twist of i against j about an axis, to within half a turn of an earlier one; w[7] becomes its gradient."""
    i, j = of.i[t], of.j[t]
    directions(Q[i], of.a[t], of.b[t], w[4], w[5], w[10])
    directions(Q[j], of.a_j[t], of.b[t], w[6], w[8], w[10])
    along, across = dot(w[4], w[6]) + dot(w[5], w[8]), dot(w[4], w[8]) - dot(w[5], w[6])
    value = np.arctan2(across, along)
    value += 2 * np.pi * np.round((near - value) / (2 * np.pi))
    size = along * along + across * across
    for m in range(3):
        w[10, m] = (along * w[8, m] - across * w[6, m]) / size
        w[11, m] = (along * w[6, m] + across * w[8, m]) / size
    cross(w[4], w[10], w[7])
    cross(w[5], w[11], w[9])
    for m in range(3):
        w[7, m] -= w[9, m]
    return value


@inner
def directions(Q, a, axis, one, other, room):  # type: ignore[no-untyped-def]
    """Q a and Q (axis × a), into `one` and `other`."""
    times(Q, a, one)
    cross(axis, a, room)
    times(Q, room, other)


@inner
def law(of, r, t, factor, e, rate, before, force, out):  # type: ignore[no-untyped-def]
    """Force against the coordinate e with its rate, and how it grows with both: out (3,); a constraint has its misfit.

    Returns whether it is a constraint.

    Parameters
    ----------
    factor : what a spring's stiffness is multiplied by
    before, force : coordinate and force along it at the beginning of the step
    """
    kind, numbers = of.law[r], of.numbers[r]
    out[1], out[2] = 0.0, 0.0
    if kind in (HELD, DRIVEN):
        out[0] = e
        return True
    if kind == SPRING:
        k = factor * numbers[0]
        out[0], out[1], out[2] = k * (e - numbers[2]) + numbers[1] * rate, k, numbers[1]
    elif kind == CURVE:
        out[0] = 0.0
    else:
        stop(numbers, e, rate, of.jumps[r] and numbers[0] <= before <= numbers[1], force, out)
    if of.curve_at[r] < of.curve_at[r + 1]:
        over = of.over[r]
        value, slope = interpolated(of, r, t if over == TIME else (rate if over == RATE else e))
        out[0] -= value
        if over != TIME:
            out[2 if over == RATE else 1] -= slope
    return False


@inner
def stop(numbers, e, rate, apart, force, out):  # type: ignore[no-untyped-def]
    """The law of a stop within a step: one that pushed goes on as long as it does not pull, wherever e is; see `law`.

    So the push is continuous in e and its rate, and a step has a solution: else it would jump by c e' at the limit.

    Parameters
    ----------
    apart : whether a step begins within the limits, and is divided where it passes one: if none pushed none does
    """
    lower, upper, k, c = numbers
    side = 0.0
    if force != 0.0:
        side = 1.0 if force < 0.0 else -1.0
    elif not apart:
        side = 1.0 if e > upper else (-1.0 if e < lower else 0.0)
    limit = upper if side > 0.0 else lower
    out[0] = 0.0
    if side != 0.0 and side * (k * (e - limit) + c * rate) > 0.0:
        out[0], out[1], out[2] = k * (e - limit) + c * rate, k, c


@inner
def interpolated(of, r, x):  # type: ignore[no-untyped-def]
    """Value and slope of a curve of cubics, held outside or repeated."""
    first, last, period = of.curve_at[r], of.curve_at[r + 1] - 1, of.period[r]
    if period > 0.0:
        x -= period * np.floor((x - of.abscissa[first]) / period)
    elif x <= of.abscissa[first]:
        return of.cubics[first, 0], 0.0
    k = first
    while k < last and x >= of.abscissa[k + 1]:
        k += 1
    s, c = x - of.abscissa[k], of.cubics[k]
    return c[0] + s * (c[1] + s * (c[2] + s * c[3])), c[1] + s * (2.0 * c[2] + s * 3.0 * c[3])
