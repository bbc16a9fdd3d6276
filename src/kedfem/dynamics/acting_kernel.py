"""Forces of actions on the coordinates of segments, compiled by numba: gathered from their ends, and put back."""

from typing import Any

from numba import njit

from kedfem.dynamics.actions_kernel import evaluate

compiled: Any = njit(cache=True, error_model="numpy")


@compiled
def external(acting, t, u, v, turned, F):  # type: ignore[no-untyped-def]
    """Add the forces of all actions to F; their coordinates.

    Parameters
    ----------
    acting : segment (A, 2) of each end; weight (A, 2, 2, D, S) of its vectors on the coordinates; table; times (T,);
        x0, v0 (T, A, 2, 2, 3) of the nominal motion; scratch: x, v, forces (A, 2, 2, 3), values (A, 4)
    t : number of the time point
    u, v, F : (L, D, S)
    turned : (A,) coordinate of each action at the time point before
    """
    segment, weight, table, times, x0, v0, x, x1, forces, values = acting
    A, (_, D, n) = len(segment), F.shape
    x[:], x1[:] = x0[t], v0[t]
    for i in range(A):
        for e in range(2):
            s = segment[i, e]
            if s >= 0:
                for m in range(2):
                    for c in range(D):
                        for j in range(n):
                            w = weight[i, e, m, c, j]
                            x[i, e, m, c] += w * u[s, c, j]
                            x1[i, e, m, c] += w * v[s, c, j]
    evaluate(times[t], x, x1, turned, table, forces, values)
    for i in range(A):
        for e in range(2):
            s = segment[i, e]
            if s >= 0:
                for m in range(2):
                    for c in range(D):
                        for j in range(n):
                            F[s, c, j] += weight[i, e, m, c, j] * forces[i, e, m, c]
    return values[:, 0]
