"""Anderson acceleration of iterations and the small dense solves of a step, compiled by numba.

pairs (2, m, N) : differences of iterates, and of the changes that the iteration requests there
products (m, m) : scalar products of the latter
last (2, N) : step taken and change requested in the last iteration
room (m + 1, m) : work array of the small system, so that a step allocates nothing
"""

import numpy as np

from kedfem.compiled import inner

RIDGE = 1e-13  # of a pair's own square: pairs that repeat each other


@inner
def accelerated(memory, counts, iteration, change):  # type: ignore[no-untyped-def]
    """Anderson acceleration, as `dynamics.anderson` has it: the change asked for becomes the step to take."""
    pairs, products, last, room = memory
    depth, N = pairs.shape[1:]
    known, slot = int(counts[2]), int(counts[3])
    if iteration > 0:
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
    for x in range(N):
        last[1, x] = change[x]
    if known > 0:
        A, b = room[:known, :known], room[depth, :known]
        for p in range(known):
            size = np.sqrt(products[p, p]) + 1e-300
            for q in range(p):
                A[p, q] = products[p, q] / (size * (np.sqrt(products[q, q]) + 1e-300))
            A[p, p] = 1 + RIDGE
            total = 0.0
            for x in range(N):
                total += pairs[1, p, x] * change[x]
            b[p] = total / size
        definite_solved(A, b)
        for p in range(known):
            gamma = b[p] / (np.sqrt(products[p, p]) + 1e-300)
            for x in range(N):
                change[x] -= gamma * pairs[0, p, x]
    for x in range(N):
        last[0, x] = change[x]


@inner
def definite_solved(A, x):  # type: ignore[no-untyped-def]
    """x becomes A⁻¹ x, A symmetric, positive definite and used up."""
    k = len(x)
    for i in range(k):
        for j in range(i + 1):
            total = A[i, j]
            for m in range(j):
                total -= A[i, m] * A[j, m]
            A[i, j] = np.sqrt(max(total, RIDGE)) if i == j else total / A[j, j]
        for m in range(i):
            x[i] -= A[i, m] * x[m]
        x[i] /= A[i, i]
    for i in range(k - 1, -1, -1):
        for j in range(i + 1, k):
            x[i] -= A[j, i] * x[j]
        x[i] /= A[i, i]
