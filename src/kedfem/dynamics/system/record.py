"""The record of a system: bodies, ends of constraints on them, coordinates, and the laws that these obey."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.links.stations import Stations
from kedfem.scene import Pieces

HELD, DRIVEN, SPRING, CURVE, STOP = range(5)
TIME, RATE, COORDINATE = range(3)
OVER = {"time": TIME, "speed": RATE, "angle": COORDINATE, "travel": COORDINATE, "length": COORDINATE}
GAP, TURN, ANGLE, DISTANCE, ROTATION, TILT, OFFSET, ARC = range(8)
ON_LINES = (OFFSET, ARC)  # of a pin and a line as both are
RIGID, POINT, PLANAR_BEAM, PLANAR, FACE, SOLID, LINE = range(7)
NOMINAL, STRESSED, COROTATIONAL, TANGENTIAL = range(4)
RIGID_BODY = STRESSED  # frames up to it are those of the rigid-body motion
FEET = 30  # Newton's steps to the place of a pin on its line, of which it takes 2 to 4
CLOSE = 1e-14  # of the line: a change of that place is rounding
TURNED = 1e-24  # (2 − the angle from half a turn)²: the direction across a line turned back is any

Vector = Float[np.ndarray, "3"]
Times = Float[np.ndarray, " T"]
Factor = Callable[[Times, Times], Times]


@dataclass(frozen=True, slots=True)
class Held:
    """A constraint: the coordinate is zero."""


@dataclass(frozen=True, slots=True)
class Driven:
    """A constraint: the coordinate is that of a drive, by its number."""

    drive: int


@dataclass(frozen=True, slots=True)
class Curve:
    """A force along the coordinate.

    over : TIME, RATE or COORDINATE
    force : there
    """

    over: int
    force: Pieces


@dataclass(frozen=True, slots=True)
class Spring:
    """A spring and damper: force k (e − free) + c e' against the coordinate e [N/m or N m; N s/m or N m s].

    drive : number of a drive whose travel is taken from the coordinate, as of a shaft that gives; −1: none
    factor : times (T,) and the drive's angles (T,) → what k is multiplied by (T,); none: one
    curve : a force along the coordinate beside it
    """

    stiffness: float
    damping: float = 0.0
    free: float = 0.0
    drive: int = -1
    factor: Factor | None = None
    curve: Curve | None = None


@dataclass(frozen=True, slots=True)
class Stop:
    """A one-sided limit at each end of a range: stiffness and damping beyond it, a push and never a pull."""

    lower: float
    upper: float
    stiffness: float
    damping: float = 0.0


Law = Held | Driven | Spring | Curve | Stop


def law_at(law: Law, t: Times, phi: Times) -> Law:
    """A law at one time (1,) and angle of the drive (1,)."""
    if isinstance(law, Spring) and law.factor is not None:
        return replace(law, stiffness=law.stiffness * float(law.factor(t, phi)[0]), factor=None)
    return law


def stiffness_factors(every: Sequence[Factor | None], t: Times, phi: Times) -> Float[np.ndarray, "T A"]:
    """What the stiffness of each law is multiplied by over time; one where it has no factor."""
    out = np.ones((len(t), len(every)))
    for i, factor in enumerate(every):
        if factor is not None:
            out[:, i] = factor(t, phi)
    return out


@dataclass(frozen=True, slots=True)
class Line:
    """The line of a slot on a body: its stations, its reference direction, and the body whose pin slides along it.

    at : (3,) the pin in the reference position [m]
    """

    stations: Stations
    axis: Vector
    pin: int
    at: Vector


@dataclass(frozen=True, slots=True)
class End:
    """The end of a constraint or force law on one body: a point, and the orientation of the surface there.

    body : number in the linkage
    form : RIGID: moves with the rigid-body motion; POINT: no orientation of its own; PLANAR_BEAM: (u, v, ψ) of a node;
        PLANAR, FACE, SOLID: a coupling surface of which one or two directions in a plane, two or three in space are
        known; LINE: the stations of a line, among which the pin is where the rigid-body motion shows, or for `ON_LINES`
        where both links are
    origin : (3,) its point in the reference position [m]
    directions : (3, 3) rows e_k in the reference position, of which the first `known` are followed by interface points
    lengths : (3,) how far off the origin these points are [m]
    onto : (p, d, c) displacements of the interface points, world components, from the interface unknowns z[columns]
    """

    body: int
    form: int
    origin: Vector
    directions: Float[np.ndarray, "3 3"]
    lengths: Vector
    known: int
    onto: Float[np.ndarray, "p d c"]
    columns: Int[np.ndarray, " c"]
    line: Line | None = None


@dataclass(frozen=True, slots=True)
class Term:
    """A scalar function of two ends, by their numbers: directions and points in the reference position.

    kind : GAP: b · (x_i − x_j), b fixed in j; TURN: a · b, a fixed in i; ANGLE: twist of i against j about b from a_j in
        j to a in i (see `motion.values`); DISTANCE: |x_i − x_j|; ROTATION: component along b of the rotation vector of i
        against j, less than half a turn; TILT: the same of the shortest rotation of an axis a from where it is in j to
        where it is in i; OFFSET: b · (x_i − c), c the point of the line of j, as it is, at which x_i stands square to it,
        b across it; ARC: the place of c along the line, from its station at s = 0 on, by the line's length unstrained
    a, a_j : points of i and j [m], or directions [-]
    """

    kind: int
    i: int
    j: int
    a: Vector
    a_j: Vector
    b: Vector
    factor: float = 1.0


@dataclass(frozen=True, slots=True)
class Constraint:
    """A coordinate, the sum of its terms, and the law that it obeys.

    name : of the joint or force element
    linear : whether the rigid-body motion shows its directions, so that it is linear in z; else the bodies themselves do
    """

    name: str
    terms: tuple[Term, ...]
    law: Law
    linear: bool


@dataclass(frozen=True, slots=True)
class System:
    """Bodies, ends and constraints of a mechanism, each a record of its own.

    links, joints : of the elastic model, in the order of the bodies
    names : of the bodies, for messages
    stiffening : stress modes of all links, whose geometric stiffening then counts; None without
    """

    names: tuple[str, ...]
    ends: tuple[End, ...]
    constraints: tuple[Constraint, ...]
    unknowns: int
    model: Any
    stiffening: Any = None


def curve_of(law: Law) -> Curve | None:
    """The curve that a law has, or is."""
    if isinstance(law, Spring):
        return law.curve
    return law if isinstance(law, Curve) else None


def is_affine(system: System, each: Constraint) -> bool:
    """Whether a force, or a misfit, grows with z by a constant gradient: one solution of the interface is exact.

    So does a spring along a slide on the ground: it pulls at a point, along a direction that only the rigid-body motion
    turns.
    """
    law = each.law
    curve = curve_of(law)
    known = not isinstance(law, Stop) and (curve is None or curve.over == TIME)
    return known and (each.linear or all(_at_a_point(system, term) for term in each.terms))


def _at_a_point(system: System, term: Term) -> bool:
    """Whether a term is the way of a point of one end along a direction of another that moves as prescribed."""
    one, other = system.ends[term.i], system.ends[term.j]
    return term.kind == GAP and other.form == RIGID and bool((term.a == one.origin).all())


def rotation_term(frame: Float[np.ndarray, "3 3"], n: int, law: Law, tilt: bool) -> Term:
    """The rotation about axis n of a joint, of its end 0 against 1: of a bushing, whose rotation may be large, that of
    the rotation vector.

    Parameters
    ----------
    tilt : whether the joint releases the rotation about its axis, so that only the tilt of the axis is left
    """
    if isinstance(law, Held):
        a, b = (frame[0], frame[1]) if n == 2 else (frame[2], frame[1 - n])
        return Term(TURN, 0, 1, a, a, b)
    return Term(TILT if tilt else ROTATION, 0, 1, frame[2], frame[2], frame[n])


def without_unknowns(system: System, each: Constraint) -> bool:
    """Whether both ends move as prescribed: what a law exerts then acts on drive joints alone."""
    return all(system.ends[n].form == RIGID for term in each.terms for n in (term.i, term.j))
