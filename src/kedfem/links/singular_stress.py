"""Singular stress: at sharp re-entrant edges the stress grows with every refinement of the mesh."""

import numpy as np

from kedfem.arrays import Bool, Float
from kedfem.links.record import Link
from kedfem.links.surfaces.surface import boundary, neighbours, surface_quadrature

SHARP = np.cos(np.radians(20))  # between facets at their edge; those of fillets differ by a few degrees there


def re_entrant(link: Link) -> Bool[np.ndarray, " n"]:
    """Nodes of a meshed link on re-entrant edges without a fillet."""
    full = link.full or link
    out = np.zeros(full.n, bool)
    if not full.meshed:
        return out
    facets, corners, _ = boundary(full)
    first, second = neighbours(full, facets)
    of, mesh = surface_quadrature(full, facets), full.basis.mesh
    numbers = mesh.facets[:, facets].T
    common = (numbers[first][:, :, None] == numbers[second][:, None, :]).any(axis=2)
    edge = np.nanmean(np.where(common[:, :, None], corners[first], np.nan), axis=1)
    normals = [_nearest_normal(of.x[each], of.normals[each], edge) for each in (first, second)]
    sharp = (normals[0] * normals[1]).sum(axis=1) < SHARP
    inwards = (normals[0] * (corners[second].mean(axis=1) - edge)).sum(axis=1) > 0
    found = sharp & inwards
    ends = np.where(common[found], numbers[first[found]], -1)
    for pair in ends:
        a = pair[pair >= 0]
        out[a] = True
        if full.d == 3:  # nodes between
            x, y = full.X[a[0]], full.X[a[-1]]
            on = np.linalg.norm(full.X - x, axis=1) + np.linalg.norm(full.X - y, axis=1)
            out |= on < (1 + 1e-3) * np.linalg.norm(y - x)
    return out


def _nearest_normal(
    x: Float[np.ndarray, "e q 3"], normals: Float[np.ndarray, "e q 3"], at: Float[np.ndarray, "e 3"]
) -> Float[np.ndarray, "e 3"]:
    nearest = np.linalg.norm(x - at[:, None], axis=2).argmin(axis=1)
    return np.asarray(normals[np.arange(len(x)), nearest])


def affected_nodes(link: Link, at: Float[np.ndarray, "k 3"]) -> Bool[np.ndarray, " n"]:
    """Nodes of a meshed link whose stress singular places affect: within `influence_radius`, or in the same element.

    Parameters
    ----------
    at : (k, 3) the places, in the reference position [m]
    """
    full = link.full or link
    out = np.zeros(full.n, bool)
    if not len(at):
        return out
    from scipy.spatial import cKDTree

    near = cKDTree(at).query(full.X)[0]
    touching = (near[full.cells] < 1e-6 * full.size).any(axis=1)
    out[full.cells[touching].ravel()] = True
    return np.asarray(out | (near <= influence_radius(full)))


def influence_radius(link: Link) -> float:
    """Volume over surface, whatever the mesh: half the thickness of a plate, a quarter of a square bar's width [m]."""
    facets, _, _ = boundary(link)
    area = float(surface_quadrature(link, facets).dA.sum())
    if link.d == 2:  # edges times the thickness, and both sides
        area += 2 * float(link.volume.sum()) / link.thickness
    return float(link.volume.sum()) / area
