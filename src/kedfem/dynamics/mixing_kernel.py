"""Anderson's mixing of sweeps and the small dense solves of a step, compiled by numba.

pairs (2, m, N) : where steps taken led, and how the change asked for changed in them
products (m, m) : of the latter with each other
last (2, N) : step taken and change asked for, of the sweep before
"""

import numpy as np

from kedfem.compiled import compiled

RIDGE = 1e-13  # of a pair's own square: pairs that repeat each other


@compiled
def mixed(memory, counts, sweep, change):  # type: ignore[no-untyped-def]
    """Anderson's mixing, see `dynamics.following.Mixing`: the change asked for becomes the step to take."""
    pairs, products, last = memory
    depth, N = pairs.shape[1:]
    known, slot = int(counts[2]), int(counts[3])
    if sweep > 0:
        known = min(depth, known + 1)
        for x in range(N):
            d = change[x] - last[1, x]
            pairs[0, slot, x], pairs[1, slot, x] = last[0, x] + d, d
        for p in range(known):
            total = 0.0
            for x in range(N):
                total += pairs[1, p, x] * pairs[1, slot, x]
            products[p, slot] = products[slot, p] = total
        counts[2], counts[3] = known, (slot + 1) % depth
    last[1] = change
    if known > 0:
        A, b = np.empty((known, known)), np.empty(known)
        for p in range(known):
            size = np.sqrt(products[p, p]) + 1e-300
            for q in range(p):
                A[p, q] = products[p, q] / (size * (np.sqrt(products[q, q]) + 1e-300))
            A[p, p] = 1 + RIDGE
            total = 0.0
            for x in range(N):
                total += pairs[1, p, x] * change[x]
            b[p] = total / size
        none = np.zeros(known, np.int64)
        factored(A, none)
        solved(A, none, b)
        for p in range(known):
            gamma = b[p] / (np.sqrt(products[p, p]) + 1e-300)
            for x in range(N):
                change[x] -= gamma * pairs[0, p, x]
    last[0] = change


@compiled
def factored(H, first):  # type: ignore[no-untyped-def]
    """Cholesky factor in place, entries of each row from its first column on."""
    for i in range(len(H)):
        for j in range(first[i], i + 1):
            total = H[i, j]
            for m in range(max(first[i], first[j]), j):
                total -= H[i, m] * H[j, m]
            H[i, j] = np.sqrt(total) if i == j else total / H[j, j]


@compiled
def solved(H, first, x):  # type: ignore[no-untyped-def]
    """x becomes the solution, by the factor."""
    k = len(x)
    for i in range(k):
        for j in range(first[i], i):
            x[i] -= H[i, j] * x[j]
        x[i] /= H[i, i]
    for i in range(k - 1, -1, -1):
        x[i] /= H[i, i]
        for j in range(first[i], i):
            x[j] -= H[i, j] * x[i]
