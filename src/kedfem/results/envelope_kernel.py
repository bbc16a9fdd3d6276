"""Extremes over time of the stress at many points, compiled by numba.

parts (p, 6, r) : of each mode at each point five deviatoric components, whose norm is the von Mises stress, and the mean
C (T, r) : coordinates of the modes over time
residuals (l, w, r) : of every window of 2^(l+1) steps how far C leaves the line between its ends, at most
highest, at (3, p) : von Mises, largest principal, minus the smallest principal stress so far; numbers of their steps

The three are convex in the stress. So within a window they are no larger than at its ends but for what the residual adds,
component by component: windows that cannot hold an extreme are skipped, others halved.
"""

import numpy as np

from kedfem.compiled import compiled

LEVELS = 5  # windows of at most 2^5 steps


@compiled
def residuals_of(C, out):  # type: ignore[no-untyped-def]
    """Fill in how far C leaves its chords."""
    T, r = C.shape
    for level in range(LEVELS):
        width = 2 << level
        for k in range(out.shape[1]):
            a = k * width
            if a >= T - 1:
                break
            b = min(a + width, T - 1)
            for j in range(r):
                slope = (C[b, j] - C[a, j]) / (b - a)
                largest = 0.0
                for t in range(a + 1, b):
                    largest = max(largest, abs(C[t, j] - C[a, j] - slope * (t - a)))
                out[level, k, j] = largest


@compiled
def stress_at(part, c, s):  # type: ignore[no-untyped-def]
    """The six components s of a point at one time; returns the von Mises stress."""
    for q in range(6):
        total = 0.0
        for j in range(len(c)):
            total += part[q, j] * c[j]
        s[q] = total
    return np.sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2] + s[3] * s[3] + s[4] * s[4])


@compiled
def tensor(s):  # type: ignore[no-untyped-def]
    """xx, yy, zz, xy, yz, zx of the deviator."""
    root = np.sqrt(1.0 / 3.0)
    a, b = root * s[0], s[1] / 3
    return a - b, -a - b, 2 * b, root * s[2], root * s[3], root * s[4]


@compiled
def principal(s, vm):  # type: ignore[no-untyped-def]
    """Largest and smallest principal stress, by the angle of Lode."""
    if vm <= 0.0:
        return s[5], s[5]
    xx, yy, zz, xy, yz, zx = tensor(s)
    J3 = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * zx) + zx * (xy * yz - yy * zx)
    theta = np.arccos(min(1.0, max(-1.0, 13.5 * J3 / (vm * vm * vm)))) / 3
    return s[5] + 2 / 3 * vm * np.cos(theta), s[5] + 2 / 3 * vm * np.cos(theta + 2 * np.pi / 3)


@compiled
def below(s, vm, sign, limit):  # type: ignore[no-untyped-def]
    """Whether no principal stress, times the sign, exceeds a limit: Sylvester on what is left up to there."""
    rest = limit - sign * s[5]
    if 2 / 3 * vm <= rest:
        return True
    if vm / 3 > rest:
        return False
    xx, yy, zz, xy, yz, zx = tensor(s)
    xx, yy, zz = rest - sign * xx, rest - sign * yy, rest - sign * zz
    xy, yz, zx = -sign * xy, -sign * yz, -sign * zx
    minor = xx * yy - xy * xy
    det = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * zx) + zx * (xy * yz - yy * zx)
    return xx > 0 and minor > 0 and det > 0


@compiled
def looked_at(part, c, step, s, highest, at, i):  # type: ignore[no-untyped-def] # noqa: PLR0913, PLR0917
    """One point at one time: stress s and its von Mises s[6]; better extremes are kept."""
    vm = stress_at(part, c, s)
    s[6] = vm
    if vm > highest[0, i]:
        highest[0, i], at[0, i] = vm, step
    more, less = not below(s, vm, 1.0, highest[1, i]), not below(s, vm, -1.0, highest[2, i])
    if more or less:
        largest, smallest = principal(s, vm)
        if more and largest > highest[1, i]:
            highest[1, i], at[1, i] = largest, step
        if less and -smallest > highest[2, i]:
            highest[2, i], at[2, i] = -smallest, step


@compiled
def skipped(a, b, more, spread, highest, i):  # type: ignore[no-untyped-def]
    """Whether no time between two ends can hold an extreme."""
    if max(a[6], b[6]) + more > highest[0, i]:
        return False
    for k, sign in ((1, 1.0), (2, -1.0)):
        limit = highest[k, i] - spread
        if not (below(a, a[6], sign, limit) and below(b, b[6], sign, limit)):
            return False
    return True


@compiled
def enveloped(parts, C, residuals, first, highest, at):  # type: ignore[no-untyped-def]
    """Extremes of all points over more steps; returns how many stresses were evaluated."""
    T, r = C.shape
    p, width = len(parts), 1 << LEVELS
    anchors = (T - 2) // width + 2 if T > 1 else 1
    ends, size, count = np.empty((anchors, 7)), np.empty((2, r)), 0
    low, high = np.empty((LEVELS + 2, 7)), np.empty((LEVELS + 2, 7))
    place = np.empty((LEVELS + 2, 2), np.int64)
    for i in range(p):
        part = parts[i]
        for j in range(r):
            vm = 0.0
            for q in range(5):
                vm += part[q, j] * part[q, j]
            size[0, j] = np.sqrt(vm)
            size[1, j] = 2 / 3 * size[0, j] + abs(part[5, j])
        for k in range(anchors):
            t = min(k * width, T - 1)
            looked_at(part, C[t], first + t, ends[k], highest, at, i)
            count += 1
        for k in range(anchors - 1):
            top = 0
            place[0, 0], place[0, 1] = LEVELS - 1, k
            low[0], high[0] = ends[k], ends[k + 1]
            while top >= 0:
                level, window = place[top, 0], place[top, 1]
                a = window * (2 << level)
                b = min(a + (2 << level), T - 1)
                if b - a < 2:
                    top -= 1
                    continue
                more, spread = 0.0, 0.0
                for j in range(r):
                    more += size[0, j] * residuals[level, window, j]
                    spread += size[1, j] * residuals[level, window, j]
                if skipped(low[top], high[top], more, spread, highest, i):
                    top -= 1
                    continue
                middle = a + (1 << level)
                if middle >= b:  # a window that the last step cuts short
                    place[top, 0], place[top, 1] = level - 1, 2 * window
                    continue
                low[top + 1], high[top + 1] = low[top], high[top]
                looked_at(part, C[middle], first + middle, high[top + 1], highest, at, i)
                count += 1
                if level == 0:
                    top -= 1
                    continue
                low[top] = high[top + 1]  # the second half waits below the first
                place[top, 0], place[top, 1] = level - 1, 2 * window + 1
                place[top + 1, 0], place[top + 1, 1] = level - 1, 2 * window
                top += 1
    return count
