"""Stress stiffness of beams in space: the part of their strains that is quadratic in the displacement.

Strains are changes of scalar products of the fields e = (x', n1, n2, n1', n2'), s_i = Σ c_iαβ e_α · e_β / 2, c symmetric.
The linear part, Σ c e_α · δe_β, is `spatial_beam.space_strains`; the quadratic one is ½ Σ c δe_α · δe_β. Forces S_i times
that, all along the beam, are ½ uᵀ (k ⊗ I) u.
"""

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float
from kedfem.links.beams.beam import assembled, parent_nodes, parent_weights, shape_functions
from kedfem.links.beams.spatial_beam import (
    HUB_STIFFNESS,
    hub_functions,
    length_of,
    rigidities,
    section_strains,
    space_strains,
)
from kedfem.links.record import Link, section_of

T, N1, N2, N1_S, N2_S = range(5)  # the fields x', n1, n2, n1', n2'


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


def spatial_stress_stiffness(link: Link, g: Float[np.ndarray, "n 3"]) -> sp.csr_array:
    """k (n, n) of the stresses in a state g of a full beam in space.

    Section forces at the Gauss points of K0, with what an axial force does to a section that turns along the beam, E I ε;
    the sections' own stresses at the nodes; the hubs' stresses.
    """
    if link.triples is None:
        raise TypeError(f"links.{link.name}: is not a beam in space")
    frame = np.asarray(link.triples @ link.X).reshape(-1, 3, 3)
    state = np.asarray(link.triples @ g).reshape(-1, 3, 3)
    blocks = [_element(link, frame[c], state[c]) for c in link.cells]
    by_station = (3 * link.cells[:, :, None] + np.arange(3)).reshape(len(link.cells), -1)
    k = sp.csr_array(link.triples.T @ assembled(blocks, by_station, 3 * len(frame)) @ link.triples)
    return sp.csr_array(k + _hubs(link, frame, g))


def _element(link: Link, x: Float[np.ndarray, "m 3 3"], u: Float[np.ndarray, "m 3 3"]) -> Float[np.ndarray, "k k"]:
    m, section = len(x), section_of(link)
    rigidity = rigidities(section, link.E, link.lame[1])
    EA, _, _, EI_y, EI_z, _ = rigidity
    out = np.zeros((3 * m, 3 * m))
    for r, w in zip(*np.polynomial.legendre.leggauss(m - 1), strict=True):
        rows, det_J = space_strains(x, float(r))
        strain = np.einsum("imfc,mfc->i", rows, u)
        fields = _fields(float(r), m, det_J)
        c = np.einsum("i,iab->ab", rigidity * strain, metric(np.einsum("amf,mfc->ac", fields, x)))
        c[N1_S, N1_S] += EI_y * strain[0]
        c[N2_S, N2_S] += EI_z * strain[0]
        flat = fields.reshape(5, -1)
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


def _fields(r: float, m: int, det_J: float) -> Float[np.ndarray, "5 m 3"]:
    """Weights of (u', p, q, p', q') on an element's (u, p, q)."""
    N, dN = shape_functions(r, m)
    out = np.zeros((5, m, 3))
    for field, of, weights in ((T, 0, dN / det_J), (N1, 1, N), (N2, 2, N), (N1_S, 1, dN / det_J), (N2_S, 2, dN / det_J)):
        out[field, :, of] = weights
    return out


def _hubs(link: Link, frame: Float[np.ndarray, "s 3 3"], g: Float[np.ndarray, "n 3"]) -> sp.csr_array:
    """Stresses of the hubs, stiffness times sym G, between their gradient functions."""
    stiffness = HUB_STIFFNESS * link.E * section_of(link).area * length_of(frame[:, 0], link.cells)
    hubs = hub_functions(link.one)
    H = np.einsum("hac,hbc->hab", link.X[hubs], g[hubs])
    return assembled(list(stiffness * (H + H.transpose(0, 2, 1)) / 2), hubs, link.n)


def _product(a: int, b: int) -> Float[np.ndarray, "5 5"]:
    """c of the scalar product e_a · e_b; of e_a · e_a half of that, as a strain has it."""
    c = np.zeros((5, 5))
    c[a, b] = c[b, a] = 1.0
    return c
