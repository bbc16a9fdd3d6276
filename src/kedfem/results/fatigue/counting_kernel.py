"""Cycle counting of periodic stress histories, and their damage, compiled by numba.

h (q, T) : histories over one period, the end of which is its beginning
S, N (m,) : natural logarithms of amplitudes [Pa] of an S-N curve, rising, and of its cycles; straight on beyond both ends
floor : amplitude below which nothing is damaged [Pa]
M : mean stress sensitivity

Histories are counted closed: from their largest value in size round to it again, by four points; what is left at the end
is one cycle, to the other extreme. pyLife's `FourPointDetector` counts the same (tests/rooms/test_fatigue_counting.py).
"""

import numpy as np

from kedfem.compiled import compiled, inner


@inner
def turning_points(h, q, out):  # type: ignore[no-untyped-def]
    """Fill in the turning points of a closed history, from its largest value in size; returns how many there are."""
    T, k = h.shape[1], 0
    for t in range(T):
        if abs(h[q, t]) > abs(h[q, k]):
            k = t
    out[0] = h[q, k]
    n = 1
    for j in range(1, T + 1):
        t = k + j
        x = h[q, t - T if t >= T else t]
        if n > 1 and (out[n - 1] - out[n - 2]) * (x - out[n - 1]) > 0:
            out[n - 1] = x
        elif x != out[n - 1]:
            out[n] = x
            n += 1
    return n


@inner
def reversed_amplitude(a, m, M):  # type: ignore[no-untyped-def]
    """The amplitude with mean 0 that is equivalent to a with mean m: Haigh's diagram of the FKM guideline."""
    if m <= -a:
        return a * (1 - M)
    if m <= a:
        return a + M * m
    return (a + M / 3 * min(m, 3 * a)) / (1 + M / 3) * (1 + M)


@inner
def damage_of(a, S, N, floor):  # type: ignore[no-untyped-def]
    """Damage of one cycle with an amplitude a and mean 0."""
    if a <= floor or a <= 0.0:
        return 0.0
    x, j = np.log(a), 1
    while j < S.shape[0] - 1 and x > S[j]:
        j += 1
    return np.exp(-(N[j - 1] + (N[j] - N[j - 1]) / (S[j] - S[j - 1]) * (x - S[j - 1])))


@inner
def added(first, second, M, S, N, floor, q, found):  # type: ignore[no-untyped-def] # noqa: PLR0913, PLR0917
    """Add one cycle of a history."""
    a, m = 0.5 * abs(second - first), 0.5 * (first + second)
    equal = reversed_amplitude(a, m, M)
    found[q, 0] += damage_of(equal, S, N, floor)
    if equal > found[q, 1]:
        found[q, 1], found[q, 2], found[q, 3] = equal, a, m


@compiled
def counted(h, M, S, N, floor, found):  # type: ignore[no-untyped-def]
    """Fill in (q, 4): damage in a period, the largest reversed amplitude, amplitude and mean of that cycle."""
    points, stack = np.empty(h.shape[1] + 1), np.empty(h.shape[1] + 1)
    for q in range(h.shape[0]):
        found[q] = 0.0
        n = 0
        for k in range(turning_points(h, q, points)):
            stack[n] = points[k]
            n += 1
            while n > 3:
                middle = abs(stack[n - 2] - stack[n - 3])
                if abs(stack[n - 1] - stack[n - 2]) < middle or abs(stack[n - 3] - stack[n - 4]) < middle:
                    break
                added(stack[n - 3], stack[n - 2], M, S, N, floor, q, found)
                stack[n - 3] = stack[n - 1]
                n -= 2
        for k in range(1, n, 2):
            added(stack[k - 1], stack[k], M, S, N, floor, q, found)
