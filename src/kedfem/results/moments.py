"""What the audit needs of a link's rigid motion and of nodal fields: moments, powers, wrenches.

A field y, forces or a momentum, matters to a rigid motion 1 ⊗ a + X Bᵀ only through Σ y and Σ X ⊗ y, its *moments*; those
of M y need m·1 and m·X. So a block of time points costs a few passes over its arrays.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from kedfem.dynamics.coupling import Attachment
from kedfem.dynamics.history import LinkHistory
from kedfem.dynamics.state import Rayleigh
from kedfem.links.record import Link, Matrix, in_space
from kedfem.motion.newton import cross_matrix
from kedfem.motion.rigid import RigidMotion

DENSE = 400  # unknowns of a link: up to here a dense product beats a sparse one
Scalars = Float[np.ndarray, " T"]
Vectors = Float[np.ndarray, "T 3"]
Field = Float[np.ndarray, "T n d"]
Moments = Float[np.ndarray, "T 4 d"]


@dataclass(frozen=True, slots=True)
class Constants:
    """What the audit needs of a link, constant.

    fit, weighted : (n, 4) [1, X] and m [1, X]: moments of a field y, and of M y
    gram : (4, 4) [1, X]ᵀ m [1, X]: mass, its first and second moment; spin: of a planar beam its sections' inertia
    stations : (p, 3) where the ports are drawn
    K0, masses : dense if small; None for a mass that is 1
    """

    link: Link
    joint: Attachment
    body: int
    damping: Rayleigh
    fit: Float[np.ndarray, "n 4"]
    weighted: Float[np.ndarray, "n 4"]
    gram: Float[np.ndarray, "4 4"]
    spin: float
    stations: Float[np.ndarray, "p 3"]
    K0: Matrix
    masses: tuple[Matrix | None, ...]


def constants(link: Link, joint: Attachment, body: int, damping: Rayleigh) -> Constants:
    """Of a link that is body number `body` of the motion."""
    fit = np.column_stack([link.one, link.X])
    weighted = np.column_stack([link.m1[:, 0], link.mX])
    spin = float(link.one @ link.m1[:, 2]) if link.kind == "beam" else 0.0
    stations = joint.weights @ link.X[joint.nodes]
    masses = tuple(None if _is_one(m) else _dense(m, link.unknowns) for m in link.mass)
    K0 = _dense(link.K0, link.unknowns)
    return Constants(link, joint, body, damping, fit, weighted, fit.T @ weighted, spin, stations, K0, masses)


@dataclass(frozen=True, slots=True)
class Nominal:
    """Rigid motion of one body: R, origin p, and (v, spin), (a, R2): p', R' and p'', R''; turning rate and its own."""

    R: Float[np.ndarray, "T 3 3"]
    p: Vectors
    v: Vectors
    spin: Float[np.ndarray, "T 3 3"]
    a: Vectors
    R2: Float[np.ndarray, "T 3 3"]
    omega: Vectors
    alpha: Vectors


def nominal(motion: RigidMotion, body: int) -> Nominal:
    """Of a body of the motion."""
    R, omega = motion.R[:, body], motion.omega[:, body]
    return Nominal(
        R, motion.p[:, body], motion.v[:, body], cross_matrix(omega) @ R, motion.p2[:, body], motion.R2[:, body],
        omega, motion.alpha[:, body],
    )  # fmt: skip


def is_nominal(of: Constants, history: LinkHistory, motion: RigidMotion) -> bool:
    """Whether the link's frame is that of the nominal motion, so that K turns with it and not with the bent link."""
    d = of.link.d
    return np.array_equal(history.R, motion.R[:, of.body, :d, :d])


def mass_moments(of: Constants, u: Field) -> Moments:
    """Moments of M u; the third row of a planar beam has a mass of its own."""
    out = of.weighted.T @ u
    if of.link.kind == "beam":
        out[:, 0, 2] = u[:, :, 2] @ of.link.m1[:, 2]
    return np.asarray(out)


def rigid_moments(of: Constants, a: Vectors, B: Float[np.ndarray, "T 3 3"], turn: Vectors) -> Moments:
    """Moments of M (1 ⊗ a + X Bᵀ)."""
    affine = np.concatenate([a[:, None], B.transpose(0, 2, 1)], axis=1)
    out = np.ascontiguousarray((of.gram @ affine)[:, :, : of.link.d])
    if of.link.kind == "beam":
        out[:, 0, 2] = of.spin * turn[:, 2]
    return out


def work_on(link: Link, y: Moments, a: Vectors, B: Float[np.ndarray, "T 3 3"], turn: Vectors) -> Scalars:
    """Σ (1 ⊗ a + X Bᵀ) · y, of nodal forces with these moments."""
    affine = np.concatenate([a[:, None], B.transpose(0, 2, 1)], axis=1)
    work = dot(in_space(link, y), affine)
    return work + turn[:, 2] * y[:, 0, 2] if link.kind == "beam" else work


def power(link: Link, y: Moments, at: Nominal) -> Scalars:
    """Of nodal forces with these moments on the nominal motion."""
    return work_on(link, y, at.v, at.spin, at.omega)


def wrench(link: Link, y: Moments, at: Nominal) -> tuple[Vectors, Vectors]:
    """Force, and moment about the body's origin, of nodal forces with these moments on the undeformed link."""
    rows = in_space(link, y)
    moment = turned(at.R @ rows[:, 1:])
    if link.kind == "beam":
        moment[:, 2] += y[:, 0, 2]
    return rows[:, 0], moment


def crossed(link: Link, x: Field, y: Field) -> Vectors:
    """Σ x × y of translations and forces."""
    out = np.zeros((len(x), 3))
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        if k == 2 or not link.planar:
            out[:, k] = np.einsum("tn,tn->t", x[..., i], y[..., j])
            out[:, k] -= np.einsum("tn,tn->t", x[..., j], y[..., i])
    return out


def swept(link: Link, Mu: Moments, a: Vectors, B: Float[np.ndarray, "T 3 3"]) -> Vectors:
    """Σ u × M (1 ⊗ a + X Bᵀ) from the moments of M u."""
    affine = np.concatenate([a[:, None], B.transpose(0, 2, 1)], axis=1)
    return turned(in_space(link, Mu).transpose(0, 2, 1) @ affine)


def turned(N: Float[np.ndarray, "T 3 3"]) -> Vectors:
    """Σ x × y from Σ x ⊗ y."""
    return np.stack([N[:, i, j] - N[:, j, i] for i, j in ((1, 2), (2, 0), (0, 1))], axis=1)


def rotated(R: Float[np.ndarray, "T 3 3"], x: Vectors) -> Vectors:
    """R x over time."""
    return np.asarray((R @ x[:, :, None])[:, :, 0])


def dot(x: Float[np.ndarray, "T ..."], y: Float[np.ndarray, "T ..."]) -> Scalars:
    """Σ x · y at every time point."""
    return np.asarray(np.einsum("tk,tk->t", x.reshape(len(x), -1), y.reshape(len(y), -1)))


def _dense(matrix: Matrix, unknowns: int) -> Matrix:
    return matrix.toarray() if unknowns <= DENSE and not isinstance(matrix, np.ndarray) else matrix


def _is_one(m: Matrix) -> bool:
    """Whether a reduced link's mass is 1, as its functions are made."""
    return isinstance(m, np.ndarray) and bool(np.abs(m - np.eye(len(m))).max() < 1e-10)
