"""The boundary of a solid or plane link: integrals over its facets, bores, balls and faces found by their geometry.

The facets of a plane link are edges, with the link's thickness as their width.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import scipy.sparse as sp
import skfem
from scipy.sparse.csgraph import connected_components
from skfem.quadrature import get_quadrature

from kedfem.arrays import Bool, Float, Int
from kedfem.links.record import Link

CYLINDER_TOLERANCE = 1e-3  # of the radius, between the corner nodes of one bore
PLANE_TOLERANCE = 1e-6  # of the link's size
SMOOTH = np.cos(np.radians(35))  # between neighbouring facets of one curved face


@dataclass(frozen=True, slots=True)
class Surface:
    """Quadrature on facets of a link, in the elements' own functions: x (f, q, 3) [m], dA (f, q) [m²],
    N (f, q, m), the functions' numbers dofs (f, m) and outward unit normals (f, q, 3)."""

    x: Float[np.ndarray, "f q 3"]
    dA: Float[np.ndarray, "f q"]
    N: Float[np.ndarray, "f q m"]
    dofs: Int[np.ndarray, "f m"]
    normals: Float[np.ndarray, "f q 3"]


def surface_quadrature(link: Link, facets: Int[np.ndarray, " f"]) -> Surface:
    """Gauss points on facets: the area element of [KED, eqs. (15)(16)], √(a_r a_s − a_rs²) = |x_r × x_s|.

    Of a plane link it is |x_r| times the thickness.
    """
    mesh, elem = link.basis.mesh, link.basis.elem
    kind: Any = type(elem)
    elements = mesh.f2t[0, facets]
    corners = mesh.t[: elem.refdom.nnodes, elements]
    on = (corners[:, None] == mesh.facets[:, facets][None]).any(axis=1)  # (c, f) corners of each facet
    face = (1 << np.arange(len(corners))) @ on
    dofs = link.basis.element_dofs[:, elements].T
    gauss = len(_facet_rule(elem)[1])
    size = len(facets), gauss
    x, normals, dA, N = (np.empty((*size, *more)) for more in ((3,), (3,), (), (dofs.shape[1],)))
    for which in np.unique(face):
        here = face == which
        shape, gradient, weights = _face_functions(kind, tuple(on[:, here.argmax()].tolist()))
        nodes = link.X[dofs[here]]
        tangents = np.einsum("qmk,fmj->kfqj", gradient, nodes)
        N[here], x[here] = shape, np.einsum("qm,fmj->fqj", shape, nodes)
        # of a plane link the second tangent is z
        element = np.cross(tangents[0], tangents[1] if link.d == 3 else [0.0, 0.0, 1.0])
        lengths = np.linalg.norm(element, axis=2)
        dA[here] = link.thickness * lengths * weights
        outward = np.sign(np.einsum("fqk,fqk->f", element, x[here] - nodes.mean(axis=1)[:, None]))
        normals[here] = element / lengths[:, :, None] * outward[:, None, None]
    return Surface(x, dA, N, dofs, normals)


def middle_facet(link: Link, facets: Int[np.ndarray, " f"], centre: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    """The middle of the facet whose middle is nearest to a place [m]."""
    middles = link.X[link.basis.mesh.facets[:, facets]].mean(axis=0)
    return np.asarray(middles[np.linalg.norm(middles - centre, axis=1).argmin()])


@cache
def _face_functions(of: Any, on: tuple[bool, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """N (q, m), its derivatives along the face (q, m, d − 1) and weights (q,) on the facet with given corners."""
    elem = of()
    corners = np.asarray(elem.doflocs)[: len(on)][np.array(on)]
    places, weights = _facet_rule(elem)
    first, edges = corners.min(axis=0), np.eye(elem.dim)[np.ptp(corners, axis=0) > 0]
    if _simplex(elem):
        first, edges = corners[0], corners[1:] - corners[0]
    points = first[:, None] + edges.T @ places
    pairs = [elem.lbasis(points, i) for i in range(len(elem.doflocs))]
    shape = np.stack([np.broadcast_to(N, points.shape[1]) for N, _ in pairs], axis=1)
    gradient = np.stack([(edges @ np.broadcast_to(dN, points.shape)).T for _, dN in pairs], axis=1)
    return shape, gradient, weights


def _simplex(elem: skfem.Element) -> bool:
    """Whether an element is a tetrahedron."""
    return bool(elem.refdom is skfem.refdom.RefTet)


def _facet_rule(elem: skfem.Element) -> tuple[np.ndarray, np.ndarray]:
    """Gauss points (d − 1, q) and weights (q,) of a facet in [0, 1]ᵈ⁻¹: 4 a direction, of a triangle of degree 8."""
    if _simplex(elem):
        places, weights = get_quadrature(skfem.refdom.RefTri, 8)
        return np.asarray(places), np.asarray(weights)
    r, w = np.polynomial.legendre.leggauss(4)
    r, w = (r + 1) / 2, w / 2
    if elem.dim == 2:
        return r[None], w
    return np.stack(np.meshgrid(r, r, indexing="ij")).reshape(2, -1), np.outer(w, w).ravel()


def boundary(link: Link) -> tuple[Int[np.ndarray, " f"], Float[np.ndarray, "f c 3"], Float[np.ndarray, "f 3"]]:
    """Facets at the surface with their corners and outward unit normals; cuts of a segment are none."""
    mesh = link.basis.mesh
    facets = np.setdiff1d(mesh.boundary_facets(), link.cuts)
    corners = link.X[mesh.facets[:, facets]].transpose(1, 0, 2)
    inner = link.X[mesh.t[: link.basis.elem.refdom.nnodes, mesh.f2t[0, facets]]].mean(axis=0)
    edges = corners[:, 1:] - corners[:, :1]
    if link.d == 2:
        crosses = np.cross(edges, [0.0, 0.0, 1.0])
    else:  # the four corners of a facet may be numbered in any order: two largest independent edges span it
        pairs = ((0, 1), (1, 2), (0, 2)) if edges.shape[1] == 3 else ((0, 1),)
        crosses = np.stack([np.cross(edges[:, i], edges[:, j]) for i, j in pairs], axis=1)
    largest = np.linalg.norm(crosses, axis=2).argmax(axis=1)
    normal = crosses[np.arange(len(facets)), largest]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    outward = np.sign(np.einsum("fk,fk->f", normal, corners.mean(axis=1) - inner))
    return facets, corners, normal * outward[:, None]


def flat_face(link: Link, point: Float[np.ndarray, "3"]) -> Int[np.ndarray, " f"]:
    """Facets of the plane face that the point lies in: within its plane and inside its extent."""
    facets, corners, normals = boundary(link)
    size = np.ptp(link.X, axis=0).max()
    centre = corners.mean(axis=1)
    height = np.abs(np.einsum("fck,fk->fc", corners - point, normals)).max(axis=1)
    touching = height <= PLANE_TOLERANCE * size
    # a point at a corner of a curved facet lies in the plane of its corners, too
    x = surface_quadrature(link, facets[touching]).x
    bulge = np.abs(np.einsum("fqk,fk->fq", x - corners[touching, :1], normals[touching]))
    touching[touching] = bulge.max(axis=1) <= PLANE_TOLERANCE * size
    reach = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
    near = touching & (np.linalg.norm(centre - point, axis=1) <= 1.01 * reach)
    if not near.any():
        return facets[:0]
    seed = np.flatnonzero(near)[np.linalg.norm(centre[near] - point, axis=1).argmin()]
    plane = touching & (normals @ normals[seed] > 1 - 1e-6)
    first, second = neighbours(link, facets)
    return np.asarray(facets[connected(seed, first, second, plane[first] & plane[second], len(facets))])


def smooth_face(link: Link, point: Float[np.ndarray, "3"]) -> Int[np.ndarray, " f"]:
    """Facets of the curved face at a point: those connected with the facet there over smooth edges."""
    facets, corners, normals = boundary(link)
    centre = corners.mean(axis=1)
    reach = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
    height = np.abs(np.einsum("fk,fk->f", centre - point, normals))
    near = np.flatnonzero((np.linalg.norm(centre - point, axis=1) <= 1.05 * reach) & (height <= 0.15 * reach))
    if not len(near):
        return facets[:0]
    first, second = neighbours(link, facets)
    smooth = np.einsum("ek,ek->e", normals[first], normals[second]) > SMOOTH
    return np.asarray(facets[connected(int(near[height[near].argmin()]), first, second, smooth, len(facets))])


def neighbours(link: Link, facets: Int[np.ndarray, " f"]) -> tuple[Int[np.ndarray, " k"], Int[np.ndarray, " k"]]:
    """Pairs of facets (their positions in the list) that share an edge, two of their corner nodes; in a plane one."""
    numbers = np.sort(link.basis.mesh.facets[:, facets].T, axis=1)
    starts = numbers.shape[1] * np.arange(len(facets) + 1)
    corners = sp.csr_array((np.ones(numbers.size), numbers.ravel(), starts))
    common = sp.coo_array(corners @ corners.T)
    first, second = (index[common.data == link.d - 1] for index in common.coords)
    return first, second


def connected(
    seed: int, first: Int[np.ndarray, " k"], second: Int[np.ndarray, " k"], joined: Bool[np.ndarray, " k"], size: int
) -> Bool[np.ndarray, " f"]:
    """Whether each facet is connected with one of them over joined pairs."""
    label = components(first, second, joined, size)
    return np.asarray(label == label[seed])


def components(
    first: Int[np.ndarray, " k"], second: Int[np.ndarray, " k"], joined: Bool[np.ndarray, " k"], size: int
) -> Int[np.ndarray, " f"]:
    """Number of the connected component of each facet over joined pairs."""
    ones = np.ones(np.count_nonzero(joined))
    graph = sp.csr_array((ones, (first[joined], second[joined])), shape=(size, size))
    return np.asarray(connected_components(graph, directed=False)[1])
