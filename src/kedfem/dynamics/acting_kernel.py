"""Forces of actions on the coordinates of segments, compiled by numba: gathered from their ends, and put back."""

from typing import Any

from numba import njit

from kedfem.dynamics.actions_kernel import evaluate

compiled: Any = njit(cache=True, error_model="numpy")


@compiled
def external(t, segment, weight, table, nominal, moving, turned, F, out, scratch):  # type: ignore[no-untyped-def]
    """out = F and the forces of all actions.

    Parameters
    ----------
    segment : (A, 2) of each end
    weight : (A, 2, 2, D, S) of the ends' vectors on the coordinates
    nominal : x, v (A, 2, 2, 3) of the nominal motion
    moving : u, v (L, D, S)
    turned : (A,) coordinate of each action at the time point before
    F, out : (L, D, S)
    scratch : x, v, forces (A, 2, 2, 3), values (A, 4)
    """
    x, v, forces, values = scratch
    x0, v0 = nominal
    u, u1 = moving
    out[:] = F
    A = len(segment)
    if A == 0:
        return
    D, n = F.shape[1:]
    x[:], v[:] = x0, v0
    for i in range(A):
        for e in range(2):
            s = segment[i, e]
            if s >= 0:
                for m in range(2):
                    for c in range(D):
                        for j in range(n):
                            w = weight[i, e, m, c, j]
                            x[i, e, m, c] += w * u[s, c, j]
                            v[i, e, m, c] += w * u1[s, c, j]
    evaluate(t, x, v, turned, table, forces, values)
    for i in range(A):
        for e in range(2):
            s = segment[i, e]
            if s >= 0:
                for m in range(2):
                    for c in range(D):
                        for j in range(n):
                            out[s, c, j] += weight[i, e, m, c, j] * forces[i, e, m, c]
