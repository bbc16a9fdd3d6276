"""L D Lᵀ factor of a matrix of unknowns and multipliers, stored by its profile, and solutions; compiled by numba.

Rows are stored one after the other, each from its first column to its diagonal. The pivots of unknowns are positive, and
those of multipliers negative, in any order in which a constraint follows all unknowns that it couples.
"""

import numpy as np

from kedfem.compiled import inner

DEPENDENT = 1e-11  # what is left of a constraint's own compliance where others constrain the same


@inner
def profile_factored(K, first, at, multiplier, inverse):  # type: ignore[no-untyped-def]
    """K becomes L below its diagonal, `inverse` that of D: zero of multipliers of constraints that repeat others."""
    for i in range(len(first)):
        row, x = K[at[i] : at[i + 1]], first[i]
        for j in range(x, i):
            begin = max(x, first[j])
            mine, its = row[begin - x : j - x], K[at[j] + begin - first[j] : at[j + 1] - 1]
            total = row[j - x]
            for m in range(len(mine)):
                total -= mine[m] * its[m]
            row[j - x] = total
        pivot = row[i - x]
        own = -pivot
        for j in range(x, i):
            before = row[j - x]
            row[j - x] *= inverse[j]
            part = before * row[j - x]
            pivot -= part
            own += max(part, 0.0)
        if multiplier[i]:
            inverse[i] = 1.0 / pivot if -pivot > DEPENDENT * own else 0.0
        else:
            inverse[i] = 1.0 / pivot if pivot > 0.0 else np.nan


@inner
def profile_solved(K, first, at, inverse, x):  # type: ignore[no-untyped-def]
    """x becomes the solution, by the factor; zero of constraints that repeat others."""
    n = len(x)
    for i in range(n):
        row, above = K[at[i] : at[i + 1] - 1], x[first[i] : i]
        total = x[i]
        for m in range(len(row)):
            total -= row[m] * above[m]
        x[i] = total
    for i in range(n):
        x[i] *= inverse[i]
    for i in range(n - 1, -1, -1):
        row, above = K[at[i] : at[i + 1] - 1], x[first[i] : i]
        for m in range(len(row)):
            above[m] -= row[m] * x[i]
