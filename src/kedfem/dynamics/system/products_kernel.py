"""Products of bodies' mass and stiffness with vectors."""

from kedfem.compiled import inner
from kedfem.dynamics.system.algebra_kernel import product


@inner
def mass_times(bodies, i, x, out):  # type: ignore[no-untyped-def]
    """out becomes M x of a sparse body, in whichever axes; a matrix that all three components share is read once."""
    n, d, of = bodies.functions[i], bodies.components[i], bodies.mass
    row, column, value = of.row, of.column, of.value
    if d == 3 and of.of[i, 0] == of.of[i, 1] == of.of[i, 2]:
        at = of.at[of.of[i, 0]]
        for j in range(n):
            x0, x1, x2 = 0.0, 0.0, 0.0
            for m in range(row[at + j], row[at + j + 1]):
                k, y = column[m], value[m]
                x0 += y * x[k]
                x1 += y * x[n + k]
                x2 += y * x[2 * n + k]
            out[j], out[n + j], out[2 * n + j] = x0, x1, x2
        return
    for b in range(d):
        at = of.at[of.of[i, b]]
        for j in range(n):
            total = 0.0
            for m in range(row[at + j], row[at + j + 1]):
                total += value[m] * x[b * n + column[m]]
            out[b * n + j] = total


@inner
def stiffness_times(bodies, i, x, out):  # type: ignore[no-untyped-def]
    """out becomes K0 x of a co-rotational body."""
    N = bodies.at[i + 1] - bodies.at[i]
    if bodies.dense[i]:
        product(bodies.K, bodies.G_at[i], N, N, x, out)
        return
    of = bodies.stiffness
    row, column, value, at = of.row, of.column, of.value, of.at[of.of[i, 0]]
    for j in range(N):
        total = 0.0
        for m in range(row[at + j], row[at + j + 1]):
            total += value[m] * x[column[m]]
        out[j] = total
