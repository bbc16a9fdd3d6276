"""Candidate surfaces for joints on a link: bores, journals, balls and plane faces, by name or by geometry.

They are listed in messages, and searched for bores whose axis is not given.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Literal

import numpy as np

from kedfem.arrays import Bool, Float, Int
from kedfem.links.record import Link, LinkFace
from kedfem.links.surfaces.round_surfaces import CLOSED
from kedfem.links.surfaces.surface import PLANE_TOLERANCE, SMOOTH, boundary, components, neighbours, surface_quadrature

FITS = 0.01  # of the radius: largest distance of corners from their cylinder or ball
FEWEST = 3  # facets of a cylinder or a ball
# least mean square of normals along any direction, of a ball; less along the axis of a cylinder
ROUNDED = 0.02
TRIMMED = 5  # times that the worse half of facets is left out
SEVERAL = 20  # cylinders and balls in a connected region
SOME = 0.15  # of a ball's facets: less is a rounded corner

Kind = Literal["bore", "journal", "ball seat", "ball", "plane face", "face"]


@dataclass(frozen=True, slots=True)
class Candidate:
    """A surface for a joint.

    name : of a named face, else empty
    centre, direction, radius : as of `mesh.elements.hexahedra.Face`; nan where they have no meaning
    length : along the axis of a cylinder, else 0 [m]
    facets : boundary facets of the link on it
    """

    kind: Kind
    name: str
    centre: Float[np.ndarray, "3"]
    direction: Float[np.ndarray, "3"]
    radius: float
    length: float = 0.0
    facets: Int[np.ndarray, " f"] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    @property
    def form(self) -> str:
        """``plane``, ``cylinder``, ``sphere`` or ``other``."""
        round_ = "cylinder" if self.cylindrical else "sphere"
        return {"plane face": "plane", "face": "other"}.get(self.kind, round_)

    @property
    def cylindrical(self) -> bool:
        """Whether it is a cylinder, with an axis."""
        return self.kind in {"bore", "journal"}

    def distance(self, point: Float[np.ndarray, "3"]) -> float:
        """Distance of a point from its axis, between its ends, or from its centre [m]."""
        r = point - self.centre
        if self.cylindrical:
            along = np.clip(r @ self.direction, -self.length / 2, self.length / 2)
            r = r - along * self.direction
        return float(np.linalg.norm(r))

    def axis_distance(self, point: Float[np.ndarray, "3"]) -> float:
        """Distance of a point from its axis, extended beyond its ends [m]."""
        r = point - self.centre
        return float(np.linalg.norm(r - (r @ self.direction) * self.direction))


def candidates(link: Link) -> list[Candidate]:
    """Candidates of a solid link: named faces if there are any, else round surfaces and plane faces."""
    link = link.full or link
    planes = link.kind == "solid" and not _with_names(link)
    return [*round_candidates(link), *(_planes(link) if planes else ())]


def distance(link: Link, each: Candidate, point: Float[np.ndarray, "3"]) -> float:
    """Distance of a point from the facets of a surface, taken as flat between their corners [m]."""
    if not len(each.facets):
        return float("inf")
    corners = link.X[link.basis.mesh.facets[:, each.facets]].transpose(1, 0, 2)
    triangles = [corners[:, list(three)] for three in combinations(range(corners.shape[1]), 3)]
    return float(_triangle_distances(point, np.concatenate(triangles)).min())


def _triangle_distances(point: Float[np.ndarray, "3"], corners: Float[np.ndarray, "t 3 3"]) -> Float[np.ndarray, " t"]:
    """Distances of a point from triangles: from their planes if it is above them, else from the nearest edge [m]."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    edges = np.roll(corners, -1, axis=1) - corners
    to = point - corners
    above = (np.einsum("tek,tk->te", np.cross(edges, to), normal) >= 0).all(axis=1)
    along = np.einsum("tek,tek->te", to, edges) / np.maximum((edges**2).sum(axis=2), 1e-300)
    beside = np.linalg.norm(to - np.clip(along, 0, 1)[..., None] * edges, axis=2).min(axis=1)
    height = np.abs(np.einsum("tk,tk->t", to[:, 0], normal))
    return np.asarray(np.where(above, height, beside))


def surfaces(link: Link) -> list[Candidate]:
    """All surfaces of a solid link: its named faces if they cover it, else fitted closed cylinders, balls and planes."""
    if link.kind != "solid":
        return []
    named = _with_names(link)
    if sum(len(each.facets) for each in named) >= len(link.basis.mesh.boundary_facets()):
        return [_named(link, each) for each in named]
    return [*_fitted(link), *_planes(link)]


def round_candidates(link: Link) -> list[Candidate]:
    """Named faces of a solid link; if there are none, fitted closed cylinders and balls."""
    if link.kind != "solid":
        return []
    return [_named(link, each) for each in _with_names(link)] or list(_fitted(link))


def _with_names(link: Link) -> list[LinkFace]:
    """Its faces with names of their own, not those that joints chose by properties."""
    return [each for each in link.faces if not each.face.chosen]


def _named(link: Link, each: LinkFace) -> Candidate:
    face = each.face
    round_: dict[tuple[str, bool], Kind] = {
        ("cylinder", True): "bore",
        ("cylinder", False): "journal",
        ("sphere", True): "ball seat",
        ("sphere", False): "ball",
    }
    kind = round_.get((face.kind, face.inward), "plane face" if face.kind == "plane" else "face")
    length = 0.0
    if face.kind == "cylinder" and len(each.facets):
        length = float(np.ptp(link.X[link.basis.mesh.facets[:, each.facets]] @ face.direction))
    return Candidate(kind, face.name, face.centre, face.direction, face.radius, length, each.facets)


def _fitted(link: Link) -> Iterator[Candidate]:
    """Closed cylinders and balls fitted to curved facets that are connected over smooth edges."""
    facets, corners, normals = boundary(link)
    first, second = neighbours(link, facets)
    bent = _bent(link, facets, corners, normals, first, second)
    smooth = bent[first] & bent[second] & (np.einsum("ek,ek->e", normals[first], normals[second]) > SMOOTH)
    label = components(first, second, smooth, len(facets))
    for number in np.unique(label[bent]):
        left = np.flatnonzero(bent & (label == number))
        for _ in range(SEVERAL):
            kept, found = _best(corners[left], normals[left])
            if found is None:
                break
            if found.length >= 0:
                yield replace(found, facets=facets[left[kept]])
            left = left[~kept]


def _bent(
    link: Link,
    facets: Int[np.ndarray, " f"],
    corners: Float[np.ndarray, "f c 3"],
    normals: Float[np.ndarray, "f 3"],
    first: Int[np.ndarray, " k"],
    second: Int[np.ndarray, " k"],
) -> Bool[np.ndarray, " f"]:
    """Curved facets; of 8-node hexahedra, whose facets are flat, those with a smooth edge to an inclined neighbour."""
    level = PLANE_TOLERANCE * link.size
    x = surface_quadrature(link, facets).x
    height = np.abs(np.einsum("fqk,fk->fq", x - corners[:, :1], normals)).max(axis=1)
    bent = np.asarray(height > level)
    if len(link.basis.element_dofs) == 8:
        turned = np.einsum("ek,ek->e", normals[first], normals[second])
        edge = (turned > SMOOTH) & (turned < 1 - 1e-6)
        bent[np.concatenate([first[edge], second[edge]])] = True
    return bent


def _best(
    corners: Float[np.ndarray, "f c 3"], normals: Float[np.ndarray, "f 3"]
) -> tuple[Bool[np.ndarray, " f"], Candidate | None]:
    """Facets on one cylinder or ball, and that surface; its length is -1 if it is a part to which no joint fits.

    First a whole ball is tried, since its belt is nearly a cylinder; then cylinders, and then balls, among other facets
    such as rounded edges.
    """
    for ball, rounds in ((True, 1), (False, TRIMMED), (True, TRIMMED)):
        kept = np.ones(len(corners), bool)
        for _ in range(rounds):
            if kept.sum() < FEWEST:
                break
            values, vectors = np.linalg.eigh(normals[kept].T @ normals[kept] / kept.sum())
            if ball and values[0] < ROUNDED:
                break
            centre, axis, radius = _fit(corners[kept].reshape(-1, 3), None if ball else vectors[:, 0])
            off = np.abs(_distances(corners, centre, axis) - radius).max(axis=1) / radius
            if (off[kept] <= FITS).all():
                on = off <= FITS  # also those that an earlier fit left out
                return on, _candidate(corners[on], normals[on], centre, axis, radius)
            kept = kept & (off <= max(FITS, float(np.median(off[kept]))))
    return np.zeros(len(corners), bool), None


def _fit(
    x: Float[np.ndarray, "p 3"], axis: Float[np.ndarray, "3"] | None
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"] | None, float]:
    """Centre, axis and radius of the cylinder through points with an approximate axis; of the ball if that is None."""
    middle = x.mean(axis=0)
    y = x - middle
    size = float(np.abs(y).max())
    plane = np.eye(3) if axis is None else np.linalg.svd(axis[None])[2][1:]
    z = y @ plane.T / size
    A = np.column_stack([2 * z, np.ones(len(z))])
    solved = np.linalg.lstsq(A, (z**2).sum(axis=1), rcond=None)[0]
    c, r = solved[:-1], float(np.sqrt(max(solved[-1] + solved[:-1] @ solved[:-1], 1e-300)))
    if axis is None:
        return middle + size * c @ plane, None, size * r
    given = axis

    def turned(p: np.ndarray) -> np.ndarray:
        a = given + p[3:] @ plane
        return np.asarray(a / np.linalg.norm(a))

    def off(p: np.ndarray) -> np.ndarray:
        return np.asarray(_distances(y / size, p[:2] @ plane, turned(p)) - p[2])

    from scipy.optimize import least_squares

    p = least_squares(off, np.array([*c, r, 0.0, 0.0]), xtol=1e-14, ftol=1e-14, gtol=1e-14).x
    a = turned(p)
    heights = x @ a
    on = middle + size * p[:2] @ plane
    return on + ((heights.min() + heights.max()) / 2 - on @ a) * a, a, float(size * p[2])


def _distances(
    x: Float[np.ndarray, "*k 3"], centre: Float[np.ndarray, "3"], axis: Float[np.ndarray, "3"] | None
) -> Float[np.ndarray, "*k"]:
    r = x - centre
    if axis is not None:
        r = r - (r @ axis)[..., None] * axis
    return np.asarray(np.linalg.norm(r, axis=-1))


def _candidate(
    corners: Float[np.ndarray, "f c 3"],
    normals: Float[np.ndarray, "f 3"],
    centre: Float[np.ndarray, "3"],
    axis: Float[np.ndarray, "3"] | None,
    radius: float,
) -> Candidate:
    r = corners.mean(axis=1) - centre
    inward = bool(np.einsum("fk,fk->f", r, normals).mean() < 0)
    if axis is None:
        # the mean of the corners of a whole ball is its centre, that of a rounded corner is on the surface
        part = np.linalg.norm(r.mean(axis=0)) / radius
        length = 0.0 if part < 1 - 2 * SOME else -1.0
        return Candidate("ball seat" if inward else "ball", "", centre, np.full(3, np.nan), radius, length)
    r = r - (r @ axis)[:, None] * axis
    closed = np.linalg.norm(r.mean(axis=0)) < CLOSED * radius
    length = float(np.ptp(corners @ axis)) if closed else -1.0
    sign = np.sign(axis[np.abs(axis).argmax()])
    return Candidate("bore" if inward else "journal", "", centre, sign * axis, radius, length)


def _planes(link: Link) -> Iterator[Candidate]:
    """Connected flat facets in one plane."""
    facets, corners, normals = boundary(link)
    first, second = neighbours(link, facets)
    bent = _bent(link, facets, corners, normals, first, second)
    level = np.einsum("ek,ek->e", normals[first], normals[second]) > 1 - 1e-9
    label = components(first, second, level & ~bent[first] & ~bent[second], len(facets))
    for number in np.unique(label[~bent]):
        here = (label == number) & ~bent
        centre, normal = corners[here].mean(axis=(0, 1)), normals[here].mean(axis=0)
        yield Candidate("plane face", "", centre, normal, float("nan"), facets=facets[here])
