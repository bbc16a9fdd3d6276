"""Extremes over time of the stress at many points, compiled by numba.

heads (p, m, 6) : of the m leading modes at each point five deviatoric components, whose norm is the von Mises stress, and
    the mean
parts (p, 6, r) : of all modes the same
C (T, r) : coordinates of the modes over time; rest (T,) the norm of those of other than leading modes
residuals (l, w, m + 1) : of every window of 2^(l+1) steps the largest distance of C from the chord between its ends; the
    last is that of the norm of all others
highest, at (3, p) : von Mises, largest principal, minus the smallest principal stress so far; numbers of their steps

The three are convex in the stress. So within a window they are no larger than at its ends but for what the residual adds,
component by component: windows that cannot hold an extreme are skipped, others halved. At an instant the head and, by
Cauchy and Schwarz, a bound of the rest mostly show that there is no extreme; all modes are summed up where they do not.
"""

import numpy as np

from kedfem.compiled import compiled, inner

LEVELS = 5  # windows of at most 2^5 steps


@compiled
def residuals_of(C, m, out):  # type: ignore[no-untyped-def]
    """Fill in the largest distances of C from its chords."""
    T, r = C.shape
    for level in range(LEVELS):
        width = 2 << level
        for k in range(out.shape[1]):
            a = k * width
            if a >= T - 1:
                break
            b = min(a + width, T - 1)
            rest = 0.0
            for j in range(r):
                slope = (C[b, j] - C[a, j]) / (b - a)
                largest = 0.0
                for t in range(a + 1, b):
                    largest = max(largest, abs(C[t, j] - C[a, j] - slope * (t - a)))
                if j < m:
                    out[level, k, j] = largest
                else:
                    rest += largest * largest
            out[level, k, m] = np.sqrt(rest)


@inner
def head_at(heads, i, C, t, seen, k):  # type: ignore[no-untyped-def]
    """The six components seen[k] of a point at one time by the leading modes; returns their von Mises stress."""
    a, b, d, e, f, g = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(heads.shape[1]):
        c = C[t, j]
        a += heads[i, j, 0] * c
        b += heads[i, j, 1] * c
        d += heads[i, j, 2] * c
        e += heads[i, j, 3] * c
        f += heads[i, j, 4] * c
        g += heads[i, j, 5] * c
    seen[k, 0], seen[k, 1], seen[k, 2], seen[k, 3], seen[k, 4], seen[k, 5] = a, b, d, e, f, g
    return np.sqrt(a * a + b * b + d * d + e * e + f * f)


@inner
def stress_at(parts, i, C, t, seen, k):  # type: ignore[no-untyped-def]
    """The same by all modes."""
    for q in range(6):
        total = 0.0
        for j in range(C.shape[1]):
            total += parts[i, q, j] * C[t, j]
        seen[k, q] = total
    a, b, d, e, f = seen[k, 0], seen[k, 1], seen[k, 2], seen[k, 3], seen[k, 4]
    return np.sqrt(a * a + b * b + d * d + e * e + f * f)


@inner
def tensor(seen, k):  # type: ignore[no-untyped-def]
    """xx, yy, zz, xy, yz, zx of the deviator."""
    root = np.sqrt(1.0 / 3.0)
    a, b = root * seen[k, 0], seen[k, 1] / 3
    return a - b, -a - b, 2 * b, root * seen[k, 2], root * seen[k, 3], root * seen[k, 4]


@inner
def principal(seen, k):  # type: ignore[no-untyped-def]
    """Largest and smallest principal stress, by the angle of Lode."""
    mean, vm = seen[k, 5], seen[k, 6]
    if vm <= 0.0:
        return mean, mean
    xx, yy, zz, xy, yz, zx = tensor(seen, k)
    J3 = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * zx) + zx * (xy * yz - yy * zx)
    theta = np.arccos(min(1.0, max(-1.0, 13.5 * J3 / (vm * vm * vm)))) / 3
    return mean + 2 / 3 * vm * np.cos(theta), mean + 2 / 3 * vm * np.cos(theta + 2 * np.pi / 3)


@inner
def below(seen, k, sign, limit):  # type: ignore[no-untyped-def]
    """Whether no principal stress, times the sign, exceeds a limit: Sylvester's criterion, limit · 1 − sign · stress."""
    vm, rest = seen[k, 6], limit - sign * seen[k, 5]
    if 2 / 3 * vm <= rest:
        return True
    if vm / 3 > rest:
        return False
    xx, yy, zz, xy, yz, zx = tensor(seen, k)
    xx, yy, zz = rest - sign * xx, rest - sign * yy, rest - sign * zz
    xy, yz, zx = -sign * xy, -sign * yz, -sign * zx
    minor = xx * yy - xy * xy
    det = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * zx) + zx * (xy * yz - yy * zx)
    return xx > 0 and minor > 0 and det > 0


@inner
def examined(heads, parts, size, C, rest, i, t, first, seen, k, highest, at):  # type: ignore[no-untyped-def] # noqa: PLR0913, PLR0917
    """Point i at step t: stress seen[k], its von Mises [6], what both may lack [7:]; better extremes are kept.

    Returns whether all modes had to be summed up.
    """
    m = heads.shape[1]
    seen[k, 6] = head_at(heads, i, C, t, seen, k)
    seen[k, 7], seen[k, 8] = size[m, 0] * rest[t], size[m, 1] * rest[t]
    if (
        seen[k, 6] + seen[k, 7] <= highest[0, i]
        and below(seen, k, 1.0, highest[1, i] - seen[k, 8])
        and below(seen, k, -1.0, highest[2, i] - seen[k, 8])
    ):
        return 0
    vm = stress_at(parts, i, C, t, seen, k)
    seen[k, 6], seen[k, 7], seen[k, 8] = vm, 0.0, 0.0
    if vm > highest[0, i]:
        highest[0, i], at[0, i] = vm, first + t
    more, less = not below(seen, k, 1.0, highest[1, i]), not below(seen, k, -1.0, highest[2, i])
    if more or less:
        largest, smallest = principal(seen, k)
        if more and largest > highest[1, i]:
            highest[1, i], at[1, i] = largest, first + t
        if less and -smallest > highest[2, i]:
            highest[2, i], at[2, i] = -smallest, first + t
    return 1


@inner
def skipped(seen, a, b, more, spread, highest, i):  # type: ignore[no-untyped-def] # noqa: PLR0913, PLR0917
    """Whether no time between two ends can hold an extreme."""
    if max(seen[a, 6] + seen[a, 7], seen[b, 6] + seen[b, 7]) + more > highest[0, i]:
        return False
    for k, sign in ((1, 1.0), (2, -1.0)):
        limit = highest[k, i] - spread
        if not (below(seen, a, sign, limit - seen[a, 8]) and below(seen, b, sign, limit - seen[b, 8])):
            return False
    return True


@inner
def sizes_of(heads, parts, i, size):  # type: ignore[no-untyped-def]
    """Largest change of von Mises and principal stresses by a unit of each leading mode, and of all others together."""
    m, r = heads.shape[1], parts.shape[2]
    for j in range(m):
        vm = 0.0
        for q in range(5):
            vm += heads[i, j, q] * heads[i, j, q]
        size[j, 0] = np.sqrt(vm)
        size[j, 1] = 2 / 3 * size[j, 0] + abs(heads[i, j, 5])
    vm, mean = 0.0, 0.0
    for q in range(5):
        for j in range(m, r):
            vm += parts[i, q, j] * parts[i, q, j]
    for j in range(m, r):
        mean += parts[i, 5, j] * parts[i, 5, j]
    size[m, 0] = np.sqrt(vm)
    size[m, 1] = 2 / 3 * size[m, 0] + np.sqrt(mean)


@compiled
def enveloped(heads, parts, C, rest, residuals, first, highest, at):  # type: ignore[no-untyped-def] # noqa: PLR0913, PLR0917
    """Extremes of all points over more steps; returns how many stresses were examined, how many with all modes."""
    T = len(C)
    (p, m, _), width = heads.shape, 1 << LEVELS
    anchors = (T - 2) // width + 2 if T > 1 else 1
    size, count, full = np.empty((m + 1, 2)), 0, 0
    seen = np.empty((anchors + LEVELS, 9))  # at the anchors, then in the middle of one window of each level
    todo = np.empty((LEVELS + 2, 4), np.int64)  # windows: level, number, rows of seen at both ends
    for i in range(p):
        sizes_of(heads, parts, i, size)
        for k in range(anchors):
            full += examined(heads, parts, size, C, rest, i, min(k * width, T - 1), first, seen, k, highest, at)
        count += anchors
        for k in range(anchors - 1):
            top = 0
            todo[0, 0], todo[0, 1], todo[0, 2], todo[0, 3] = LEVELS - 1, k, k, k + 1
            while top >= 0:
                level, window, low, high = todo[top, 0], todo[top, 1], todo[top, 2], todo[top, 3]
                a = window * (2 << level)
                b = min(a + (2 << level), T - 1)
                if b - a < 2:
                    top -= 1
                    continue
                more, spread = 0.0, 0.0
                for j in range(m + 1):
                    more += size[j, 0] * residuals[level, window, j]
                    spread += size[j, 1] * residuals[level, window, j]
                if skipped(seen, low, high, more, spread, highest, i):
                    top -= 1
                    continue
                t = a + (1 << level)
                if t >= b:  # a window that the last step cuts short
                    todo[top, 0], todo[top, 1] = level - 1, 2 * window
                    continue
                middle = anchors + level
                full += examined(heads, parts, size, C, rest, i, t, first, seen, middle, highest, at)
                count += 1
                if level == 0:
                    top -= 1
                    continue
                # the second half waits below the first
                todo[top, 0], todo[top, 1], todo[top, 2] = level - 1, 2 * window + 1, middle
                top += 1
                todo[top, 0], todo[top, 1], todo[top, 2], todo[top, 3] = level - 1, 2 * window, low, middle
    return count, full
