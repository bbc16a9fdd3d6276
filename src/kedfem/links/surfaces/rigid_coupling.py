"""Rigid couplings: coupling surfaces that keep their shape, such as a bore about a pressed-in pin.

A penalty energy keeps the surface rigid: of its deviation from the affine field through a few of its nodes, and of that
field's deviation from the nearest rigid motion. Its matrix is added to the link's K0: symmetric, the same in every
direction of the link, zero on rigid motions. Each node of the surface is coupled to these few only: K0 stays sparse."""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float, Int
from kedfem.links.record import Link
from kedfem.links.reduced import reduced, rigid_motions
from kedfem.links.surfaces.coupling_surfaces import CouplingSurface
from kedfem.links.surfaces.surface import surface_quadrature

#: κ in E per radius of the surface. The error of the shape is proportional to 1/STIFF, rounding to STIFF: here a bore
#: deforms by 5e-4 of a distributing one, with deflections within 2e-4 of those about rigid pins (docs/ports.md).
STIFF = 1e3
FLAT = 1e-5  # of the radius: largest distance of the nodes of a flat coupling surface from their plane
EQUAL = 1e-6  # of the largest distance: smaller differences between nodes are rounding
NOTHING = 1e-12  # of the largest value: functions that vanish on the coupling surface


def with_rigid_coupling(link: Link, surface: CouplingSurface, times: float = STIFF) -> Link:
    """A link whose coupling surface keeps its shape; beams and rigid links, whose sections are rigid, are unchanged.

    K0 ← K0 + κ [((1 − L P)ᵀ G (1 − L P)) ⊗ I + Pᵀ (D − D B (Bᵀ D B)⁻¹ Bᵀ D) P], κ = times · E / radius [N/m³], with
    G_ab = ∫ N_a N_b dΓ over the coupling surface, P a few nodes of it far apart, L the affine field through these at all
    its nodes, D = (Lᵀ G L) ⊗ I, and B the rigid motions of the few.

    Parameters
    ----------
    link : reduced or not; a reduced one keeps its functions
    times : stiffness relative to E / radius [-]
    """
    if link.full is not None and link.Q is not None:
        return reduced(with_rigid_coupling(link.full, surface, times), link.Q)
    if surface.facets is None or link.rigid:
        return link
    nodes, G = surface_gram(link, surface.facets)
    x, unit = (link.X[nodes] - surface.origin) / surface_radius(surface), sp.eye_array(link.d)
    few = _far_apart(x)
    L, P = _affine(x, few), _choice(few, len(x))
    off = sp.csr_array(sp.eye_array(len(x)) - sp.csr_array(L) @ P)
    D, B = np.kron(L.T @ (G @ L), np.eye(link.d)), rigid_motions(x[few], np.ones(len(few)), link.d)
    bent = D - D @ B @ np.linalg.solve(B.T @ D @ B, B.T @ D)
    on_few = sp.csr_array(sp.kron(P, unit))
    within = sp.kron(off.T @ G @ off, unit) + on_few.T @ sp.csr_array(bent) @ on_few
    at = sp.csr_array(sp.kron(_choice(nodes, link.n), unit))
    added = times * link.E / surface_radius(surface) * sp.csr_array(at.T @ within @ at)
    return replace(link, K0=sp.csr_array(link.K0 + (added + added.T) / 2))


def _choice(which: Int[np.ndarray, " k"], n: int) -> sp.csr_array:
    """(k, n): values at some of n nodes."""
    return sp.csr_array((np.ones(len(which)), (np.arange(len(which)), which)), shape=(len(which), n))


def _affine(x: Float[np.ndarray, "b 3"], few: Int[np.ndarray, " k"]) -> Float[np.ndarray, "b k"]:
    """L: values at all places of the affine field through values at a few."""
    parts = (x - x[few[0]]) @ np.linalg.pinv(x[few[1:]] - x[few[0]])
    return np.column_stack([1 - parts.sum(axis=1), parts])


def _far_apart(x: Float[np.ndarray, "b 3"]) -> Int[np.ndarray, " k"]:
    """Nodes that determine an affine field: four, three of a plane face, two of a straight edge; the first of equals."""
    chosen: list[int] = []
    left = x - x.mean(axis=0)
    for _ in range(4):
        size = np.linalg.norm(left, axis=1)
        if size.max() < FLAT:
            break
        chosen.append(int(np.argmax(size > (1 - EQUAL) * size.max())))
        if len(chosen) == 1:
            left = x - x[chosen[0]]
        else:
            e = left[chosen[-1]] / size[chosen[-1]]
            left = left - np.outer(left @ e, e)
    return np.array(chosen)


def surface_radius(surface: CouplingSurface) -> float:
    """The radius of a bore; of other coupling surfaces the radius of a bore with the same spread [m]."""
    return float(np.sqrt(2) * surface.spread[surface.spread > 0][:2][-1])


def surface_gram(link: Link, facets: Int[np.ndarray, " f"]) -> tuple[Int[np.ndarray, " b"], sp.csr_array]:
    """The functions that do not vanish on facets, and G_ab = ∫ N_a N_b dΓ of these [m²]."""
    on = surface_quadrature(link, facets)
    size = np.abs(on.N).max(axis=1)  # (f, m)
    nodes = np.unique(on.dofs[size > NOTHING * size.max()])
    place = np.full(link.n, -1)
    place[nodes] = np.arange(len(nodes))
    local = np.einsum("fqm,fqk,fq->fmk", on.N, on.N, on.dA, optimize=True)
    here = place[on.dofs]
    rows, columns = np.broadcast_arrays(here[:, :, None], here[:, None, :])
    used = (rows >= 0) & (columns >= 0)
    entries = sp.coo_array((local[used], (rows[used], columns[used])), shape=(len(nodes), len(nodes)))
    return nodes, sp.csr_array(entries)
