"""Values of constraint rows and their first and second derivatives, for many time points at once.

Internally time is the last axis, so that operations on a few hundred points stay in the cache.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.motion.constraints import Rows

Poses = tuple[Float[np.ndarray, "T B 3 3"], Float[np.ndarray, "T B 3"]]
Twists = tuple[Float[np.ndarray, "T B 3"], Float[np.ndarray, "T B 3"]]


@dataclass(frozen=True, slots=True)
class Features:
    """Vectors of E elementary rows, A of them angles, at T time points.

    u : (3, E, T) gap: x_i − x_j; turn, angle: a in world components
    w : (3, E, T) b in world components
    arm_i, arm_j : (3, E, T) R_i a and R_j a_j
    value : (E, T) [m, -, rad]
    hand_i, hand_j : (3, A, T) of angles: a − i b × a in body i and a_j + i b × a_j in body j, world components, complex
    product : (A, T) of angles: hand_i · hand_j, r exp(i angle)
    rate : (3, A, T) of angles: hand_i × hand_j by their product; ω_i − ω_j times it is the rate of ln r + i angle
    """

    u: np.ndarray
    w: np.ndarray
    arm_i: np.ndarray
    arm_j: np.ndarray
    value: np.ndarray
    hand_i: np.ndarray
    hand_j: np.ndarray
    product: np.ndarray
    rate: np.ndarray

    @property
    def about(self) -> np.ndarray:
        """Derivative of angles by ω_i − ω_j (3, A, T); the axis itself where the hinge is closed."""
        return self.rate.imag


def features(rows: Rows, poses: Poses, near: Float[np.ndarray, "T A"] | None = None) -> Features:
    """Values of elementary rows; `near`: angle of each angle row to within half a revolution [rad], 0 if not given."""
    near = np.zeros((len(poses[1]), len(rows.angles))) if near is None else near
    R, p = np.ascontiguousarray(poses[0].transpose(3, 2, 1, 0)), np.ascontiguousarray(poses[1].T)
    turned = R[0].take(rows.body, axis=1) * rows.vector[:, 0, None]
    for c in (1, 2):
        turned += R[c].take(rows.body, axis=1) * rows.vector[:, c, None]
    E, A, g, k = len(rows.kind), len(rows.angles), rows.gaps, rows.angles
    arm_i, arm_j, w = turned[:, :E], turned[:, E : 2 * E], turned[:, 2 * E : 3 * E]
    hands = turned[:, 3 * E :].reshape(3, 4, A, turned.shape[2])
    hand_i, hand_j = hands[:, 0] - 1j * hands[:, 1], hands[:, 2] + 1j * hands[:, 3]
    u = arm_i.copy()
    u[:, g] += p[:, rows.i[g]] - p[:, rows.j[g]] - arm_j[:, g]
    value = _dot(u, w)
    product = _dot(hand_i, hand_j)
    value[k] = near.T + np.angle(product * np.exp(-1j * near.T))  # sines of large angles are reduced without loss
    return Features(u, w, arm_i, arm_j, value, hand_i, hand_j, product, _cross(hand_i, hand_j) / product)


def residuals(rows: Rows, f: Features, q: Float[np.ndarray, "T D"]) -> Float[np.ndarray, "T m"]:
    """Values of the constraints, q those of the drives [m, - or rad]."""
    out = f.value[: rows.count].T.copy()
    for k, row, c in rows.plus:
        out[:, k] += c * f.value[row]
    out[:, rows.driven] -= q[:, rows.drive[rows.driven]]
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
    # u · w, w fixed in body j, changes with u'' − ω_j × (2 u' − ω_j × u)
    rate_i, rate_j = _cross(wi, f.arm_i), _cross(wj[:, g], f.arm_j[:, g])
    seen = _cross(wj, f.u) - 2 * rate_i
    seen[:, g] += rate_j - 2 * (v[:, rows.i[g]] - v[:, rows.j[g]])
    out = _dot(_cross(wi, rate_i) + _cross(wj, seen), f.w)
    if len(k):
        out[k] = _angle_convective(f, wi[:, k], wj[:, k])
    total: np.ndarray = out[: rows.count].T.copy()
    for row, other, c in rows.plus:
        total[:, row] += c * out[other]
    return total


def _angle_convective(f: Features, wi: np.ndarray, wj: np.ndarray) -> np.ndarray:
    """Second derivative of angles, of Im ln z, z the product of both hands; real multiples of z left out."""
    apart = wi - wj
    z2 = _dot(wi, f.hand_j) * _dot(apart, f.hand_i) - _dot(wj, f.hand_i) * _dot(apart, f.hand_j)
    return np.asarray((z2 / f.product - _dot(apart, f.rate) ** 2).imag)


def angle_rates(rows: Rows, f: Features, twists: Twists) -> Float[np.ndarray, "T A"]:
    """Rates of the angle rows."""
    omega, k = twists[1].T, rows.angles
    return np.asarray(_dot(f.about, omega[:, rows.i[k]] - omega[:, rows.j[k]]).T)


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a · b over the first axis."""
    return np.asarray(np.einsum("k...,k...", a, b))


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a × b over the first axis."""
    out = a.take(NEXT, axis=0) * b.take(LAST, axis=0)
    out -= a.take(LAST, axis=0) * b.take(NEXT, axis=0)
    return np.asarray(out)


NEXT, LAST = np.array([1, 2, 0]), np.array([2, 0, 1])
