"""Constraint rows of joints and drives, and their first and second derivatives, for many time points at once.

A body's point is at p + R X (X: reference position, R = I there). Two kinds of rows make every joint:

* gap:  b_j · (x_i − x_j) = 0       two points of bodies i and j meet, seen along a direction b fixed in body j
* turn: a_i · b_j = 0               a direction of body i stays perpendicular to a direction of body j
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Float

GAP, TURN = 0, 1
Vector = Float[np.ndarray, "3"]


@dataclass(frozen=True, slots=True)
class Row:
    """One scalar constraint between bodies i and j (0 is the ground).

    kind : GAP or TURN
    a : point X of the joint (gap) [m] or direction in body i (turn) [-], reference components
    b : direction in body j, reference components
    b_drive : turn only: b at drive angle φ is b cos φ + b_drive sin φ; None: b does not depend on φ
    joint : name, for messages
    """

    kind: int
    i: int
    j: int
    a: Vector
    b: Vector
    joint: str
    b_drive: Vector | None = None


def perpendiculars(axis: Vector) -> tuple[Vector, Vector]:
    """Two unit vectors e1, e2 with e1 × e2 = axis."""
    aside = np.eye(3)[np.abs(axis).argmin()]
    e1 = cross(axis, aside)
    e1 /= np.linalg.norm(e1)
    return e1, cross(axis, e1)


def joint_rows(
    kind: str,
    name: str,
    i: int,
    j: int,
    point: Vector,
    axis: Vector | None,
    axes: tuple[Vector, Vector] | None = None,
) -> list[Row]:
    """Rows of a joint between bodies i and j; of a slot i has the pin and j the line.

    Parameters
    ----------
    point : of the joint, reference position [m]
    axis : unit vector; of a revolute joint its axis, of a prismatic joint its direction, of a planar joint its normal
    axes : unit vectors of a universal joint, in body i and in body j
    """
    x, y, z = np.eye(3)
    meet = [Row(GAP, i, j, point, b, name) for b in (x, y, z)]
    aligned = [Row(TURN, i, j, a, b, name) for a, b in combinations((x, y, z), 2)]
    if kind == "spherical":
        return meet
    if kind == "weld":
        return meet + aligned
    if kind == "universal":
        assert axes is not None  # noqa: S101  (the scene requires them)
        return [*meet, Row(TURN, i, j, *axes, name)]
    assert axis is not None  # noqa: S101  (the scene requires it)
    e1, e2 = perpendiculars(axis)
    upright = [Row(TURN, i, j, axis, b, name) for b in (e1, e2)]
    slides = [Row(GAP, i, j, point, b, name) for b in (e1, e2)]
    match kind:
        case "revolute":
            return meet + upright
        case "planar":
            return [Row(GAP, i, j, point, axis, name), *upright]
        case "slot":
            return slides
        case "cylindrical" | "screw":
            return slides + upright
    return slides + aligned


def drive_row(name: str, i: int, j: int, axis: Vector) -> Row:
    """The drive of a revolute joint: body i is turned by φ about the axis against body j.

    e1 of body i stays perpendicular to e2 of body j turned by φ: −e1 sin φ + e2 cos φ.
    """
    e1, e2 = perpendiculars(axis)
    return Row(TURN, i, j, e1, e2, name, -e1)


def free_rows(kind: str, name: str, i: int, j: int, point: Vector, axis: Vector | None) -> list[Row]:
    """Rows of what a joint leaves free, as `joint_rows` holds the rest; i is the body that moves.

    Their rates: of a hinge's turn row −(ω_i − ω_j) · axis, of a slide's gap row (v_i − v_j) · axis.
    """
    x, y, z = np.eye(3)
    if kind == "spherical":
        return [Row(TURN, i, j, a, b, name) for a, b in combinations((x, y, z), 2)]
    if kind == "weld" or axis is None:
        return []
    if kind == "prismatic":
        return [Row(GAP, i, j, point, axis, name)]
    e1, e2 = perpendiculars(axis)
    return [Row(TURN, i, j, e2, e1, name)]


@dataclass(frozen=True, slots=True)
class Rows:
    """Rows as arrays: kind, i, j (m,); a, b, b_drive (m, 3); driven (m,)."""

    kind: np.ndarray
    i: np.ndarray
    j: np.ndarray
    a: np.ndarray
    b: np.ndarray
    b_drive: np.ndarray
    driven: np.ndarray


def stacked(rows: list[Row]) -> Rows:
    """Rows as arrays, for evaluation all at once."""
    zero = np.zeros(3)
    return Rows(
        kind=np.array([r.kind for r in rows], int),
        i=np.array([r.i for r in rows], int), j=np.array([r.j for r in rows], int),
        a=np.array([r.a for r in rows]).reshape(-1, 3), b=np.array([r.b for r in rows]).reshape(-1, 3),
        b_drive=np.array([zero if r.b_drive is None else r.b_drive for r in rows]).reshape(-1, 3),
        driven=np.array([r.b_drive is not None for r in rows], bool),
    )  # fmt: skip


Poses = tuple[Float[np.ndarray, "T B 3 3"], Float[np.ndarray, "T B 3"]]
Twists = tuple[Float[np.ndarray, "T B 3"], Float[np.ndarray, "T B 3"]]


@dataclass(frozen=True, slots=True)
class Features:
    """What rows are made of at T time points: all (T, m, 3).

    u : gap: x_i − x_j, turn: a in world components; w : b in world components; w_phi : ∂w/∂φ;
    arm_i, arm_j : R_i a and R_j a, the joint point from the bodies' reference origins.
    """

    u: np.ndarray
    w: np.ndarray
    w_phi: np.ndarray
    arm_i: np.ndarray
    arm_j: np.ndarray


def features(rows: Rows, poses: Poses, phi: Float[np.ndarray, " T"]) -> Features:
    """Evaluate what the rows are made of."""
    R, p = poses
    Ri, Rj = R[:, rows.i], R[:, rows.j]
    arm_i, arm_j = _turned(Ri, rows.a), _turned(Rj, rows.a)
    w, w_phi = _turned(Rj, rows.b), np.zeros_like(arm_j)
    cos, sin, driven = np.cos(phi)[:, None, None], np.sin(phi)[:, None, None], rows.driven
    b, b_drive = rows.b[driven], rows.b_drive[driven]
    w[:, driven] = _turned(Rj[:, driven], b * cos + b_drive * sin)
    w_phi[:, driven] = _turned(Rj[:, driven], b_drive * cos - b * sin)
    gap = p[:, rows.i] + arm_i - p[:, rows.j] - arm_j
    is_gap = (rows.kind == GAP)[:, None]
    return Features(u=np.where(is_gap, gap, arm_i), w=w, w_phi=w_phi, arm_i=arm_i, arm_j=arm_j)


def cross(a: Float[np.ndarray, "... 3"], b: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3"]:
    """a × b, several times as fast as numpy's own on stacks of vectors."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        np.subtract(a[..., i] * b[..., j], a[..., j] * b[..., i], out=out[..., k])
    return out


def _turned(R: Float[np.ndarray, "... 3 3"], x: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3"]:
    """R x, column by column: stacks of small products are slow otherwise."""
    return np.asarray(sum(R[..., k] * x[..., k, None] for k in range(3)))


def residuals(f: Features) -> Float[np.ndarray, "T m"]:
    """Values of the rows: u · w [m or -]."""
    return np.asarray(np.einsum("tmk,tmk->tm", f.u, f.w))


def jacobian(rows: Rows, f: Features, bodies: int) -> Float[np.ndarray, "T m k"]:
    """Derivatives of the rows by the bodies' twists (v, ω), δR = [δθ]× R; ground columns dropped, k = 6 (bodies − 1)."""
    T, m = f.u.shape[:2]
    J = np.zeros((T, m, bodies, 6))
    gap, number = (rows.kind == GAP)[:, None], np.arange(m)
    # d(u·w) = w · du + u · dw;  du: gap v_i + ω_i × arm_i − v_j − ω_j × arm_j, turn ω_i × u;  dw = ω_j × w
    J[:, number, rows.i, :3] += np.where(gap, f.w, 0)
    J[:, number, rows.j, :3] -= np.where(gap, f.w, 0)
    J[:, number, rows.i, 3:] += cross(f.arm_i, f.w)
    J[:, number, rows.j, 3:] += cross(f.w, f.u) - np.where(gap, cross(f.arm_j, f.w), 0)
    return J[:, :, 1:].reshape(T, m, 6 * (bodies - 1))


def drive_derivative(f: Features) -> Float[np.ndarray, "T m"]:
    """∂(row)/∂φ."""
    return np.asarray(np.einsum("tmk,tmk->tm", f.u, f.w_phi))


def convective(
    rows: Rows, f: Features, twists: Twists, speed: Float[np.ndarray, " T"]
) -> Float[np.ndarray, "T m"]:
    """Second time derivative of the rows without the terms in accelerations: J̇ q̇ and the drive's quadratic terms."""
    v, omega = twists
    wi, wj = omega[:, rows.i], omega[:, rows.j]
    gap = (rows.kind == GAP)[:, None]
    rate_i, rate_j = cross(wi, f.arm_i), cross(wj, f.arm_j)
    u1 = np.where(gap, v[:, rows.i] + rate_i - v[:, rows.j] - rate_j, rate_i)
    u2 = cross(wi, rate_i) - np.where(gap, cross(wj, rate_j), 0)
    s = speed[:, None, None]
    turn_w = cross(wj, f.w)
    w1 = turn_w + f.w_phi * s
    driven = rows.driven[:, None]
    w2 = cross(wj, turn_w) + 2 * s * cross(wj, f.w_phi) - np.where(driven, f.w, 0) * s**2
    return np.asarray(
        np.einsum("tmk,tmk->tm", u2, f.w)
        + 2 * np.einsum("tmk,tmk->tm", u1, w1)
        + np.einsum("tmk,tmk->tm", f.u, w2)
    )
