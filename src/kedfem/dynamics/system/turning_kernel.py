"""Loads that turn with bodies in a step, compiled by numba; `turning_loads` has the formulas."""

import numpy as np

from kedfem.compiled import inner


@inner
def turned_loads(loads, bodies, R, amounts, u, f, frame):  # type: ignore[no-untyped-def]
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
        first, n, turned = bodies.at[i], bodies.functions[i], bodies.components[i]
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
            turned = 2
            for x in range(n):
                f[first + 2 * n + x] -= amount * loads.force[at + 2 * n + x]
        for b in range(turned):
            for m in range(turned):
                p = amount * frame[b, m]
                for x in range(n):
                    f[first + b * n + x] -= p * loads.force[at + m * n + x]


@inner
def shown_frame(loads, bodies, w, R, u, frame):  # type: ignore[no-untyped-def]
    """frame becomes the axes of the directions that show how load w has turned, in columns, world components."""
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
    for m in range(2):
        for b in range(3):
            y = 0.0
            for k in range(3):
                y += R[b, k] * loads.drawn[w, m, k]
            if b < d:
                for x in range(n):
                    y += loads.shown[at + m * n + x] * u[first + b * n + x]
            frame[b, m] = y
    if d == 2:
        size = np.sqrt(frame[0, 0] * frame[0, 0] + frame[1, 0] * frame[1, 0])
        c, s = frame[0, 0] / size, frame[1, 0] / size
        frame[0, 0], frame[1, 0], frame[0, 1], frame[1, 1], frame[2, 1], frame[2, 2] = c, s, -s, c, 0.0, 1.0
        return
    unit(frame, 0)
    across(frame, 0, 1, 2)
    unit(frame, 2)
    across(frame, 2, 0, 1)


@inner
def unit(frame, m):  # type: ignore[no-untyped-def]
    """Column m becomes of length one."""
    size = np.sqrt(frame[0, m] ** 2 + frame[1, m] ** 2 + frame[2, m] ** 2)
    for b in range(3):
        frame[b, m] /= size


@inner
def across(frame, i, j, k):  # type: ignore[no-untyped-def]
    """Column k becomes column i × column j."""
    frame_0 = frame[1, i] * frame[2, j] - frame[2, i] * frame[1, j]
    frame_1 = frame[2, i] * frame[0, j] - frame[0, i] * frame[2, j]
    frame_2 = frame[0, i] * frame[1, j] - frame[1, i] * frame[0, j]
    frame[0, k], frame[1, k], frame[2, k] = frame_0, frame_1, frame_2
