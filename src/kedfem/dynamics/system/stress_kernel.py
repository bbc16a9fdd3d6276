"""Geometric stiffening of bodies with rigid-body frames, compiled by numba: k g P is part of the right-hand side.

Without such bodies `of` may be None; this module is then not compiled.
"""

from kedfem.compiled import inner
from kedfem.dynamics.system.algebra_kernel import frame_copied, rotated
from kedfem.dynamics.system.bodies_kernel import right_hand_side


@inner
def combined(of, driving, t, out):  # type: ignore[no-untyped-def]
    """out becomes the entries of k = Σ s_j k_j of all bodies at one time."""
    if of is None:
        return
    for i in range(len(of.at) - 1):
        k = out[of.at[i] : of.at[i + 1]]
        k[:] = 0.0
        for j in range(driving.terms_at[i], driving.terms_at[i + 1]):
            s, of_j = (driving.factors[t, j], driving.entries[driving.entries_at[j] : driving.entries_at[j + 1]])
            for m in range(len(k)):
                k[m] += s * of_j[m]


@inner
def stressed_begin(of, c, bodies, i, R, F, state, trial, room):  # type: ignore[no-untyped-def]
    """trial.f becomes the right-hand side of a body without its stress stiffness."""
    if of is None:
        return
    frame_copied(R, trial.Rp[i])
    right_hand_side(c, bodies, i, trial.Rp[i], F, state, trial.f, room)


@inner
def stressed_side(of, c, bodies, i, trial, work):  # type: ignore[no-untyped-def]
    """trial.r becomes the right-hand side, k g P taken from it at trial.u."""
    if of is None:
        return
    first, last = bodies.at[i], bodies.at[i + 1]
    N, share = last - first, 1 - c.alpha_f
    rotated(trial.Rp[i].T, bodies.components[i], trial.u[first:last], work.y[:N])
    work.strained[:N] = 0.0
    add_stress(of, bodies, i, trial.stress, work.y, work.rotated, work.strained)
    for x in range(N):
        trial.r[first + x] = trial.f[first + x] - share * work.strained[x]


@inner
def stressed_end(of, bodies, i, trial, state, g, work):  # type: ignore[no-untyped-def]
    """The internal force gets k g P."""
    if of is None:
        return
    first, last = bodies.at[i], bodies.at[i + 1]
    N = last - first
    work.strained[:N] = 0.0
    add_stress(of, bodies, i, trial.stress, g[first:last], work.rotated, work.strained)
    rotated(trial.Rp[i], bodies.components[i], work.strained[:N], work.y[:N])
    for x in range(N):
        state.f[first + x] += work.y[x]


@inner
def add_stress(of, bodies, i, entries, g, room, out):  # type: ignore[no-untyped-def]
    """out + k g P of body i."""
    n, d = bodies.functions[i], bodies.components[i]
    P, k, row = of.P[i], entries[of.at[i] : of.at[i + 1]], room[:n]
    for b in range(d):
        row[:] = 0.0
        present = False
        for c in range(d):
            if P[c, b] != 0.0:
                present, component = True, g[c * n : (c + 1) * n]
                for j in range(n):
                    row[j] += P[c, b] * component[j]
        if present:
            scalar_times(of, i, bodies.dense[i], k, row, out[b * n : (b + 1) * n])


@inner
def scalar_times(of, i, dense, k, x, out):  # type: ignore[no-untyped-def]
    """out + k x, k (n, n) full or of the body's sparsity pattern."""
    n = len(x)
    for a in range(n):
        total = 0.0
        if dense:
            row = k[a * n : (a + 1) * n]
            for j in range(n):
                total += row[j] * x[j]
        else:
            first, last = of.row[of.row_at[i] + a], of.row[of.row_at[i] + a + 1]
            columns, values = of.column[of.column_at[i] + first : of.column_at[i] + last], k[first:last]
            for m in range(len(values)):
                total += values[m] * x[columns[m]]
        out[a] += total
