"""Mapped regions of a plan (blocks, rings and discs): their choice, the element numbers of their sides, their cells."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.mesh.layered.partition import Loop, Plan, Region, corner_angles, loop_samples, signed_area
from kedfem.mesh.planar.areas import PlaneQuads

_CORNER = np.radians(150)  # largest angle of a vertex that is a corner of a block
_DEAR = (1.6, 3.5)  # largest factor on the elements of a side, for regions with one loop and with two
_UNEVEN = 4.0  # largest ratio of the longest to the shortest distance across a ring


@dataclass(frozen=True, slots=True)
class Mapping:
    """The mapping of a region.

    kind : a block has four sides, a ring lies between two loops, a disc inside a smooth loop
    corners : indices of the curves of the outer loop with which the sides of a block begin
    """

    kind: Literal["block", "ring", "disc"]
    corners: tuple[int, ...] = ()


def mappings(plan: Plan, counts: list[int]) -> tuple[Mapping | None, ...]:
    """The mapping of each region, or None; `counts` of the curves are raised until opposite sides agree."""
    found = [_mapping(plan, region) for region in plan.regions]
    while True:
        raised, dear = _raised(plan, found, counts)
        if dear is None:
            counts[:] = raised
            return tuple(found)
        found[dear] = None


def _raised(plan: Plan, found: list[Mapping | None], counts: list[int]) -> tuple[list[int], int | None]:
    """Counts that agree on opposite sides, and None; or a region that needs too many elements."""
    raised, number = list(counts), None
    for _ in range(200):
        uneven = _uneven_sides(plan, found, raised)
        if uneven is None:
            return raised, None
        number, side, wanted = uneven
        dear = _DEAR[len(plan.regions[number].loops) - 1]
        _raise(plan, raised, side, wanted)
        before, after = (sum(one[i] for i in side) for one in (counts, raised))
        if after > max(before + 2, dear * before):
            break
    return raised, number


def _mapping(plan: Plan, region: Region) -> Mapping | None:
    """The mapping of a region that its shape allows."""
    if len(region.loops) == 2:
        return Mapping("ring") if _is_even_ring(plan, region) else None
    if len(region.loops) > 2:
        return None
    angles = corner_angles(plan.curves, region.loops[0])
    corners = np.sort(np.argsort(angles)[:4])
    others = np.delete(angles, corners)
    if len(corners) == 4 and angles[corners].max() < _CORNER and (others > _CORNER).all():
        return Mapping("block", tuple(int(corner) for corner in corners))
    if (angles > _CORNER).all() and _is_round(plan, region):
        return Mapping("disc")
    return None


def _is_even_ring(plan: Plan, region: Region) -> bool:
    """Whether the width of a region between two loops varies little."""
    outer, inner = (loop_samples(plan.curves, loop) for loop in region.loops)
    across = np.linalg.norm(outer[:, None] - inner, axis=2)
    widths = np.concatenate([across.min(axis=1), across.min(axis=0)])
    lengths = [sum(plan.curves[i].length for i, _ in loop) for loop in region.loops]
    return bool(widths.max() < _UNEVEN * widths.min() and lengths[0] < 4 * lengths[1])


def _is_round(plan: Plan, region: Region) -> bool:
    """Whether the area of a loop is nearly that of a circle of the same length."""
    samples = loop_samples(plan.curves, region.loops[0])
    length = sum(plan.curves[i].length for i, _ in region.loops[0])
    return signed_area(samples) > 0.7 * length**2 / (4 * np.pi)


def _sides_of(plan: Plan, mapping: Mapping, loops: tuple[Loop, ...]) -> list[tuple[list[int], list[int]]]:
    """The pairs of sides, as curves, that must have equal numbers of elements."""
    if mapping.kind == "disc":
        return []
    curves = [[i for i, _ in loop] for loop in loops]
    if mapping.kind == "ring":
        return _facing_curves(plan, loops) or [(curves[0], curves[1])]
    first, *others = mapping.corners
    bounds = [first, *others, first + len(curves[0])]
    around = curves[0] + curves[0]
    sides = [around[start:end] for start, end in pairwise(bounds)]
    return [(sides[0], sides[2]), (sides[1], sides[3])]


def _facing_curves(plan: Plan, loops: tuple[Loop, ...]) -> list[tuple[list[int], list[int]]]:
    """The curves of two loops in pairs, if both have the same number of curves, at least two."""
    outer, inner = loops[0], loops[1][::-1]
    if len(outer) != len(inner) or len(outer) < 2:
        return []
    middles = [np.array([plan.curves[i].samples.mean(axis=0) for i, _ in loop]) for loop in (outer, inner)]
    turns = [((middles[0] - np.roll(middles[1], -k, axis=0)) ** 2).sum() for k in range(len(inner))]
    turned = np.roll([i for i, _ in inner], -int(np.argmin(turns)))
    return [([i], [int(j)]) for (i, _), j in zip(outer, turned, strict=True)]


def _uneven_sides(plan: Plan, found: list[Mapping | None], counts: list[int]) -> tuple[int, list[int], int] | None:
    """A region whose opposite sides do not agree: its number, the side with fewer elements, and the number it needs."""
    for number, (mapping, region) in enumerate(zip(found, plan.regions, strict=True)):
        for pair in _sides_of(plan, mapping, region.loops) if mapping else []:
            sums = [sum(counts[i] for i in side) for side in pair]
            if sums[0] != sums[1]:
                return number, pair[int(sums[1] < sums[0])], max(sums)
    return None


def _raise(plan: Plan, counts: list[int], side: list[int], wanted: int) -> None:
    """Raise the counts of a side by two at a time, on the curve whose elements are longest."""
    while sum(counts[i] for i in side) < wanted:
        longest = max(side, key=lambda i: plan.curves[i].length / counts[i])
        counts[longest] += 2


@dataclass(frozen=True, slots=True)
class Rim:
    """The divided boundary of a region.

    points : (n, 2) its nodes [-]
    loops : node numbers along each curve of each loop, the region on the left, the outer loop first
    middles : (n, 2) points of the boundary half way along each side, in the order of `sides` [-]
    """

    points: Float[np.ndarray, "n 2"]
    loops: tuple[tuple[Int[np.ndarray, " _"], ...], ...]
    middles: Float[np.ndarray, "n 2"]

    @property
    def sides(self) -> Int[np.ndarray, "n 2"]:
        """Start and end of each side."""
        curves = [curve for loop in self.loops for curve in loop]
        return np.concatenate([np.stack([curve[:-1], curve[1:]], axis=1) for curve in curves])

    def nodes(self, loop: int) -> Int[np.ndarray, " _"]:
        """Numbers of the nodes around a loop, each once."""
        return np.concatenate([curve[:-1] for curve in self.loops[loop]])


def mapped(rim: Rim, mapping: Mapping) -> PlaneQuads:
    """The cells of a mapped region."""
    grids = {"block": _block, "ring": _ring, "disc": _disc}
    inner, cells = grids[mapping.kind](rim, mapping)
    return PlaneQuads(np.concatenate([rim.points, inner]), cells, rim.sides, rim.middles)


def _block(rim: Rim, mapping: Mapping) -> tuple[Float[np.ndarray, "_ 2"], Int[np.ndarray, "_ 4"]]:
    """Inner nodes and cells of a block, by transfinite interpolation between its sides."""
    curves = rim.loops[0]
    starts = np.cumsum([0, *(len(curve) - 1 for curve in curves)])
    turned = np.roll(rim.nodes(0), -starts[mapping.corners[0]])
    bounds = [int(starts[c] - starts[mapping.corners[0]]) for c in mapping.corners] + [len(turned)]
    return _transfinite(rim.points, turned, bounds)


def _transfinite(
    points: Float[np.ndarray, "n 2"], around: Int[np.ndarray, " m"], bounds: Sequence[int]
) -> tuple[Float[np.ndarray, "_ 2"], Int[np.ndarray, "_ 4"]]:
    """Inner nodes and cells of a Coons patch; `bounds` divide the nodes around it into four sides."""
    sides = [np.append(around, around[0])[start : end + 1] for start, end in pairwise(bounds)]
    south, east, north, west = sides[0], sides[1], sides[2][::-1], sides[3][::-1]
    i, j = len(south), len(west)
    grid = np.full((i, j), -1)
    grid[:, 0], grid[:, -1], grid[0], grid[-1] = south, north, west, east
    u, v = np.linspace(0, 1, i)[:, None, None], np.linspace(0, 1, j)[None, :, None]
    p = points
    patch = (1 - v) * p[south][:, None] + v * p[north][:, None] + (1 - u) * p[west] + u * p[east]
    patch -= (1 - u) * ((1 - v) * p[south[0]] + v * p[north[0]])
    patch -= u * ((1 - v) * p[south[-1]] + v * p[north[-1]])
    grid[1:-1, 1:-1] = len(points) + np.arange((i - 2) * (j - 2)).reshape(i - 2, j - 2)
    return patch[1:-1, 1:-1].reshape(-1, 2), _cells(grid)


def _cells(grid: Int[np.ndarray, "i j"]) -> Int[np.ndarray, "_ 4"]:
    """Quadrilaterals between the nodes of a grid, anticlockwise if the turn from i to j is."""
    corners = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    return np.stack(corners, axis=-1).reshape(-1, 4)


def _ring(rim: Rim, _: Mapping) -> tuple[Float[np.ndarray, "_ 2"], Int[np.ndarray, "_ 4"]]:
    """Inner nodes and cells of a ring: straight lines between loops of equal numbers of nodes, in nearly square cells."""
    outer, inner = rim.nodes(0), rim.nodes(1)[::-1]
    facing = np.roll(inner, -_offset(rim.points[outer], rim.points[inner]))
    across = np.linalg.norm(rim.points[outer] - rim.points[facing], axis=1).mean()
    sides = np.linalg.norm(np.diff(rim.points[rim.sides], axis=1)[:, 0], axis=1).mean()
    layers = max(1, int(np.rint(across / sides)))
    return _between(rim.points, outer, facing, layers)


def _offset(outer: Float[np.ndarray, "n 2"], inner: Float[np.ndarray, "n 2"]) -> int:
    """Shift of the nodes of an inner loop that places them nearest to those of the outer one."""
    turned = [((outer - np.roll(inner, -k, axis=0)) ** 2).sum() for k in range(len(inner))]
    return int(np.argmin(turned))


def _between(
    points: Float[np.ndarray, "n 2"], outer: Int[np.ndarray, " m"], inner: Int[np.ndarray, " m"], layers: int
) -> tuple[Float[np.ndarray, "_ 2"], Int[np.ndarray, "_ 4"]]:
    """Nodes and cells between two closed loops."""
    share = np.linspace(0, 1, layers + 1)[1:-1, None, None]
    nodes = ((1 - share) * points[outer] + share * points[inner]).reshape(-1, 2)
    rows = len(points) + np.arange(len(nodes)).reshape(layers - 1, len(outer))
    grid = np.concatenate([outer[None], rows, inner[None]])
    return nodes, _cells(np.concatenate([grid, grid[:, :1]], axis=1).T)


def _disc(rim: Rim, _: Mapping) -> tuple[Float[np.ndarray, "_ 2"], Int[np.ndarray, "_ 4"]]:
    """Inner nodes and cells of a disc: a rectangle of cells inside a ring of cells."""
    outer = rim.nodes(0)
    count = len(outer)
    i = count // 4
    j = count // 2 - i
    centre = rim.points[outer].mean(axis=0)
    square = centre + 0.55 * (rim.points[outer] - centre)
    layers = max(1, int(np.rint(0.45 * count / (2 * np.pi))))
    points = np.concatenate([rim.points, square])
    inner = len(rim.points) + np.arange(count)
    middle, square_cells = _transfinite(points, inner, [0, i, i + j, 2 * i + j, 2 * (i + j)])
    points = np.concatenate([points, middle])
    between, ring_cells = _between(points, outer, inner, layers)
    return np.concatenate([points, between])[len(rim.points) :], np.concatenate([square_cells, ring_cells])
