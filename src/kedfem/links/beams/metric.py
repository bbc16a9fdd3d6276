"""Elements of beams in space with strains as changes of the metric of axis and directors, exact for any rotation.

Node a has the gradient functions g_k, in the reference position X_k; its rotation Q_a is the nearest to them, Σ g_k ⊗
X_k = Q_a U, and its directors are d_i = Q_a n_i. With x' and d_i interpolated, and b = n1'·t, n2'·t, n1'·n2, n2'·n1 in
the reference position,

    ε = |x'| − 1,   γ_i = x'·d_i,   a_ij = ½ d_i·d_j
    κ1 = x'·d1' − b1 (ε + a11) − b3 γ2 − b2 a12,   κ2 = x'·d2' − b2 (ε + a22) − b4 γ1 − b1 a12
    τ = ½ (d2·d1' − d1·d2') − b3 (a11 + a22)

less their values in the reference position. They vanish for finite rigid motions: these elements need no frame.
For small displacements they are `spatial_beam.space_strains` of p, q = θ × n1, θ × n2. Strains within the section,
½ (g_k·g_l − X_k·X_l), do not rotate nodes: they are independent of the beam's forces and have a stiffness of their own.
"""

from dataclasses import replace

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.links.beams.beam import parent_weights, shape_functions
from kedfem.links.record import BeamElement, read_only
from kedfem.vectors import cross

# of κ G A l: the stiffness of sections against shear, so that A fits at any rotation of them
SECTION_STIFF = 1.0
# of E I / l, in addition, at ends and corners, which joints strain
RIGID_NODE_STIFF = 1000.0
Vectors = Float[np.ndarray, "*b _ 3"]
Column = Float[np.ndarray, "*b _"]


def beam_element(
    x: Float[np.ndarray, "m 3 3"],
    X: Float[np.ndarray, "n 3"],
    one: Float[np.ndarray, " n"],
    order: Int[np.ndarray, " m"],
    rigidity: Float[np.ndarray, "6"],
) -> BeamElement:
    """The record of an element.

    Parameters
    ----------
    x : position and the section's directions at its nodes, ends first
    X, one : functions of the element, node after node along it: a value, then two or three directions
    order : of each of its nodes, which it is along the element
    rigidity : of `spatial_beam.rigidities`
    """
    m, first = len(x), np.flatnonzero(one)[order]
    count = np.diff(np.append(np.flatnonzero(one), len(one)))[order] - 1
    gradient = np.concatenate([f + 1 + np.arange(c) for f, c in zip(first, count, strict=True)])
    node = np.repeat(np.arange(m), count)
    places, weights = np.polynomial.legendre.leggauss(m - 1)
    N, D = np.array([shape_functions(float(r), m) for r in places]).transpose(1, 0, 2)
    det_J = np.linalg.norm(D @ x[:, 0], axis=1)
    D = D / det_J[:, None]
    t, n1, n2, n1_s, n2_s = D @ x[:, 0], N @ x[:, 1], N @ x[:, 2], D @ x[:, 1], D @ x[:, 2]
    bend = np.stack([(a * b).sum(axis=1) for a, b in ((n1_s, t), (n2_s, t), (n1_s, n2), (n2_s, n1))], axis=1)
    pairs = np.array([(i, j) for i in range(len(node)) for j in range(i, len(node)) if node[i] == node[j]])
    tangents, gradients = np.zeros((m - 1, len(X))), np.zeros((len(node), len(X)))
    tangents[:, first], gradients[np.arange(len(node)), gradient] = D, 1.0
    lengths = weights * det_J
    shear = rigidity[1:3].max() * parent_weights(m) / 2 * lengths.sum()
    stiff = SECTION_STIFF * shear + (count == 3) * RIGID_NODE_STIFF * rigidity[3:5].max() / lengths.sum()
    stiffness = np.concatenate([np.outer(lengths, rigidity).ravel(), stiff[node[pairs[:, 0]]]])
    made = BeamElement(tangents, gradients, node, X[gradient], x[:, 1:].copy(), N, D, bend, pairs, stiffness,
                       np.zeros(len(stiffness)), np.zeros((len(stiffness), 3 * len(X))),
                       np.zeros((3 * len(X), len(stiffness))))  # fmt: skip
    made = replace(made, drawn_strains=strains_of(made, X))
    rows = pulled_back(made, X, np.eye(len(stiffness))).reshape(len(stiffness), -1)
    made = replace(made, rows=rows, share=np.linalg.pinv(rows))
    read_only(made.drawn_strains, made.rows, made.share)
    return made


def strains_of(element: BeamElement, y: Vectors) -> Column:
    """Strains at a position: ε, γ1, γ2, κ1, κ2, τ at each Gauss point, then those within sections."""
    g, x = element.gradients @ y, element.tangents @ y
    d1, d2, s1, s2 = _interpolated(element, _directors(element, node_rotations(element, g)))
    b1, b2, b3, b4 = element.bend.T
    eps = np.linalg.norm(x, axis=-1) - 1
    gamma1, gamma2 = _dot(x, d1), _dot(x, d2)
    a11, a12, a22 = (_dot(d1, d1) - 1) / 2, _dot(d1, d2) / 2, (_dot(d2, d2) - 1) / 2
    kappa1 = _dot(x, s1) - b1 * (eps + a11) - b3 * gamma2 - b2 * a12
    kappa2 = _dot(x, s2) - b2 * (eps + a22) - b4 * gamma1 - b1 * a12
    tau = (_dot(d2, s1) - _dot(d1, s2)) / 2 - b3 * (a11 + a22)
    i, j = element.pairs.T
    change = _dot(g[..., i, :], g[..., j, :]) - _dot(element.drawn[i], element.drawn[j])
    beam = np.stack([eps, gamma1, gamma2, kappa1, kappa2, tau], axis=-1)
    every = [beam.reshape(*beam.shape[:-2], -1), _pair_factors(element) * change]
    return np.asarray(np.concatenate(every, axis=-1) - element.drawn_strains)


def pulled_back(
    element: BeamElement, y: Float[np.ndarray, "*#b n 3"], stress: Float[np.ndarray, "*#b s"]
) -> Float[np.ndarray, "*#b n 3"]:
    """Nodal forces (…, n, 3) of stress resultants (…, s), or of many at one position: (∂ strains / ∂ y)ᵀ stress."""
    g, x = element.gradients @ y, element.tangents @ y
    Q = node_rotations(element, g)
    d = _directors(element, Q)
    d1, d2, s1, s2 = _interpolated(element, d)
    E, b = x.shape[-2], element.bend.T[:, :, None]
    on = stress[..., : 6 * E].reshape(*stress.shape[:-1], E, 6)
    n, v1, v2, m1, m2, t = (on[..., k : k + 1] for k in range(6))
    a11, a12, a22 = -b[0] * m1 - b[2] * t, -(b[1] * m1 + b[0] * m2) / 2, -b[1] * m2 - b[2] * t
    n, v1, v2 = n - b[0] * m1 - b[1] * m2, v1 - b[3] * m2, v2 - b[2] * m1
    on_x = n * x / np.linalg.norm(x, axis=-1)[..., None] + v1 * d1 + v2 * d2 + m1 * s1 + m2 * s2
    on_d = (v1 * x + a11 * d1 + a12 * d2 - t / 2 * s2, v2 * x + a22 * d2 + a12 * d1 + t / 2 * s1)
    on_s = (m1 * x + t / 2 * d2, m2 * x - t / 2 * d1)
    torque = sum(cross(d[..., i, :], element.N.T @ on_d[i] + element.D.T @ on_s[i]) for i in range(2))
    on_g = _torque_forces(element, g, Q, np.asarray(torque))
    first, second = (np.eye(len(element.node))[:, each] for each in element.pairs.T)
    c = (_pair_factors(element) * stress[..., 6 * E :])[..., None]
    on_g += first @ (c * (second.T @ g)) + second @ (c * (first.T @ g))
    return np.asarray(element.tangents.T @ on_x + element.gradients.T @ on_g)


def _torque_forces(
    element: BeamElement, g: Float[np.ndarray, "*#b k 3"], Q: Float[np.ndarray, "*#b m 3 3"],
    torque: Float[np.ndarray, "*#b m 3"],
) -> Float[np.ndarray, "*#b k 3"]:  # fmt: skip
    """Forces on gradient functions with the same virtual work as torques (…, m, 3) on the nodes' rotations."""
    out = np.zeros((*np.broadcast_shapes(g.shape[:-2], torque.shape[:-2]), *g.shape[-2:]))
    for a in range(Q.shape[-3]):
        mine, q = np.flatnonzero(element.node == a), Q[..., a, :, :]
        back = np.swapaxes(q, -1, -2)
        U = back @ (np.swapaxes(g[..., mine, :], -1, -2) @ element.drawn[mine])
        G = np.trace(U, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) - (U + np.swapaxes(U, -1, -2)) / 2
        w = np.linalg.solve(G, back @ torque[..., a, :, None])[..., 0]
        out[..., mine, :] = cross(w[..., None, :], element.drawn[mine]) @ back
    return out


def node_rotations(element: BeamElement, g: Vectors) -> Float[np.ndarray, "*b m 3 3"]:
    """Q of Σ g_k ⊗ X_k = Q U of each node."""
    shares = [np.swapaxes(g[..., mine, :], -1, -2) @ element.drawn[mine]
              for mine in (np.flatnonzero(element.node == a) for a in range(len(element.directors)))]  # fmt: skip
    left, _, right = np.linalg.svd(np.stack(shares, axis=-3))
    left[..., 2] *= np.linalg.det(left @ right)[..., None]
    return np.asarray(left @ right)


def _directors(element: BeamElement, Q: Float[np.ndarray, "*b m 3 3"]) -> Float[np.ndarray, "*b m 2 3"]:
    return np.asarray(element.directors @ np.swapaxes(Q, -1, -2))


def _interpolated(element: BeamElement, d: Float[np.ndarray, "*b m 2 3"]) -> list[Vectors]:
    """d1, d2 and d1', d2' at the Gauss points, (…, E, 3) each."""
    return [of @ d[..., i, :] for of in (element.N, element.D) for i in range(2)]


def _pair_factors(element: BeamElement) -> Column:
    """Factors of strains within a section: |sym|² has off-diagonal components twice."""
    i, j = element.pairs.T
    return np.where(i == j, 0.5, np.sqrt(0.5))


def _dot(a: Vectors, b: Vectors) -> Column:
    return np.asarray((a * b).sum(axis=-1))
