"""The oracle's own view of terms: of pins on lines that bend and turn places by bisection, directions by rotations."""

from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from kedfem.arrays import Float
from kedfem.dynamics.system.ends import line_of
from kedfem.dynamics.system.oracle.monolithic_places import placed, point, valued
from kedfem.dynamics.system.record import OFFSET, End, System, Term
from kedfem.errors import SolveError

NEAR = 1e-15  # of places by bisection
Column = Float[np.ndarray, " _"]


def measured(system: System, term: Term, at: tuple[Any, Any, Column], near: float) -> tuple[float, Column, float]:
    """A term's value, its gradient by z, and an angle to be near the next time.

    Parameters
    ----------
    at : R and p of all bodies, and z
    """
    (R, p, z), ends = at, [system.ends[n] for n in (term.i, term.j)]
    poses = [placed(end, R, p, z) for end in ends]
    if term.kind != OFFSET:
        return valued(system, term, poses, near)
    body = ends[1].body
    return (*off_line(term, *point(poses[0], ends[0], term.a), ends[1], (R[body], p[body], z)), near)


def off_line(
    term: Term, pin: Float[np.ndarray, "3"], by_pin: Float[np.ndarray, "3 k"], end: End, pose: tuple[Any, Any, Column]
) -> tuple[float, Column]:
    """How far a pin is off a line along a direction across it, and the gradient by z.

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
    tangent = curve(s, 1) / np.linalg.norm(curve(s, 1))
    axis, away = R @ line.axis, pin - curve(s)
    n = _turned(axis, tangent) @ R @ term.b
    moved, turned = (np.einsum("p,pmk->mk", cardinal(s, k), onto) for k in (0, 1))
    slides = away @ turned + curve(s, 1) @ (by_pin - moved)
    slides = slides / (curve(s, 1) @ curve(s, 1) - curve(s, 2) @ away)
    by_tangent = (turned + np.outer(curve(s, 2), slides)) / np.linalg.norm(curve(s, 1))
    spin = np.cross(axis, tangent) / (1 + axis @ tangent) @ by_tangent  # about the tangent, of the smallest rotation
    return float(n @ away), n @ (by_pin - moved) - (away @ np.cross(tangent, n)) * spin


def _place(curve: CubicSpline, x: Float[np.ndarray, "3"]) -> float:
    """Where a point stands square to a curve, and is nearest to it."""

    def ahead(s: float) -> float:
        return float(curve(s, 1) @ (x - curve(s)))

    found = [brentq(ahead, a, b, xtol=NEAR, rtol=1e-15) for a, b in zip(curve.x, curve.x[1:], strict=False)
             if ahead(a) >= 0 >= ahead(b)]  # fmt: skip
    if not found:
        raise SolveError("analysis.solver: a pin must stay on its line, got one that slides off it")
    return float(min(found, key=lambda s: np.linalg.norm(x - curve(s))))


def _turned(a: Float[np.ndarray, "3"], t: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """The smallest rotation of a to t."""
    normal = np.cross(a, t)
    size = float(np.linalg.norm(normal))
    about = normal * (np.arctan2(size, a @ t) / size) if size else np.zeros(3)
    return np.asarray(Rotation.from_rotvec(about).as_matrix())
