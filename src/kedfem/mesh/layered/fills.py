"""Regions of a plan filled with mapped quadrilaterals: four sides, rings, discs; straight-sided, not yet relaxed."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from kedfem.mesh.layered.mapping import Mapping
from kedfem.mesh.planar.areas import PlaneQuads


@dataclass(frozen=True, slots=True)
class Rim:
    """The divided boundary of a region.

    points : (n, 2) its nodes
    loops : numbers of the nodes along each curve of each loop, the region on the left, the outer loop first
    middles : (n, 2) the boundary's point half way between each node and the next one of its loop, in the order of
        `sides`
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
    """Four sides: transfinite interpolation between them."""
    curves = rim.loops[0]
    starts = np.cumsum([0, *(len(curve) - 1 for curve in curves)])
    turned = np.roll(rim.nodes(0), -starts[mapping.corners[0]])
    bounds = [int(starts[c] - starts[mapping.corners[0]]) for c in mapping.corners] + [len(turned)]
    south, east, north, west = (
        np.append(turned, turned[0])[start : end + 1] for start, end in pairwise(bounds)
    )
    return _transfinite(rim.points, south, east, north[::-1], west[::-1])


def _transfinite(
    points: Float[np.ndarray, "n 2"],
    south: Int[np.ndarray, " i"],
    east: Int[np.ndarray, " j"],
    north: Int[np.ndarray, " i"],
    west: Int[np.ndarray, " j"],
) -> tuple[Float[np.ndarray, "_ 2"], Int[np.ndarray, "_ 4"]]:
    """Coons' patch: nodes inside four sides, which run along i and j, and its cells."""
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
    """Quadrilaterals between the nodes of a grid, anticlockwise if i to j is."""
    corners = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    return np.stack(corners, axis=-1).reshape(-1, 4)


def _ring(rim: Rim, _: Mapping) -> tuple[Float[np.ndarray, "_ 2"], Int[np.ndarray, "_ 4"]]:
    """Between two loops of as many nodes: straight lines across, divided as the sides' lengths ask for."""
    outer, inner = rim.nodes(0), rim.nodes(1)[::-1]
    facing = np.roll(inner, -_offset(rim.points[outer], rim.points[inner]))
    across = np.linalg.norm(rim.points[outer] - rim.points[facing], axis=1).mean()
    sides = np.linalg.norm(np.diff(rim.points[rim.sides], axis=1)[:, 0], axis=1).mean()
    layers = max(1, int(np.rint(across / sides)))
    return _between(rim.points, outer, facing, layers)


def _offset(outer: Float[np.ndarray, "n 2"], inner: Float[np.ndarray, "n 2"]) -> int:
    """How far to turn the nodes of an inner loop so that they face those of the outer one."""
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
    """A rectangle of cells inside a ring of them."""
    outer = rim.nodes(0)
    count = len(outer)
    i = count // 4
    j = count // 2 - i
    centre = rim.points[outer].mean(axis=0)
    square = centre + 0.55 * (rim.points[outer] - centre)
    layers = max(1, int(np.rint(0.45 * count / (2 * np.pi))))
    points = np.concatenate([rim.points, square])
    inner = len(rim.points) + np.arange(count)
    bounds = np.cumsum([0, i, j, i, j])
    south, east, north, west = (
        np.append(inner, inner[0])[start : end + 1] for start, end in pairwise(bounds)
    )
    middle, square_cells = _transfinite(points, south, east, north[::-1], west[::-1])
    points = np.concatenate([points, middle])
    between, ring_cells = _between(points, outer, inner, layers)
    return np.concatenate([points, between])[len(rim.points) :], np.concatenate([square_cells, ring_cells])
