"""Products and rotations of a body's coordinates and of its interface points, compiled by numba."""

from kedfem.compiled import inner


@inner
def copied(x, out):  # type: ignore[no-untyped-def]
    """out becomes x, number by number: assigning arrays to each other would look whether they overlap."""
    for k in range(len(out)):
        out[k] = x[k]


@inner
def state_of(x, first, last):  # type: ignore[no-untyped-def]
    """A quantity of a body, its rate and the rate of that, of an array (3, N) of all bodies."""
    return x[0, first:last], x[1, first:last], x[2, first:last]


@inner
def frame_copied(R, out):  # type: ignore[no-untyped-def]
    """out becomes the rotation R."""
    for b in range(3):
        for m in range(3):
            out[b, m] = R[b, m]


@inner
def rotated(R, d, x, out):  # type: ignore[no-untyped-def]
    """out becomes R x for d components of coordinates; of R.T Rᵀ x."""
    n = len(x) // d
    first, second, third = x[:n], x[n : 2 * n], x[(d - 1) * n : d * n]
    for b in range(d):
        to, p, q, r = out[b * n : (b + 1) * n], R[b, 0], R[b, 1], R[b, 2]
        if d == 3:
            for j in range(n):
                to[j] = p * first[j] + q * second[j] + r * third[j]
        else:
            for j in range(n):
                to[j] = p * first[j] + q * second[j]


@inner
def rotated_ports(bodies, i, R, x, out):  # type: ignore[no-untyped-def]
    """out becomes R x for held components of interface points; the same columns of both."""
    first, last = bodies.port_at[i], bodies.port_at[i + 1]
    for q in range(first, last):
        out[q - first] = 0.0
    for q in range(first, last):
        for m in range(bodies.group[q], last):
            if bodies.group[m] != bodies.group[q]:
                break
            out[q - first] += R[bodies.component[q], bodies.component[m]] * x[m - first]


@inner
def interface_columns(bodies, i, R, RB):  # type: ignore[no-untyped-def]
    """RB (q × c, flat) becomes Rᵀ B of a body."""
    first, last = bodies.port_at[i], bodies.port_at[i + 1]
    c, at = bodies.column_at[i + 1] - bodies.column_at[i], bodies.B_at[i]
    B, group, component = bodies.B[at : bodies.B_at[i + 1]], bodies.group[first:last], bodies.component[first:last]
    reach = bodies.reach[bodies.column_at[i] : bodies.column_at[i + 1]]
    RB[:] = 0.0
    for m in range(c):
        for q in range(reach[m, 0], reach[m, 1]):
            total = 0.0
            for o in range(group[q] - first, last - first):
                if group[o] != group[q]:
                    break
                total += R[component[o], component[q]] * B[o * c + m]
            RB[q * c + m] = total


@inner
def product(A, at, rows, columns, x, out):  # type: ignore[no-untyped-def]
    """out becomes A x, A (rows × columns) flat from `at` on.

    A row is a view: of indices that are sums numba would ask whether each is negative, which takes 2.6 times as long.
    """
    for r in range(rows):
        total, row = 0.0, A[at + r * columns : at + (r + 1) * columns]
        for m in range(columns):
            total += row[m] * x[m]
        out[r] = total


@inner
def add_transposed(A, at, rows, columns, x, out):  # type: ignore[no-untyped-def]
    """out + Aᵀ x."""
    for r in range(rows):
        if x[r] != 0.0:
            row = A[at + r * columns : at + (r + 1) * columns]
            for m in range(columns):
                out[m] += x[r] * row[m]
