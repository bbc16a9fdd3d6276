"""The error of stresses in each element: the indicator of Zienkiewicz and Zhu (1987).

The recovered stress, averaged at the nodes and interpolated by the shape functions, is closer to the exact stress than
that of the element. Their difference estimates the error of the mesh, relative to the whole in the energy norm:

    η² = ∫ (σ* − σ_h) : C⁻¹ : (σ* − σ_h) / (∫ σ_h : C⁻¹ : σ_h + the same)

The error of a displacement under the loads, that is of a compliance, is η². At a re-entrant edge without a fillet, and
under a point force, the exact stress is singular and no stress converges; `re_entrant` finds such edges.
"""

from dataclasses import dataclass

import numpy as np
import skfem

from kedfem.arrays import Float
from kedfem.links.record import Link
from kedfem.links.recovery import nodal_gradients, nodal_state
from kedfem.links.singular_stress import re_entrant

NEAR_PEAK = 0.5  # of the highest density of the error: a re-entrant edge there is reported


@dataclass(frozen=True, slots=True)
class Indicator:
    """The error indicator of one meshed link in one state.

    elements : (e,) share of each element in η², by volume: its density of the error over the mean energy's [-]
    error, energy : ∫ of the difference, and of the element's own stress: twice strain energies [J]
    singular : whether the error is greatest at a re-entrant edge
    """

    elements: Float[np.ndarray, " e"]
    error: float
    energy: float
    singular: bool

    @property
    def eta(self) -> float:
        """η of the link."""
        whole = self.error + self.energy
        return float(np.sqrt(self.error / whole)) if whole else 0.0


def indicator(link: Link, g: Float[np.ndarray, "n d"]) -> Indicator:
    """The indicator of a meshed link in a state of its own frame, of a reduced one on the mesh that it was made from."""
    g, link = nodal_state(link, g), link.full or link
    d, basis = link.d, skfem.Basis(link.basis.mesh, link.basis.elem, intorder=4)
    H = np.stack([G @ g for G in nodal_gradients(link)], axis=2)  # (n, i, j)
    own, recovered = np.zeros((2, d, d, *basis.dx.shape))  # (i, j, e, q)
    for (shape,), dofs in zip(basis.basis, basis.element_dofs, strict=True):
        own += g[dofs].T[:, None, :, None] * np.asarray(shape.grad)
        recovered += H[dofs].transpose(1, 2, 0)[..., None] * np.asarray(shape)
    both = recovered - own, own
    error, energy = ((_density(link, x) * basis.dx).sum(axis=1) * link.thickness for x in both)
    volume = basis.dx.sum(axis=1) * link.thickness
    mean = (error.sum() + energy.sum()) / volume.sum()
    density = error / volume
    elements = np.sqrt(density / mean) if mean else np.zeros_like(density)
    worst = density >= NEAR_PEAK * density.max(initial=0.0)
    singular = bool(mean) and bool(re_entrant(link)[link.cells[worst]].any())
    return Indicator(elements, float(error.sum()), float(energy.sum()), singular)


def _density(link: Link, H: Float[np.ndarray, "d d e q"]) -> Float[np.ndarray, "e q"]:
    """σ : ε = λ (tr ε)² + 2 μ ε : ε of displacement gradients; of a plane link with λ*."""
    lam, mu = link.lame
    strain = (H + H.swapaxes(0, 1)) / 2
    return np.asarray(lam * np.einsum("iieq->eq", strain) ** 2 + 2 * mu * (strain**2).sum(axis=(0, 1)))
