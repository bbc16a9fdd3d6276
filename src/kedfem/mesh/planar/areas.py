"""Plane quadrilaterals inside a boundary that may be curved: with straight sides, and quadratic."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float, Int

# nodes [m]; quad9 cells in VTK order, anticlockwise
Quads = tuple[Float[np.ndarray, "_ 2"], Int[np.ndarray, "_ 9"]]


@dataclass(frozen=True, slots=True)
class PlaneQuads:
    """Quadrilaterals with straight sides inside, and the sides on the boundary with their true middles.

    points : (n, 2) corners of the cells [m]
    cells : (e, 4) quadrilaterals, anticlockwise
    rim : (b, 2) sides on the boundary, each once, in the direction of its cell
    middles : (b, 2) point of the boundary half way along each of these sides [m]
    """

    points: Float[np.ndarray, "n 2"]
    cells: Int[np.ndarray, "e 4"]
    rim: Int[np.ndarray, "b 2"]
    middles: Float[np.ndarray, "b 2"]


@dataclass(frozen=True, slots=True)
class QuadraticQuads:
    """quad9 nodes and cells, and the movement of all nodes with the free ones.

    points : (m, 2) corners, then middles of sides (those on the boundary exactly), then centres of cells [m]
    cells : (e, 9) VTK order
    free : (f,) corners inside the boundary
    follow : (m, f) movement of each node per movement of each free one; nodes of sides and centres stay in the middle [-]
    """

    points: Float[np.ndarray, "m 2"]
    cells: Int[np.ndarray, "e 9"]
    free: Int[np.ndarray, " f"]
    follow: sp.csr_array


def directed_sides(cells: Int[np.ndarray, "e 4"]) -> Int[np.ndarray, "s 2"]:
    """Start and end of the four sides of each cell, cell by cell."""
    return np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1).reshape(-1, 2)


def pillowed(mesh: PlaneQuads) -> PlaneQuads:
    """The mesh with a layer of cells inserted along the whole boundary, to be relaxed afterwards.

    No cell then has two sides on a smooth boundary, an angle of 180° that no movement of inner nodes mends.
    """
    n, centres = len(mesh.points), np.repeat(mesh.points[mesh.cells].mean(axis=1), 4, axis=0)
    nodes, outer = mesh.cells.ravel(), np.unique(mesh.rim)
    inner = np.arange(n)
    inner[outer] = n + np.arange(len(outer))
    inward = np.stack([np.bincount(nodes, centres[:, i], n) for i in (0, 1)], axis=1)
    inward = inward / np.bincount(nodes, minlength=n)[:, None] - mesh.points
    layer = np.column_stack([mesh.rim, inner[mesh.rim[:, ::-1]]])
    points = np.concatenate([mesh.points, (mesh.points + 0.4 * inward)[outer]])
    return PlaneQuads(points, np.concatenate([inner[mesh.cells], layer]), mesh.rim, mesh.middles)


def quadratic_quads(mesh: PlaneQuads) -> QuadraticQuads:
    """The quad9 cells with the same corners: straight sides inside, sides through the given middles on the boundary."""
    n, e = len(mesh.points), len(mesh.cells)
    sides, side = np.unique(np.sort(directed_sides(mesh.cells), axis=1), axis=0, return_inverse=True)
    cells = np.column_stack([mesh.cells, n + side.reshape(e, 4), n + len(sides) + np.arange(e)])
    on_rim = np.searchsorted(sides @ [n, 1], np.sort(mesh.rim, axis=1) @ [n, 1])
    half = np.full(len(sides), 0.5)
    half[on_rim] = 0.0
    middle_of = _rows(sides, np.repeat(half[:, None], 2, axis=1), n)
    middles = middle_of @ mesh.points
    middles[on_rim] = mesh.middles
    centre_of = _rows(cells[:, :8], np.tile([-0.25] * 4 + [0.5] * 4, (e, 1)), n + len(sides))
    around = np.concatenate([mesh.points, middles])
    free = np.setdiff1d(np.arange(n), mesh.rim)
    follow = sp.vstack([sp.eye_array(n, format="csr"), middle_of], format="csr")
    follow = sp.csr_array(sp.vstack([follow, centre_of @ follow], format="csr")[:, free])
    return QuadraticQuads(np.concatenate([around, centre_of @ around]), cells, free, follow)


def _rows(columns: Int[np.ndarray, "r c"], values: Float[np.ndarray, "r c"], width: int) -> sp.csr_array:
    """Sparse matrix with the same number of entries in each row."""
    starts = np.arange(0, columns.size + 1, columns.shape[1])
    return sp.csr_array((values.ravel(), columns.ravel(), starts), shape=(len(columns), width))
