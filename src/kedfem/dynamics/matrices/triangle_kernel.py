"""A pair of triangular solves with a sparse Cholesky factor L, compiled by numba.

Consecutive columns with the same rows below them are a block (a supernode). Its part of a right-hand side is solved in
a separate work array, four columns at a time, so that each number there is read and written once for four of the factor.
"""

from kedfem.compiled import inner


@inner
def block_of(triangle, block, x, room):  # type: ignore[no-untyped-def]
    """A block's first column, part of x and rows below; the room of all its rows, with x in it, and of those below."""
    first, below_at, below, _, _, _ = triangle
    c, rows = first[block], below[below_at[block] : below_at[block + 1]]
    w = first[block + 1] - c
    h = w + len(rows)
    own, all_rows = x[c : c + w], room[:h]
    for j in range(w):
        all_rows[j] = own[j]
    return c, own, rows, all_rows, room[w:h]


@inner
def forward(triangle, x, room):  # type: ignore[no-untyped-def]
    """x becomes L⁻¹ x, in the factor's order."""
    first, _, _, at, L, _ = triangle
    for block in range(len(first) - 1):
        c, own, rows, all_rows, rest = block_of(triangle, block, x, room)
        w, h = len(own), len(all_rows)
        for j in range(len(rest)):
            rest[j] = 0.0
        k = 0
        while k + 4 <= w:
            p, q, r, s, end = at[c + k], at[c + k + 1], at[c + k + 2], at[c + k + 3], at[c + k + 4]
            a0, a1, a2, a3, y = L[p:q], L[q:r], L[r:s], L[s:end], room[k:h]
            x0 = y[0] * a0[0]
            x1 = (y[1] - a0[1] * x0) * a1[0]
            x2 = (y[2] - a0[2] * x0 - a1[1] * x1) * a2[0]
            x3 = (y[3] - a0[3] * x0 - a1[2] * x1 - a2[1] * x2) * a3[0]
            y[0], y[1], y[2], y[3] = x0, x1, x2, x3
            a0, a1, a2, a3, y = a0[4:], a1[3:], a2[2:], a3[1:], y[4:]
            for j in range(len(y)):
                y[j] -= a0[j] * x0 + a1[j] * x1 + a2[j] * x2 + a3[j] * x3
            k += 4
        while k < w:
            p, end = at[c + k], at[c + k + 1]
            x0 = all_rows[k] * L[p]
            all_rows[k] = x0
            a0, y = L[p + 1 : end], all_rows[k + 1 :]
            for j in range(len(y)):
                y[j] -= a0[j] * x0
            k += 1
        for j in range(w):
            own[j] = all_rows[j]
        for j in range(len(rest)):
            x[rows[j]] += rest[j]


@inner
def backward(triangle, x, room):  # type: ignore[no-untyped-def]
    """x becomes L⁻ᵀ x, in the factor's order."""
    first, _, _, at, L, _ = triangle
    for block in range(len(first) - 2, -1, -1):
        c, own, rows, all_rows, rest = block_of(triangle, block, x, room)
        w, h = len(own), len(all_rows)
        for j in range(len(rest)):
            rest[j] = x[rows[j]]
        k = w
        while k % 4:
            k -= 1
            p, end = at[c + k], at[c + k + 1]
            a0, y, y0 = L[p + 1 : end], all_rows[k + 1 :], 0.0
            for j in range(len(y)):
                y0 += a0[j] * y[j]
            all_rows[k] = (all_rows[k] - y0) * L[p]
        while k > 0:
            k -= 4
            p, q, r, s, end = at[c + k], at[c + k + 1], at[c + k + 2], at[c + k + 3], at[c + k + 4]
            a0, a1, a2, a3, y = L[p:q], L[q:r], L[r:s], L[s:end], room[k:h]
            b0, b1, b2, b3, z = a0[4:], a1[3:], a2[2:], a3[1:], y[4:]
            y0, y1, y2, y3 = y[0], y[1], y[2], y[3]
            z0, z1, z2, z3 = 0.0, 0.0, 0.0, 0.0
            for j in range(len(z)):
                z0 += b0[j] * z[j]
                z1 += b1[j] * z[j]
                z2 += b2[j] * z[j]
                z3 += b3[j] * z[j]
            x3 = (y3 - z3) * a3[0]
            x2 = (y2 - z2 - a2[1] * x3) * a2[0]
            x1 = (y1 - z1 - a1[1] * x2 - a1[2] * x3) * a1[0]
            x0 = (y0 - z0 - a0[1] * x1 - a0[2] * x2 - a0[3] * x3) * a0[0]
            y[0], y[1], y[2], y[3] = x0, x1, x2, x3
        for j in range(w):
            own[j] = all_rows[j]


@inner
def solved(triangle, b, x, room, out):  # type: ignore[no-untyped-def]
    """out becomes A⁻¹ b, both in the order that the triangle's places are of; x and room are room."""
    place = triangle[-1]
    for j in range(len(place)):
        x[j] = b[place[j]]
    forward(triangle, x, room)
    backward(triangle, x, room)
    for j in range(len(place)):
        out[place[j]] = x[j]
