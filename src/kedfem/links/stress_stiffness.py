"""Stress stiffness: the stiffness that a stress σ adds for small rotations of a link's parts.

k_ab = ∫ ∇N_a · σ ∇N_b dV is a scalar matrix, the same for all components of a state, like the mass. It is linear in the
state with the stress σ. Σ_b k_ab X_b is that state's internal force K0 g: for a link that rotates by θ,
k (θ × X) = θ × K0 g, the rotation of its forces.
"""

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
import skfem

from kedfem.arrays import Float
from kedfem.links.beams.beam import assembled, strain_rows
from kedfem.links.beams.spatial_stress import spatial_stress_stiffness
from kedfem.links.record import Link, Matrix, section_of
from kedfem.links.reduced import STRAIGHT
from kedfem.links.solid import SparsityPattern, sparsity_pattern

StressStiffness = Callable[[Float[np.ndarray, "n d"]], Matrix]
ELEMENTS = 256  # taken together


def rotated_directions(link: Link) -> Float[np.ndarray, "d d"]:
    """P of k g P, link frame, the components on which k acts: the unit matrix, but for planar beams.

    Of planar beams it is without ψ, and of straight ones only the component across the axis, as the axial strain is
    √((1 + u')² + v'²) − 1 = u' + v'²/2 + …
    """
    if link.kind != "beam":
        return np.eye(link.d)
    X = (link.full or link).X[:, :2]
    sizes, axes = np.linalg.svd(X - X.mean(axis=0), full_matrices=False)[1:]
    P = np.diag([1.0, 1.0, 0.0])
    if sizes[1] <= STRAIGHT * sizes[0]:
        P[:2, :2] -= np.outer(axes[0], axes[0])
    return P


def stress_stiffness(link: Link) -> StressStiffness:
    """The map from a state g (n, d), link frame, to the stress stiffness k (n, n) of its stresses [N/m].

    Of a reduced link Qᵀ k Q with k of the link that it was made from; of a rigid one that of its forces.
    """
    if link.rigid:
        return lambda g: _rigid(link, g)
    if link.full is not None and link.Q is not None:
        full, Q = stress_stiffness(link.full), link.Q
        return lambda g: _symmetric(Q.T @ np.asarray(full(Q @ g) @ Q))
    match link.kind:
        case "beam":
            return lambda g: _beam(link, g)
        case "spatial_beam":
            return lambda g: spatial_stress_stiffness(link, g)
        case _:
            on = sparsity_pattern(link.basis)
            return lambda g: _meshed(link, on, g)


def _meshed(link: Link, on: SparsityPattern, g: Float[np.ndarray, "n d"]) -> sp.csr_array:
    """Stress stiffness of a solid or plane link, at the Gauss points of K0."""
    (lam, mu), basis = link.lame, link.basis
    shapes: list[skfem.DiscreteField] = [shape[0] for shape in basis.basis]
    local = np.empty((basis.nelems, len(shapes), len(shapes)))
    for first in range(0, basis.nelems, ELEMENTS):
        e = slice(first, first + ELEMENTS)
        dN = np.stack([np.asarray(shape.grad)[:, e] for shape in shapes])  # (a, i, e, q)
        H = np.einsum("aieq,aej->jieq", dN, g[basis.element_dofs[:, e]], optimize=True)
        stress = mu * (H + H.transpose(1, 0, 2, 3))
        stress[range(link.d), range(link.d)] += lam * np.trace(H)
        stress *= link.thickness * basis.dx[e]
        flux = np.einsum("ijeq,bjeq->beiq", stress, dN, optimize=True)
        rows = dN.transpose(2, 0, 1, 3).reshape(flux.shape[1], len(shapes), -1)
        columns = flux.transpose(1, 0, 2, 3).reshape(rows.shape)
        local[e] = rows @ columns.transpose(0, 2, 1)
    return on.assembled(local)


def _beam(link: Link, g: Float[np.ndarray, "n d"]) -> sp.csr_array:
    """∫ N N_a' N_b' ds of a planar beam with its axial force N."""
    area, m = section_of(link).area, link.cells.shape[1]
    points = list(zip(*np.polynomial.legendre.leggauss(m - 1), strict=True))
    blocks = []
    for cell in link.cells:
        k = np.zeros((m, m))
        for r, w in points:
            rows, det_J = strain_rows(link.X[cell, :2], float(r))
            axial = rows[0].reshape(m, 3)
            N = link.E * area * float(np.vdot(axial, g[cell]))
            k += w * det_J * N * axial @ axial.T  # N_a' t · N_b' t
        blocks.append(k)
    return assembled(blocks, link.cells, link.n)


def _rigid(link: Link, g: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "n n"]:
    """k of the functions {1, x, y, z}, by their constant gradients and ∫ σ dV = Σ f_a X_aᵀ of the forces f."""
    space = 2 if link.kind == "beam" else link.d
    f = (link.K0 @ g.ravel()).reshape(g.shape)[:, :space]
    X = link.X[:, :space]
    gradients = np.linalg.pinv(np.column_stack([link.one, X]), rcond=1e-9)[1:].T
    virial = f.T @ X
    return np.asarray(gradients @ _symmetric(virial) @ gradients.T)


def _symmetric(k: Float[np.ndarray, "n n"]) -> Float[np.ndarray, "n n"]:
    return np.asarray((k + k.T) / 2)
