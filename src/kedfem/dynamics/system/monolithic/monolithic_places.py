"""Ends, coordinates and laws in the monolithic solver, by singular values and the equations of rigid motion."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import PPoly
from scipy.linalg import expm

from kedfem.arrays import Float
from kedfem.dynamics.loads import Pattern
from kedfem.dynamics.system import record
from kedfem.dynamics.system.forces.follower_loads import shown_by
from kedfem.dynamics.system.record import Constraint, Curve, End, Spring, Stop, System, Term, law_at
from kedfem.links.record import Link
from kedfem.motion.constraints import ConstraintEquation, stacked
from kedfem.motion.newton import cross_matrix
from kedfem.motion.rigid import RigidMotion
from kedfem.motion.values import features, gradients

ALIGNED = 1e-12  # sine of an angle below which any normal of an axis is one of both
Column = Float[np.ndarray, " _"]


def force(each: Constraint, at: RigidMotion, e: float, rate: float, side: int | None) -> float:
    """Force of a law against its coordinate, at one time; `side` as of `monolithic_stops.sides`."""
    match law_at(each.law, at.t, at.phi):
        case Spring(stiffness=k, damping=c, free=free, curve=curve):
            return float(k * (e - free) + c * rate - _on_curve(curve, at, e, rate))
        case Curve() as curve:
            return -_on_curve(curve, at, e, rate)
        case Stop(lower=lower, upper=upper, stiffness=k, damping=c):
            side = int(e > upper) - int(e < lower) if side == 0 else side
            push = k * (e - (upper if side > 0 else lower)) + c * rate if side else 0.0
            return push if side and side * push > 0 else 0.0
        case _:
            raise ValueError(f"{each.name}: a constraint has no force law")


def _on_curve(curve: Curve | None, at: RigidMotion, e: float, rate: float) -> float:
    """Force along the coordinate."""
    if curve is None:
        return 0.0
    of, x = (curve.force, float(at.t[0]) if curve.over == record.TIME else (rate if curve.over == record.RATE else e))
    x = of.at[0] + (x - of.at[0]) % of.period if of.period else max(x, of.at[0])
    return float(PPoly(np.array(of.coefficients).T[::-1], [*of.at, max(x, of.at[-1]) + 1.0])(x))


def rotated_load(
    link: Link, load: Pattern, R: Float[np.ndarray, "3 3"], u: Float[np.ndarray, "n d"]
) -> Float[np.ndarray, "n d"]:
    """Nodal forces of a follower load on a link of orientation R, displaced by u: rotations that align best."""
    from scipy.spatial.transform import Rotation

    drawn, weights = shown_by(link, load.forces)
    if link.kind == "beam":
        turn = Rotation.from_rotvec([0, 0, float(weights[0] @ u[:, 2])]).as_matrix() @ R
        return np.asarray(load.forces @ np.block([[turn[:2, :2].T, np.zeros((2, 1))], [np.zeros((1, 2)), 1.0]]))
    moved = drawn @ R.T
    moved[:, : link.d] += weights @ u
    turn = Rotation.align_vectors(moved, drawn)[0].as_matrix()
    share = 1.0 if load.share is None else float(load.share[1] @ turn @ load.share[0])
    return np.asarray(share * load.forces @ turn[: link.d, : link.d].T)


@dataclass(frozen=True, slots=True)
class Pose:
    """Position and orientation of an end, and how both change with z: (3, k) each, δQ = [δθ]× Q."""

    x: Float[np.ndarray, "3"]
    Q: Float[np.ndarray, "3 3"]
    by_x: Float[np.ndarray, "3 k"]
    by_Q: Float[np.ndarray, "3 k"]


def placed(end: End, R: Any, p: Any, z: Column) -> Pose:
    """Where an end is: of a surface the rotation nearest to its directions, by singular values."""
    (count, d, _), k = end.onto.shape, len(z)
    pin = R[end.line.pin] if end.line is not None else None
    R, x = R[end.body], p[end.body] + R[end.body] @ end.origin
    by_x, by_Q = np.zeros((3, k)), np.zeros((3, k))
    if end.form == record.RIGID:
        return Pose(x, R, by_x, by_Q)
    onto = np.zeros((count, d, k))
    onto[:, :, end.columns] = end.onto
    if end.line is not None:  # the pin's place in the frame of the line
        from scipy.interpolate import CubicSpline

        away = p[end.line.pin] + pin @ end.line.at - p[end.body]
        s = float((away @ R - end.line.at) @ end.line.axis)
        onto = np.einsum("p,pdk->dk", CubicSpline(end.line.stations.s, np.eye(len(onto)))(s), onto)[None]
    u = onto @ z
    flat = 2 if end.form == record.PLANAR_BEAM else d
    x[:flat] += u[0, :flat]
    by_x[:flat] = onto[0, :flat]
    if end.form == record.PLANAR_BEAM:
        c, s = np.cos(u[0, 2]), np.sin(u[0, 2])
        by_Q[2] = onto[0, 2]
        return Pose(x, np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ R, by_x, by_Q)
    if end.form in (record.POINT, record.LINE):
        return Pose(x, R, by_x, by_Q)
    D, by = np.zeros((3, 3)), np.zeros((3, 3, k))  # direction, component
    for n in range(end.known):
        D[n] = R @ end.directions[n]
        D[n, :d] += (u[n + 1] - u[0]) / end.lengths[n]
        by[n, :d] = (onto[n + 1] - onto[0]) / end.lengths[n]
    if end.form == record.PLANAR:
        if end.known == 1:
            D[1], by[1] = np.cross([0, 0, 1], D[0]), np.cross([0, 0, 1], by[0], axisb=0, axisc=0)
        D[2] = [0, 0, 1]
    if end.form == record.FACE:
        normal = np.cross(D[0], D[1])
        size = np.linalg.norm(normal)
        D[2] = normal / size
        change = np.cross(by[0], D[1], axisa=0, axisc=0) + np.cross(D[0], by[1], axisb=0, axisc=0)
        by[2] = (change - np.outer(D[2], D[2] @ change)) / size
    A = D.T @ end.directions
    left, _, right = np.linalg.svd(A)
    Q = left @ right
    U = Q.T @ A
    B = np.einsum("ba,nbk,nc->ack", Q, by, end.directions)
    axial = np.stack([B[2, 1] - B[1, 2], B[0, 2] - B[2, 0], B[1, 0] - B[0, 1]])
    return Pose(x, Q, by_x, Q @ np.linalg.solve(np.trace(U) * np.eye(3) - (U + U.T) / 2, axial))


def point(pose: Pose, end: End, a: Float[np.ndarray, "3"]) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3 k"]]:
    """Where a point of an end is, and how this changes with z."""
    arm = pose.Q @ (a - end.origin)
    return pose.x + arm, pose.by_x - cross_matrix(arm) @ pose.by_Q


def of_rows(
    system: System, terms: Sequence[Term], poses: Mapping[int, Pose], near: Column
) -> tuple[Column, Float[np.ndarray, "t k"], Column]:
    """Values of terms that are constraint rows of rigid motion between their ends, their gradients by z, and angles to be
    near the next time."""
    number = {n: body for body, n in enumerate(poses, start=1)}
    starts = [np.zeros(3), *(pose.x - pose.Q @ system.ends[n].origin for n, pose in poses.items())]
    rows = stacked([ConstraintEquation(x.kind, number[x.i], number[x.j], x.a, x.b, "", x.a_j) for x in terms])
    at = np.stack([np.eye(3), *(pose.Q for pose in poses.values())])[None], np.stack(starts)[None]
    f = features(rows, at, near[rows.angles][None])
    value, twists = f.value[:, 0], gradients(rows, f)[..., 0]
    gradient = [
        sum(_by_z(poses[n], starts[number[n]], twist) for n, twist in zip((x.i, x.j), pair, strict=True))
        for x, pair in zip(terms, twists, strict=True)
    ]
    return value, np.array(gradient), np.where(rows.kind == record.ANGLE, value, near)


def _by_z(pose: Pose, start: Float[np.ndarray, "3"], twist: Float[np.ndarray, "6"]) -> Column:
    """How a value changes with z, by the twist of a body at the origin of the coordinates: v = δx − δθ × (x − start)."""
    return np.asarray(twist[:3] @ pose.by_x + (twist[3:] - cross_matrix(pose.x - start) @ twist[:3]) @ pose.by_Q)


def valued(system: System, term: Term, one: Pose, other: Pose) -> tuple[float, Column]:
    """The value of a distance, rotation or tilt between two ends, and its gradient by z."""
    if term.kind == record.DISTANCE:
        (x, by_x), (y, by_y) = point(one, system.ends[term.i], term.a), point(other, system.ends[term.j], term.a_j)
        size = float(np.linalg.norm(x - y))
        return size, (x - y) / size @ (by_x - by_y)
    value, moment = (rotation_along if term.kind == record.ROTATION else tilt_along)(term, one.Q, other.Q)
    return value, moment @ (one.by_Q - other.by_Q)


def rotation_along(term: Term, Q_i: Any, Q_j: Any) -> tuple[float, Float[np.ndarray, "3"]]:
    """Along b the logarithm of the rotation; the gradient by the mean of rotations on the way, ∫ exp [s θ]× ds."""
    from scipy.spatial.transform import Rotation

    theta = Rotation.from_matrix(Q_j.T @ Q_i).as_rotvec()
    both = np.zeros((6, 6))
    both[:3, :3], both[:3, 3:] = np.cross(np.eye(3), theta), np.eye(3)
    return float(theta @ term.b), Q_j @ np.linalg.solve(expm(both)[:3, 3:].T, term.b)


def tilt_along(term: Term, Q_i: Any, Q_j: Any) -> tuple[float, Float[np.ndarray, "3"]]:
    """Along b the angle between both axes about the normal e of both: ω changes the angle, and turns e about the axis."""
    a, n, b = Q_i @ term.a, Q_j @ term.a_j, Q_j @ term.b
    normal = np.cross(n, a)
    sine = float(np.linalg.norm(normal))
    t = float(np.arctan2(sine, n @ a))
    e, share = (normal, t / sine) if sine > ALIGNED else (b, 1.0)
    e = e - (e @ n) * n  # of a small normal rounding is along the axis too
    e /= np.linalg.norm(e)
    return t * float(b @ e), (b @ e) * e + share * (b @ np.cross(n, e)) * np.cross(a, e)
