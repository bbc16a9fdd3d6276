"""Moments of nodal fields and rates of the rigid motion, for the energy account.

The work of a field y (forces or a momentum) on a rigid motion 1 ⊗ a + X Bᵀ depends only on Σ y and Σ X ⊗ y, its
*moments*, and for a planar beam on its couple. So one product per field and block suffices; all further work is on the
moments of all links together, time last: (1 + k, k, S, T) for S links of any size at T time points, in k dimensions.
Products take one component after the other, the order of histories in memory.
"""

from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.stepping.state import Rayleigh
from kedfem.links.record import Link, Matrix
from kedfem.motion.rigid import RigidMotion
from kedfem.vectors import cross

DENSE = 400  # unknowns of a link: up to here a dense product beats a sparse one
ACROSS = ((1, 2), (2, 0), (0, 1))  # components of a cross product; in a plane the last
SMALL = 100  # up to here one product with all of M beats one per component
Field = Float[np.ndarray, "_ _ _"]


@dataclass(frozen=True, slots=True)
class Weights:
    """Weights for moments of nodal vectors.

    rows : (1 + k, n) of each of the first k components
    couple : (n,) of the third component of a planar beam, else None
    """

    rows: Float[np.ndarray, "k1 n"]
    couple: Float[np.ndarray, " n"] | None

    @property
    def m(self) -> int:
        """How many moments there are, (1 + k) k and a couple."""
        return len(self.rows) * (len(self.rows) - 1) + 1

    def of(self, y: Field, out: Float[np.ndarray, "m T"]) -> None:
        """Moments and couple of a field over time, into `out`."""
        k = len(self.rows) - 1
        moments = out[:-1].reshape(1 + k, k, len(y))
        for j in range(k):
            np.matmul(self.rows, y[:, :, j].T, out=moments[:, j])
        out[-1] = 0.0 if self.couple is None else y[:, :, 2] @ self.couple


@dataclass(frozen=True, slots=True)
class Constants:
    """Constants of a link for the energy account.

    k : 2 of planar links, which move in a plane, else 3
    fit, weighted, ports : for moments of nodal forces y, of M u, and of port forces
    gram : (1 + k, 1 + k) [1, X]ᵀ m [1, X]: mass, its first and second moment
    spin : of a planar beam its sections' inertia
    K0 : dense and for `flat` fields if small
    masses : a matrix per component, or a dense one for all of `flat` fields; None for a mass that is 1
    """

    link: Link
    joint: Attachment
    body: int
    damping: Rayleigh
    k: int
    fit: Weights
    weighted: Weights
    ports: Weights
    gram: Float[np.ndarray, "k1 k1"]
    spin: float
    K0: Matrix
    masses: tuple[Matrix, ...] | None


def constants(link: Link, joint: Attachment, body: int, damping: Rayleigh) -> Constants:
    """The constants of a link that is body number `body` of the motion."""
    k = 2 if link.planar else 3
    fit = np.column_stack([link.one, link.X[:, :k]])
    weighted = np.column_stack([link.m1[:, 0], link.mX[:, :k]])
    at_ports = joint.weights @ fit[joint.nodes]
    spin = float(link.one @ link.m1[:, 2]) if link.kind == "beam" else 0.0
    couples = (link.one, link.m1[:, -1], at_ports[:, 0]) if link.kind == "beam" else (None,) * 3
    every = zip((fit, weighted, at_ports), couples, strict=True)
    F, M, ports = (Weights(np.ascontiguousarray(x.T), couple) for x, couple in every)
    K0, masses = _stiffness(link), _masses(link)
    return Constants(link, joint, body, damping, k, F, M, ports, fit.T @ weighted, spin, K0, masses)


@dataclass(frozen=True, slots=True)
class RigidRates:
    """Rigid motion of S bodies at T time points, x = p + R X, in k dimensions, time last.

    R : (k, k, S, T)
    rates : (2, 1 + k, k, S, T) of x' and x'': [p', R'ᵀ] and [p'', R''ᵀ]
    omega, alpha : (3, S, T) angular velocity and acceleration; in a plane (1, S, T)
    """

    R: Float[np.ndarray, "k k S T"]
    rates: Float[np.ndarray, "2 k1 k S T"]
    omega: Float[np.ndarray, "c S T"]
    alpha: Float[np.ndarray, "c S T"]

    def of(self, bodies: Int[np.ndarray, " S"], k: int = 3) -> "RigidRates":
        """Rates of some of the bodies, in k dimensions."""
        turns = (x[2 * (3 - k) :, bodies] for x in (self.omega, self.alpha))
        return RigidRates(self.R[:k, :k, bodies], self.rates[:, : 1 + k, :k, bodies], *turns)

    def every(self, which: slice) -> "RigidRates":
        """At some of the time points."""
        return RigidRates(*(x[..., which] for x in (self.R, self.rates, self.omega, self.alpha)))


def rates_of_bodies(motion: RigidMotion) -> RigidRates:
    """Rates of all bodies of a motion."""
    T, B = motion.p.shape[:2]
    R, rates = np.ascontiguousarray(motion.R.transpose(2, 3, 1, 0)), np.empty((2, 4, 3, B, T))
    rates[0, 0], rates[1, 0] = motion.v.T, motion.p2.T
    rates[1, 1:] = motion.R2.transpose(3, 2, 1, 0)
    omega, alpha = (np.ascontiguousarray(x.T) for x in (motion.omega, motion.alpha))
    for k in range(3):
        rates[0, 1 + k] = cross(omega.T, R[:, k].T).T
    return RigidRates(R, rates, omega, alpha)


def mass_times(of: Constants, u: Field) -> Field:
    """M u over time."""
    if of.masses is None:
        return u
    if len(of.masses) == 1:
        return flat_times(of.masses[0], u)
    out = np.empty_like(u)
    for k, m in enumerate(of.masses):
        out[:, :, k] = (m @ u[:, :, k].T).T
    return out


def flat(u: Field) -> Float[np.ndarray, "T dn"]:
    """All components one after the other: of histories a view."""
    return u.transpose(0, 2, 1).reshape(len(u), -1)


def flat_times(A: Matrix, u: Field) -> Field:
    """A u over time, of a symmetric matrix on all unknowns: of `flat` fields if it is dense, else node by node."""
    T, n, d = u.shape
    if isinstance(A, np.ndarray):
        return (flat(u) @ A).reshape(T, d, n).transpose(0, 2, 1)
    return np.asarray((A @ u.reshape(T, -1).T).T).reshape(u.shape)


def crossed(k: int, x: Field, y: Field) -> Float[np.ndarray, "c T"]:
    """Σ x × y of translations and forces, in a plane the one component across it."""
    of, dot = ACROSS[2 * (3 - k) :], np.vecdot
    return np.stack([dot(x[:, :, i], y[:, :, j]) - dot(x[:, :, j], y[:, :, i]) for i, j in of])


def turned(N: Float[np.ndarray, "k k S T"]) -> Float[np.ndarray, "c S T"]:
    """Σ x × y from Σ x ⊗ y, in a plane the one component across it."""
    return np.stack([N[i, j] - N[j, i] for i, j in ACROSS[2 * (3 - len(N)) :]])


def rotated(at: RigidRates, x: Float[np.ndarray, "c S T"]) -> Float[np.ndarray, "c S T"]:
    """R x; what is across a plane stays there."""
    return x if len(x) == 1 else np.einsum("ijst,jst->ist", at.R, x)


def dot(x: Field, y: Field) -> Float[np.ndarray, " T"]:
    """Σ x · y at every time point."""
    return np.asarray(np.vecdot(flat(x), flat(y)))


def _stiffness(link: Link) -> Matrix:
    K0 = _dense(link.K0, link.unknowns)
    if not isinstance(K0, np.ndarray):
        return K0
    return K0.reshape(link.n, link.d, link.n, link.d).transpose(1, 0, 3, 2).reshape(K0.shape)


def _masses(link: Link) -> tuple[Matrix, ...] | None:
    masses = tuple(_dense(m, link.unknowns) for m in link.mass)
    if all(isinstance(m, np.ndarray) and np.abs(m - np.eye(len(m))).max() < 1e-10 for m in masses):
        return None  # a reduced link, with mass-orthonormal modes
    if link.unknowns > SMALL:
        return masses
    M = np.zeros((link.d, link.n, link.d, link.n))
    for k, m in enumerate(masses):
        M[k, :, k] = m
    return (M.reshape(link.unknowns, -1),)


def _dense(matrix: Matrix, unknowns: int) -> Matrix:
    return matrix.toarray() if unknowns <= DENSE and not isinstance(matrix, np.ndarray) else matrix
