"""The plan of a solid made of layers: a partition of the plane into regions, with the slabs in which each is filled."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from kedfem.arrays import Bool, Float


@dataclass(frozen=True, slots=True)
class Curve:
    """A curve between two regions, or between one and the outside.

    ends : numbers of the vertices where it starts and ends, equal if it is closed
    free : whether it is closed and meets no other curve, so that its vertex may be anywhere on it
    lengths : (m,) arc length from the start to each sample [-]
    samples : (m, 2) points along the curve, from end to end [-]
    curvatures : (m,) curvature at the samples, at least 0 [-]
    places : function from arc lengths to points exactly on the curve
    """

    ends: tuple[int, int]
    free: bool
    lengths: Float[np.ndarray, " m"]
    samples: Float[np.ndarray, "m 2"]
    curvatures: Float[np.ndarray, " m"]
    places: Callable[[Float[np.ndarray, " s"]], Float[np.ndarray, "s 2"]]

    @property
    def length(self) -> float:
        """Arc length."""
        return float(self.lengths[-1])

    @property
    def tangents(self) -> Float[np.ndarray, "2 2"]:
        """Unit vectors along the curve at its start and end."""
        near = 1e-4 * self.length
        points = self.places(np.array([0.0, near, self.length - near, self.length]))
        along = points[1::2] - points[::2]
        return np.asarray(along / np.linalg.norm(along, axis=1, keepdims=True))


#: A sequence of curves: the number of each, and whether it runs from its start to its end.
Loop = tuple[tuple[int, bool], ...]


@dataclass(frozen=True, slots=True)
class Region:
    """A part of the plane inside which no section has an edge.

    loops : its boundary, the region on the left: the outer loop, then those around holes
    material : (slabs,) whether each slab has material here
    area : [-]
    """

    loops: tuple[Loop, ...]
    material: Bool[np.ndarray, " slabs"]
    area: float


@dataclass(frozen=True, slots=True)
class Plan:
    """The sections of all slabs in one plane; lengths are divided by the solid's extent.

    axes : (3, 3) rows: the plan's x and y and the direction of the layers, in the solid's components [-]
    extent : the unit of all lengths here [m]
    heights : (slabs + 1,) bounds of the slabs along the direction [-]
    curves : tuple of Curve
    regions : tuple of Region
    origin : (3,) origin of the plan, in the solid's components [m]
    """

    axes: Float[np.ndarray, "3 3"]
    extent: float
    heights: Float[np.ndarray, " h"]
    curves: tuple[Curve, ...]
    regions: tuple[Region, ...]
    origin: Float[np.ndarray, "3"] = field(default_factory=lambda: np.zeros(3))

    @property
    def volume(self) -> float:
        """Volume of the solid."""
        thicknesses = np.diff(self.heights)
        return float(sum(region.area * (thicknesses @ region.material) for region in self.regions))

    @property
    def wall_heights(self) -> Float[np.ndarray, " c"]:
        """Total height over which each curve is a wall, with material on one side only [-]."""
        odd = np.zeros((len(self.curves), len(self.heights) - 1), dtype=bool)
        for region in self.regions:
            for loop in region.loops:
                for curve, _ in loop:
                    odd[curve] ^= region.material
        return np.asarray(odd @ np.diff(self.heights))

    def in_space(self, point: Float[np.ndarray, "2"], height: float) -> Float[np.ndarray, "3"]:
        """A point of the plan at a height, in the solid's components [m]."""
        return np.asarray(self.origin + self.extent * (np.array([*point, height]) @ self.axes))


def loop_samples(curves: tuple[Curve, ...], loop: Loop) -> Float[np.ndarray, "_ 2"]:
    """Points along a loop, in order."""
    parts = [curves[i].samples if forward else curves[i].samples[::-1] for i, forward in loop]
    return np.concatenate([part[:-1] for part in parts])


def signed_area(polygon: Float[np.ndarray, "_ 2"]) -> float:
    """Area of a polygon, positive if it runs anticlockwise."""
    x, y = (polygon - polygon[0]).T
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2)


def corner_angles(curves: tuple[Curve, ...], loop: Loop) -> Float[np.ndarray, " c"]:
    """Angle inside the region at the start of each curve of a loop [rad], between 0 and 2π."""
    angles = []
    for (before, ahead), (after, forward) in zip((loop[-1], *loop[:-1]), loop, strict=True):
        came = curves[before].tangents[1] if ahead else -curves[before].tangents[0]
        goes = curves[after].tangents[0] if forward else -curves[after].tangents[1]
        turn = np.arctan2(came[0] * goes[1] - came[1] * goes[0], came @ goes)
        angles.append(np.pi - turn)
    return np.array(angles)
