"""Coupling surfaces of joints: the affine field that best fits a bore or face, with weights invariant in rotations."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import qr

from kedfem.arrays import Float, Int
from kedfem.errors import MeshError
from kedfem.links.record import Link
from kedfem.links.surfaces.facet_selection import named_facets, selected_facets
from kedfem.links.surfaces.missing import in_link_plane, missing_surface
from kedfem.links.surfaces.surface import PLANE_TOLERANCE, boundary, flat_face, smooth_face, surface_quadrature


@dataclass(frozen=True, slots=True)
class CouplingSurface:
    """The surface of a link that a joint acts on, with the affine fit of its displacement.

    u(x) = fit[0] @ u + (x − origin) · (fit[1:] @ u): value and gradient of the affine field closest, area-weighted,
    to the displacement u of the surface. The weights are scalars, so they commute with every rotation.

    fit : (4, n) [-; 1/m]
    origin : (3,) area centroid, or the node of a beam [m]
    directions : (3, 3) rows, principal directions, widest spread first
    spread : (3,) standard deviations along them [m]; along z of a plane link 0, directions[2] being z
    facets : boundary facets of a solid or plane link (for surface loads)
    dimensions : of its link: 2 for a plane link
    """

    fit: Float[np.ndarray, "4 n"]
    origin: Float[np.ndarray, "3"]
    directions: Float[np.ndarray, "3 3"]
    spread: Float[np.ndarray, "3"]
    facets: Int[np.ndarray, " f"] | None = None
    dimensions: int = 3


def port_weights(surface: CouplingSurface, points: Float[np.ndarray, "p 3"]) -> Float[np.ndarray, "p n"]:
    """Scalar weights W of interface points: u(points) = W u.

    Parameters
    ----------
    points : (p, 3) reference positions [m]; each row of the result sums to one.
    """
    return np.asarray(surface.fit[0] + (points - surface.origin) @ surface.fit[1:])


def determines_gradient(surface: CouplingSurface, direction: Float[np.ndarray, "3"]) -> bool:
    """Whether the affine fit has a gradient along a direction (of a flat face not along its normal)."""
    known = surface.spread > PLANE_TOLERANCE * max(surface.spread[0], 1e-300)
    return bool(np.linalg.norm(surface.directions[~known] @ direction) < 1e-6)


def is_flat(surface: CouplingSurface) -> bool:
    """Whether the coupling surface is a plane face, of a plane link a straight edge, of a spatial beam a section between
    its rigid nodes."""
    return bool(surface.spread[0] > 0 and surface.spread[surface.dimensions - 1] == 0)


def face_normal(surface: CouplingSurface) -> Float[np.ndarray, "3"]:
    """Direction across a flat coupling surface, along which its affine fit has no gradient."""
    return np.asarray(surface.directions[surface.dimensions - 1])


def joint_surface(
    link: Link, where: str, point: Float[np.ndarray, "3"], axis: Float[np.ndarray, "3"] | None, faces: Sequence[str] = ()
) -> CouplingSurface:
    """A joint's coupling surface on a link: a beam's node; else a bore or journal about the axis, else the face there.

    Parameters
    ----------
    where : how messages name the joint, e.g. ``joints.B``
    point : reference position of the joint [m]
    axis : unit vector of a bore to look for, or None
    faces : names of the faces that make up the coupling surface, if given

    Raises
    ------
    MeshError
        If the link has no node, bore or face there, or several that cannot be distinguished.
    """
    if link.full is not None and link.Q is not None:
        surface = joint_surface(link.full, where, point, axis, faces)
        return replace(surface, fit=surface.fit @ link.Q)
    if link.anywhere:
        return rigid_link_surface(link, point)
    if link.kind == "beam":
        return _node_surface(link, where, point)
    if link.kind == "spatial_beam":
        return _section_surface(link, where, point)
    facets = named_facets(link, where, faces) if faces else selected_facets(link, where, point, axis)
    return facet_surface(link, facets)


def rigid_link_surface(link: Link, at: Float[np.ndarray, "3"]) -> CouplingSurface:
    """The coupling surface of a rigid solid or plane link at any point: its affine field by four, or three, of its nodes.

    Parameters
    ----------
    at : reference position, in the link or outside it [m]
    """
    d = link.d
    known = np.column_stack([link.one, (link.X - np.outer(link.one, at))[:, :d] / link.size])
    few = qr(known.T, mode="r", pivoting=True)[1][: d + 1]
    fit = np.zeros((4, link.n))
    fit[: d + 1, few] = np.linalg.inv(known[few]) / np.array([1.0, *[link.size] * d])[:, None]
    return CouplingSurface(fit, np.asarray(at, float), np.eye(3), link.size * (np.arange(3) < d))


def face_surface(link: Link, where: str, point: Float[np.ndarray, "3"]) -> CouplingSurface:
    """The flat or cylindrical face of a link that passes through a point, e.g. to carry a surface force."""
    if link.full is not None and link.Q is not None:
        surface = face_surface(link.full, where, point)
        return replace(surface, fit=surface.fit @ link.Q)
    seen = in_link_plane(link, point)
    facets = flat_face(link, seen)
    if not len(facets):
        facets = smooth_face(link, seen)
    if not len(facets):
        raise MeshError(missing_surface(link, where, point))
    return facet_surface(link, facets)


def same_face(link: Link, surface: CouplingSurface) -> CouplingSurface | None:
    """The part of a plane face that another segment of the link has, None without any.

    Parameters
    ----------
    surface : the face on the segment where it was found
    """
    if link.full is not None and link.Q is not None:
        found = same_face(link.full, surface)
        return None if found is None else replace(found, fit=found.fit @ link.Q)
    _, corners, normals = boundary(link)
    height = np.abs((corners - surface.origin) @ face_normal(surface)).max(axis=1)
    along = np.abs(normals @ face_normal(surface)) > 1 - 1e-6
    for point in corners.mean(axis=1)[(height <= PLANE_TOLERANCE * link.size) & along]:
        if len(facets := flat_face(link, point)):
            return facet_surface(link, facets)
    return None


def surface_weights(link: Link, surface: CouplingSurface) -> Float[np.ndarray, " n"]:
    """Area integrals ∫ N_a dΓ, [KED, eqs. (15)(16)]: a force φ per area gives weights ⊗ φ [m²]."""
    if surface.facets is None:
        return np.zeros(link.n)
    if link.full is not None and link.Q is not None:
        return np.asarray(surface_weights(link.full, surface) @ link.Q)
    on = surface_quadrature(link, surface.facets)
    local = np.einsum("fqm,fq->fm", on.N, on.dA)
    return np.bincount(on.dofs.ravel(), weights=local.ravel(), minlength=link.n)


def face_normals(link: Link, surface: CouplingSurface) -> Float[np.ndarray, "n d"]:
    """Area integrals ∫ N_a n dΓ [m²], n the outward normal: a pressure p gives forces −p times them."""
    if surface.facets is None:
        return np.zeros((link.n, link.d))
    if link.full is not None and link.Q is not None:
        return np.asarray(link.Q.T @ face_normals(link.full, surface))
    on = surface_quadrature(link, surface.facets)
    local = np.einsum("fqm,fq,fqk->kfm", on.N, on.dA, on.normals)
    rows = [np.bincount(on.dofs.ravel(), weights=x.ravel(), minlength=link.n) for x in local[: link.d]]
    return np.stack(rows, axis=1)


def surface_couples(link: Link, surface: CouplingSurface, where: str) -> Float[np.ndarray, "3 n d"]:
    """Nodal forces of unit couples about x, y, z on a coupling surface, conjugate to the rotation of its affine fit.

    The rotation in the plane of two principal directions i, j is ½ (∂_i u_j − ∂_j u_i), or ∂_i u_j where the fit does not
    determine ∂_j (j across a flat coupling surface). There is no resultant force.
    """
    D, known = surface.directions, surface.spread > 0
    if link.d == 2:
        known = known & [True, True, False]
    couples = np.zeros((3, link.n, 3))
    for k in [2] if link.d == 2 else range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        if not (known[i] or known[j]):
            raise MeshError(f"{where}.at: must be a bore or a face of link '{link.name}', got a single point")
        both = 0.5 if known[i] and known[j] else 1.0
        turn = both * (np.outer(D[i], D[j]) * known[i] - np.outer(D[j], D[i]) * known[j])
        about = np.linalg.det(D) * D[k]
        couples += about[:, None, None] * (surface.fit[1:].T @ turn)
    return couples[:, :, : link.d]


def _node_at(link: Link, where: str, point: Float[np.ndarray, "3"]) -> int:
    """The function whose node is at a point."""
    distance = np.where(link.one != 0, np.linalg.norm(link.X - point, axis=1), np.inf)
    node = int(distance.argmin())
    if distance[node] > PLANE_TOLERANCE * link.size:
        raise MeshError(missing_surface(link, where, point))
    return node


def _node_surface(link: Link, where: str, point: Float[np.ndarray, "3"]) -> CouplingSurface:
    node = _node_at(link, where, point)
    fit = np.zeros((4, link.n))
    fit[0, node] = 1.0
    return CouplingSurface(fit, link.X[node], np.eye(3), np.zeros(3))


def _section_surface(link: Link, where: str, point: Float[np.ndarray, "3"]) -> CouplingSurface:
    """The section at a node of a spatial beam; between rigid nodes it does not determine the gradient along the axis.

    Its spread is of the link's size, not the section's: from ports farther apart the section's rotation is more accurate.
    """
    node = _node_at(link, where, point)
    following = np.flatnonzero(link.one[node + 1 :])
    slopes = np.arange(node + 1, node + 1 + following[0] if len(following) else link.n)
    fit = np.zeros((4, link.n))
    fit[0, node] = 1.0
    fit[1:, slopes] = link.X[slopes].T
    y, z = link.X[slopes[-2:]]
    known = np.array([1.0, 1.0, len(slopes) - 2.0])
    axes = np.stack([y, z, np.cross(y, z)])
    return CouplingSurface(fit, link.X[node], axes, known * link.size / np.sqrt(12))


def facet_surface(
    link: Link, facets: Int[np.ndarray, " f"], across: Float[np.ndarray, "3"] | None = None
) -> CouplingSurface:
    """The coupling surface that some boundary facets of a meshed link make.

    Parameters
    ----------
    across : unit normal of a plane on which facets that are not plane are projected, so that forces are distributed as
        those of tension and bending in a prism
    """
    on = surface_quadrature(link, facets)
    x, dA = on.x.transpose(2, 0, 1), on.dA  # (3, f, q), (f, q)
    if across is not None:
        dA = dA * (on.normals @ across)
        dA *= np.sign(dA.sum())
    area = dA.sum()
    origin = np.einsum("kfq,fq->k", x, dA) / area
    r = x - origin[:, None, None]
    if across is not None:
        r -= np.einsum("k,j,jfq->kfq", across, across, r)
    spread, directions = _principal(np.einsum("ifq,jfq,fq->ij", r, r, dA) / area, link.d)
    phi = np.concatenate([np.ones((1, *dA.shape)), np.einsum("ij,jfq->ifq", directions, r)])
    moments = np.zeros((4, link.n))
    local = np.einsum("cfq,fqm,fq->cfm", phi, on.N, dA, optimize=True)
    for c in range(4):
        moments[c] = np.bincount(on.dofs.ravel(), weights=local[c].ravel(), minlength=link.n)
    known = np.concatenate([[True], spread > 0])
    scale = np.where(known, area * np.concatenate([[1.0], np.maximum(spread, 1e-300) ** 2]), np.inf)
    local_fit = moments / scale[:, None]
    fit = np.concatenate([local_fit[:1], directions.T @ local_fit[1:]])
    return CouplingSurface(fit, origin, directions, spread, facets, link.d)


def _principal(covariance: Float[np.ndarray, "3 3"], d: int) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3 3"]]:
    """Standard deviations, widest first, and their directions as rows; in a plane the third is z."""
    variance, vectors = np.linalg.eigh(covariance[:d, :d])
    spread, directions = np.zeros(3), np.eye(3)
    spread[:d], directions[:d, :d] = np.sqrt(np.abs(variance[::-1])), vectors[:, ::-1].T
    spread[spread < PLANE_TOLERANCE * spread[0]] = 0.0
    return spread, directions
