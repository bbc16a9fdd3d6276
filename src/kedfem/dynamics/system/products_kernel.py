"""Products of bodies' mass and stiffness with vectors, and what sparse bodies do while their interface points are held.

Arrays of the latter are found by their addresses: each body has its own, as factors are too large for copies in one.
"""

from kedfem.compiled import compiled, inner
from kedfem.dynamics.matrices.triangle_kernel import solved
from kedfem.dynamics.system.algebra_kernel import add_transposed, product
from kedfem.dynamics.system.reference import integers_at, reals_at


@inner
def mass_times(bodies, i, x, out, rows):  # type: ignore[no-untyped-def]
    """out becomes M x of a sparse body, in whichever axes.

    A matrix that all three components share is read once, and what it meets at a time stands in one of the rows.

    Parameters
    ----------
    rows : room for (n, 4) numbers
    """
    n, d, of = bodies.functions[i], bodies.components[i], bodies.mass
    column, value = of.column, of.value
    if d == 3 and of.of[i, 0] == of.of[i, 1] == of.of[i, 2]:
        at = of.at[of.of[i, 0]]
        ends = of.row[at : at + n + 1]
        first, second, third = x[:n], x[n : 2 * n], x[2 * n : 3 * n]
        to, to_second, to_third = out[:n], out[n : 2 * n], out[2 * n : 3 * n]
        for j in range(n):
            rows[j, 0], rows[j, 1], rows[j, 2] = first[j], second[j], third[j]
        for j in range(n):
            columns, values = column[ends[j] : ends[j + 1]], value[ends[j] : ends[j + 1]]
            x0, x1, x2 = 0.0, 0.0, 0.0
            for m in range(len(columns)):
                y, row = values[m], rows[columns[m]]
                x0 += y * row[0]
                x1 += y * row[1]
                x2 += y * row[2]
            to[j], to_second[j], to_third[j] = x0, x1, x2
        return
    for b in range(d):
        at = of.at[of.of[i, b]]
        ends, own, to = of.row[at : at + n + 1], x[b * n : (b + 1) * n], out[b * n : (b + 1) * n]
        for j in range(n):
            columns, values = column[ends[j] : ends[j + 1]], value[ends[j] : ends[j + 1]]
            total = 0.0
            for m in range(len(columns)):
                total += values[m] * own[columns[m]]
            to[j] = total


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


@inner
def held(arrays, r, out, reaction):  # type: ignore[no-untyped-def]
    """out becomes G r = y − Y v and reaction its part of v, where y = Ã⁻¹ r and v = S Cᵀ y; see `Substructure`.

    Parameters
    ----------
    arrays : (13, 2) addresses and sizes of the body's arrays, see `sparse.compiled_arrays`
    """
    where, size = arrays[:, 0], arrays[:, 1]
    triangle = (
        integers_at(where[0], size[0]), integers_at(where[1], size[1]), integers_at(where[2], size[2]),
        integers_at(where[3], size[3]), reals_at(where[4], size[4]), integers_at(where[5], size[5]),
    )  # fmt: skip
    at, place, weight = (
        integers_at(where[6], size[6]),
        integers_at(where[7], size[7]),
        reals_at(where[8], size[8]),
    )
    S, Y = reals_at(where[9], size[9]), reals_at(where[10], size[10])
    seen, v, c = reals_at(where[11], size[11]), reals_at(where[12], size[12]), len(at) - 1
    solved(triangle, r, seen, v, out)
    for k in range(c):
        x = 0.0
        for m in range(at[k], at[k + 1]):
            x += weight[m] * out[place[m]]
        seen[k] = x
    product(S, 0, c, c, seen, v)
    for k in range(len(reaction)):
        reaction[k] = v[k]
    for k in range(c):
        v[k] = -v[k]
    add_transposed(Y, 0, c, len(r), v, out)


@inner
def sparse_held(bodies, i, trial, called):  # type: ignore[no-untyped-def]
    """trial.held and trial.reaction of a sparse body from trial.r."""
    if bodies.arrays[i, 0, 1] == 0:
        called(i)
        return
    first, last = bodies.at[i], bodies.at[i + 1]
    reaction = trial.reaction[bodies.port_at[i] : bodies.port_at[i + 1]]
    held(bodies.arrays[i], trial.r[first:last], trial.held[first:last], reaction)


@compiled
def held_alone(arrays, r, out, reaction):  # type: ignore[no-untyped-def]
    """`held` for what is not compiled."""
    held(arrays, r, out, reaction)
