"""Meshes of plate links in blocks of quadrilaterals: a ring round each bore, and the waist between the rings."""

from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.mesh.elements.hexahedra import rectangle_quads
from kedfem.mesh.elements.shape_functions import QUAD9
from kedfem.mesh.planar.areas import Quads

_STEEPEST = np.pi / 8  # largest angle of an element along an arc
_STEEPEST_WAY_IN = np.pi / 6  # the same along the bore where it faces the waist
_SLENDER = 1.5  # length of the waist's elements in widths


@dataclass(frozen=True, slots=True)
class PlateSizes:
    """Plane dimensions of a plate link [m]: distance of its bores, waist, eyes outside and inside.

    Eyes as wide as the waist give a stadium. Wider ones meet the waist in fillets that are tangent to both and end on
    its sides 1.5 eye radii from the bore's centre, or before the middle of the waist.
    """

    length: float
    width: float
    eye_diameter: float
    bore_diameter: float

    @property
    def waisted(self) -> bool:
        """Whether the eyes are wider than the waist."""
        return self.eye_diameter > self.width * (1 + 1e-9)

    @property
    def reach(self) -> float:
        """Distance from the bore's centre to the straight sides, where the fillet or the eye ends [m]."""
        if not self.waisted:
            return 0.0
        R, half = self.eye_diameter / 2, self.width / 2
        return float(min(1.5 * R, (np.sqrt(R**2 - half**2) + self.length / 2) / 2))

    @property
    def fillet_radius(self) -> float:
        """Radius of the fillets between eye and waist [m], 0 for a stadium."""
        if not self.waisted:
            return 0.0
        R, half = self.eye_diameter / 2, self.width / 2
        return float((self.reach**2 / (R - half) - R - half) / 2)

    @property
    def shoulder(self) -> float:
        """Half the opening of the eye's arc towards the waist, seen from its centre [rad]."""
        return float(np.arctan2(self.width / 2 + self.fillet_radius, self.reach))


def plate_quads(sizes: PlateSizes, size: float) -> Quads:
    """quad9 mesh of a plate link with bores at (0, 0) and (length, 0); nodes of round sides lie on their circles.

    Parameters
    ----------
    sizes : eyes must be at least as wide as the waist; wider ones must not meet
    size : edge length of the elements [m]; in the waist they may be half as long again
    """
    across = max(1, round(sizes.width / size))
    slope = _section_slope(sizes)
    points, cells = _eye(sizes, size, across, slope)
    blocks = [(points, cells), ([sizes.length, 0.0] - points, cells)]
    waist = _waist(sizes, size, across, slope)
    return joined([*blocks, waist] if len(waist[1]) else blocks, 1e-6 * min(size, sizes.width))


def _section_slope(sizes: PlateSizes) -> float:
    """Slope [rad] of the fillet where the ring round the bore ends and the waist begins.

    Three elements meet there; with the ray from the bore at an angle β to the waist, their angles are
    β + slope, π/2 - β and π/2 - slope. The slope maximises the sharpest of them, at places not closer to the
    bore than the eye's outside.
    """
    slopes = np.linspace(0, 0.6 * (np.pi / 2 - sizes.shoulder), 25)
    x, y = _fillet(sizes, slopes).T
    beta = np.arctan2(y, x)
    sharpest = np.minimum(np.sin(beta + slopes), np.minimum(np.cos(beta), np.cos(slopes)))
    return float(slopes[np.argmax(np.where(x >= sizes.eye_diameter / 2, sharpest, -slopes))])


def _fillet(sizes: PlateSizes, slopes: Float[np.ndarray, " m"]) -> Float[np.ndarray, "m 2"]:
    """Points of the upper fillet of the eye at (0, 0) by their slopes [rad], 0 where it meets the waist."""
    r = sizes.fillet_radius
    return np.stack([sizes.reach - r * np.sin(slopes), sizes.width / 2 + r * (1 - np.cos(slopes))], axis=1)


def _stadium_section(sizes: PlateSizes, size: float) -> float:
    """Distance from the bore's centre at which the waist of a stadium begins [m]: the eye's radius if there is room."""
    R = sizes.eye_diameter / 2
    return R if sizes.length > 2 * R + size / 2 else sizes.length / 2


def _eye(sizes: PlateSizes, size: float, across: int, slope: float) -> Quads:
    """The ring between the bore at (0, 0) and the eye's outside, closed by the section before the waist."""
    side = _side(sizes, size, across, slope)
    turn, R = 2 * (np.pi - sizes.shoulder), sizes.eye_diameter / 2
    front = side[0] * np.stack([np.ones(2 * across + 1), np.linspace(-1, 1, 2 * across + 1)], axis=1)
    facing = np.concatenate([side[::-1] * [1, -1], front[1:], side[1:]])
    arc = sizes.shoulder + np.linspace(0, turn, 2 * _count(R * turn, turn, size) + 1)[1:-1]
    angles = np.concatenate([np.linspace(-sizes.shoulder, sizes.shoulder, len(facing)), arc])
    rim = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    wall = R - sizes.bore_diameter / 2
    outside = np.concatenate([facing, R * rim[len(facing) :]])
    return ring_quads(sizes.bore_diameter / 2 * rim, outside, max(1, round(wall / size)))


def _side(sizes: PlateSizes, size: float, across: int, slope: float) -> Float[np.ndarray, "m 2"]:
    """Nodes along the upper side of the ring, from the section before the waist to the eye's arc."""
    least = int(np.ceil(sizes.shoulder / _STEEPEST_WAY_IN - across / 2 - 1e-9))
    if not sizes.waisted:
        section, half = _stadium_section(sizes, size), sizes.width / 2
        return np.linspace([section, half], [0.0, half], 2 * max(1, least, round(section / size)) + 1)
    turn = np.pi / 2 - sizes.shoulder - slope
    steps = max(least, _count(sizes.fillet_radius * turn, turn, size))
    return _fillet(sizes, slope + np.linspace(0, turn, 2 * steps + 1))


def _waist(sizes: PlateSizes, size: float, across: int, slope: float) -> Quads:
    """The block between the two sections: straight columns, their ends on the sides and the fillets."""
    columns = _columns(sizes, size, slope)
    points, cells = rectangle_quads(1.0, 2.0, len(columns) // 2, across)
    column = np.arange(len(points)) // (2 * across + 1)
    return np.stack([columns[column, 0], points[:, 1] * columns[column, 1]], axis=1), cells


def _columns(sizes: PlateSizes, size: float, slope: float) -> Float[np.ndarray, "c 2"]:
    """Place and half height of the waist's columns of nodes, at ends and middles of elements alternately."""
    start = sizes.reach if sizes.waisted else _stadium_section(sizes, size)
    straight = sizes.length - 2 * start
    steps = 2 * int(np.ceil(straight / (_SLENDER * size) - 1e-9))
    middle = np.linspace([start, sizes.width / 2], [sizes.length - start, sizes.width / 2], steps + 1)
    if slope == 0:
        return middle
    length = sizes.fillet_radius * slope
    fillet = _fillet(sizes, np.linspace(slope, 0, 2 * _count(length / _SLENDER, slope, size) + 1))[:-1]
    return np.concatenate([fillet, middle, [sizes.length, 0] - fillet[::-1] * [1, -1]])


def _count(length: float, turn: float, size: float) -> int:
    """Number of elements along an arc."""
    return max(1, round(length / size), int(np.ceil(turn / _STEEPEST - 1e-9)))


def ring_quads(inside: Float[np.ndarray, "m 2"], outside: Float[np.ndarray, "m 2"], layers: int) -> Quads:
    """quad9 mesh along straight rays between two closed curves with equal numbers of nodes, ring by ring from inside.

    Parameters
    ----------
    inside, outside : (m, 2) nodes round the curves, anticlockwise, corners and middles of elements alternately [m]
    layers : elements along each ray
    """
    rays = np.linspace(inside, outside, 2 * layers + 1)
    m = len(inside)
    i, j = np.meshgrid(2 * np.arange(layers) + 1, 2 * np.arange(m // 2) + 1, indexing="ij")
    cells = (i.ravel()[:, None] + QUAD9[:, 0]) * m + (j.ravel()[:, None] + QUAD9[:, 1]) % m
    return rays.reshape(-1, 2), cells


def joined(blocks: list[Quads], tolerance: float) -> Quads:
    """Several meshes as one: nodes closer than `tolerance` [m] are made the same."""
    from scipy.spatial import cKDTree

    starts = np.cumsum([0, *(len(points) for points, _ in blocks)])
    points = np.concatenate([points for points, _ in blocks])
    cells = np.concatenate([cells + start for (_, cells), start in zip(blocks, starts, strict=False)])
    first = np.array([min(near) for near in cKDTree(points).query_ball_point(points, tolerance)])
    used, renumbered = np.unique(first[cells], return_inverse=True)
    return points[used], renumbered.reshape(cells.shape)
