"""Least squares over the constraint rows of many bodies, by Cholesky of JᵀJ in blocks of six, compiled by numba.

A row touches two to four bodies: JᵀJ has a block for each pair of bodies that a joint connects, its factor few more.

values (T, e, 6) : of each entry, the derivative of a row by the twist of one body
starts (m + 1,) : first entry of each row; body (e,) : place of its body in the order of elimination
pairs (n, 3) : block of JᵀJ, and the two entries whose product goes there
columns (b + 1,) : first block of each column of the factor, that of the diagonal; below (blocks,) : its block row
updates (n, 3) : block that two blocks of one column change; of_column (b + 1,) : first of each column
"""

import numpy as np

from kedfem.compiled import compiled, inner

REFINEMENTS = 2  # of refinement: each takes off what the squared condition number costs
TRIES, SETTLED = 60, 1e-5  # of the iterations for extreme singular values: relative change at which they end


@inner
def factored(value, pairs, columns, updates, of_column, L):  # type: ignore[no-untyped-def]
    """Factor of JᵀJ at one time; whether it is definite."""
    L[:] = 0.0
    for n in range(len(pairs)):
        block, a, b = L[pairs[n, 0]], value[pairs[n, 1]], value[pairs[n, 2]]
        for i in range(6):
            for j in range(6):
                block[i, j] += a[i] * b[j]
    for k in range(len(columns) - 1):
        first = columns[k]
        D = L[first]
        for i in range(6):
            for j in range(i + 1):
                total = D[i, j]
                for n in range(j):
                    total -= D[i, n] * D[j, n]
                if i == j:
                    if not total > 0.0:
                        return False
                    D[i, i] = np.sqrt(total)
                else:
                    D[i, j] = total / D[j, j]
        for p in range(first + 1, columns[k + 1]):
            X = L[p]
            for i in range(6):
                for j in range(6):
                    total = X[i, j]
                    for n in range(j):
                        total -= X[i, n] * D[j, n]
                    X[i, j] = total / D[j, j]
        for n in range(of_column[k], of_column[k + 1]):
            C, A, B = L[updates[n, 0]], L[updates[n, 1]], L[updates[n, 2]]
            for i in range(6):
                for j in range(6):
                    total = 0.0
                    for m in range(6):
                        total += A[i, m] * B[j, m]
                    C[i, j] -= total
    return True


@inner
def solved(L, columns, below, x):  # type: ignore[no-untyped-def]
    """Solution with the factor, in place, of x (b, 6)."""
    count = len(columns) - 1
    for k in range(count):
        D = L[columns[k]]
        for i in range(6):
            total = x[k, i]
            for j in range(i):
                total -= D[i, j] * x[k, j]
            x[k, i] = total / D[i, i]
        for p in range(columns[k] + 1, columns[k + 1]):
            X, y = L[p], x[below[p]]
            for i in range(6):
                for j in range(6):
                    y[i] -= X[i, j] * x[k, j]
    for k in range(count - 1, -1, -1):
        D = L[columns[k]]
        for p in range(columns[k] + 1, columns[k + 1]):
            X, y = L[p], x[below[p]]
            for i in range(6):
                for j in range(6):
                    x[k, j] -= X[i, j] * y[i]
        for i in range(5, -1, -1):
            total = x[k, i]
            for j in range(i + 1, 6):
                total -= D[j, i] * x[k, j]
            x[k, i] = total / D[i, i]


@inner
def onto_rows(value, starts, body, x, out):  # type: ignore[no-untyped-def]
    """J x of x (b, 6)."""
    for r in range(len(starts) - 1):
        total = 0.0
        for n in range(starts[r], starts[r + 1]):
            v, y = value[n], x[body[n]]
            for i in range(6):
                total += v[i] * y[i]
        out[r] = total


@inner
def onto_bodies(value, starts, body, rows, out):  # type: ignore[no-untyped-def]
    """Jᵀ y of y (m,)."""
    out[:] = 0.0
    for r in range(len(starts) - 1):
        y = rows[r]
        if y != 0.0:
            for n in range(starts[r], starts[r + 1]):
                v, z = value[n], out[body[n]]
                for i in range(6):
                    z[i] += v[i] * y


@inner
def refined(value, right, starts, body, columns, below, L, x, left, change):  # type: ignore[no-untyped-def]
    """x (b, 6) that leaves least of J x = right, and left (m,), what it leaves."""
    x[:] = 0.0
    for r in range(len(left)):
        left[r] = right[r]
    for _ in range(REFINEMENTS + 1):
        onto_bodies(value, starts, body, left, change)
        solved(L, columns, below, change)
        for k in range(len(x)):
            for i in range(6):
                x[k, i] += change[k, i]
        onto_rows(value, starts, body, x, left)
        for r in range(len(left)):
            left[r] = right[r] - left[r]


@compiled
def least_squares(values, rhs, starts, body, pairs, columns, below, updates, of_column, x):  # type: ignore[no-untyped-def]
    """x (T, c, b, 6) that leaves least of J x = rhs (T, c, m), which becomes what is left; times where defined."""
    L = np.empty((len(below), 6, 6))
    left, change = np.empty(rhs.shape[2]), np.empty(x.shape[2:])
    for t in range(len(values)):
        if not factored(values[t], pairs, columns, updates, of_column, L):
            return t
        for c in range(rhs.shape[1]):
            refined(values[t], rhs[t, c], starts, body, columns, below, L, x[t, c], left, change)
            rhs[t, c] = left
    return len(values)


@compiled
def least_norm(values, rhs, starts, body, pairs, columns, below, updates, of_column, y):  # type: ignore[no-untyped-def]
    """The least y (T, m) with Jᵀ y = rhs (T, b, 6); the number of times at which that is defined."""
    L = np.empty((len(below), 6, 6))
    more, left = np.empty(y.shape[1]), np.empty(rhs.shape[1:])
    for t in range(len(values)):
        if not factored(values[t], pairs, columns, updates, of_column, L):
            return t
        y[t] = 0.0
        left[:] = rhs[t]
        for _ in range(REFINEMENTS + 1):
            solved(L, columns, below, left)
            onto_rows(values[t], starts, body, left, more)
            y[t] += more
            onto_bodies(values[t], starts, body, y[t], left)
            for k in range(len(left)):
                for i in range(6):
                    left[k, i] = rhs[t, k, i] - left[k, i]
    return len(values)


@inner
def normalised(x):  # type: ignore[no-untyped-def]
    """Length of x (b, 6), which becomes one."""
    size = 0.0
    for k in range(len(x)):
        for i in range(6):
            size += x[k, i] ** 2
    size = np.sqrt(size)
    for k in range(len(x)):
        for i in range(6):
            x[k, i] /= size
    return size


@compiled
def extremes(values, starts, body, pairs, columns, below, updates, of_column, first, out):  # type: ignore[no-untyped-def]
    """Greatest and least singular values of J, out (T, 2), by iterations from first (b, 6), then from the last."""
    L = np.empty((len(below), 6, 6))
    rows, high, low = np.empty(len(starts) - 1), first.copy(), first.copy()
    for t in range(len(values)):
        high += 0.01 * first
        before = 0.0
        normalised(high)
        for _ in range(TRIES):
            onto_rows(values[t], starts, body, high, rows)
            onto_bodies(values[t], starts, body, rows, high)
            size = normalised(high)
            if abs(size - before) < SETTLED * size:
                break
            before = size
        out[t, 0] = np.sqrt(size)
        if not factored(values[t], pairs, columns, updates, of_column, L):
            out[t, 1] = 0.0
            continue
        low += 0.01 * first
        before = 0.0
        normalised(low)
        for _ in range(TRIES):
            solved(L, columns, below, low)
            size = normalised(low)
            if abs(size - before) < SETTLED * size:
                break
            before = size
        out[t, 1] = 1.0 / np.sqrt(size)
