"""Values of constraint rows and their first and second derivatives, for many time points at once.

Inside, time runs along the last axis: of a few hundred points all that one operation touches then lies in the cache.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.motion.constraints import Rows, cross

Poses = tuple[Float[np.ndarray, "T B 3 3"], Float[np.ndarray, "T B 3"]]
Twists = tuple[Float[np.ndarray, "T B 3"], Float[np.ndarray, "T B 3"]]


@dataclass(frozen=True, slots=True)
class Features:
    """What E elementary rows with A angles among them are made of at T time points.

    u : (3, E, T) gap: x_i − x_j; turn, angle: a in world components
    w : (3, E, T) b in world components
    arm_i, arm_j : (3, E, T) R_i a and R_j a_j
    value : (E, T) [m, -, rad]
    along, across : (A, T) of angles: a · a_j + e · e_j and a · e_j − e · a_j; their ratio is the tangent
    e, e_j : (3, A, T) of angles: b × a in body i and b × a_j in body j, world components
    about : (3, A, T) of angles: derivative by ω_i − ω_j; the axis itself where the hinge is closed
    """

    u: np.ndarray
    w: np.ndarray
    arm_i: np.ndarray
    arm_j: np.ndarray
    value: np.ndarray
    along: np.ndarray
    across: np.ndarray
    e: np.ndarray
    e_j: np.ndarray
    about: np.ndarray


def features(rows: Rows, poses: Poses, near: Float[np.ndarray, "T A"]) -> Features:
    """Evaluate elementary rows; `near` holds the turn of each angle row to within half a turn [rad]."""
    R, p = np.ascontiguousarray(poses[0].transpose(2, 3, 1, 0)), np.ascontiguousarray(poses[1].T)
    Ri, Rj = np.take(R, rows.i, axis=2), np.take(R, rows.j, axis=2)
    arm_i, arm_j, w = _turned(Ri, rows.a), _turned(Rj, rows.a_j), _turned(Rj, rows.b)
    u, g, k = arm_i.copy(), rows.gaps, rows.angles
    u[:, g] += p[:, rows.i[g]] - p[:, rows.j[g]] - arm_j[:, g]
    value = _dot(u, w)
    a, a_j = arm_i[:, k], arm_j[:, k]
    e, e_j = _turned(Ri[:, :, k], cross(rows.b[k], rows.a[k])), _cross(w[:, k], a_j)
    along, across = _dot(a, a_j) + _dot(e, e_j), _dot(a, e_j) - _dot(e, a_j)
    cos, sin = np.cos(near.T), np.sin(near.T)  # sines of large angles are reduced without loss
    value[k] = near.T + np.arctan2(across * cos - along * sin, along * cos + across * sin)
    about = _cross(a, along * e_j - across * a_j) - _cross(e, along * a_j + across * e_j)
    return Features(u, w, arm_i, arm_j, value, along, across, e, e_j, about / (along**2 + across**2))


def residuals(rows: Rows, f: Features, q: Float[np.ndarray, "T D"]) -> Float[np.ndarray, "T m"]:
    """Values of the constraints, q those of the drives [m, - or rad]."""
    out = f.value[: rows.count].T.copy()
    for k, row, c in rows.plus:
        out[:, k] += c * f.value[row]
    driven = np.flatnonzero(rows.drive >= 0)
    out[:, driven] -= q[:, rows.drive[driven]]
    return out


def jacobian(rows: Rows, f: Features, bodies: int, size: float = 1.0) -> Float[np.ndarray, "T m k"]:
    """Derivatives of the constraints by the bodies' twists (v, ω), δR = [δθ]× R; no ground columns, k = 6 (bodies − 1).

    With a size, rows of gaps are divided and columns of velocities multiplied by it: entries of order one.
    """
    each = gradients(rows, f, size)
    m, T = rows.count, each.shape[3]
    J = np.zeros((len(rows.kind), bodies, 6, T))
    every = np.arange(len(rows.kind))
    J[every, rows.i] = each[:, 0]
    J[every, rows.j] = each[:, 1]
    for row, other, c in coupled_terms(rows, size):
        J[row] += c * J[other]
    return np.ascontiguousarray(J[:m, 1:].reshape(m, 6 * (bodies - 1), T).transpose(2, 0, 1))


def coupled_terms(rows: Rows, size: float) -> Iterator[tuple[int, int, float]]:
    """Further elementary rows of constraints, with their coefficients in scaled rows."""
    scale = rows.scale(size)
    for row, other, c in rows.plus:
        yield row, other, c * scale[row] / scale[other]


def gradients(rows: Rows, f: Features, size: float = 1.0) -> Float[np.ndarray, "E 2 6 T"]:
    """Derivatives of elementary rows by the twists (v, ω) of their bodies i and j; scaled as in `jacobian`."""
    g, k = rows.gaps, rows.angles
    # d(u·w) = w · du + u · dw;  du: gap v_i + ω_i × arm_i − v_j − ω_j × arm_j, turn ω_i × u;  dw = ω_j × w
    by_i, arm = _cross(f.arm_i, f.w), f.u.copy()
    arm[:, g] += f.arm_j[:, g]
    by_j = _cross(f.w, arm)
    by_i[:, k], by_j[:, k] = f.about, -f.about
    if size != 1.0:
        by_i[:, g] /= size
        by_j[:, g] /= size
    out = np.zeros((len(rows.kind), 2, 6, f.u.shape[2]))
    out[g, 0, :3] = f.w[:, g].transpose(1, 0, 2)
    out[g, 1, :3] = -out[g, 0, :3]
    out[:, 0, 3:], out[:, 1, 3:] = by_i.transpose(1, 0, 2), by_j.transpose(1, 0, 2)
    return out


def convective(rows: Rows, f: Features, twists: Twists) -> Float[np.ndarray, "T m"]:
    """Second time derivative of the constraints without the terms in accelerations, J̇ q̇."""
    v, omega = (np.ascontiguousarray(x.T) for x in twists)
    wi, wj = np.take(omega, rows.i, axis=1), np.take(omega, rows.j, axis=1)
    g, k = rows.gaps, rows.angles
    rate_i, rate_j = _cross(wi, f.arm_i), _cross(wj[:, g], f.arm_j[:, g])
    u1, u2 = rate_i.copy(), _cross(wi, rate_i)
    u1[:, g] += v[:, rows.i[g]] - v[:, rows.j[g]] - rate_j
    u2[:, g] -= _cross(wj[:, g], rate_j)
    w1 = _cross(wj, f.w)
    out = _dot(u2, f.w) + 2 * _dot(u1, w1) + _dot(f.u, _cross(wj, w1))
    if len(k):
        out[k] = _angle_convective(f, k, wi[:, k], wj[:, k])
    total: np.ndarray = out[: rows.count].T.copy()
    for row, other, c in rows.plus:
        total[:, row] += c * out[other]
    return total


def _angle_convective(f: Features, k: np.ndarray, wi: np.ndarray, wj: np.ndarray) -> np.ndarray:
    """Of angles: second derivative of the arc tangent of y / x, sums of products of directions of both bodies."""
    a, a_j, square = f.arm_i[:, k], f.arm_j[:, k], f.along**2 + f.across**2
    x1, y1, x2, y2 = np.zeros((4, *square.shape))
    for u, along, across in ((a, a_j, f.e_j), (f.e, f.e_j, -a_j)):
        u1 = _cross(wi, u)
        u2, u1j, u2j = _cross(wi, u1), _cross(wj, u1), _cross(wj, _cross(wj, u))
        # of u · f, f fixed in body j: u2 · f + 2 u1 · (ω_j × f) + u · (ω_j × (ω_j × f))
        bent, rate = u2 - 2 * u1j + u2j, u1 - _cross(wj, u)
        x1 += _dot(rate, along)
        y1 += _dot(rate, across)
        x2 += _dot(bent, along)
        y2 += _dot(bent, across)
    spin = (f.along * y1 - f.across * x1) / square
    swing = (f.along * x1 + f.across * y1) / square
    return np.asarray((f.along * y2 - f.across * x2) / square - 2 * swing * spin)


def turning(rows: Rows, f: Features, twists: Twists) -> Float[np.ndarray, "T A"]:
    """Rates of the angle rows."""
    omega, k = twists[1].T, rows.angles
    return np.asarray(_dot(f.about, omega[:, rows.i[k]] - omega[:, rows.j[k]]).T)


def _turned(R: Float[np.ndarray, "3 3 E T"], x: Float[np.ndarray, "E 3"]) -> Float[np.ndarray, "3 E T"]:
    """R x of each row."""
    out = R[:, 0] * x[:, 0, None]
    out += R[:, 1] * x[:, 1, None]
    out += R[:, 2] * x[:, 2, None]
    return np.asarray(out)


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a · b over the first axis."""
    out = a[0] * b[0]
    out += a[1] * b[1]
    out += a[2] * b[2]
    return np.asarray(out)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a × b over the first axis."""
    out = np.empty(a.shape)
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        np.subtract(a[i] * b[j], a[j] * b[i], out=out[k])
    return out
