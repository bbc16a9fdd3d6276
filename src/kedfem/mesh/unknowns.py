"""The search for a mesh of about a number of unknowns."""

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from kedfem.errors import MeshError

NEAR = 1.3  # ratio of the unknowns found to those asked for, within which the search ends
APART = 1.02  # ratio of sizes below which no size between them is tried
TRIES = 6  # most meshes
COARSER = 2.0  # ratio of a size that gives no mesh to the next one, where no smaller one is known as too small
VAIN = 3  # tries without any mesh after which no other is made

T = TypeVar("T")


class TooCoarseError(MeshError):
    """Elements of a size give no mesh; smaller ones may."""


def nearest_mesh(
    wanted: int, size: float, most: float, power: float, mesh_of: Callable[[float], tuple[T, int]]
) -> tuple[T, str]:
    """Of at most TRIES meshes the one nearest to the unknowns asked for, and a note if it is not within NEAR.

    Parameters
    ----------
    wanted : number of unknowns
    size, most : first and largest size of elements [m]
    power : the number of unknowns falls with this power of the size
    mesh_of : function from a size to the mesh and its number of unknowns

    Raises
    ------
    TooCoarseError
        No size that was tried gives a mesh.
    """
    found: list[tuple[float, T]] = []
    low, high = 0.0, np.inf  # sizes known as too small and too large
    for k in range(TRIES):
        tried = min(size, most)
        try:
            mesh, unknowns = mesh_of(tried)
        except TooCoarseError:
            if not found and k == VAIN - 1:
                raise
            ratio = COARSER**-power
        else:
            ratio = unknowns / wanted
            found.append((ratio, mesh))
        if 1 / NEAR < ratio < NEAR:
            break
        low, high = (max(low, tried), high) if ratio > 1 else (low, min(high, tried))
        if low >= most or high < APART * low:
            break
        size = tried * ratio ** (1 / power)
        if not low < size < high:
            size = float(np.sqrt(low * high))
    ratio, mesh = min(found, key=lambda each: abs(np.log(each[0])))
    note = f"the nearest found to the {wanted:,} unknowns asked for"
    return mesh, "" if 1 / NEAR < ratio < NEAR else note
