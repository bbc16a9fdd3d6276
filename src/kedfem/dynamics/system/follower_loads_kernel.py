"""Loads that rotate with bodies in a step, compiled by numba; `forces.follower_loads` has the formulas."""

import numpy as np

from kedfem.compiled import inner

TURNS = 30


@inner
def add_follower_loads(loads, bodies, R, amounts, u, f, frame):  # type: ignore[no-untyped-def]
    """Subtract loads from internal forces f (N,), world components, of bodies displaced by u (N,).

    Parameters
    ----------
    R : (M, 3, 3) of the rigid-body motion
    frame : (3, 3) room
    """
    if loads is None:
        return
    for w in range(len(loads.body)):
        if amounts[w] == 0.0:
            continue
        i = loads.body[w]
        first, n, d = bodies.at[i], bodies.functions[i], bodies.components[i]
        shown_frame(loads, bodies, w, R[bodies.motion[i]], u, frame)
        amount, share, along = amounts[w], 0.0, 0.0
        for b in range(3):
            along += abs(loads.axis[w, b])
            for m in range(3):
                share += loads.fixed[w, b] * frame[b, m] * loads.axis[w, m]
        if along > 0.0:
            amount *= share
        at = loads.force_at[w]
        if loads.planar_beam[w]:
            d = 2
            for x in range(n):
                f[first + 2 * n + x] -= amount * loads.force[at + 2 * n + x]
        for b in range(d):
            for m in range(d):
                p = amount * frame[b, m]
                for x in range(n):
                    f[first + b * n + x] -= p * loads.force[at + m * n + x]


@inner
def shown_frame(loads, bodies, w, R, u, frame):  # type: ignore[no-untyped-def]
    """frame becomes the rotation by which load w has rotated, from the reference position to the world."""
    i, at = loads.body[w], loads.shown_at[w]
    first, n, d = bodies.at[i], bodies.functions[i], bodies.components[i]
    for b in range(3):
        for m in range(3):
            frame[b, m] = 0.0
    if loads.planar_beam[w]:
        angle = 0.0
        for x in range(n):
            angle += loads.shown[at + x] * u[first + 2 * n + x]
        c, s = np.cos(angle), np.sin(angle)
        for b in range(2):
            frame[b, 0], frame[b, 1] = R[b, 0] * c + R[b, 1] * s, R[b, 1] * c - R[b, 0] * s
        frame[2, 2] = 1.0
        return
    for m in range(3):
        for b in range(3):
            y = 0.0
            for k in range(3):
                y += R[b, k] * loads.drawn[w, m, k]
            if b < d:
                for x in range(n):
                    y += loads.shown[at + m * n + x] * u[first + b * n + x]
            frame[b, m] = y
    rotated(frame)


@inner
def rotated(A):  # type: ignore[no-untyped-def]
    """A = Q U becomes its rotation Q: by Newton, from (A + cof A) / 2, which has the same one, of rank two as well."""
    det = 1.0
    for turn in range(TURNS):
        C = (crossed(A, 1, 2), crossed(A, 2, 0), crossed(A, 0, 1))
        if turn > 0:
            det = A[0, 0] * C[0][0] + A[0, 1] * C[0][1] + A[0, 2] * C[0][2]
        size = 0.0
        for b in range(3):
            for m in range(3):
                change = (C[b][m] / det - A[b, m]) / 2
                size = max(size, abs(change))
                A[b, m] += change
        if size <= 1e-8:  # the next, quadratically smaller, is rounding
            break


@inner
def crossed(A, i, j):  # type: ignore[no-untyped-def]
    """Row i × row j."""
    return (
        A[i, 1] * A[j, 2] - A[i, 2] * A[j, 1],
        A[i, 2] * A[j, 0] - A[i, 0] * A[j, 2],
        A[i, 0] * A[j, 1] - A[i, 1] * A[j, 0],
    )
