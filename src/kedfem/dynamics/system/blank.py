"""Empty states, trials, histories and working room for a system's arrays."""

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.anderson import DEPTH
from kedfem.dynamics.metric import room_for
from kedfem.dynamics.system.arrays import Bodies, Constraints, Ends
from kedfem.dynamics.system.record import RIGID_BODY
from kedfem.dynamics.system.state import History, State, Trial, Work


def empty_state(bodies: Bodies, of: Constraints) -> State:
    """A state of zeros, frames in the reference position."""
    N, L, k, r = int(bodies.at[-1]), len(bodies.motion), len(bodies.place), len(of.law)
    b, _, E = bodies.beams.tangent.shape
    moving = sum(int(n) for n, at in zip(np.diff(bodies.at), bodies.passed, strict=True) if at >= 0) + k
    direction = np.zeros((b, 2, E))
    direction[:] = bodies.beams.tangent
    return State(
        time=np.zeros(1), u=np.zeros(N), v=np.zeros(N), a=np.zeros(N), F=np.zeros(N), f=np.zeros(N),
        damped=np.zeros(3 * N), momentum=np.zeros(3 * N), seen=np.zeros(3 * N),
        Q=np.tile(np.eye(3), (L, 1, 1)), angle=np.zeros(L),
        strain=np.zeros((3, b, 3, E)), direction=direction, turn=np.zeros((b, E)),
        port_force=np.zeros(int(bodies.port_at[-1])), z=np.zeros((3, k)), e=np.zeros((3, r)),
        turned=np.zeros(len(of.kind)), bearing=np.zeros(k), multiplier=np.zeros(r), pairs=np.zeros((2, DEPTH, moving)),
        products=np.zeros((DEPTH, DEPTH)), last=np.zeros((2, moving)), counts=np.zeros(4), passes=np.zeros(3),
    )  # fmt: skip


def empty_trial(bodies: Bodies, ends: Ends, of: Constraints, like: State) -> Trial:
    """Room for the end of a step."""
    L, k, r, E = len(bodies.motion), len(bodies.place), len(of.law), len(ends.form)
    b, _, points = bodies.beams.tangent.shape
    q, B, size = int(bodies.port_at[-1]), int(bodies.B_at[-1]), int(bodies.row_at[-1])
    place = (np.zeros((E, 3)), *np.zeros((3, E, 3, 3)), np.zeros((len(ends.knots), 3)))
    return Trial(
        u=like.u.copy(), f=like.u.copy(), damped=like.damped.copy(), seen=like.seen.copy(), Q=like.Q.copy(),
        angle=like.angle.copy(), base=np.zeros((b, 4, points)), resisted=np.zeros((b, 3, points)),
        strained=np.zeros((b, 6, points)), r=like.u.copy(), held=like.u.copy(),
        reaction=np.zeros(q), w=np.zeros(q), force=np.zeros(q),
        Rp=np.zeros((L, 3, 3)), RB=np.zeros(B), SRB=np.zeros(B), H=np.zeros(size), K=np.zeros(size),
        inverse=np.zeros(k + r), x=np.zeros(k + r), z=np.zeros(k), e=np.zeros(r), turned=like.turned.copy(),
        C=np.zeros(len(of.columns)), target=np.zeros(r), compliance=np.zeros(r), beside=np.zeros(r), m=np.zeros(r),
        right=np.zeros(k), dz=np.zeros(k), row=np.zeros(k),
        change=np.zeros(like.last.shape[1]), mixing=np.zeros((DEPTH + 1, DEPTH)),
        fixed=place, moving=tuple(x.copy() for x in place), stress=np.zeros(int(bodies.stresses.at[-1])),
        response=np.zeros(len(like.u)), foreseen=np.zeros(len(like.u)),
    )  # fmt: skip


def room(bodies: Bodies) -> Work:
    """Room for one body or end at a time."""
    n = max(int(np.diff(bodies.at).max()), int(np.diff(bodies.port_at).max(initial=0)))
    y, turned, strained, other = np.zeros((4, n))
    points = np.zeros((5, bodies.beams.tangent.shape[2]))
    return Work(
        y, turned, strained, other, np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3), points, np.zeros(16),
        np.zeros((12, 3)), np.zeros(3), room_for(bodies.elements), np.zeros((3, 3)),
    )  # fmt: skip


def empty_history(
    T: int, bodies: Bodies, of: Constraints, F: Float[np.ndarray, "T N"] | None = None
) -> History:
    """Room for T time points; of applied forces that are known beforehand none.

    What steps write of every body is not set to zero before. It is one array, which asks for memory of the system anew
    less often than several: pages that are seen for the first time would cost half of what a small solid's steps do.
    """
    N, L, k, r = int(bodies.at[-1]), len(bodies.motion), len(bodies.place), len(of.law)
    b, _, E = bodies.beams.tangent.shape
    rows = np.empty((5 if bodies.dense.all() else 7, T, N))
    if (bodies.frame > RIGID_BODY).any():
        rows[3:] = 0.0
    u, v, a, g, Kg, *more = rows
    Mv, Cg = more or rows[:2, :0]
    forces = np.zeros((T, N)) if F is None else F
    return History(
        u, v, a, forces, g, np.zeros((T, b, 3, E)), np.zeros((T, L, 3, 3)), np.zeros((T, int(bodies.port_at[-1]))),
        np.zeros((T, L)), np.zeros((T, k)), np.zeros((T, r)), np.zeros((T, r)), np.zeros((T, r)), Kg, Mv, Cg,
    )  # fmt: skip
