"""Lines of slots in the monolithic solver: places of pins by bisection, directions across by rotations."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from kedfem.arrays import Float
from kedfem.dynamics.system.ends import line_of
from kedfem.dynamics.system.monolithic.monolithic_places import of_rows, placed, point, valued
from kedfem.dynamics.system.record import ANGLE, ARC, GAP, ON_LINES, TURN, End, System, Term
from kedfem.errors import SolveError

NEAR = 1e-15  # of places by bisection
Column = Float[np.ndarray, " _"]


def measured(
    system: System, terms: Sequence[Term], at: tuple[Any, Any, Column], near: Column
) -> tuple[Column, Float[np.ndarray, "t k"], Column]:
    """Values of t terms, their gradients by z, and angles to be near the next time.

    Parameters
    ----------
    at : R and p of all bodies, and z
    near : (t,) angles of the last time
    """
    R, p, z = at
    poses = {n: placed(system.ends[n], R, p, z) for n in {end for term in terms for end in (term.i, term.j)}}
    value, gradient, near = np.zeros(len(terms)), np.zeros((len(terms), len(z))), near.copy()
    rows = [n for n, term in enumerate(terms) if term.kind in (GAP, TURN, ANGLE)]
    if rows:
        value[rows], gradient[rows], near[rows] = of_rows(system, [terms[n] for n in rows], poses, near[rows])
    for n in set(range(len(terms))).difference(rows):
        term, end = terms[n], system.ends[terms[n].j]
        if term.kind in ON_LINES:
            pin = point(poses[term.i], system.ends[term.i], term.a)
            on = _foot(*pin, end, (R[end.body], p[end.body], z))
            value[n], gradient[n] = (on.s, on.slides) if term.kind == ARC else off_line(term, on, end, R[end.body])
        else:
            value[n], gradient[n] = valued(system, term, poses[term.i], poses[term.j])
    return value, gradient, near


@dataclass(frozen=True, slots=True)
class _Foot:
    """Where a pin stands square to a line: the place s, the tangent of length one, the way from there to the pin.

    slides, moves, turns : how s, that way with s constant, and the tangent change with z
    """

    s: float
    tangent: Float[np.ndarray, "3"]
    away: Float[np.ndarray, "3"]
    slides: Column
    moves: Float[np.ndarray, "3 k"]
    turns: Float[np.ndarray, "3 k"]


def _foot(
    pin: Float[np.ndarray, "3"], by_pin: Float[np.ndarray, "3 k"], end: End, pose: tuple[Any, Any, Column]
) -> _Foot:
    """Where a pin is on the line of an end.

    Parameters
    ----------
    pin, by_pin : where the pin is, and how this changes with z
    pose : R and p of the line's body, and z

    Raises
    ------
    SolveError
        If the pin stands square to no place of the line.
    """
    (R, p, z), (count, d, _) = pose, end.onto.shape
    line = line_of(end)
    onto = np.zeros((count, 3, len(z)))
    onto[:, :d, end.columns] = end.onto
    X = p + line.stations.points @ R.T + onto @ z
    curve, cardinal = CubicSpline(line.stations.s, X), CubicSpline(line.stations.s, np.eye(count))
    s = _place(curve, pin)
    away = pin - curve(s)
    moved, turned = (np.einsum("p,pmk->mk", cardinal(s, k), onto) for k in (0, 1))
    slides = away @ turned + curve(s, 1) @ (by_pin - moved)
    slides = slides / (curve(s, 1) @ curve(s, 1) - curve(s, 2) @ away)
    size = np.linalg.norm(curve(s, 1))
    by_tangent = (turned + np.outer(curve(s, 2), slides)) / size
    return _Foot(s, curve(s, 1) / size, away, slides, by_pin - moved, by_tangent)


def off_line(term: Term, on: _Foot, end: End, R: Float[np.ndarray, "3 3"]) -> tuple[float, Column]:
    """How far a pin is off a line along a direction across it, and the gradient by z; R of the line's body."""
    axis, tangent = R @ line_of(end).axis, on.tangent
    n = _tangent_rotation(axis, tangent) @ R @ term.b
    spin = np.cross(axis, tangent) / (1 + axis @ tangent) @ on.turns  # about the tangent, of the smallest rotation
    return float(n @ on.away), n @ on.moves - (on.away @ np.cross(tangent, n)) * spin


def _place(curve: CubicSpline, x: Float[np.ndarray, "3"]) -> float:
    """Where a point stands square to a curve, and is nearest to it."""

    def ahead(s: float) -> float:
        return float(curve(s, 1) @ (x - curve(s)))

    found = [brentq(ahead, a, b, xtol=NEAR, rtol=1e-15) for a, b in zip(curve.x, curve.x[1:], strict=False)
             if ahead(a) >= 0 >= ahead(b)]  # fmt: skip
    if not found:
        raise SolveError("analysis.solver: a pin must stay on its line, got one that slides off it")
    return float(min(found, key=lambda s: np.linalg.norm(x - curve(s))))


def _tangent_rotation(a: Float[np.ndarray, "3"], t: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """The smallest rotation of a to t."""
    normal = np.cross(a, t)
    size = float(np.linalg.norm(normal))
    about = normal * (np.arctan2(size, a @ t) / size) if size else np.zeros(3)
    return np.asarray(Rotation.from_rotvec(about).as_matrix())
