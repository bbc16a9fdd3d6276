"""Ends of constraints, compiled by numba: position and orientation from the interface unknowns, and forces on these.

The orientation of a coupling surface is the rotation Q of A = Σ D_k ⊗ e_k = Q U, with its directions D_k now and e_k
in the reference position. If two directions of a surface are known, the third is its normal. With G = tr(U) 1 − U a
moment τ on Q is

    τ · ω = Σ q_k · δD_k,   q_k = Q (t × e_k),   t = G⁻¹ Qᵀ τ

Without lines of slots `ends.knots` may be None; the functions of lines are then not compiled.

    place : x (E, 3), Q (E, 3, 3), D (E, 3, 3), U (E, 3, 3) of all ends; X (n, 3) of the stations of all lines
"""

import numpy as np

from kedfem.compiled import inner
from kedfem.dynamics.frames_kernel import rodrigues, turn_of
from kedfem.dynamics.system.algebra_kernel import frame_copied
from kedfem.dynamics.system.record import FACE, PLANAR, PLANAR_BEAM, POINT, RIGID

TURNS = 30


@inner
def cross(a, b, out):  # type: ignore[no-untyped-def]
    """out becomes a × b."""
    out[0], out[1], out[2] = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inner
def dot(a, b):  # type: ignore[no-untyped-def]
    """a · b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inner
def triple(a, b, c):  # type: ignore[no-untyped-def]
    """a · (b × c)."""
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])


@inner
def times(R, x, out):  # type: ignore[no-untyped-def]
    """out becomes R x."""
    for m in range(3):
        out[m] = R[m, 0] * x[0] + R[m, 1] * x[1] + R[m, 2] * x[2]


@inner
def times_transposed(R, x, out):  # type: ignore[no-untyped-def]
    """out becomes Rᵀ x."""
    for m in range(3):
        out[m] = R[0, m] * x[0] + R[1, m] * x[1] + R[2, m] * x[2]


@inner
def placed(ends, R, p, z, place, y, w):  # type: ignore[no-untyped-def]
    """Where all ends are at the interface displacement z.

    Parameters
    ----------
    R, p : (M, 3, 3), (M, 3) of all bodies of the linkage
    y, w : (16,), (12, 3) room
    """
    x, Q, D, U, X = place
    for e in range(len(ends.form)):
        body, form, d = ends.body[e], ends.form[e], ends.components[e]
        times(R[body], ends.origin[e], w[0])
        for m in range(3):
            x[e, m] = p[body, m] + w[0, m]
        frame_copied(R[body], Q[e])
        if form == RIGID:
            continue
        moved(ends, e, z, y)
        for m in range(2 if form == PLANAR_BEAM else d):
            x[e, m] += y[m]
        if form == PLANAR_BEAM:
            w[0, 0], w[0, 1], w[0, 2] = 0.0, 0.0, y[2]
            rodrigues(w[0], Q[e], U[e])
        elif form != POINT:
            directed(ends, e, R[body], y, D[e], w[0])
            oriented(ends.directions[e], D[e], Q[e], U[e], w)
    stationed(ends.knots, ends, R, p, z, X, w)


@inner
def stationed(knots, ends, R, p, z, X, w):  # type: ignore[no-untyped-def]
    """X becomes the positions of the stations of all lines whose pins are where both links are."""
    if knots is None:
        return
    for n in range(len(ends.line)):
        if ends.free[n]:
            body = ends.body[ends.line[n]]
            on_line(ends, n, R[body], p[body], z, X, w)


@inner
def on_line(ends, n, R, p, z, X, w):  # type: ignore[no-untyped-def]
    """The same of line n."""
    e, first, at = ends.line[n], ends.line_at[n], ends.full_at[n]
    d, column, c = ends.components[e], ends.column_at[e], ends.column_at[e + 1] - ends.column_at[e]
    for k in range(first, ends.line_at[n + 1]):
        for m in range(3):
            w[0, m] = ends.origin[e, m] + (ends.knots[k] - ends.knots[first]) * ends.axis[n, m]
        times(R, w[0], X[k])
        for m in range(3):
            X[k, m] += p[m]
        for m in range(d):
            for o in range(c):
                X[k, m] += ends.full[at + o] * z[ends.columns[column + o]]
            at += c


@inner
def on_lines(knots, ends, weights):  # type: ignore[no-untyped-def]
    """`onto` of ends on lines becomes what is at their pins, from the weights (n,) of all stations."""
    if knots is None:
        return
    for n in range(len(ends.line)):
        at = ends.onto_at[ends.line[n]]
        size = ends.onto_at[ends.line[n] + 1] - at
        for m in range(size):
            ends.onto[at + m] = 0.0
        for p in range(ends.line_at[n], ends.line_at[n + 1]):
            of = ends.full_at[n] + (p - ends.line_at[n]) * size
            for m in range(size):
                ends.onto[at + m] += weights[p] * ends.full[of + m]


@inner
def unmoved(ends, of, driving, t, trial, work):  # type: ignore[no-untyped-def]
    """trial.fixed becomes where ends are in the rigid-body motion, for coordinates that are linear there."""
    if of is None:
        return
    if of.linear.any():
        on_lines(ends.knots, ends, driving.stations[t])
        placed(ends, driving.R[t], driving.p[t], trial.row, trial.fixed, work.end, work.vectors)


@inner
def moved(ends, e, z, y):  # type: ignore[no-untyped-def]
    """y becomes the displacements of an end's interface points, one after the other."""
    first, last = ends.column_at[e], ends.column_at[e + 1]
    at, c = ends.onto_at[e], ends.column_at[e + 1] - ends.column_at[e]
    for r in range(ends.components[e] * (ends.known[e] + 1)):  # also of an end without unknowns
        y[r] = 0.0
        for m in range(first, last):
            y[r] += ends.onto[at + r * c + m - first] * z[ends.columns[m]]


@inner
def directed(ends, e, R, y, D, w):  # type: ignore[no-untyped-def]
    """D becomes the directions of a surface: the known ones from its points, the others completed."""
    form, d, known = ends.form[e], ends.components[e], ends.known[e]
    for k in range(known):
        times(R, ends.directions[e, k], D[k])
        for m in range(d):
            D[k, m] += (y[(k + 1) * d + m] - y[m]) / ends.lengths[e, k]
    if form == PLANAR:
        if known == 1:
            D[1, 0], D[1, 1], D[1, 2] = -D[0, 1], D[0, 0], 0.0
        D[2, 0], D[2, 1], D[2, 2] = 0.0, 0.0, 1.0
    if form == FACE:
        cross(D[0], D[1], w)
        size = np.sqrt(dot(w, w))
        for m in range(3):
            D[2, m] = w[m] / size


@inner
def oriented(e, D, Q, U, w):  # type: ignore[no-untyped-def]
    """Q becomes the rotation of A = Σ D_k ⊗ e_k, U = Qᵀ A: by Newton from one as near as A is to a rotation."""
    squared(D, w[4:7])
    squared(e, w[7:10])
    for b in range(3):
        for m in range(3):
            Q[b, m] = w[4, b] * w[7, m] + w[5, b] * w[8, m] + w[6, b] * w[9, m]
    for _ in range(TURNS):
        stretched(e, D, Q, U, w[0])
        w[1, 0], w[1, 1], w[1, 2] = U[2, 1] - U[1, 2], U[0, 2] - U[2, 0], U[1, 0] - U[0, 1]
        size = max(abs(w[1, 0]), abs(w[1, 1]), abs(w[1, 2]))
        if size < 1e-15:
            break
        turn_of(U, w[1])
        size = max(abs(w[1, 0]), abs(w[1, 1]), abs(w[1, 2]))
        if size > 0.5:
            for m in range(3):
                w[1, m] *= 0.5 / size
        rodrigues(w[1], Q, U)
        if size <= 1e-8:
            break
    stretched(e, D, Q, U, w[0])


@inner
def squared(D, out):  # type: ignore[no-untyped-def]
    """out becomes a right-handed triad: along D_0, in the plane of D_0 and D_1, and across both."""
    cross(D[0], D[1], out[2])
    cross(out[2], D[0], out[1])
    size, across, up = np.sqrt(dot(D[0], D[0])), np.sqrt(dot(out[1], out[1])), np.sqrt(dot(out[2], out[2]))
    for m in range(3):
        out[0, m], out[1, m], out[2, m] = D[0, m] / size, out[1, m] / across, out[2, m] / up


@inner
def stretched(e, D, Q, U, w):  # type: ignore[no-untyped-def]
    """U becomes Qᵀ Σ D_k ⊗ e_k."""
    for b in range(3):
        for m in range(3):
            U[b, m] = 0.0
    for k in range(3):
        times_transposed(Q, D[k], w)
        for b in range(3):
            for m in range(3):
                U[b, m] += w[b] * e[k, m]


@inner
def borne(ends, e, force, moment, factor, rigid_motion, place, row, y, w):  # type: ignore[no-untyped-def]
    """Add to a row on z a force and a moment on an end, both times a factor.

    Parameters
    ----------
    rigid_motion : R (M, 3, 3), v and ω (M, 3) of all bodies of the linkage

    Returns
    -------
    Their power in the rigid-body motion, z constant
    """
    R, v, omega = rigid_motion
    form, d, body = ends.form[e], ends.components[e], ends.body[e]
    times(R[body], ends.origin[e], w[0])
    cross(omega[body], w[0], w[1])
    power = dot(force, w[1]) + dot(force, v[body])
    if form in (RIGID, POINT, PLANAR_BEAM):
        power += dot(moment, omega[body])
    if form == RIGID:
        return factor * power
    first, c = ends.column_at[e], ends.column_at[e + 1] - ends.column_at[e]
    at = ends.onto_at[e]
    rows = (ends.onto_at[e + 1] - at) // max(c, 1)
    for r in range(rows):
        y[r] = 0.0
    for m in range(2 if form == PLANAR_BEAM else d):
        y[m] = force[m]
    if form == PLANAR_BEAM:
        y[2] = moment[2]
    elif form != POINT:
        power += turning(ends, e, moment, R[body], omega[body], place, y, w)
    for r in range(rows):
        if y[r] != 0.0:
            for m in range(c):
                row[ends.columns[first + m]] += factor * y[r] * ends.onto[at + r * c + m]
    return factor * power


@inner
def turning(ends, e, moment, R, omega, place, y, w):  # type: ignore[no-untyped-def]
    """Add to forces y at an end's points those that a moment on its orientation is; its power in the rigid-body
    motion."""
    form, d, known = ends.form[e], ends.components[e], ends.known[e]
    Q, D = place[1][e], place[2][e]
    times_transposed(Q, moment, w[0])
    turn_of(place[3][e], w[0])
    for k in range(3):
        cross(w[0], ends.directions[e, k], w[3])
        times(Q, w[3], w[k + 1] if k < 2 else w[0])
    q1, q2, q3 = w[1], w[2], w[0]
    if form == PLANAR and known == 1:
        q1[0] += q2[1]
        q1[1] -= q2[0]
    if form == FACE:
        n = D[2]
        cross(D[0], D[1], w[3])
        size = np.sqrt(dot(w[3], w[3]))
        cross(D[1], n, w[3])
        share = dot(q3, w[3]) / size
        for m in range(3):
            q1[m] -= share * n[m]
        cross(n, D[0], w[3])
        share = dot(q3, w[3]) / size
        for m in range(3):
            q2[m] -= share * n[m]
    power = 0.0
    for k in range(known):
        q = q1 if k == 0 else (q2 if k == 1 else q3)
        times(R, ends.directions[e, k], w[3])
        power += triple(q, omega, w[3])
        for m in range(d):
            x = q[m] / ends.lengths[e, k]
            y[(k + 1) * d + m] += x
            y[m] -= x
    return power
