"""Structured hexahedra on mapped unit cubes, made into links."""

from collections.abc import Callable

import numpy as np

from kedfem.links.plane import plane_link
from kedfem.links.record import Link
from kedfem.links.solid import solid_link
from kedfem.mesh import QuadMesh, SolidMesh
from kedfem.mesh.elements.hexahedra import rectangle_quads, serendipity
from kedfem.mesh.elements.shape_functions import HEX8, HEX27
from kedfem.mesh.elements.tetrahedra import tetrahedral
from kedfem.scene import Material

Mapping = Callable[[np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]

PlaneMapping = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


def mapped_mesh(counts: tuple[int, int, int], mapping: Mapping, nodes: int = 27, closed: bool = False) -> SolidMesh:
    """counts elements along the unit cube's coordinates (r, s, t), each node at mapping(r, s, t).

    closed : the face r = 1 is the face r = 0 again, as in a ring.
    """
    order = 1 if nodes == 8 else 2
    size = order * np.array(counts) + 1
    axes = [np.arange(n) for n in size]
    r, s, t = (i.ravel() / (n - 1) for i, n in zip(np.meshgrid(*axes, indexing="ij"), size, strict=True))
    corners = np.stack(np.meshgrid(*(order * np.arange(c) for c in counts), indexing="ij"), -1).reshape(-1, 3)
    inside = HEX27 + 1 if order == 2 else (HEX8 + 1) // 2
    index = corners[:, None, :] + inside
    if closed:
        index[..., 0] %= size[0] - 1
    cells = np.ravel_multi_index(tuple(np.moveaxis(index, -1, 0)), tuple(size))
    used, renumbered = np.unique(cells, return_inverse=True)
    mesh = SolidMesh(np.stack(mapping(r, s, t), axis=1)[used], renumbered.reshape(cells.shape))
    return {10: tetrahedral, 20: serendipity}.get(nodes, lambda same: same)(mesh)


def box(lengths: tuple[float, float, float], start: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Mapping:
    """The unit cube stretched and moved."""
    return lambda r, s, t: (start[0] + lengths[0] * r, start[1] + lengths[1] * s, start[2] + lengths[2] * t)


def mapped_link(
    counts: tuple[int, int, int], mapping: Mapping, material: Material, nodes: int = 27, closed: bool = False
) -> Link:
    """The link of a mapped mesh, its axes those of the world."""
    return solid_link("test", mapped_mesh(counts, mapping, nodes, closed), material, np.eye(3))


def between_ellipses(r: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A quarter of the plate between two ellipses of NAFEMS tests LE1 and LE10 [m]."""
    c, d = np.cos(np.pi / 2 * s), np.sin(np.pi / 2 * s)
    return (2 + 1.25 * r) * c, (1 + 1.75 * r) * d


def mapped_plane(counts: tuple[int, int], mapping: PlaneMapping, thickness: float, material: Material) -> Link:
    """counts quad9 elements along the unit square's coordinates (r, s), each node at mapping(r, s)."""
    points, cells = rectangle_quads(1.0, 1.0, *counts)
    x, y = mapping(points[:, 0], points[:, 1] + 0.5)
    return plane_link("test", QuadMesh(np.stack([x, y, 0 * x], axis=1), cells, thickness), material, np.eye(3))


def model(counts: tuple[int, ...], link: Link, kind: str = "hex27") -> str:
    """Mesh and unknowns in words."""
    return f"{kind} {'×'.join(map(str, counts))}, {link.unknowns:,} unknowns"
