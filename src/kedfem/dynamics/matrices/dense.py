"""Small links as dense constant matrices, in coordinates in which their mass is one."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from kedfem.arrays import Float
from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.joints.ports import port_columns
from kedfem.links.record import Link

SMALL = 360  # unknowns of a link: up to here dense matrices beat a sparse factor (docs/performance)
UNIT = 1e-10  # a mass of mass-orthonormal functions differs from 1 by their rounding


@dataclass(frozen=True, slots=True)
class DensePart:
    """One link with its ports held, in mass-orthonormal coordinates x, component first: row c of δ is T[c] x[c].

    T : per component (n, n); unit: whether it is 1, as of reduced links
    G : (N, N) A⁻¹ with ports held; Y : (N, q) shape of the link as its ports move; S : (q, q) port stiffness of A
    W : (q, N) ports; q counts all components of all ports, those that are not held are zero
    """

    T: tuple[Float[np.ndarray, "n n"], ...]
    G: Float[np.ndarray, "N N"]
    Y: Float[np.ndarray, "N q"]
    S: Float[np.ndarray, "q q"]
    W: Float[np.ndarray, "q N"]
    unit: bool = False


class Coordinates(Protocol):
    """How coordinates of a part are its nodal rows: row c is T[c] x[c]; without any T they are these themselves."""

    @property
    def T(self) -> tuple[np.ndarray, ...]:
        """Per component (n, n)."""

    @property
    def unit(self) -> bool:
        """Whether each is 1."""


def dense_part(link: Link, joint: Attachment, c_M: float, c_K: float) -> DensePart:
    """A link in mass-orthonormal coordinates; its ports are held by a null-space basis, so that a long step, where A
    nearly lets a free link go, does no harm."""
    T = tuple(_mass_orthonormal(as_dense(m)) for m in link.mass)
    n, unit = link.n, all(np.array_equal(t, np.eye(link.n)) for t in T)
    A = c_K * _symmetric(component_first(T, link.K0))
    A[np.diag_indices(len(A))] += c_M
    W = port_rows(T, joint, n)
    if not len(W):
        return DensePart(T, _symmetric(np.linalg.inv(A)), W.T, np.zeros((0, 0)), W, unit)
    V, L = scipy.linalg.qr(W.T)
    V1, Z = V[:, : len(W)], V[:, len(W) :]
    factor = scipy.linalg.cho_factor(_symmetric(Z.T @ A @ Z))
    G = Z @ scipy.linalg.cho_solve(factor, Z.T)
    moved = V1 @ np.linalg.inv(L[: len(W)]).T  # W moved = 1
    Y = moved - G @ (A @ moved)
    return DensePart(T, _symmetric(G), Y, _symmetric(Y.T @ A @ Y), W, unit)


def port_rows(T: Sequence[Float[np.ndarray, "n n"]], joint: Attachment, n: int) -> Float[np.ndarray, "q N"]:
    """What held components of ports have of coordinates x."""
    W = port_columns(joint, n).T.reshape(-1, n, len(T)).transpose(0, 2, 1)
    return np.concatenate([W[:, c] @ t for c, t in enumerate(T)], axis=1)


def _mass_orthonormal(m: Float[np.ndarray, "n n"]) -> Float[np.ndarray, "n n"]:
    """T with Tᵀ m T = 1."""
    if np.abs(m - np.eye(len(m))).max() < UNIT:
        return np.eye(len(m))
    return np.asarray(np.linalg.inv(np.linalg.cholesky(m)).T)


def component_first(T: Sequence[Float[np.ndarray, "n n"]], K: Any) -> Float[np.ndarray, "N N"]:
    """Tᵀ K T of a matrix on states, component by component."""
    n, d = len(T[0]), len(T)
    blocks = as_dense(K).reshape(n, d, n, d).transpose(1, 0, 3, 2)
    return np.concatenate([np.concatenate([T[i].T @ blocks[i, :, j] @ T[j] for j in range(d)], axis=1) for i in range(d)])


def coordinates(link: Link, part: Coordinates, rows: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "d n"]:
    """x of a state: T⁻¹ = Tᵀ m."""
    if not part.T:
        return np.ascontiguousarray(rows.T)
    return np.stack([part.T[c].T @ (link.mass[c] @ rows[:, c]) for c in range(link.d)])


def work_on(part: Coordinates, rows: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "d n"]:
    """Nodal forces on x."""
    if not part.T:
        return np.ascontiguousarray(rows.T)
    return np.stack([T.T @ rows[:, c] for c, T in enumerate(part.T)])


def work_over_time(part: Coordinates, rows: Float[np.ndarray, "T n d"]) -> Float[np.ndarray, "T d n"]:
    """Nodal forces on x over time."""
    if part.unit:
        return rows.transpose(0, 2, 1)
    return np.stack([rows[:, :, c] @ T for c, T in enumerate(part.T)], axis=1)


def rows_of(link: Link, part: Coordinates, x: Float[np.ndarray, "T D n"]) -> Float[np.ndarray, "T _ d"]:
    """States of x over time, component first in memory; where coordinates are rows a view."""
    if part.unit:
        return x[:, :, : link.n].transpose(0, 2, 1)
    return np.stack([x[:, c, : link.n] @ part.T[c].T for c in range(link.d)], axis=1).transpose(0, 2, 1)


def _symmetric(A: Float[np.ndarray, "k k"]) -> Float[np.ndarray, "k k"]:
    return np.asarray((A + A.T) / 2)


def as_dense(matrix: Any) -> np.ndarray:
    """A matrix, sparse or not, as an array."""
    return matrix.toarray() if sp.issparse(matrix) else np.asarray(matrix)
