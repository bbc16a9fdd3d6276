"""Round coupling surfaces by their geometry: bores, journals and balls about a joint's point, in any mesh."""

from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Bool, Float, Int
from kedfem.links.record import Link
from kedfem.links.surfaces.surface import (
    CYLINDER_TOLERANCE,
    PLANE_TOLERANCE,
    boundary,
    components,
    neighbours,
    surface_quadrature,
)

FAR = 5.0  # lengths and radii of a bore: largest distance of a joint along its axis
AROUND = 0.1  # of a bore's radius: least distance of the middle of a facet from the axis
# of the radius: largest distance from the axis of the mean of a closed cylinder's corners
CLOSED = 0.3
LEVEL = 1e-3  # of a cylinder's length and radius: smaller distances along the axis are rounding
MANY = 12  # facets at one distance from a point, which are no coincidence
SUNK = 0.1  # of a cylinder's radius: largest depth of its facets; those of a prism of six sides have 0.13
ALL_WAYS = 0.01  # least variance of the normals of a ball in any direction; a zone of it of 30° has 0.02
# of a ball's radius: largest depth of curved facets; those of a cube about it have 0.4
DOMED = 0.1


@dataclass(frozen=True, slots=True)
class RoundSurface:
    """Facets on a closed cylinder about an axis: of all bores of one radius, which one pin fits, or of a journal.

    low, high : its ends along the axis, from the joint's point [m]
    """

    facets: Int[np.ndarray, " f"]
    radius: float
    inward: bool
    low: float
    high: float

    @property
    def gap(self) -> float:
        """Distance of the joint's point from the nearer end along the axis, negative inside [m]."""
        return max(self.low, -self.high)

    @property
    def level(self) -> float:
        """Tolerance of distances along the axis [m]."""
        return LEVEL * (self.high - self.low + self.radius)


def round_surfaces(link: Link, point: Float[np.ndarray, "3"], axis: Float[np.ndarray, "3"]) -> list[RoundSurface]:
    """All closed cylinders about an axis through a point, near to it along the axis.

    Facets may be flat, with at least seven of them around.
    """
    facets, corners, normals = boundary(link)
    along = (corners - point) @ axis
    r = corners - point - along[..., None] * axis
    radii = np.linalg.norm(r, axis=2)
    mean, middle = radii.mean(axis=1), r.mean(axis=1)
    out = np.linalg.norm(middle, axis=1)
    # the corners of a facet that the axis passes through may be equidistant from it, too
    round_ = (np.ptp(radii, axis=1) <= CYLINDER_TOLERANCE * mean) & (out > AROUND * mean)
    round_ &= mean > PLANE_TOLERANCE * np.ptp(link.X, axis=0).max()
    some = np.flatnonzero(round_)
    x = surface_quadrature(link, facets[some]).x - point
    within = np.linalg.norm(x - (x @ axis)[..., None] * axis, axis=2).min(axis=1)
    round_[some] = within >= (1 - SUNK) * mean[some]
    facing = np.einsum("fk,fk->f", normals, middle)
    found = []
    for inward, side in ((True, facing < -0.5 * out), (False, facing > 0.5 * out)):
        for same in _of_one_radius(np.flatnonzero(round_ & side), mean):
            for piece in [same] if inward else _pieces(link, facets, same):
                if np.linalg.norm(r[piece].mean(axis=(0, 1))) < CLOSED * mean[piece].min():
                    low, high = float(along[piece].min()), float(along[piece].max())
                    found.append(RoundSurface(facets[piece], float(mean[piece].mean()), inward, low, high))
    return [each for each in found if each.gap <= FAR * (each.high - each.low + each.radius)]


def _of_one_radius(which: Int[np.ndarray, " k"], radius: Float[np.ndarray, " f"]) -> list[Int[np.ndarray, " _"]]:
    """Facets sorted by radius and divided where it differs."""
    order = which[radius[which].argsort()]
    steps = np.flatnonzero(np.diff(radius[order]) > CYLINDER_TOLERANCE * radius[order[:-1]])
    return [part for part in np.split(order, steps + 1) if len(part)]


def _pieces(link: Link, facets: Int[np.ndarray, " f"], which: Int[np.ndarray, " k"]) -> list[Int[np.ndarray, " _"]]:
    """Facets divided into connected groups."""
    first, second = neighbours(link, facets[which])
    label = components(first, second, np.ones(len(first), bool), len(which))
    return [which[label == k] for k in range(label.max() + 1)]


def nearest_round_surfaces(found: list[RoundSurface], flat: bool) -> list[RoundSurface]:
    """The bores, or journals, of a joint: several only where they cannot be distinguished.

    One whose extent contains the joint's point, of bores the narrowest; else the nearest along the axis.

    Parameters
    ----------
    flat : whether they are in a plane, where cylinders have no extent
    """
    inside = [each for each in found if flat or each.gap < -each.level]
    if inside:
        narrowest = min(inside, key=lambda each: each.radius)
        return [narrowest] if narrowest.inward else inside
    nearest = min((each.gap for each in found), default=0.0)
    return [each for each in found if each.gap <= nearest + each.level]


def ball(link: Link, point: Float[np.ndarray, "3"]) -> Int[np.ndarray, " f"]:
    """Facets of the smallest ball or ball seat about the point, whole or in part: a ball may have a neck."""
    facets, corners, normals = boundary(link)
    radius = np.linalg.norm(corners - point, axis=2)
    mean = radius.mean(axis=1)
    round_ = np.ptp(radius, axis=1) <= CYLINDER_TOLERANCE * mean
    for same in _of_one_radius(np.flatnonzero(round_), mean):
        # a ring of a cylinder, cone or fillet is equidistant too, but its normals end on a plane
        spread = np.linalg.eigvalsh(np.cov(normals[same].T, ddof=0))
        if spread[0] > ALL_WAYS and (len(same) >= MANY or _domed(link, facets[same], point).all()):
            return np.asarray(facets[same])
    return facets[:0]


def _domed(link: Link, facets: Int[np.ndarray, " f"], point: Float[np.ndarray, "3"]) -> Bool[np.ndarray, " f"]:
    """Whether the interior of facets is as far from a point as their corners."""
    distance = np.linalg.norm(surface_quadrature(link, facets).x - point, axis=2)
    return np.asarray(np.ptp(distance, axis=1) <= DOMED * distance.max(axis=1))
