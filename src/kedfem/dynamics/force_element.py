"""The record of a force element: a force that depends on how the mechanism moves; where its ends are, and how they move.

A force element has two ends. An end is up to two vectors of a link, linear in its state: a point, or directions across a
hinge. `force_elements_kernel` makes forces on these vectors from their positions and velocities.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.history import LinkHistory
from kedfem.motion.constraints import cross, perpendiculars
from kedfem.motion.rigid import RigidMotion
from kedfem.scene import Pieces

TURN, SLIDE, DISTANCE = 0, 1, 2
POINT, PAIR, SINGLE, ANGLE = 0, 1, 2, 3
TIME, SPEED, POSITION = 0, 1, 2
OVER = {"time": TIME, "speed": SPEED, "angle": POSITION, "travel": POSITION, "length": POSITION}
IN_SPACE = (1.0, 1.0, 1.0)

Vector = Float[np.ndarray, "3"]
Times = Float[np.ndarray, " T"]
Factor = Callable[[Times, Times], Times]


NO_CURVE = Pieces()


@dataclass(frozen=True, slots=True)
class End:
    """One end of a force element: vectors x_i = rigid_i + mask * Σ_a w_ia u_a, u the link's state in world components.

    k : number of the link in the model; -1: nothing but the rigid-body motion moves it (the ground, what the drive
    carries)
    body : whose rigid-body motion it has, by number in the linkage
    form : POINT: one point; PAIR: two directions across a hinge, e1 × e2 its axis; SINGLE: one direction across, and the
        axis; ANGLE: (0, 0, ψ) of a planar beam
    weights : (m, n) on the rows of the state; (m, 0) for k = -1
    X : (m, 3) the vectors in the reference position [m; -]
    mask : (3,) which components of the state's rows the vectors are made of; forces on them likewise
    offset : (3,) from the point of the link, to which X belongs, to the end itself; does not turn [m]
    link : name of the link in the scene, where that is not the model's: a slider, what the drive carries
    """

    k: int
    body: int
    form: int
    weights: Float[np.ndarray, "m n"]
    X: Float[np.ndarray, "m 3"]
    mask: tuple[float, float, float] = IN_SPACE
    offset: Vector = field(default_factory=lambda: np.zeros(3))
    link: str = ""


@dataclass(frozen=True, slots=True)
class ForceElement:
    """A force law on one coordinate: the turn of a hinge, the travel of a slide, the distance of two points.

    name : ``motors/NAME``, ``springs/NAME``, ``limits/NAME`` or ``joints/NAME``
    kind : TURN, SLIDE, DISTANCE
    ends : the coordinate is that of the first against the second
    stiffness, damping, free : of a spring, free where it has no force
    factor : of a spring, times (T,) and the drive's angles (T,) → what its stiffness is multiplied by; none: one
    limits : of a stop, between which it has no force; none: no stop
    axis : of a hinge or slide, in the reference position
    over, curve : force along the coordinate, of a motor or beside a spring's; none: no points
    """

    name: str
    kind: int
    ends: tuple[End, End]
    stiffness: float = 0.0
    damping: float = 0.0
    free: float = 0.0
    factor: Factor | None = None
    limits: tuple[float, float] | None = None
    axis: Vector = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    over: int = 0
    curve: Pieces = NO_CURVE


Table = tuple[np.ndarray, ...]


def kernel_table(every: Sequence[ForceElement]) -> Table:
    """What the kernel takes of force elements: kinds, forms, numbers, over, first, at, cubics, periods."""
    numbers = np.zeros((len(every), 16))
    for row, element in zip(numbers, every, strict=True):
        row[:2] = element.stiffness, element.damping
        row[2], row[14] = element.limits or (element.free, element.free)
        e1, e2 = perpendiculars(element.axis)
        row[3:12] = np.concatenate([element.axis, e1, e2])
        if element.kind == TURN:
            row[12:14] = _drawn_angles(element, e1, e2)
    return (
        np.array([element.kind for element in every], int),
        np.array([[end.form for end in element.ends] for element in every], int).reshape(-1, 2),
        numbers,
        np.array([element.over for element in every], int),
        np.concatenate([[0], np.cumsum([len(element.curve.at) for element in every], dtype=int)]),
        np.array([x for element in every for x in element.curve.at], float),
        np.array([c for element in every for c in element.curve.coefficients], float).reshape(-1, 4),
        np.array([element.curve.period for element in every], float),
    )


def stiffness_factors(every: Sequence[Factor | None], t: Times, phi: Times) -> Float[np.ndarray, "T A"]:
    """What the stiffness of each force element, or law, is multiplied by over time; one where it has no factor."""
    out = np.ones((len(t), len(every)))
    for i, factor in enumerate(every):
        if factor is not None:
            out[:, i] = factor(t, phi)
    return out


def _drawn_angles(element: ForceElement, e1: Vector, e2: Vector) -> list[float]:
    """Angles from the second end's directions to the first's, in the reference position."""
    drawn = []
    for k in range(2):
        a, b = (
            {PAIR: end.X[k % len(end.X)], SINGLE: end.X[0], ANGLE: (e1, e2)[k]}[end.form]
            for end in element.ends
        )
        drawn.append(float(np.arctan2(element.axis @ np.cross(b, a), a @ b)))
    return drawn


Vectors = tuple[Float[np.ndarray, "T 2 3"], Float[np.ndarray, "T 2 3"]]
"""Two vectors of an end over time, and their rates; the second is zero where there is none."""


def rigid_vectors(end: End, motion: RigidMotion) -> Vectors:
    """What an end's vectors and their rates would be if its link did not deform or leave the rigid-body motion."""
    R, omega, m = motion.R[:, end.body], motion.omega[:, end.body], len(end.X)
    x, v = np.zeros((2, len(motion.t), 2, 3))
    if end.form == ANGLE:
        x[:, 0, 2], v[:, 0, 2] = np.arctan2(R[:, 1, 0], R[:, 0, 0]), omega[:, 2]
        return x, v
    x[:, :m] = end.X @ R.transpose(0, 2, 1)
    v[:, :m] = cross(omega[:, None], x[:, :m])
    if end.form == POINT:
        x[:, 0] += motion.p[:, end.body] + end.offset
        v[:, 0] += motion.v[:, end.body]
    return x, v


@dataclass(frozen=True, slots=True)
class Evaluated:
    """Force elements over time: vectors of both ends, forces on them, values as of the kernel."""

    x: Float[np.ndarray, "T A 2 2 3"]
    forces: Float[np.ndarray, "T A 2 2 3"]
    values: Float[np.ndarray, "T A 4"]


def evaluated(
    every: Sequence[ForceElement], table: Table, turned: Float[np.ndarray, " A"], motion: RigidMotion,
    links: Sequence[LinkHistory] = (),
) -> Evaluated:  # fmt: skip
    """All force elements at successive times.

    Parameters
    ----------
    turned : coordinates before, near which rotations are; moved on to the last
    links : histories of a model's links; without them none deforms or leaves the rigid-body motion
    """
    from kedfem.dynamics.force_elements_kernel import evaluate_all

    x, v, forces = np.zeros((3, len(motion.t), len(every), 2, 2, 3))
    for i, element in enumerate(every):
        for e, end in enumerate(element.ends):
            x[:, i, e], v[:, i, e] = rigid_vectors(end, motion)
            if end.k >= 0 and links:
                x[:, i, e] += elastic_vectors(end, links[end.k].u)
                v[:, i, e] += elastic_vectors(end, links[end.k].v)
    factors = stiffness_factors([each.factor for each in every], motion.t, motion.phi)
    values = np.zeros((len(motion.t), len(every), 4))
    evaluate_all(motion.t, factors, x, v, turned, table, forces, values)
    return Evaluated(x, forces, values)


def wrench(
    end: End, x: Float[np.ndarray, "T 2 3"], f: Float[np.ndarray, "T 2 3"]
) -> tuple[Float[np.ndarray, "T 3"], Float[np.ndarray, "T 3"]]:
    """Force and moment about the world's origin of the forces on an end's vectors."""
    if end.form == POINT:
        return f[:, 0], cross(x[:, 0], f[:, 0])
    moment = f[:, 0] if end.form == ANGLE else cross(x, f).sum(axis=1)
    return np.zeros_like(moment), np.asarray(moment)


def elastic_vectors(end: End, u: Float[np.ndarray, "T n d"]) -> Float[np.ndarray, "T 2 3"]:
    """What an end's vectors have of the displacement of its link, or of its rate."""
    moved = end.weights @ u
    out = np.zeros((len(u), 2, 3))
    out[:, : moved.shape[1], : u.shape[2]] = moved
    return np.asarray(out * end.mask)
