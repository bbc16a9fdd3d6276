"""Variables of a system: its state, histories and the work arrays of a step, and functions that allocate them."""

from collections import namedtuple

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.anderson import DEPTH
from kedfem.dynamics.metric import room_for
from kedfem.dynamics.system.arrays import Bodies, Constraints, Ends
from kedfem.dynamics.system.record import RIGID_BODY


class State(namedtuple("State", (
    "time u v a F f damped momentum seen Q angle strain direction turn port_force z e term_angles bearing "
    "multiplier pairs products last counts passes"
))):  # fmt: skip
    """Everything that a step remembers, flat and with names; N coordinates, k interface unknowns, r constraints.

    time : (1,) [s]
    u, v, a : (N,) δ, δ', δ'' in coordinates, world components
    F, f : (N,) applied and internal force, world components
    damped : (3, N) damping force without its rate, and its rates, in the rigid-body frame
    momentum : (3, N) of sparse bodies M δ, M δ', M δ'' in world components
    seen : (3, N) of co-rotational bodies the deformation g and its rates
    Q, angle : (bodies, 3, 3), (bodies,) frames' rotation in the rigid-body one; of planar bodies its angle, with turns
    strain, direction, turn : of planar beams at their points, see `beams_kernel`
    port_force : (q,) force on each body at its interface points, world components
    z : (3, k) interface unknowns and their rates
    e : (3, r) coordinates and their rates; term_angles : (terms,) counting revolutions
    bearing : (k,) force of all constraints and laws on z; multiplier : (r,) force along each
    pairs, products, last, counts : Anderson acceleration's memory, see `anderson_kernel`
    passes : (3,) taken so far, steps whose tolerance was eased, largest in a step
    """


def copied(state: State) -> State:
    """A state of its own arrays."""
    return State(*(x.copy() for x in state))


class History(namedtuple("History", "u v a F g strain R port_force energy z e multiplier rate Kg Mv Cg")):
    """What a march records at each of T times; as in `State`, and R (T, bodies, 3, 3) the frames, link to world.

    g : (T, N) deformation; strain : (T, beams, 3, points) of planar beams; energy : (T, bodies) ½ gᵀ K0 g [J]
    Kg : (T, N) K0 g of bodies with rigid-body frames
    Mv, Cg : (T, N) M δ' in world components and C0 g of sparse ones among them, (0, N) without any
    """


class Driving(namedtuple("Driving", (
    "t R p v omega drives F amounts stations stiffness_factors factors terms_at entries_at entries"
))):  # fmt: skip
    """The rigid-body motion and loads over T times.

    t : (T,); R, p : (T, M, 3, 3), (T, M, 3) of all bodies of the linkage; v, omega : (T, M, 3) their rates
    drives : (T, D)
    F : (T, N) P − M R0'' on the coordinates, world components; amounts : (T, w) of follower loads
    stations : (T, n) weights of the stations of all lines, where their pins are
    stiffness_factors : (T, r) what the stiffness of each law is multiplied by
    factors : (T, m) of the terms of stress stiffness; terms_at : (i + 1,) where those of each body begin
    entries_at, entries : (m + 1,) where the entries of each term begin
    """


class Trial(namedtuple("Trial", (
    "u f damped seen Q angle base resisted strained r held reaction w force Rp RB SRB H K inverse x z e term_angles "
    "C target compliance beside m right dz known row change memory fixed moving stress response foreseen"
))):  # fmt: skip
    """The end of a step while it is sought; arrays as in `State`.

    r : (N,) right-hand sides or residuals in the bodies' frames; held : (N,) Ã⁻¹ r of sparse bodies
    reaction, w, force : (q,) at their interface points
    Rp : (bodies, 3, 3) frames of the step's factor; RB, SRB : flat, as B and its transpose; H : their common matrix, by
        its profile
    memory : room of `anderson_kernel`
    C : gradients on what each constraint couples, in `columns`; target, compliance, beside, m : (r,); right, dz : (k,)
    known : room for the interface unknowns that one body knows, or what it exerts on them
    K, inverse, x : H with constraints in it, factored, the inverse of its pivots, and what is solved for
    row : (k,) room for one gradient, zero between; change : what a pass asks for
    fixed, moving : places of all ends in the rigid-body motion, and at z
    base, resisted, strained : of planar beams, see `beams_kernel`
    stress : entries of the stress stiffness of all bodies
    response, foreseen : (N,) K (g + β g') of rigid bodies, as it is and as the pass before foresaw it, in their frames
    """


class Work(namedtuple("Work", "y rotated strained room A U change points end vectors law element frame")):
    """Room for one body or end at a time."""


def empty_state(bodies: Bodies, of: Constraints) -> State:
    """A state of zeros, frames in the reference position."""
    N, L, k, r = int(bodies.at[-1]), len(bodies.motion), len(bodies.place), len(of.law)
    b, _, E = bodies.beams.tangent.shape
    moving = sum(int(n) for n, at in zip(np.diff(bodies.at), bodies.passed, strict=True) if at >= 0) + k
    direction = np.zeros((b, 2, E))
    direction[:] = bodies.beams.tangent
    return State(
        time=np.zeros(1), u=np.zeros(N), v=np.zeros(N), a=np.zeros(N), F=np.zeros(N), f=np.zeros(N),
        damped=np.zeros((3, N)), momentum=np.zeros((3, N)), seen=np.zeros((3, N)),
        Q=np.tile(np.eye(3), (L, 1, 1)), angle=np.zeros(L),
        strain=np.zeros((3, b, 3, E)), direction=direction, turn=np.zeros((b, E)),
        port_force=np.zeros(int(bodies.port_at[-1])), z=np.zeros((3, k)), e=np.zeros((3, r)),
        term_angles=np.zeros(len(of.kind)), bearing=np.zeros(k), multiplier=np.zeros(r),
        pairs=np.zeros((2, DEPTH, moving)), products=np.zeros((DEPTH, DEPTH)), last=np.zeros((2, moving)),
        counts=np.zeros(4), passes=np.zeros(3),
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
        inverse=np.zeros(k + r), x=np.zeros(k + r), z=np.zeros(k), e=np.zeros(r), term_angles=like.term_angles.copy(),
        C=np.zeros(len(of.columns)), target=np.zeros(r), compliance=np.zeros(r), beside=np.zeros(r), m=np.zeros(r),
        right=np.zeros(k), dz=np.zeros(k), row=np.zeros(k),
        known=np.zeros(int(np.diff(bodies.column_at).max(initial=0))),
        change=np.zeros(like.last.shape[1]), memory=np.zeros((DEPTH + 1, DEPTH)),
        fixed=place, moving=tuple(x.copy() for x in place), stress=np.zeros(int(bodies.stresses.at[-1])),
        response=np.zeros(len(like.u)), foreseen=np.zeros(len(like.u)),
    )  # fmt: skip


def room(bodies: Bodies) -> Work:
    """Room for one body or end at a time."""
    n = max(int(np.diff(bodies.at).max()), int(np.diff(bodies.port_at).max(initial=0)))
    y, rotated, strained, other = np.zeros((4, n))
    points = np.zeros((5, bodies.beams.tangent.shape[2]))
    return Work(
        y, rotated, strained, other, np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3), points, np.zeros(16),
        np.zeros((12, 3)), np.zeros(3), room_for(bodies.elements), np.zeros((3, 3)),
    )  # fmt: skip


def empty_history(T: int, bodies: Bodies, of: Constraints, F: Float[np.ndarray, "T N"] | None = None) -> History:
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
