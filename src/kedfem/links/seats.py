"""Where joints sit: the affine field that best fits a bore or a face, with scalar, rotation-invariant weights."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import skfem
from jaxtyping import Float, Int
from scipy.sparse.csgraph import connected_components

from kedfem.errors import MeshError
from kedfem.links.record import Link

CYLINDER_TOLERANCE = 1e-3  # of the radius, between the corner nodes of one bore
PLANE_TOLERANCE = 1e-6  # of the link's size
SMOOTH = np.cos(np.radians(35))  # between neighbouring facets of one curved face


@dataclass(frozen=True, slots=True)
class Seat:
    """The surface of a link that a joint holds, seen through its affine fit.

    u(x) = fit[0] @ u + (x − origin) · (fit[1:] @ u): value and gradient of the affine field closest, area-weighted,
    to the displacement u of the surface. The weights are scalars, so they commute with every rotation.

    fit : (4, n) [-; 1/m]
    origin : (3,) area centroid, or the node of a beam [m]
    directions : (3, 3) rows, principal directions, widest spread first
    spread : (3,) standard deviations along them [m]
    facets : boundary facets of a solid (for surface loads)
    """

    fit: Float[np.ndarray, "4 n"]
    origin: Float[np.ndarray, "3"]
    directions: Float[np.ndarray, "3 3"]
    spread: Float[np.ndarray, "3"]
    facets: Int[np.ndarray, " f"] | None = None


def port_weights(seat: Seat, points: Float[np.ndarray, "p 3"]) -> Float[np.ndarray, "p n"]:
    """Scalar weights W of port points: u(points) = W u.

    Parameters
    ----------
    points : (p, 3) reference positions [m]; each row of the result sums to one.
    """
    return np.asarray(seat.fit[0] + (points - seat.origin) @ seat.fit[1:])


def holds(seat: Seat, direction: Float[np.ndarray, "3"]) -> bool:
    """Whether the affine fit knows how the displacement changes along a direction (a flat face: not its normal)."""
    known = seat.spread > PLANE_TOLERANCE * max(seat.spread[0], 1e-300)
    return bool(np.linalg.norm(seat.directions[~known] @ direction) < 1e-6)


def is_flat(seat: Seat) -> bool:
    """Whether the seat is a plane face; a beam's node is not."""
    return bool(seat.spread[0] > 0 and seat.spread[2] == 0)


def joint_seat(
    link: Link, where: str, point: Float[np.ndarray, "3"], axis: Float[np.ndarray, "3"] | None
) -> Seat:
    """The seat that a link offers to a joint: a beam's node; a solid's bore about the axis, else the face there.

    Parameters
    ----------
    where : how messages name the joint, e.g. ``joints.B``
    point : reference position of the joint [m]
    axis : unit vector of a bore to look for, or None

    Raises
    ------
    MeshError
        If the link has no node, bore or face there.
    """
    if link.kind == "beam":
        return _node_seat(link, where, point)
    facets = _surface_at(link, point, axis)
    if not len(facets):
        raise MeshError(_not_touching(link, where, point))
    return _facet_seat(link, facets)


def face_seat(link: Link, where: str, point: Float[np.ndarray, "3"]) -> Seat:
    """The flat or cylindrical face of a solid that passes through a point, e.g. to carry a surface force.

    Raises
    ------
    MeshError
        If no face does.
    """
    facets = _flat_face(link, point)
    if not len(facets):
        facets = _smooth_face(link, point)
    if not len(facets):
        raise MeshError(_not_touching(link, where, point))
    return _facet_seat(link, facets)


def surface_weights(link: Link, seat: Seat) -> Float[np.ndarray, " n"]:
    """Area integrals ∫ N_a dΓ of a seat's surface, [KED, eqs. (15)(16)]: a force φ per area gives weights ⊗ φ.

    Returns
    -------
    (n,) [m²]
    """
    if seat.facets is None:
        return np.zeros(link.n)
    on = surface(link, seat.facets)
    local = np.einsum("fqm,fq->fm", on.N, on.dA)
    return np.bincount(on.dofs.ravel(), weights=local.ravel(), minlength=link.n)


@dataclass(frozen=True, slots=True)
class Surface:
    """Quadrature on facets of a solid, in the elements' own functions: x (f, q, 3) [m], dA (f, q) [m²],
    N (f, q, m) and the functions' numbers dofs (f, m)."""

    x: Float[np.ndarray, "f q 3"]
    dA: Float[np.ndarray, "f q"]
    N: Float[np.ndarray, "f q m"]
    dofs: Int[np.ndarray, "f m"]


def surface(link: Link, facets: Int[np.ndarray, " f"]) -> Surface:
    """Gauss points on facets: the area element of [KED, eqs. (15)(16)], √(a_r a_s − a_rs²) = |x_r × x_s|."""
    mesh, elem = link.basis.mesh, link.basis.elem
    elements = mesh.f2t[0, facets]
    local = np.argmax(mesh.t[:8, elements][:, None] == mesh.facets[:, facets][None], axis=0)  # (4, f)
    corners = np.asarray(elem.doflocs)[local]  # (4, f, 3)
    fixed = np.ptp(corners, axis=0).argmin(axis=1)
    face = 2 * fixed + corners[0, np.arange(len(facets)), fixed].astype(int)
    dofs = link.basis.element_dofs[:, elements].T
    x, dA, N = (
        np.empty((len(facets), 16, 3)),
        np.empty((len(facets), 16)),
        np.empty((len(facets), 16, dofs.shape[1])),
    )
    for which in np.unique(face):
        here = face == which
        shape, gradient, weights = _face_functions(elem, which // 2, which % 2)
        nodes = link.X[dofs[here]]
        tangents = np.einsum("qmk,fmj->kfqj", gradient, nodes)
        N[here], x[here] = shape, np.einsum("qm,fmj->fqj", shape, nodes)
        dA[here] = np.linalg.norm(np.cross(tangents[0], tangents[1]), axis=2) * weights
    return Surface(x, dA, N, dofs)


def _face_functions(elem: skfem.Element, fixed: int, side: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """N (q, m), its derivatives along the face (q, m, 2) and weights (q,) on one face of [0, 1]³."""
    r, w = np.polynomial.legendre.leggauss(4)
    r, w = (r + 1) / 2, w / 2
    across = [k for k in range(3) if k != fixed]
    points = np.full((3, 16), float(side))
    points[across] = np.stack(np.meshgrid(r, r, indexing="ij")).reshape(2, 16)
    pairs = [elem.lbasis(points, i) for i in range(len(elem.doflocs))]
    shape = np.stack([np.broadcast_to(N, 16) for N, _ in pairs], axis=1)
    gradient = np.stack([np.asarray(dN)[across].T for _, dN in pairs], axis=1)
    return shape, gradient, np.outer(w, w).ravel()


def _node_seat(link: Link, where: str, point: Float[np.ndarray, "3"]) -> Seat:
    distance = np.linalg.norm(link.X - point, axis=1)
    node = int(distance.argmin())
    if distance[node] > PLANE_TOLERANCE * np.ptp(link.X, axis=0).max():
        raise MeshError(_not_touching(link, where, point))
    fit = np.zeros((4, link.n))
    fit[0, node] = 1.0
    return Seat(fit, link.X[node], np.eye(3), np.zeros(3))


def _facet_seat(link: Link, facets: Int[np.ndarray, " f"]) -> Seat:
    on = surface(link, facets)
    x, dA = on.x.transpose(2, 0, 1), on.dA  # (3, f, q), (f, q)
    area = dA.sum()
    origin = np.einsum("kfq,fq->k", x, dA) / area
    r = x - origin[:, None, None]
    covariance = np.einsum("ifq,jfq,fq->ij", r, r, dA) / area
    variance, vectors = np.linalg.eigh(covariance)
    order = np.argsort(variance)[::-1]
    spread, directions = np.sqrt(np.abs(variance[order])), vectors[:, order].T
    spread[spread < PLANE_TOLERANCE * spread[0]] = 0.0
    phi = np.concatenate([np.ones((1, *dA.shape)), np.einsum("ij,jfq->ifq", directions, r)])
    moments = np.zeros((4, link.n))
    local = np.einsum("cfq,fqm,fq->cfm", phi, on.N, dA, optimize=True)
    for c in range(4):
        moments[c] = np.bincount(on.dofs.ravel(), weights=local[c].ravel(), minlength=link.n)
    known = np.concatenate([[True], spread > 0])
    scale = np.where(known, area * np.concatenate([[1.0], np.maximum(spread, 1e-300) ** 2]), np.inf)
    local_fit = moments / scale[:, None]
    fit = np.concatenate([local_fit[:1], directions.T @ local_fit[1:]])
    return Seat(fit, origin, directions, spread, facets)


def _surface_at(
    link: Link, point: Float[np.ndarray, "3"], axis: Float[np.ndarray, "3"] | None
) -> Int[np.ndarray, " f"]:
    if axis is not None:
        bore = _cylinder(link, point, axis)
        if len(bore):
            return bore
    else:
        ball = _sphere(link, point)
        if len(ball):
            return ball
    return _flat_face(link, point)


def _boundary(
    link: Link,
) -> tuple[Int[np.ndarray, " f"], Float[np.ndarray, "f 4 3"], Float[np.ndarray, "f 3"]]:
    """Boundary facets with their corners and outward unit normals."""
    mesh = link.basis.mesh
    facets = mesh.boundary_facets()
    corners = mesh.doflocs[:, mesh.facets[:, facets]].transpose(2, 1, 0)
    inner = link.X[mesh.t[:8, mesh.f2t[0, facets]]].mean(axis=0)
    # the four corners of a facet may be numbered in any order: two largest independent edges span it
    edges = corners[:, 1:] - corners[:, :1]
    crosses = np.stack([np.cross(edges[:, i], edges[:, j]) for i, j in ((0, 1), (1, 2), (0, 2))], axis=1)
    largest = np.linalg.norm(crosses, axis=2).argmax(axis=1)
    normal = crosses[np.arange(len(facets)), largest]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    outward = np.sign(np.einsum("fk,fk->f", normal, corners.mean(axis=1) - inner))
    return facets, corners, normal * outward[:, None]


def _cylinder(
    link: Link, point: Float[np.ndarray, "3"], axis: Float[np.ndarray, "3"]
) -> Int[np.ndarray, " f"]:
    """Facets of the smallest closed bore about the axis."""
    facets, corners, normals = _boundary(link)
    r = corners - point
    r = r - (r @ axis)[..., None] * axis
    radius = np.linalg.norm(r, axis=2)
    mean = radius.mean(axis=1)
    inward = np.einsum("fk,fk->f", normals, r.mean(axis=1)) < -0.5 * np.linalg.norm(r.mean(axis=1), axis=1)
    size = np.ptp(link.X, axis=0).max()
    round_ = (np.ptp(radius, axis=1) <= CYLINDER_TOLERANCE * mean) & (mean > 1e-6 * size) & inward
    if not round_.any():
        return facets[:0]
    same = round_ & (np.abs(mean - mean[round_].min()) <= CYLINDER_TOLERANCE * mean)
    centre = r[same].mean(axis=(0, 1))
    closed = np.linalg.norm(centre) < 0.3 * mean[same].min()  # facets all round, not on one side only
    return facets[same] if closed else facets[:0]


def _sphere(link: Link, point: Float[np.ndarray, "3"]) -> Int[np.ndarray, " f"]:
    """Facets of the smallest sphere about the point."""
    facets, corners, _ = _boundary(link)
    radius = np.linalg.norm(corners - point, axis=2)
    mean = radius.mean(axis=1)
    round_ = np.ptp(radius, axis=1) <= CYLINDER_TOLERANCE * mean
    if round_.sum() < 6:  # a few facets may be equidistant by chance
        return facets[:0]
    same = round_ & (np.abs(mean - mean[round_].min()) <= CYLINDER_TOLERANCE * mean)
    return facets[same] if same.sum() >= 6 else facets[:0]


def _flat_face(link: Link, point: Float[np.ndarray, "3"]) -> Int[np.ndarray, " f"]:
    """Facets of the plane face that the point lies in: within its plane and inside its extent."""
    facets, corners, normals = _boundary(link)
    size = np.ptp(link.X, axis=0).max()
    centre = corners.mean(axis=1)
    height = np.abs(np.einsum("fck,fk->fc", corners - point, normals)).max(axis=1)
    touching = height <= 1e-6 * size
    reach = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
    near = touching & (np.linalg.norm(centre - point, axis=1) <= 1.01 * reach)
    if not near.any():
        return facets[:0]
    normal = normals[near][np.linalg.norm(centre[near] - point, axis=1).argmin()]
    return np.asarray(facets[touching & (normals @ normal > 1 - 1e-6)])


def _smooth_face(link: Link, point: Float[np.ndarray, "3"]) -> Int[np.ndarray, " f"]:
    """Facets of the curved face at a point: from the facet there over all edges that are not sharp."""
    facets, corners, normals = _boundary(link)
    centre = corners.mean(axis=1)
    reach = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
    height = np.abs(np.einsum("fk,fk->f", centre - point, normals))
    near = np.flatnonzero((np.linalg.norm(centre - point, axis=1) <= 1.05 * reach) & (height <= 0.15 * reach))
    if not len(near):
        return facets[:0]
    # facets are neighbours if they share an edge, two of their corner nodes
    numbers = np.sort(link.basis.mesh.facets[:, facets].T, axis=1)
    shared = sp.csr_array((np.ones(numbers.size), numbers.ravel(), 4 * np.arange(len(facets) + 1)))
    common = sp.coo_array(shared @ shared.T)
    first, second = (index[common.data == 2] for index in common.coords)
    smooth = np.einsum("ek,ek->e", normals[first], normals[second]) > SMOOTH
    joined = sp.csr_array((np.ones(smooth.sum()), (first[smooth], second[smooth])), shape=(len(facets),) * 2)
    face = connected_components(joined, directed=False)[1]
    seed = near[height[near].argmin()]
    return np.asarray(facets[face == face[seed]])


def _not_touching(link: Link, where: str, point: Float[np.ndarray, "3"]) -> str:
    nearest = link.X[np.linalg.norm(link.X - point, axis=1).argmin()]
    gap = np.linalg.norm(nearest - point)
    what = "a node of" if link.kind == "beam" else "a bore or a flat face of"
    return (
        f"{where}: must sit on {what} link '{link.name}' at {_shown(point)}, "
        f"got none there (nearest node {_shown(nearest)}, {gap:.3g} m away)"
    )


def _shown(x: Float[np.ndarray, "3"]) -> str:
    return "(" + ", ".join(f"{v:.6g}" for v in x) + ")"
