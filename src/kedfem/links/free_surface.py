"""Points on the free surface of a link, where cracks begin, with axes of the surface."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float, Int
from kedfem.links.record import Link
from kedfem.links.recovery import StressRecovery
from kedfem.links.surfaces.surface import boundary, surface_quadrature

ROUNDING = 1e-9  # of a function whose largest value is one


@dataclass(frozen=True, slots=True)
class FreeSurface:
    """Stress places at the surface of a link.

    places : (k,) their numbers among those of `StressRecovery.stressed`
    axes : (k, 3, 3) two tangents and the outward normal as rows, in the axes of the stress
    """

    places: Int[np.ndarray, " k"]
    axes: Float[np.ndarray, "k 3 3"]


def free_surface(recovery: StressRecovery) -> FreeSurface:
    """Stress places at a link's surface.

    Of solids the nodes of boundary facets, with the mean of their normals; of plane links all nodes, with the normal z;
    of beams all places of their sections, with the beam's tangent and the direction of the shear stress of torsion.
    """
    link = recovery.link
    if link.kind == "solid":
        return _of_solid(link)
    axes = np.tile(np.eye(3), (recovery.stressed, 1, 1))
    if link.kind == "spatial_beam":
        axes = _of_sections(recovery.matrices[1], recovery.matrices[2])
    return FreeSurface(np.arange(recovery.stressed), axes)


def _of_solid(link: Link) -> FreeSurface:
    facets, _, _ = boundary(link)
    of = surface_quadrature(link, facets)
    on = (np.abs(of.N) > ROUNDING).any(axis=1)  # (f, m) functions of nodes on a facet: others are zero there
    normals = np.zeros((link.n, 3))
    mean = np.einsum("fq,fqk->fk", of.dA, of.normals)
    for m in range(of.dofs.shape[1]):
        np.add.at(normals, of.dofs[on[:, m], m], mean[on[:, m]])
    places = np.unique(of.dofs[on])
    return FreeSurface(places, surface_axes(normals[places]))


def surface_axes(normals: Float[np.ndarray, "k 3"]) -> Float[np.ndarray, "k 3 3"]:
    """Two tangents and the unit normal, as rows, from normals of any length."""
    n = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    least = np.eye(3)[np.abs(n).argmin(axis=1)]
    first = np.cross(least, n)
    first /= np.maximum(np.linalg.norm(first, axis=1, keepdims=True), 1e-300)
    return np.stack([first, np.cross(n, first), n], axis=1)


def _of_sections(xy: sp.csr_array, zx: sp.csr_array) -> Float[np.ndarray, "k 3 3"]:
    """The beam's tangent, the direction of the shear stress of torsion in the section, and the normal to both.

    Shear stress at a place is proportional to the twist, so that its direction is constant.
    """
    own = np.asarray(xy.multiply(xy).sum(axis=1)).ravel()
    both = np.asarray(xy.multiply(zx).sum(axis=1)).ravel()
    other = np.asarray(zx.multiply(zx).sum(axis=1)).ravel()
    angle = 0.5 * np.arctan2(2 * both, own - other)
    out = np.zeros((len(angle), 3, 3))
    out[:, 0, 0] = 1.0
    out[:, 1, 1], out[:, 1, 2] = np.cos(angle), np.sin(angle)
    out[:, 2, 1], out[:, 2, 2] = -np.sin(angle), np.cos(angle)
    return out
