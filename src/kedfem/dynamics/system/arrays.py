"""What a step works on, as flat arrays with names: bodies, ends, constraints, the state, and what a march leaves behind.

Bodies are solved in coordinates in which their mass is one, component first: all x, then all y. Arrays hold all bodies
one after the other; `at` says where each begins.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Int

from kedfem.dynamics.metric import Elements


def ends_of(sizes: Sequence[int]) -> Int[np.ndarray, " _"]:
    """Where each of some arrays begins that stand one after the other, and where the last ends."""
    return np.concatenate([[0], np.cumsum(np.array(sizes, int))])


class Coefficients(NamedTuple):
    """Of one member of generalised-α at a fixed step, and of Rayleigh damping.

    c_M [1/s²], c_K [-] : of A = c_M M + c_K K0
    acceleration, rate : (3,) Newmark's formulas, see `dynamics.stepping.scheme`
    h, late, early : step, h γ, h (1 − γ) [s]
    alpha [1/s], beta [s] : C0 = α M + β K0
    tolerance, floor : change of a pass, of what a step moves and at least [-, kg^½ m]
    weight : of interface unknowns beside coordinates [kg^½]
    single : whether all is linear, so that one pass solves a step
    """

    c_M: float
    c_K: float
    alpha_m: float
    alpha_f: float
    acceleration: Any
    rate: Any
    h: float
    late: float
    early: float
    alpha: float
    beta: float
    tolerance: float
    floor: float
    weight: float
    single: bool


class Beams(NamedTuple):
    """Planar beams with strains at points, as `beams_kernel` takes them."""

    segment: Any
    body: Any
    at: Any
    stride: Any
    rows: Any
    tangent: Any
    rigidity: Any


class TurningLoads(NamedTuple):
    """Loads that turn with bodies, as directions shown by the body turn; see `turning_loads`.

    body, at : (w,) number, and where its coordinates' share of `force` and twice its functions' of `shown` begin
    planar_beam : (w,) whether an angle shows how it turns
    drawn : (w, 2, 3) the directions as drawn; shown : weights of functions on what they move by
    force : on the body's coordinates, components along the directions' frame
    axis, fixed : (w, 3) in that frame and in the world, whose product a load's amount has for a factor; zero: none
    """

    body: Any
    force_at: Any
    shown_at: Any
    planar_beam: Any
    drawn: Any
    shown: Any
    force: Any
    axis: Any
    fixed: Any


class Stresses(NamedTuple):
    """Stress stiffness k g P of links with geometric stiffening, see `stresses`.

    at : (i + 1,) where the entries of k of each begin; P : (i, 3, 3) what they act on of components
    row_at, row, column_at, column : of sparse bodies k's pattern, row by row
    """

    at: Any
    P: Any
    row_at: Any
    row: Any
    column_at: Any
    column: Any


class Masses(NamedTuple):
    """Matrices of sparse bodies, whose coordinates are nodal: of components, row by row, one after the other.

    of : (i, 3) number of the matrix of each component; at : where its rows' ends begin in `row`
    """

    of: Any
    at: Any
    row: Any
    column: Any
    value: Any


class Bodies(NamedTuple):
    """All bodies as flat arrays, constant; i counts bodies.

    at : (i + 1,) where the coordinates of each begin; functions, components : n and d; motion : number in the linkage
    frame, kind : NOMINAL, STRESSED, COROTATIONAL or TANGENTIAL; as `frames_kernel` counts kinds
    dense : whether G is here; else a sparse factor gives G r and Yᵀ r, coordinates are nodal and `mass` counts
    passed : where its coordinates stand among those that passes change, −1 if none
    port_at : (i + 1,) held components q; component : of each; group_at : (i + 2...) where interface points begin
    G, Y, W : N × N, q × N, q × N of each, in `G_at`, `Y_at`; S, B : q × q and q × c, in `S_at`, `B_at`
    column_at, columns : interface unknowns that each body knows; first : profile of their common matrix
    X, one, fit : coordinates of position and of unity, and the frames' weights; K : N × N of co-rotational ones
    beams : those that know their strains at points; elements : of beams in space, whose strains need no frame
    turning : loads that turn with bodies
    stiffness : K0 of sparse co-rotational bodies, row by row, the number of its matrix first in `of`
    size : √ of the mass that a coordinate of a body counts with where passes are judged: one of dense ones [kg^½]
    """

    at: Any
    functions: Any
    components: Any
    motion: Any
    frame: Any
    kind: Any
    dense: Any
    passed: Any
    port_at: Any
    component: Any
    group: Any
    G_at: Any
    Y_at: Any
    S_at: Any
    B_at: Any
    G: Any
    Y: Any
    W: Any
    S: Any
    B: Any
    column_at: Any
    columns: Any
    first: Any
    X: Any
    one: Any
    fit: Any
    K: Any
    beams: Beams
    elements: Elements
    mass: Masses
    turning: TurningLoads
    stiffness: Masses
    size: Any
    stresses: Stresses


class Ends(NamedTuple):
    """All ends as flat arrays; see `End`.

    line, line_at, full_at, full : ends on lines of slots, where their stations' weights begin, and what these stations
        have of z: a step makes `onto` of them
    """

    body: Any
    form: Any
    origin: Any
    directions: Any
    lengths: Any
    known: Any
    components: Any
    column_at: Any
    columns: Any
    onto_at: Any
    onto: Any
    line: Any
    line_at: Any
    full_at: Any
    full: Any


class Constraints(NamedTuple):
    """All constraints and laws as flat arrays; terms stand in order of their constraints.

    term_at : (r + 1,); kind, i, j, a, a_j, b, factor : of each term
    linear, law : (r,); numbers : (r, 4) of a law; drive : (r,) whose travel is taken from the coordinate, −1: none
    over, curve_at, abscissa, period : of curves; cubics : (c, 4) from each abscissa on, as `Pieces` has them
    jumps : (r,) stops with damping, whose push begins at once: a step in which it does is divided
    """

    term_at: Any
    kind: Any
    i: Any
    j: Any
    a: Any
    a_j: Any
    b: Any
    factor: Any
    linear: Any
    law: Any
    numbers: Any
    drive: Any
    over: Any
    curve_at: Any
    abscissa: Any
    cubics: Any
    period: Any
    jumps: Any


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

    r : (N,) right-hand sides or residuals in the bodies' frames; held : (N,) G r of sparse bodies
    reaction, w, force : (q,) at their interface points
    Rp : (bodies, 3, 3) frames of the step's factor; RB, SRB : flat, as B; H : (k, k) their common matrix, then factored
    mixing : room of `mixing_kernel`
    C, CH : (r, k) gradients, and these after the first half of a solution with H; G : (r, r); target, compliance, beside,
        m, left : (r,); right, dz, part : (k,); change : what a pass asks for
    fixed, moving : places of all ends in the rigid-body motion, and at z
    base, resisted, strained : of planar beams, see `beams_kernel`
    stress : entries of the stress stiffness of all bodies
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
    H_rows: Any
    z: Any
    e: Any
    turned: Any
    C: Any
    CH: Any
    G: Any
    target: Any
    compliance: Any
    beside: Any
    pivots: Any
    m: Any
    left: Any
    right: Any
    dz: Any
    part: Any
    change: Any
    mixing: Any
    fixed: Any
    moving: Any
    stress: Any


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
