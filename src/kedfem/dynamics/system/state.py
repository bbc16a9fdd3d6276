"""What changes as a system moves: its state, histories, and what a step works on."""

from collections import namedtuple


class State(namedtuple("State", (
    "time u v a F f damped momentum seen Q angle strain direction turn port_force z e turned bearing "
    "multiplier pairs products last counts passes"
))):  # fmt: skip
    """Everything that a step remembers, flat and with names; N coordinates, k interface unknowns, r constraints.

    time : (1,) [s]
    u, v, a : (N,) δ, δ', δ'' in coordinates, world components
    F, f : (N,) applied and internal force, world components
    damped : (3N,) per body (3, N): damping force without its rate, and its rates, in the rigid-body frame
    momentum : (3N,) per sparse body (3, N): M δ, M δ', M δ'' in world components
    seen : (3N,) per co-rotational body (3, N): deformation g and its rates
    Q, angle : (bodies, 3, 3), (bodies,) frames' rotation in the rigid-body one; of planar bodies its angle, with turns
    strain, direction, turn : of planar beams at their points, see `beams_kernel`
    port_force : (q,) force on each body at its interface points, world components
    z : (3, k) interface unknowns and their rates
    e : (3, r) coordinates and their rates; turned : (terms,) angles, counting turns
    bearing : (k,) force of all constraints and laws on z; multiplier : (r,) force along each
    pairs, products, last, counts : Anderson acceleration's memory, see `mixing_kernel`
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
    F : (T, N) P − M R0'' on the coordinates, world components; amounts : (T, w) of loads that turn with bodies
    stations : (T, n) weights of the stations of all lines, where their pins are
    stiffness_factors : (T, r) what the stiffness of each law is multiplied by
    factors : (T, m) of the terms of stress stiffness; terms_at : (i + 1,) where those of each body begin
    entries_at, entries : (m + 1,) where the entries of each term begin
    """


class Trial(namedtuple("Trial", (
    "u f damped seen Q angle base resisted strained r held reaction w force Rp RB SRB H K inverse x z e turned "
    "C target compliance beside m right dz row change mixing fixed moving stress response foreseen"
))):  # fmt: skip
    """The end of a step while it is sought; arrays as in `State`.

    r : (N,) right-hand sides or residuals in the bodies' frames; held : (N,) Ã⁻¹ r of sparse bodies
    reaction, w, force : (q,) at their interface points
    Rp : (bodies, 3, 3) frames of the step's factor; RB, SRB : flat, as B and its transpose; H : their common matrix, by
        its profile
    mixing : room of `mixing_kernel`
    C : gradients on what each constraint couples, in `columns`; target, compliance, beside, m : (r,); right, dz : (k,)
    K, inverse, x : H with constraints in it, factored, the inverse of its pivots, and what is solved for
    row : (k,) room for one gradient, zero between; change : what a pass asks for
    fixed, moving : places of all ends in the rigid-body motion, and at z
    base, resisted, strained : of planar beams, see `beams_kernel`
    stress : entries of the stress stiffness of all bodies
    response, foreseen : (N,) K (g + β g') of rigid bodies, as it is and as the pass before foresaw it, in their frames
    """


class Work(namedtuple("Work", "y turned strained room A U change points end vectors law element frame")):
    """Room for one body or end at a time."""
