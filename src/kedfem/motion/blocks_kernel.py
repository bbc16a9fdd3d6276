"""Least squares over the constraint rows of many bodies, by Cholesky of JᵀJ in blocks of six, compiled by numba.

A row touches two to four bodies: JᵀJ has a block for each pair of bodies that a joint connects, its factor few more.

values (T, e, 6) : of each entry, the derivative of a row by the twist of one body
plan : `blocks.Plan`
"""

import numpy as np

from kedfem.compiled import compiled, inner

REFINEMENTS = 2  # steps of iterative refinement, for the accuracy lost by the squared condition number
TRIES, SETTLED = 60, 1e-5  # iterations for extreme singular values; relative change at which they end


@inner
def factored(value, plan, L):  # type: ignore[no-untyped-def]
    """Factor of JᵀJ at one time; whether it is definite."""
    pairs, columns, updates, of_column = plan.pairs, plan.columns, plan.updates, plan.of_column
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
def solved(L, plan, x):  # type: ignore[no-untyped-def]
    """Solution with the factor, in place, of x (b, 6)."""
    columns, below = plan.columns, plan.below
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
def onto_rows(value, plan, x, out):  # type: ignore[no-untyped-def]
    """J x of x (b, 6)."""
    starts, body = plan.starts, plan.body
    for r in range(len(starts) - 1):
        total = 0.0
        for n in range(starts[r], starts[r + 1]):
            v, y = value[n], x[body[n]]
            for i in range(6):
                total += v[i] * y[i]
        out[r] = total


@inner
def onto_bodies(value, plan, rows, out):  # type: ignore[no-untyped-def]
    """Jᵀ y of y (m,)."""
    starts, body = plan.starts, plan.body
    out[:] = 0.0
    for r in range(len(starts) - 1):
        y = rows[r]
        if y != 0.0:
            for n in range(starts[r], starts[r + 1]):
                v, z = value[n], out[body[n]]
                for i in range(6):
                    z[i] += v[i] * y


@inner
def refined(value, right, plan, L, x, left, change):  # type: ignore[no-untyped-def]
    """Fill in x (b, 6) of the least squares of J x − right, and the residual, left (m,)."""
    x[:] = 0.0
    for r in range(len(left)):
        left[r] = right[r]
    for _ in range(REFINEMENTS + 1):
        onto_bodies(value, plan, left, change)
        solved(L, plan, change)
        for k in range(len(x)):
            for i in range(6):
                x[k, i] += change[k, i]
        onto_rows(value, plan, x, left)
        for r in range(len(left)):
            left[r] = right[r] - left[r]


@compiled
def least_squares(values, rhs, plan, x):  # type: ignore[no-untyped-def]
    """Fill in x (T, c, b, 6) of the least squares of J x − rhs (T, c, m), then the residual; times where defined."""
    L = np.empty((len(plan.below), 6, 6))
    left, change = np.empty(rhs.shape[2]), np.empty(x.shape[2:])
    for t in range(len(values)):
        if not factored(values[t], plan, L):
            return t
        for c in range(rhs.shape[1]):
            refined(values[t], rhs[t, c], plan, L, x[t, c], left, change)
            rhs[t, c] = left
    return len(values)


@compiled
def least_norm(values, rhs, plan, y):  # type: ignore[no-untyped-def]
    """Fill in the y (T, m) of least norm with Jᵀ y = rhs (T, b, 6); returns the number of times where it is defined."""
    L = np.empty((len(plan.below), 6, 6))
    more, left = np.empty(y.shape[1]), np.empty(rhs.shape[1:])
    for t in range(len(values)):
        if not factored(values[t], plan, L):
            return t
        y[t] = 0.0
        left[:] = rhs[t]
        for _ in range(REFINEMENTS + 1):
            solved(L, plan, left)
            onto_rows(values[t], plan, left, more)
            y[t] += more
            onto_bodies(values[t], plan, y[t], left)
            for k in range(len(left)):
                for i in range(6):
                    left[k, i] = rhs[t, k, i] - left[k, i]
    return len(values)


@inner
def normalised(x):  # type: ignore[no-untyped-def]
    """Normalise x (b, 6); returns its length."""
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
def extremes(values, plan, first, out):  # type: ignore[no-untyped-def]
    """Greatest and least singular values of J, out (T, 2), by iterations from first (b, 6), then from the last."""
    L = np.empty((len(plan.below), 6, 6))
    rows, vectors = np.empty(len(plan.starts) - 1), (first.copy(), first.copy())
    for t in range(len(values)):
        out[t, 1] = 0.0
        for which in range(2 if factored(values[t], plan, L) else 1):
            x, size, before = vectors[which], 0.0, 0.0
            x += 0.01 * first
            normalised(x)
            for _ in range(TRIES):
                if which == 0:
                    onto_rows(values[t], plan, x, rows)
                    onto_bodies(values[t], plan, rows, x)
                else:
                    solved(L, plan, x)
                size = normalised(x)
                if abs(size - before) < SETTLED * size:
                    break
                before = size
            out[t, which] = np.sqrt(size) if which == 0 else 1.0 / np.sqrt(size)
