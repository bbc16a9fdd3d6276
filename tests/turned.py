"""Meshes of known surfaces made by hand: turned parts with bores and journals, a ball on a neck, a ball seat."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from kedfem.mesh import SolidMesh
from kedfem.mesh.cad.sides import boundary_sides, side_corners
from kedfem.mesh.elements.hexahedra import Face, linear, quadratic, serendipity, without_unused_nodes
from kedfem.mesh.elements.shape_functions import HEX8, HEX27
from kedfem.mesh.elements.tetrahedra import tetrahedral

FORMS = {8: linear, 10: tetrahedral, 20: serendipity, 27: quadratic}


def turned(parts: Sequence[tuple[float, float, float, float]], nodes: int = 20, around: int = 16) -> SolidMesh:
    """A part turned about z: hollow cylinders from low to high, from one radius (0: solid) to another [m]."""
    core = 0.5 * min(r for part in parts for r in part[2:] if r > 0)
    radii = sorted({r for part in parts for r in part[2:] if r > 0} | {core})
    heights = sorted({z for part in parts for z in part[:2]})
    n = around // 4
    # sides of a square in order around it: what lies within the core circle
    s = np.linspace(-1, 1, n + 1)
    side = [np.column_stack([s[:-1], -np.ones(n)])]
    for _ in range(3):
        side.append(side[-1] @ [[0, 1], [-1, 0]])
    rim = np.concatenate(side)
    circle = rim / np.linalg.norm(rim, axis=1, keepdims=True)
    inner = np.stack(np.meshgrid(s, s, indexing="ij"), axis=-1).reshape(-1, 2) * core * 0.6
    points = [inner, *(r * circle for r in radii)]
    first = np.cumsum([0, *map(len, points)])
    on_rim = [int(np.argmin(np.linalg.norm(inner - 0.6 * core * p, axis=1))) for p in rim]
    rings = [np.array(on_rim), *(f + np.arange(around) for f in first[1:-1])]
    quads, spans = [], []
    for i in range(n):
        for j in range(n):
            a = i * (n + 1) + j
            quads.append([a, a + n + 1, a + n + 2, a + 1])
            spans.append(0.0)
    for k, (inside, outside) in enumerate(pairwise(rings)):
        for t in range(around):
            u = (t + 1) % around
            quads.append([inside[t], outside[t], outside[u], inside[u]])
            spans.append(([0.0, *radii])[k])
    plane, quads_, from_ = np.concatenate(points), np.array(quads), np.array(spans)
    cells = []
    for level, (low, high) in enumerate(pairwise(heights)):
        used = np.zeros(len(quads_), bool)
        for z0, z1, r0, r1 in parts:
            if z0 <= low and high <= z1:
                used |= (from_ >= r0 - 1e-12) & (from_ < r1 - 1e-12)
        q = quads_[used] + level * len(plane)
        cells.append(np.column_stack([q, q + len(plane)]))
    swept = np.column_stack([np.tile(plane, (len(heights), 1)), np.repeat(heights, len(plane))])
    mesh = without_unused_nodes(SolidMesh(swept, np.concatenate(cells)))
    distance = np.linalg.norm(mesh.points[:, :2], axis=1)
    return curved(mesh, nodes, distance * (distance > 0.9 * core), lambda x: x * [1, 1, 0])


def curved(mesh: SolidMesh, nodes: int, radius: np.ndarray, arm: Callable[[np.ndarray], np.ndarray]) -> SolidMesh:
    """The mesh with more nodes, put where the corners of their edge or side are that have one radius (0: straight)."""
    out = quadratic(mesh)
    points = out.points.copy()
    on = (HEX27[8:, None] * HEX8 >= 0).all(axis=2)
    for added, corners in zip(out.cells[:, 8:].T, on, strict=True):
        r = radius[mesh.cells[:, corners]]
        same = (np.ptp(r, axis=1) < 1e-9 * radius.max()) & (r.min(axis=1) > 0)
        x = out.points[added[same]]
        away = arm(x)
        points[added[same]] = x + away * (r[same].mean(axis=1) / np.linalg.norm(away, axis=1) - 1)[:, None]
    return FORMS[nodes](replace(out, points=points))


def ball_on_neck(radius: float, nodes: int = 20) -> SolidMesh:
    """A ball about the origin with a square neck along x that is two radii long."""
    s = np.linspace(-1, 1, 5)
    grid = np.stack(np.meshgrid(s, s, s, indexing="ij"), axis=-1).reshape(-1, 3)
    size = np.abs(grid).max(axis=1)
    round_ = np.where(size[:, None] > 0.9, grid / np.maximum(np.linalg.norm(grid, axis=1), 1e-9)[:, None], 0.6 * grid)
    number = np.arange(125).reshape(5, 5, 5)
    cells = [
        [number[tuple(np.add((i, j, k), c))] for c in (HEX8 + 1) // 2]
        for i in range(4) for j in range(4) for k in range(4)
    ]  # fmt: skip
    patch = number[4, 1:4, 1:4]
    neck = np.arange(125, 134).reshape(3, 3)
    end = np.array([[2.0, 0.3 * a, 0.3 * b] for a in (-1, 0, 1) for b in (-1, 0, 1)])
    for j in range(2):
        for k in range(2):
            cells.append([
                (patch if c[0] < 0 else neck)[j + (c[1] > 0), k + (c[2] > 0)] for c in HEX8
            ])  # fmt: skip
    mesh = SolidMesh(radius * np.concatenate([round_, end]), np.array(cells))
    on = np.zeros(len(mesh.points))
    on[np.flatnonzero(size > 0.9)] = radius
    return curved(mesh, nodes, on, lambda x: x)


def ball_seat(radius: float, nodes: int = 20) -> SolidMesh:
    """A block with a ball's hollow about the origin, open towards x."""
    s = np.linspace(-1, 1, 4)
    grid = np.stack(np.meshgrid(s, s, s, indexing="ij"), axis=-1).reshape(-1, 3)
    shell = np.abs(grid).max(axis=1) > 0.9
    inner = grid / np.maximum(np.linalg.norm(grid, axis=1), 1e-9)[:, None]
    points = np.concatenate([inner, 2 * grid])
    number = np.arange(64).reshape(4, 4, 4)
    cells = []
    for axis, end in ((0, 0), (1, 0), (1, 3), (2, 0), (2, 3)):  # not the side towards x
        side = np.take(number, end, axis=axis)
        for i in range(3):
            for j in range(3):
                q = [side[i, j], side[i + 1, j], side[i + 1, j + 1], side[i, j + 1]]
                cell = [*q, *(64 + x for x in q)]
                corner = points[cell]
                flipped = np.linalg.det(corner[[1, 3, 4]] - corner[0]) < 0
                cells.append([cell[k] for k in (0, 3, 2, 1, 4, 7, 6, 5)] if flipped else cell)
    mesh = SolidMesh(radius * points, np.array(cells))
    mesh = without_unused_nodes(mesh)
    distance = np.linalg.norm(mesh.points, axis=1)
    del shell
    return curved(mesh, nodes, np.where(np.abs(distance - radius) < 1e-9, radius, 0.0), lambda x: x)


def with_face(mesh: SolidMesh, name: str, on: Callable[[np.ndarray], np.ndarray]) -> SolidMesh:
    """The mesh with a named face: the sides whose corners all fulfil a condition on their places."""
    sides = boundary_sides(mesh.cells)
    sides = sides[:, : side_corners(sides.shape[1])]
    sides = sides[on(mesh.points)[sides].all(axis=1)]
    nan = np.full(3, np.nan)
    face = Face(name, "other", mesh.points[sides].mean(axis=(0, 1)), nan, np.nan, False, sides)
    return replace(mesh, faces=(*mesh.faces, face))
