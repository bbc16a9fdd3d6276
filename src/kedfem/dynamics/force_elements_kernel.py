"""Forces of motors, springs, dampers and stops from positions and velocities, compiled by numba.

Each force element has one coordinate q of the positions x of its two ends: the turn of a hinge, the travel of a slide,
the
distance of two points. Its generalised force Q(t, q, q') acts on the ends as Q ∂q/∂x: its virtual work is Q δq, whatever
moves. As q does not change where all turns or moves together, the forces balance.

A : force elements; every array has a row per force element

    x, v : (A, 2, 2, 3) two vectors of each of two ends, world components, and their rates; see `force_elements.End`
    factors : (A,) what the stiffness of each is multiplied by
    before : (A,) q at the time point before, so that turns are counted on beyond ±π
    forces : (A, 2, 2, 3) out
    values : (A, 4) out: q, q', Q, energy stored

    kinds : (A,) TURN, SLIDE, DISTANCE
    forms : (A, 2) POINT, PAIR, SINGLE, ANGLE: what the vectors of an end are
    numbers : (A, 16) stiffness, damping, lower q without force; axis, e1, e2 in the reference position; of each pair of
        directions its angle in the reference position; upper q without force, of a spring the lower one
    over : (A,) TIME, SPEED, POSITION: what the curve is over
    first : (A + 1,) where the points of its curve begin
    at : (c,), cubics : (c, 4) the curves, one after the other, as `Pieces` has them
    periods : (A,) of the curves, 0: held outside
"""

import numpy as np

from kedfem.compiled import compiled_in_order as compiled
from kedfem.dynamics.force_element import PAIR, SINGLE, SLIDE, SPEED, TIME, TURN

STIFFNESS, DAMPING, LOWER, AXIS, E1, E2, DRAWN, UPPER = 0, 1, 2, 3, 6, 9, 12, 14


@compiled
def evaluate(t, factors, x, v, before, table, forces, values):  # type: ignore[no-untyped-def]
    """Forces and values of all force elements at one time, into `forces` and `values`."""
    kinds, forms, numbers, over, first, at, cubics, periods = table
    for i in range(len(kinds)):
        gradient = forces[i]
        gradient[:] = 0.0
        if kinds[i] == TURN:
            q = turn(x[i], forms[i], numbers[i], before[i], gradient)
        elif kinds[i] == SLIDE:
            q = travel(x[i], numbers[i], gradient)
        else:
            q = distance(x[i], gradient)
        rate = 0.0
        for e in range(2):
            for k in range(2):
                for c in range(3):
                    rate += gradient[e, k, c] * v[i, e, k, c]
        lower, upper = numbers[i, LOWER], numbers[i, UPPER]
        stretch = q - lower if q < lower else q - upper if q > upper else 0.0
        stiffness = factors[i] * numbers[i, STIFFNESS]
        Q = -stiffness * stretch - numbers[i, DAMPING] * rate
        if lower < upper and Q * stretch >= 0.0:  # a stop pushes, and only beyond
            Q = 0.0
        if first[i] < first[i + 1]:
            along = t if over[i] == TIME else rate if over[i] == SPEED else q
            Q += on_curve(along, at[first[i] : first[i + 1]], cubics[first[i] : first[i + 1]], periods[i])
        for e in range(2):
            for k in range(2):
                for c in range(3):
                    gradient[e, k, c] *= Q
        values[i, 0], values[i, 1], values[i, 2] = q, rate, Q
        values[i, 3] = 0.5 * stiffness * stretch * stretch


@compiled
def evaluate_all(t, factors, x, v, before, table, forces, values):  # type: ignore[no-untyped-def]
    """The same at T times: factors (T, A), x, v, forces (T, A, 2, 2, 3), values (T, A, 4).

    before (A,) is moved on to the last.
    """
    for k in range(len(t)):
        evaluate(t[k], factors[k], x[k], v[k], before, table, forces[k], values[k])
        before[:] = values[k, :, 0]


@compiled
def on_curve(x, at, cubics, period):  # type: ignore[no-untyped-def]
    """A curve at x: held outside, or repeated."""
    if period > 0.0:
        x -= period * np.floor((x - at[0]) / period)
    k = np.searchsorted(at, x, side="right")
    if k == 0:
        return cubics[0, 0]
    s, c = x - at[k - 1], cubics[k - 1]
    return c[0] + s * (c[1] + s * (c[2] + s * c[3]))


@compiled
def distance(x, gradient):  # type: ignore[no-untyped-def]
    """Distance of the points at both ends, and its gradient; none where they meet: it has no direction there."""
    d = x[0, 0] - x[1, 0]
    q = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    if q > 0.0:
        gradient[0, 0] = d / q
        gradient[1, 0] = -d / q
    return q


@compiled
def travel(x, numbers, gradient):  # type: ignore[no-untyped-def]
    """Travel of the first end against the second along the axis, and its gradient; along the second end's own, if any."""
    q, own = 0.0, dot(x[1, 1], x[1, 1]) > 0.0
    for c in range(3):
        n = x[1, 1, c] if own else numbers[AXIS + c]
        q += n * (x[0, 0, c] - x[1, 0, c])
        gradient[0, 0, c] = n
        gradient[1, 0, c] = -n
    return q


@compiled
def turn(x, forms, numbers, before, gradient):  # type: ignore[no-untyped-def]
    """Turn of the first end against the second about the hinge's axis n, and its gradient.

    The mean over two pairs of directions a, b of the ends, drawn across n and seen along n, of

        θ = atan2(s, c),   s = n · (b × a),   c = a · b − (n · a)(n · b)

    less the angle in the reference position, counted on from `before`. n moves with the first end that shows it.
    """
    n, size, end = axis_of(x, forms, numbers)
    q = 0.0
    normal = np.zeros(3)  # ∂q/∂n
    for k in range(2):
        a, b = direction(x, forms, numbers, 0, k), direction(x, forms, numbers, 1, k)
        na, nb, across = dot(n, a), dot(n, b), cross(b, a)
        s, c = dot(n, across), dot(a, b) - na * nb
        theta = np.arctan2(s, c) - numbers[DRAWN + k]
        q += 0.5 * (theta + 2.0 * np.pi * np.floor((before - theta) / (2.0 * np.pi) + 0.5))
        ds, dc = 0.5 * c / (s * s + c * c), -0.5 * s / (s * s + c * c)
        add_direction(x, forms, numbers, 0, k, ds * cross(n, b) + dc * (b - nb * n), gradient)
        add_direction(x, forms, numbers, 1, k, ds * cross(a, n) + dc * (a - na * n), gradient)
        normal += ds * across - dc * (nb * a + na * b)
    if end >= 0:
        normal = (normal - dot(normal, n) * n) / size
        if forms[end] == PAIR:
            gradient[end, 0] += cross(x[end, 1], normal)
            gradient[end, 1] += cross(normal, x[end, 0])
        else:
            gradient[end, 1] += normal
    return q


@compiled
def axis_of(x, forms, numbers):  # type: ignore[no-untyped-def]
    """The axis of a hinge now, the length of the vector it is made of, and the end that shows it; −1: none."""
    for e in range(2):
        if forms[e] == PAIR or forms[e] == SINGLE:
            m = cross(x[e, 0], x[e, 1]) if forms[e] == PAIR else x[e, 1].copy()
            size = np.sqrt(dot(m, m))
            return m / size, size, e
    return numbers[AXIS : AXIS + 3].copy(), 1.0, -1


@compiled
def direction(x, forms, numbers, e, k):  # type: ignore[no-untyped-def]
    """The k-th direction of an end across the hinge's axis."""
    if forms[e] == PAIR:
        return x[e, k].copy()
    if forms[e] == SINGLE:
        return x[e, 0].copy()
    return turned(numbers, x[e, 0, 2] * numbers[AXIS + 2], k)


@compiled
def add_direction(x, forms, numbers, e, k, change, gradient):  # type: ignore[no-untyped-def]
    """Add to the gradient by an end's vectors what q changes with its k-th direction."""
    if forms[e] == PAIR:
        gradient[e, k] += change
    elif forms[e] == SINGLE:
        gradient[e, 0] += change
    else:  # a direction that turns by ψ about z changes by z × itself
        d = turned(numbers, x[e, 0, 2] * numbers[AXIS + 2], k)
        gradient[e, 0, 2] += change[1] * d[0] - change[0] * d[1]


@compiled
def turned(numbers, angle, k):  # type: ignore[no-untyped-def]
    """e1 (k = 0) or e2 (k = 1), turned about the axis e1 × e2."""
    c, s = np.cos(angle), np.sin(angle)
    one, other = numbers[E1 : E1 + 3], numbers[E2 : E2 + 3]
    return c * one + s * other if k == 0 else c * other - s * one


@compiled
def cross(a, b):  # type: ignore[no-untyped-def]
    """a × b."""
    out = np.empty(3)
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]
    return out


@compiled
def dot(a, b):  # type: ignore[no-untyped-def]
    """a · b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
