"""Curved tetrahedra that are folded, made straighter until none is."""

import numpy as np
from jaxtyping import Bool, Float, Int

from kedfem.mesh.elements.bounds import valid_everywhere
from kedfem.mesh.elements.quality import scaled_jacobian
from kedfem.mesh.elements.simplices import EDGES
from kedfem.mesh.elements.tetrahedra import edge_middles

# how far edges of bad elements are straightened, those of folded ones in the end wholly
_BLENDS = (0.4, 0.7, 1.0)


def unfolded(
    points: Float[np.ndarray, "n 3"], cells: Int[np.ndarray, "e 10"], least: float
) -> Float[np.ndarray, "n 3"] | None:
    """The nodes, edges made straighter where elements are bad, until none is folded; None if straight ones are.

    Elements with straight edges are valid if their corners are in order, so that there is an end to it.
    """
    bent, straight = points, points.copy()
    straight[cells[:, 4:]] = edge_middles(points, cells)
    moved = np.zeros(len(points))
    for _ in range(len(_BLENDS) * len(EDGES)):
        folded = ~valid_everywhere(points, cells)
        bad = scaled_jacobian(points, cells) < least
        nodes = np.union1d(cells[folded, 4:], cells[bad, 4:][moved[cells[bad, 4:]] < _BLENDS[-2]])
        if not len(nodes):
            return points
        if (moved[nodes] == 1.0).all():
            return None
        moved[nodes] = _next(moved[nodes])
        points = bent + moved[:, None] * (straight - bent)
    return None


def _next(blend: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """The next of the blends."""
    step: Bool[np.ndarray, "b n"] = np.array(_BLENDS)[:, None] > blend
    return np.where(step.any(axis=0), np.array(_BLENDS)[step.argmax(axis=0)], 1.0)
