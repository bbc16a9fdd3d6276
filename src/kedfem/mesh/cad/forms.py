"""The geometry of a face, fitted to points and normals on it: a plane, a cylinder, a sphere or another form."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from kedfem.arrays import Float

Kind = Literal["plane", "cylinder", "sphere", "other"]
_NAN = np.full(3, np.nan)


@dataclass(frozen=True, slots=True)
class Form:
    """The geometry of a piece of surface, as in `Face`; `length` is that of a cylinder along its axis [m]."""

    kind: Kind
    centre: Float[np.ndarray, "3"]
    direction: Float[np.ndarray, "3"]
    radius: float = np.nan
    inward: bool = False
    length: float = np.nan


@dataclass(frozen=True, slots=True)
class Sample:
    """Points of a surface, and outward unit normals there or elsewhere on it.

    points : (n, 3) points on the surface, up to its edges [m]
    places, normals : (q, 3) [m], [-] unit normals and where they are; these places may be slightly off the surface
    """

    points: Float[np.ndarray, "n 3"]
    places: Float[np.ndarray, "q 3"]
    normals: Float[np.ndarray, "q 3"]

    @property
    def size(self) -> float:
        """Diagonal of the bounding box [m]."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))


def fitted_form(sample: Sample, accuracy: float, skew: float) -> Form:
    """The simplest form that fits a sample.

    The centre of a plane and of "other" is the mean of the points; a caller that knows the centroid replaces it.

    Parameters
    ----------
    sample : at least three points
    accuracy : most distance of points from the form, in sizes of the sample [-]
    skew : sine of the most angle between normals and those of the form [-]
    """
    other = Form("other", sample.points.mean(axis=0), _NAN)
    for fit in (_plane, _cylinder, _sphere):
        found = fit(sample, accuracy * sample.size, skew)
        if found is not None:
            return found
    return other


def _plane(sample: Sample, slack: float, skew: float) -> Form | None:
    """The plane of the points, if all normals agree and the points are in it."""
    mean = sample.normals.mean(axis=0)
    length = np.linalg.norm(mean)
    if length < 0.5 or np.linalg.norm(np.cross(sample.normals, mean / length), axis=1).max() > skew:
        return None
    centre = sample.points.mean(axis=0)
    normal = np.linalg.svd(sample.points - centre)[2][2] if skew > 1e-2 else mean / length
    normal = normal * np.sign(normal @ mean)
    off = np.abs((sample.points - centre) @ normal).max()
    return Form("plane", centre, normal) if off <= slack else None


def _cylinder(sample: Sample, slack: float, skew: float) -> Form | None:
    """The cylinder of the points, if the normals are perpendicular to an axis and all points equally far from it."""
    axis = np.linalg.svd(sample.normals)[2][2]
    if _only_two(sample.normals) or np.abs(sample.normals @ axis).max() > skew:
        return None
    axis = axis * np.sign(axis[np.argmax(np.abs(axis) > 0.5)])
    square = np.linalg.svd(axis[None])[2][1:]
    found = _round(sample.points @ square.T, slack)
    if found is None:
        return None
    flat, radius = found
    inward = _inward(sample.places @ square.T - flat, sample.normals @ square.T)
    along = sample.points @ axis
    middle = (along.max() + along.min()) / 2
    return Form("cylinder", flat @ square + middle * axis, axis, radius, inward, float(np.ptp(along)))


def _only_two(normals: Float[np.ndarray, "q 3"]) -> bool:
    """Whether the normals have at most two directions, as those of opposite or adjacent planes."""
    return len(np.unique(np.round(normals, 4), axis=0)) < 3


def _sphere(sample: Sample, slack: float, skew: float) -> Form | None:
    """The sphere of the points, if all are equally far from a centre and the normals are radial."""
    found = _round(sample.points, slack)
    if found is None or _only_two(sample.normals):
        return None
    centre, radius = found
    radial = sample.places - centre
    radial /= np.linalg.norm(radial, axis=1)[:, None]
    if np.linalg.norm(np.cross(radial, sample.normals), axis=1).max() > skew:
        return None
    return Form("sphere", centre, _NAN, radius, _inward(radial, sample.normals))


def _round(points: Float[np.ndarray, "n d"], slack: float) -> tuple[Float[np.ndarray, "d"], float] | None:
    """Centre and radius of the circle or sphere through points: |p|² = 2 c·p + (r² − |c|²), by least squares."""
    middle = points.mean(axis=0)
    from_middle = points - middle
    scale = np.abs(from_middle).max()
    p = from_middle / scale
    rows = np.column_stack([2 * p, np.ones(len(p))])
    (*half, rest), _, rank, _ = np.linalg.lstsq(rows, (p**2).sum(axis=1), rcond=1e-9)
    if rank <= points.shape[1]:
        return None
    radius = np.sqrt(rest + np.dot(half, half))
    centre = middle + scale * np.array(half)
    off = np.abs(np.linalg.norm(points - centre, axis=1) - scale * radius).max()
    return (centre, float(scale * radius)) if off <= slack else None


def _inward(radial: Float[np.ndarray, "q d"], normals: Float[np.ndarray, "q d"]) -> bool:
    """Whether the outward normals point to the centre: the material surrounds the surface."""
    return bool((radial * normals).sum() < 0)
