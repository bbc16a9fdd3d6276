"""Stress stiffness of beams in space: the part of their strains that is quadratic in the displacement.

Strains are changes of scalar products of the fields e = (x', n1, n2, n1', n2'), s_i = Σ c_iαβ e_α · e_β / 2, c symmetric.
The linear part, Σ c e_α · δe_β, is `spatial_beam.space_strains`; the quadratic one is ½ Σ c δe_α · δe_β. Its product with
the stress resultants S_i, integrated along the beam, is ½ uᵀ (k ⊗ I) u.
"""

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float
from kedfem.links.beams.beam import assembled, dofs, parent_nodes, parent_weights, shape_functions
from kedfem.links.beams.spatial_beam import (
    N1_S,
    N2_S,
    RIGID_NODE_STIFFNESS,
    fields,
    length_of,
    metric,
    rigid_node_functions,
    rigidities,
    section_strains,
    space_strains,
)
from kedfem.links.record import Link, section_of


def spatial_stress_stiffness(link: Link, g: Float[np.ndarray, "n 3"]) -> sp.csr_array:
    """k (n, n) of the stresses in a state g of a full beam in space.

    Section forces at the Gauss points of K0, with the effect E I ε of an axial force on a section that rotates along the
    beam; the sections' own stresses at the nodes; the stresses of rigid cross-section nodes.
    """
    if link.triples is None:
        raise TypeError(f"links.{link.name}: is not a beam in space")
    frame = np.asarray(link.triples @ link.X).reshape(-1, 3, 3)
    state = np.asarray(link.triples @ g).reshape(-1, 3, 3)
    blocks = [_element(link, frame[c], state[c]) for c in link.cells]
    k = sp.csr_array(link.triples.T @ assembled(blocks, dofs(link.cells), 3 * len(frame)) @ link.triples)
    return sp.csr_array(k + _rigid_nodes(link, frame, g))


def _element(link: Link, x: Float[np.ndarray, "m 3 3"], u: Float[np.ndarray, "m 3 3"]) -> Float[np.ndarray, "k k"]:
    m, section = len(x), section_of(link)
    rigidity = rigidities(section, link.E, link.lame[1])
    EA, _, _, EI_y, EI_z, _ = rigidity
    out = np.zeros((3 * m, 3 * m))
    for r, w in zip(*np.polynomial.legendre.leggauss(m - 1), strict=True):
        rows, det_J = space_strains(x, float(r))
        strain = np.einsum("imfc,mfc->i", rows, u)
        weights, _ = fields(x, float(r))
        c = np.einsum("i,iab->ab", rigidity * strain, metric(np.einsum("amf,mfc->ac", weights, x)))
        c[N1_S, N1_S] += EI_y * strain[0]
        c[N2_S, N2_S] += EI_z * strain[0]
        flat = weights.reshape(5, -1)
        out += w * det_J * flat.T @ c @ flat
    for a, (parent, weight) in enumerate(zip(parent_nodes(m), parent_weights(m), strict=True)):
        det_J = float(np.linalg.norm(shape_functions(parent, m)[1] @ x[:, 0]))
        s = EA * weight * det_J * np.einsum("ifc,fc->i", section_strains(x[a]), u[a])
        p, q = 3 * a + 1, 3 * a + 2
        out[p, p] += s[0]
        out[p, q] += s[1] / 2
        out[q, p] += s[1] / 2
        out[q, q] += s[2]
    return out


def _rigid_nodes(link: Link, frame: Float[np.ndarray, "s 3 3"], g: Float[np.ndarray, "n 3"]) -> sp.csr_array:
    """Stresses of the rigid cross-section nodes, stiffness times sym G, between their gradient functions."""
    stiffness = RIGID_NODE_STIFFNESS * link.E * section_of(link).area * length_of(frame[:, 0], link.cells)
    rigid_nodes = rigid_node_functions(link.one)
    H = np.einsum("hac,hbc->hab", link.X[rigid_nodes], g[rigid_nodes])
    return assembled(list(stiffness * (H + H.transpose(0, 2, 1)) / 2), rigid_nodes, link.n)
