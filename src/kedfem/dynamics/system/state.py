"""What changes as a system moves: its state, histories, and what a step works on."""

from typing import Any, NamedTuple


class State(NamedTuple):
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

    time: Any
    u: Any
    v: Any
    a: Any
    F: Any
    f: Any
    damped: Any
    momentum: Any
    seen: Any
    Q: Any
    angle: Any
    strain: Any
    direction: Any
    turn: Any
    port_force: Any
    z: Any
    e: Any
    turned: Any
    bearing: Any
    multiplier: Any
    pairs: Any
    products: Any
    last: Any
    counts: Any
    passes: Any


def copied(state: State) -> State:
    """A state of its own arrays."""
    return State(*(x.copy() for x in state))


class History(NamedTuple):
    """What a march records at each of T times; as in `State`, and R (T, bodies, 3, 3) the frames, link to world.

    g : (T, N) deformation; strain : (T, beams, 3, points) of planar beams; energy : (T, bodies) ½ gᵀ K0 g [J]
    Kg : (T, N) K0 g of bodies with rigid-body frames
    Mv, Cg : (T, N) M δ' in world components and C0 g of sparse ones among them, (0, N) without any
    """

    u: Any
    v: Any
    a: Any
    F: Any
    g: Any
    strain: Any
    R: Any
    port_force: Any
    energy: Any
    z: Any
    e: Any
    multiplier: Any
    rate: Any
    Kg: Any
    Mv: Any
    Cg: Any


class Driving(NamedTuple):
    """The rigid-body motion and loads over T times.

    t : (T,); R, p : (T, M, 3, 3), (T, M, 3) of all bodies of the linkage; v, omega : (T, M, 3) their rates
    drives : (T, D)
    F : (T, N) P − M R0'' on the coordinates, world components; amounts : (T, w) of loads that turn with bodies
    stations : (T, n) weights of the stations of all lines, where their pins are
    stiffness_factors : (T, r) what the stiffness of each law is multiplied by
    factors : (T, m) of the terms of stress stiffness; terms_at : (i + 1,) where those of each body begin
    entries_at, entries : (m + 1,) where the entries of each term begin
    """

    t: Any
    R: Any
    p: Any
    v: Any
    omega: Any
    drives: Any
    F: Any
    amounts: Any
    stations: Any
    stiffness_factors: Any
    factors: Any
    terms_at: Any
    entries_at: Any
    entries: Any


class Trial(NamedTuple):
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

    u: Any
    f: Any
    damped: Any
    seen: Any
    Q: Any
    angle: Any
    base: Any
    resisted: Any
    strained: Any
    r: Any
    held: Any
    reaction: Any
    w: Any
    force: Any
    Rp: Any
    RB: Any
    SRB: Any
    H: Any
    K: Any
    inverse: Any
    x: Any
    z: Any
    e: Any
    turned: Any
    C: Any
    target: Any
    compliance: Any
    beside: Any
    m: Any
    right: Any
    dz: Any
    row: Any
    change: Any
    mixing: Any
    fixed: Any
    moving: Any
    stress: Any
    response: Any
    foreseen: Any


class Work(NamedTuple):
    """Room for one body or end at a time."""

    y: Any
    turned: Any
    strained: Any
    room: Any
    A: Any
    U: Any
    change: Any
    points: Any
    end: Any
    vectors: Any
    law: Any
    element: Any
    frame: Any
