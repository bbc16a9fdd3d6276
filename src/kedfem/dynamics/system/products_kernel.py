"""Products of bodies' mass and stiffness with vectors, and solutions of sparse bodies; compiled by numba.

Arrays of sparse bodies are passed by their addresses, as factors are too large to be copied into one array.
Without sparse bodies their addresses and mass may be None; this module is then not compiled.
"""

from kedfem.compiled import compiled, inner
from kedfem.dynamics.matrices.triangle_kernel import solved
from kedfem.dynamics.system.algebra_kernel import add_transposed, copied, product
from kedfem.dynamics.system.reference import integers_at, reals_at


@inner
def mass_times(of, bodies, i, x, out):  # type: ignore[no-untyped-def]
    """out becomes M x of a sparse body, in whichever axes; of a matrix that is symmetric rows end at their diagonal.

    One that all three components share is read once.
    """
    if of is None:
        return
    n, d = bodies.functions[i], bodies.components[i]
    shared = d == 3 and of.of[i, 0] == of.of[i, 1] == of.of[i, 2]
    for b in range(1 if shared else d):
        at = of.at[of.of[i, b]]
        ends, own, to = of.row[at : at + n + 1], x[b * n : (b + 1) * n], out[b * n : (b + 1) * n]
        if shared:
            shared_mass_times(
                ends, of.column, of.value, (own, x[n : 2 * n], x[2 * n :]), (to, out[n : 2 * n], out[2 * n :])
            )
            continue
        for j in range(n):
            end = ends[j + 1] - 1
            columns, values = of.column[ends[j] : end], of.value[ends[j] : end]
            mine, total = own[j], of.value[end] * own[j]
            for m in range(len(columns)):
                total += values[m] * own[columns[m]]
                to[columns[m]] += values[m] * mine
            to[j] = total


@inner
def shared_mass_times(ends, column, value, x, out):  # type: ignore[no-untyped-def]
    """Of all three components (n,), from those of x."""
    first, second, third = x
    to, to_second, to_third = out
    for j in range(len(ends) - 1):
        end = ends[j + 1] - 1
        columns, values, y = column[ends[j] : end], value[ends[j] : end], value[end]
        p, q, r = first[j], second[j], third[j]
        x0, x1, x2 = y * p, y * q, y * r
        for m in range(len(columns)):
            y, o = values[m], columns[m]
            x0 += y * first[o]
            x1 += y * second[o]
            x2 += y * third[o]
            to[o] += y * p
            to_second[o] += y * q
            to_third[o] += y * r
        to[j], to_second[j], to_third[j] = x0, x1, x2


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
def condensed(arrays):  # type: ignore[no-untyped-def]
    """C row by row, S and Y of a sparse body, room and v; see `sparse.compiled_arrays`."""
    where, size = arrays[:, 0], arrays[:, 1]
    return (
        integers_at(where[6], size[6]), integers_at(where[7], size[7]), reals_at(where[8], size[8]),
        reals_at(where[9], size[9]), reals_at(where[10], size[10]), reals_at(where[11], size[11]),
        reals_at(where[12], size[12]),
    )  # fmt: skip


@inner
def held(arrays, r, y, reaction, solve):  # type: ignore[no-untyped-def]
    """y becomes Ã⁻¹ r unless it is that, and reaction what is held of v = S Cᵀ y, which is kept; see `Substructure`.

    Parameters
    ----------
    arrays : (13, 2) addresses and sizes of the body's arrays
    """
    at, place, weight, S, _, seen, v = condensed(arrays)
    if solve:
        where, size = arrays[:, 0], arrays[:, 1]
        triangle = (
            integers_at(where[0], size[0]), integers_at(where[1], size[1]), integers_at(where[2], size[2]),
            integers_at(where[3], size[3]), reals_at(where[4], size[4]), integers_at(where[5], size[5]),
        )  # fmt: skip
        solved(triangle, r, seen, v, y)
    c = len(at) - 1
    for k in range(c):
        x = 0.0
        for m in range(at[k], at[k + 1]):
            x += weight[m] * y[place[m]]
        seen[k] = x
    product(S, 0, c, c, seen, v)
    copied(v, reaction)


@inner
def add_answer(arrays, i, w, out):  # type: ignore[no-untyped-def]
    """out + Y (S w − v) of sparse body i: what interface points that move by w, and anchors, do to Ã⁻¹ r."""
    if arrays is None:
        return
    at, _, _, S, Y, forces, v = condensed(arrays[i])
    c = len(at) - 1
    for k in range(c):
        row, x = S[k * c : k * c + len(w)], -v[k]
        for m in range(len(w)):
            x += row[m] * w[m]
        forces[k] = x
    add_transposed(Y, 0, c, len(out), forces, out)


@inner
def sparse_held(arrays, bodies, i, trial, called):  # type: ignore[no-untyped-def]
    """trial.held = Ã⁻¹ r and trial.reaction of a sparse body from trial.r."""
    if arrays is None:
        return
    first, last = bodies.at[i], bodies.at[i + 1]
    taken = arrays[i, 0, 1] > 0
    if not taken:
        called(i)
    reaction = trial.reaction[bodies.port_at[i] : bodies.port_at[i + 1]]
    held(arrays[i], trial.r[first:last], trial.held[first:last], reaction, taken)


@inner
def displaced(bodies, i, trial, out):  # type: ignore[no-untyped-def]
    """out becomes g = G r + Y w, [KED, eq. (5)], of a body whose interface points move by trial.w."""
    first, last, of_ports = bodies.at[i], bodies.at[i + 1], bodies.port_at[i]
    q, N = bodies.port_at[i + 1] - of_ports, last - first
    w = trial.w[of_ports : of_ports + q]
    if bodies.dense[i]:
        product(bodies.G, bodies.G_at[i], N, N, trial.r[first:last], out)
        add_transposed(bodies.Y, bodies.Y_at[i], q, N, w, out)
    else:
        copied(trial.held[first:last], out[:N])
        add_answer(bodies.arrays, i, w, out[:N])


@inner
def add_at_ports(bodies, i, x, out):  # type: ignore[no-untyped-def]
    """out + Wᵀ x, x on a body's interface points."""
    if bodies.dense[i]:
        add_transposed(bodies.W, bodies.Y_at[i], len(x), bodies.at[i + 1] - bodies.at[i], x, out)
    else:
        sparse_at_ports(bodies.arrays, i, x, out)


@inner
def sparse_at_ports(arrays, i, x, out):  # type: ignore[no-untyped-def]
    """The same of a sparse body."""
    if arrays is None:
        return
    at, place, weight, _, _, _, _ = condensed(arrays[i])
    for k in range(len(x)):
        for m in range(at[k], at[k + 1]):
            out[place[m]] += weight[m] * x[k]


@inner
def take_ports(bodies, i, u, out):  # type: ignore[no-untyped-def]
    """out − W u, out on a body's interface points."""
    N = bodies.at[i + 1] - bodies.at[i]
    if bodies.dense[i]:
        for k in range(len(out)):
            row, x = bodies.W[bodies.Y_at[i] + k * N : bodies.Y_at[i] + (k + 1) * N], 0.0
            for m in range(N):
                x += row[m] * u[m]
            out[k] -= x
    else:
        take_sparse_ports(bodies.arrays, i, u, out)


@inner
def take_sparse_ports(arrays, i, u, out):  # type: ignore[no-untyped-def]
    """The same of a sparse body."""
    if arrays is None:
        return
    at, place, weight, _, _, _, _ = condensed(arrays[i])
    for k in range(len(out)):
        x = 0.0
        for m in range(at[k], at[k + 1]):
            x += weight[m] * u[place[m]]
        out[k] -= x


@compiled
def held_alone(arrays, r, out, reaction):  # type: ignore[no-untyped-def]
    """out becomes G r, and reaction Yᵀ r, for what is not compiled."""
    held(arrays[0], r, out, reaction, True)
    add_answer(arrays, 0, reaction[:0], out)
