"""The record of a force element: a force that depends on how the mechanism moves; where its ends are, and how they move.

A force element has two ends. An end is up to two vectors of a link, linear in its state: a point, or directions across a
hinge. Its coordinate q depends on these vectors alone, and its force Q acts on them as Q ∂q/∂x.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.history import LinkHistory
from kedfem.dynamics.system.record import Curve, Factor, Law, Spring, Stop, Times
from kedfem.motion.constraints import cross, perpendiculars
from kedfem.motion.rigid import RigidMotion

TURN, SLIDE, DISTANCE = 0, 1, 2
POINT, PAIR, SINGLE, ANGLE = 0, 1, 2, 3
IN_SPACE = (1.0, 1.0, 1.0)

Vector = Float[np.ndarray, "3"]


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
    law : of its force; none of a hinge whose turn alone is examined
    axis : of a hinge or slide, in the reference position
    """

    name: str
    kind: int
    ends: tuple[End, End]
    law: Law | None = None
    axis: Vector = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))


def stiffness_factors(every: Sequence[Factor | None], t: Times, phi: Times) -> Float[np.ndarray, "T A"]:
    """What the stiffness of each force element, or law, is multiplied by over time; one where it has no factor."""
    out = np.ones((len(t), len(every)))
    for i, factor in enumerate(every):
        if factor is not None:
            out[:, i] = factor(t, phi)
    return out


Vectors = Float[np.ndarray, "T 2 2 3"]
"""Two vectors of each of two ends over time; the second is zero where there is none."""


def placed(element: ForceElement, motion: RigidMotion, links: Sequence[LinkHistory] = ()) -> tuple[Vectors, Vectors]:
    """Vectors of both ends and their rates.

    Parameters
    ----------
    links : histories of a model's links; without them none deforms or leaves the rigid-body motion
    """
    x, v = np.zeros((2, len(motion.t), 2, 2, 3))
    for e, end in enumerate(element.ends):
        R, omega, m = motion.R[:, end.body], motion.omega[:, end.body], len(end.X)
        if end.form == ANGLE:
            x[:, e, 0, 2], v[:, e, 0, 2] = np.arctan2(R[:, 1, 0], R[:, 0, 0]), omega[:, 2]
        else:
            x[:, e, :m] = end.X @ R.transpose(0, 2, 1)
            v[:, e, :m] = cross(omega[:, None], x[:, e, :m])
        if end.form == POINT:
            x[:, e, 0] += motion.p[:, end.body] + end.offset
            v[:, e, 0] += motion.v[:, end.body]
        if end.k >= 0 and links:
            for of, u in ((x, links[end.k].u), (v, links[end.k].v)):
                d = u.shape[2]
                of[:, e, :m, :d] += (end.weights @ u) * end.mask[:d]
    return x, v


def coordinate(element: ForceElement, x: Vectors, before: float = 0.0) -> Times:
    """The turn, travel or distance q of the first end against the second, whatever their links do.

    A turn is the mean over two pairs of directions a, b of the ends, drawn across the axis n and seen along it, of
    atan2(n · (b × a), a · b − (n · a)(n · b)), less that in the reference position, counted on beyond ±π. n moves with
    the first end that shows it.

    Parameters
    ----------
    before : a turn before the first time, near which it is
    """
    if element.kind != TURN:
        gap = x[:, 0, 0] - x[:, 1, 0]
        return np.asarray((_axis(element, x) * gap).sum(axis=1) if element.kind == SLIDE else np.linalg.norm(gap, axis=1))
    drawn = np.zeros((1, 2, 2, 3))
    for e, end in enumerate(element.ends):
        drawn[0, e, : len(end.X)] = end.X
    turned = np.full((1 + len(x), 2), before)
    turned[1:] = _angles(element, x) - _angles(element, drawn)
    return np.asarray(np.unwrap(turned, axis=0)[1:].mean(axis=1))


def _angles(element: ForceElement, x: Vectors) -> Float[np.ndarray, "T 2"]:
    n, out = _axis(element, x), []
    for k in range(2):
        a, b = (_direction(element, end.form, x[:, e], k) for e, end in enumerate(element.ends))
        across = (a * b).sum(axis=1) - (n * a).sum(axis=1) * (n * b).sum(axis=1)
        out.append(np.arctan2((n * cross(b, a)).sum(axis=1), across))
    return np.stack(out, axis=1)


def _axis(element: ForceElement, x: Vectors) -> Float[np.ndarray, "T 3"]:
    """The axis of a hinge as its first end shows it that does; of a slide as the second end, if that turns it."""
    if element.kind == SLIDE and x[0, 1, 1].any():
        return x[:, 1, 1]
    for e, end in enumerate(element.ends) if element.kind == TURN else ():
        if end.form in (PAIR, SINGLE):
            n = cross(x[:, e, 0], x[:, e, 1]) if end.form == PAIR else x[:, e, 1]
            return np.asarray(n / np.linalg.norm(n, axis=1)[:, None])
    return np.tile(element.axis, (len(x), 1))


def _direction(element: ForceElement, form: int, x: Float[np.ndarray, "T 2 3"], k: int) -> np.ndarray:
    """The k-th direction of an end across the axis of its hinge: of a planar beam one that ψ turns."""
    if form != ANGLE:
        return x[:, k if form == PAIR else 0]
    e, angle = perpendiculars(element.axis)[k], x[:, 0, 2, None] * element.axis[2]
    return np.asarray(np.cos(angle) * e + np.sin(angle) * cross(element.axis, e))


def unit_forces(element: ForceElement, x: Vectors) -> Vectors:
    """∂q/∂x, forces on the vectors of both ends under Q = 1, where no hub is deformed: of a hinge couples."""
    out, n = np.zeros_like(x), _axis(element, x)
    if element.kind == DISTANCE:
        n = x[:, 0, 0] - x[:, 1, 0]
        size = np.linalg.norm(n, axis=1)[:, None]
        n = n / np.where(size > 0.0, size, 1.0)  # points that meet have no direction
    for e, end in enumerate(element.ends):
        sign = 1 - 2 * e
        if element.kind != TURN:
            out[:, e, 0] = sign * n
        elif end.form == ANGLE:
            out[:, e, 0, 2] = sign * n[:, 2]
        else:
            m = 2 if end.form == PAIR else 1
            out[:, e, :m] = sign * cross(n[:, None], x[:, e, :m]) / m
    return out


def effort(law: Law | None, motion: RigidMotion, q: Times, rate: Times) -> Times:
    """The force of a law along its coordinate at the times of a motion."""
    match law:
        case Curve(over=over, force=force):
            return force((motion.t, rate, q)[over])[0]
        case Spring(stiffness=k, damping=c, free=free, factor=factor, curve=curve):
            along = k * stiffness_factors([factor], motion.t, motion.phi)[:, 0] * (free - q) - c * rate
            return along if curve is None else along + effort(curve, motion, q, rate)
        case Stop(lower=lower, upper=upper, stiffness=k, damping=c):
            beyond = q - np.clip(q, lower, upper)
            Q = -k * beyond - c * rate
            return np.where(Q * beyond < 0.0, Q, 0.0)  # it pushes, and only beyond
        case _:
            return np.zeros_like(q)


def wrench(
    end: End, x: Float[np.ndarray, "T 2 3"], f: Float[np.ndarray, "T 2 3"]
) -> tuple[Float[np.ndarray, "T 3"], Float[np.ndarray, "T 3"]]:
    """Force and moment about the world's origin of the forces on an end's vectors."""
    if end.form == POINT:
        return f[:, 0], cross(x[:, 0], f[:, 0])
    moment = f[:, 0] if end.form == ANGLE else cross(x, f).sum(axis=1)
    return np.zeros_like(moment), np.asarray(moment)
