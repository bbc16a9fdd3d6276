"""Deflections and natural frequencies of one link with some unknowns held, without any time integration."""

import numpy as np
import scipy.sparse as sp
from benchmarks.monolithic import shared_nodes
from scipy.sparse.linalg import LinearOperator, eigsh

from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.matrices.cholesky import Cholesky
from kedfem.links.record import Link
from kedfem.links.surfaces.coupling_surfaces import face_surface, port_weights


def held(*sets: tuple[np.ndarray, str], d: int = 3) -> np.ndarray:
    """Unknowns of the nodes in a mask: held((x == 0, "xyz"), (z == 0, "z")); d: of the link."""
    dofs = [d * np.flatnonzero(nodes) + "xyz".index(c) for nodes, components in sets for c in components]
    return np.unique(np.concatenate(dofs)) if dofs else np.zeros(0, int)


def free_map(link: Link, fixed: np.ndarray) -> sp.csr_array:
    """(dn, free) map from the unknowns that are left to all of them."""
    free = np.setdiff1d(np.arange(link.unknowns), fixed)
    return sp.csr_array((np.ones(len(free)), (free, np.arange(len(free)))), shape=(link.unknowns, len(free)))


def vector_mass(link: Link) -> sp.csr_array:
    """M = m ⊗ 1, (dn, dn), dof d·node + component."""
    units = [sp.csr_array(([1.0], ([k], [k])), shape=(link.d, link.d)) for k in range(link.d)]
    return sp.csr_array(sum(sp.kron(m, e, format="csr") for m, e in zip(link.mass, units, strict=True)))


def deflection(link: Link, T: sp.csr_array, force: np.ndarray) -> np.ndarray:
    """(n, d) solution of K0 u = force in the space that T spans."""
    reduced = Cholesky(sp.csr_array(T.T @ link.K0 @ T), "K0")
    return (T @ reduced.solve(T.T @ force.ravel())).reshape(-1, link.d)


def modes(link: Link, T: sp.csr_array, count: int, near: float) -> tuple[np.ndarray, np.ndarray]:
    """The lowest `count` natural frequencies [Hz], rigid modes included, and modes (3n, count).

    Shift and invert, with the shift below zero so that a free body needs no supports.

    near : of the order of the first elastic one [Hz]
    """
    K, M = sp.csr_array(T.T @ link.K0 @ T), sp.csr_array(T.T @ vector_mass(link) @ T)
    shift = (2 * np.pi * 0.3 * near) ** 2
    factor = Cholesky(sp.csr_array(K + shift * M), "K0 + shift M")
    inverse = LinearOperator(K.shape, lambda b: factor.solve(np.ravel(b)).copy(), dtype=float)
    start = np.random.default_rng(1).standard_normal(K.shape[0])
    squares, vectors = eigsh(K, count, M, sigma=-shift, OPinv=inverse, v0=start)
    order = np.argsort(squares)
    return np.sqrt(np.abs(squares[order])) / (2 * np.pi), T @ vectors[:, order]


def frequencies(link: Link, T: sp.csr_array, count: int, near: float) -> np.ndarray:
    """The frequencies of `modes`."""
    return modes(link, T, count, near)[0]


def frequency_of(link: Link, shape: np.ndarray, count: int, near: float) -> float:
    """Frequency of the mode of a free link that is most like a shape (n, 3)."""
    found, vectors = modes(link, free_map(link, held()), count, near)
    return float(found[np.abs(vectors.T @ (vector_mass(link) @ shape.ravel())).argmax()])


def mean_support(link: Link, *ends: tuple[np.ndarray, list[tuple[int, str]]]) -> sp.csr_array:
    """Map from free unknowns when the flat faces through some points are held in the mean only.

    ends : a point in the middle of a face that is normal to x, and which components are held of the values of
        its affine fit at ports: 0 the point, 1 and 2 a unit length from it along y, z: [(0, "xyz"), (1, "z")]
    """
    weights, components, p = [], [], 0
    for point, ports in ends:
        surface = face_surface(link, "support", point)
        weights.append(port_weights(surface, point + np.array([[0, 0, 0], [0, 1, 0], [0, 0, 1]])))
        components += [3 * (p + port) + "xyz".index(c) for port, names in ports for c in names]
        p += 3
    W, keep = np.concatenate(weights), np.array(components)
    nodes = np.flatnonzero(W.any(axis=0))
    joint = Attachment(
        nodes, W[:, nodes], 3, np.zeros((p, 3)), ("support",) * p, keep, np.zeros(0, int), np.zeros((len(keep), 0)), 0
    )
    return shared_nodes([link], [joint])
