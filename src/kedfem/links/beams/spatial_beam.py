"""Beams in space: a line element times a linear section, functions N_a(s) {1, y, z} with a vector in R³ at each.

x = Σ N_a (x_a + y n1_a + z n2_a) and u = Σ N_a (u_a + y p_a + z q_a): isoparametric, so that the space contains rigid
motions. A state has rows of vectors as in a solid, with mass m ⊗ I3, [KED, eqs. (4)(9)(11)]. Strains are linearised
changes of the metric of axis and directors, which vanish for rigid motions.
"""

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float, Int
from kedfem.links.beams.beam import assembled, cell_type, chord_axes, dofs, parent_nodes, parent_weights, shape_functions
from kedfem.links.beams.beam_axis import Axis
from kedfem.links.beams.section import Section
from kedfem.links.record import Link, mass_constants, read_only
from kedfem.scene import Material

RIGID_NODE_STIFFNESS = 100.0  # of E A L: compliance of a corner EI/(100 E A L²) of the beam's
RIGID_NODE_INERTIA = 1e-3  # of a cube's, along the axis, in which the section itself has no inertia
STRAIGHT = 1e-9  # of tangents: rounding
T, N1, N2, N1_S, N2_S = range(5)  # the fields x', n1, n2, n1', n2'


def space_strains(x: Float[np.ndarray, "m 3 3"], r: float) -> tuple[Float[np.ndarray, "6 m 3 3"], float]:
    """Strains (ε, γ1, γ2, κ1, κ2, τ) from an element's (u, p, q), and det J.

    With tangent t, directions n1, n2, ' the derivative by arc length, a = n1·p, b = ½ (n1·q + n2·p), c = n2·q:
    ε = t·u', γ1 = n1·u' + t·p, γ2 = n2·u' + t·q,
    κ1 = t·p' + n1'·u' − (n1'·t) (ε + a) − (n1'·n2) γ2 − (n2'·t) b,
    κ2 = t·q' + n2'·u' − (n2'·t) (ε + c) − (n2'·n1) γ1 − (n1'·t) b,
    τ = ½ (n2·p' + n1'·q − n1·q' − n2'·p) − (n1'·n2) (a + c).
    If sections turn by θ(s), and whatever their own strains a, b, c: κ1 = −θ'·n2, κ2 = θ'·n1, τ = θ'·t.

    Parameters
    ----------
    x : (m, 3, 3) position and the section's directions n1, n2 at each node
    r : parent coordinate in [-1, 1]

    Returns
    -------
    (6, m, 3, 3) by strain, node, function (u, p, q) and component; det J [m]
    """
    weights, det_J = fields(x, r)
    e = np.einsum("amf,mfc->ac", weights, x)
    return np.einsum("iab,ac,bmf->imfc", metric(e), e, weights), det_J


def fields(x: Float[np.ndarray, "m 3 3"], r: float) -> tuple[Float[np.ndarray, "5 m 3"], float]:
    """Weights of (u', p, q, p', q') on an element's (u, p, q), and det J."""
    N, dN = shape_functions(r, len(x))
    det_J = float(np.linalg.norm(dN @ x[:, 0]))
    out = np.zeros((5, len(x), 3))
    for field, of, weights in ((T, 0, dN / det_J), (N1, 1, N), (N2, 2, N), (N1_S, 1, dN / det_J), (N2_S, 2, dN / det_J)):
        out[field, :, of] = weights
    return out, det_J


def metric(e: Float[np.ndarray, "5 3"]) -> Float[np.ndarray, "6 5 5"]:
    """Coefficients c of the strains (ε, γ1, γ2, κ1, κ2, τ) in the scalar products of the undeformed fields e."""
    t, n1, n2, n1_s, n2_s = e
    a, b, c, stretch, shear_1, shear_2, bend_1, bend_2, twist_1, twist_2 = (
        _product(*pair)
        for pair in ((N1, N1), (N1, N2), (N2, N2), (T, T), (T, N1), (T, N2), (T, N1_S), (T, N2_S),
                     (N2, N1_S), (N1, N2_S))
    )  # fmt: skip
    b = b / 2
    kappa_1 = bend_1 - (n1_s @ t) * (stretch + a) - (n1_s @ n2) * shear_2 - (n2_s @ t) * b
    kappa_2 = bend_2 - (n2_s @ t) * (stretch + c) - (n2_s @ n1) * shear_1 - (n1_s @ t) * b
    tau = (twist_1 - twist_2) / 2 - (n1_s @ n2) * (a + c)
    return np.stack([stretch, shear_1, shear_2, kappa_1, kappa_2, tau])


def _product(a: int, b: int) -> Float[np.ndarray, "5 5"]:
    """c of the scalar product e_a · e_b; of e_a · e_a half of that, as a strain has it."""
    c = np.zeros((5, 5))
    c[a, b] = c[b, a] = 1.0
    return c


def section_strains(x: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "3 3 3"]:
    """Strains within the section at a node, n1·p, ½ (n1·q + n2·p) and n2·q: rows by strain, function and component."""
    rows = np.zeros((3, 3, 3))
    rows[0, 1], rows[1, 1], rows[1, 2], rows[2, 2] = x[1], x[2] / 2, x[1] / 2, x[2]
    return rows


def rigidities(section: Section, E: float, G: float) -> Float[np.ndarray, "6"]:
    """(EA, κ1 GA, κ2 GA, E I_y, E I_z, GJ) [N, N m²]."""
    A, (k1, k2) = section.area, section.shear_coefficients
    return np.array([E * A, k1 * G * A, k2 * G * A, E * section.second_moment, E * section.second_moment_z,
                     G * section.torsion_constant])  # fmt: skip


def space_stiffness(x: Float[np.ndarray, "m 3 3"], rigidity: Float[np.ndarray, "6"]) -> Float[np.ndarray, "k k"]:
    """Stiffness of one element, [KED, eq. (13)].

    Beam strains by reduced integration (m − 1 Gauss points); strains within the section at the nodes, with the axial
    stiffness and without ν: the section keeps its shape, and does not lock.

    Parameters
    ----------
    rigidity : (EA, κ1 GA, κ2 GA, E I_y, E I_z, GJ) [N, N m²]
    """
    m = len(x)
    K = np.zeros((9 * m, 9 * m))
    for r, w in zip(*np.polynomial.legendre.leggauss(m - 1), strict=True):
        rows, det_J = space_strains(x, float(r))
        B = rows.reshape(6, -1)
        K += w * det_J * (B.T * rigidity) @ B
    for a, (parent, weight) in enumerate(zip(parent_nodes(m), parent_weights(m), strict=True)):
        _, dN = shape_functions(parent, m)
        S = section_strains(x[a]).reshape(3, 9)
        here = slice(9 * a, 9 * a + 9)
        K[here, here] += weight * np.linalg.norm(dN @ x[:, 0]) * rigidity[0] * S.T @ S
    return K


def space_mass(x: Float[np.ndarray, "m 3 3"], section: Section) -> Float[np.ndarray, "k k"]:
    """∫ N_a N_b det J ⊗ diag(A, I_y, I_z) of one element, (3m, 3m), to be multiplied by ρ, [KED, eq. (9)]."""
    m = np.zeros((len(x), len(x)))
    for r, w in zip(*np.polynomial.legendre.leggauss(len(x) + 1), strict=True):
        N, dN = shape_functions(r, len(x))
        m += w * np.linalg.norm(dN @ x[:, 0]) * np.outer(N, N)
    return np.kron(m, np.diag([section.area, section.second_moment, section.second_moment_z]))


def spatial_beam_link(name: str, axis: Axis, section: Section, material: Material) -> Link:
    """The record of a beam in space.

    Ends and corners are rigid cross-section nodes with four functions {1, x, y, z}: an affine field with the energy
    ½ RIGID_NODE_STIFFNESS E A L |sym G|², whose gradient G gives each segment p = G n1, q = G n2 in its own directions.
    """
    X, one, triples = functions(axis)
    x, cells, n = axis.frame[:, [0, 2, 3]], axis.cells, len(X)
    rigidity = rigidities(section, material.youngs_modulus, material.shear_modulus)
    by_station = dofs(cells)
    m = assembled([material.density * space_mass(x[c], section) for c in cells], by_station, 3 * len(x))
    K = assembled([space_stiffness(x[c], rigidity) for c in cells], dofs(by_station), 9 * len(x))
    vectors = sp.csr_array(sp.kron(triples, sp.eye_array(3)))
    cube = np.sqrt(section.area) * min(section.second_moment, section.second_moment_z)
    rigid_nodes = rigid_node_functions(one)
    lumped = np.zeros(n)
    lumped[rigid_nodes[:, 0]] = RIGID_NODE_INERTIA * material.density * cube
    m = sp.csr_array(triples.T @ m @ triples + sp.diags_array(lumped))
    K0 = sp.csr_array(
        vectors.T @ K @ vectors
        + rigid_node_stiffness(X, rigid_nodes, RIGID_NODE_STIFFNESS * rigidity[0] * length_of(axis.frame[:, 0], cells))
    )
    mass = (m, m, m)
    m1, mX = mass_constants(mass, one, X)
    read_only(X, one, cells, m1, mX)
    return Link(
        name=name, kind="spatial_beam", X=X, one=one, cells=cells, cell_type=cell_type(cells.shape[1]),
        axes=_link_axes(axis), mass=mass, K0=K0, m1=m1, mX=mX, volume=m1[:, 0] / material.density,
        E=material.youngs_modulus, lame=material.lame(), section=section, triples=triples,
    )  # fmt: skip


def _link_axes(axis: Axis) -> Float[np.ndarray, "3 3"]:
    """Axes of a straight beam's section, else x between its ends; of a closed beam along its first element."""
    chord = chord_axes(axis.frame[[0, axis.cells[0][1], -1], 0], axis.up)
    straight = np.abs(axis.frame[:, 1] - chord[:, 0]).max() < STRAIGHT
    return np.asarray(axis.frame[0, 1:].T) if straight else chord


def functions(axis: Axis) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"], sp.csr_array]:
    """Functions of all nodes in order, (1, y, z), or (1, x, y, z) of a rigid one in the directions of its first station.

    Returns
    -------
    X, one : coefficients of position and of the constant
    triples : (3s, n) values of (x, n1, n2), and so of (u, p, q), at every station
    """
    first = np.unique(axis.node, return_index=True)[1]
    count = np.where(axis.rigid_node, 4, 3)
    start = np.concatenate([[0], count.cumsum()])
    X, one = np.empty((start[-1], 3)), np.zeros(start[-1])
    one[start[:-1]] = 1.0
    triples = sp.lil_array((3 * len(axis.node), start[-1]))
    for k, s in enumerate(first):
        X[start[k] : start[k + 1]] = axis.frame[s] if axis.rigid_node[k] else axis.frame[s, [0, 2, 3]]
    for s, k in enumerate(axis.node):
        own = slice(start[k] + 1, start[k + 1])
        triples[3 * s, start[k]] = 1.0
        turned = axis.frame[s, 2:] @ X[own].T
        turned[np.abs(turned) < 1e-15] = 0.0  # rounding
        triples[3 * s + 1 : 3 * s + 3, own] = turned
    return X, one, sp.csr_array(triples)


def rigid_node_functions(one: Float[np.ndarray, " n"]) -> Int[np.ndarray, "h 3"]:
    """Numbers of the three gradient functions of every rigid cross-section node."""
    start = np.append(np.flatnonzero(one), len(one))
    node = start[:-1][np.diff(start) == 4]
    return np.asarray(node[:, None] + np.arange(1, 4))


def rigid_node_stiffness(X: Float[np.ndarray, "n 3"], rigid_nodes: Int[np.ndarray, "h 3"], k: float) -> sp.csr_array:
    """k |sym G|² of every rigid cross-section node's gradient G, (3n, 3n) [N m]; zero for rotations."""
    blocks = []
    for node in rigid_nodes:
        pairs = [(i, j) for i in range(3) for j in range(i, 3)]
        rows = np.zeros((6, 3, 3))
        for row, (i, j) in zip(rows, pairs, strict=True):
            row[i] += X[node[j]] / (2 if i == j else np.sqrt(2))
            row[j] += X[node[i]] / (2 if i == j else np.sqrt(2))
        B = rows.reshape(6, 9)
        blocks.append(k * B.T @ B)
    return assembled(blocks, dofs(rigid_nodes), 3 * len(X))


def length_of(stations: Float[np.ndarray, "s 3"], cells: Int[np.ndarray, "e m"]) -> float:
    """Length of an axis by the chords of its elements [m]."""
    ends = stations[cells[:, :2]]
    return float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum())
