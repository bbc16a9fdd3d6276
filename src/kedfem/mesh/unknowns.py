"""Meshes of about as many unknowns as asked for."""

from collections.abc import Callable
from typing import TypeVar

import numpy as np

NEAR = 1.3  # ratio of unknowns got and asked for that is near enough
APART = 1.02  # ratio of sizes between which no other number of unknowns is sought
TRIES = 6  # meshes made in search of a number of unknowns

T = TypeVar("T")


def nearest(
    wanted: int, size: float, most: float, power: float, mesh_of: Callable[[float], tuple[T, int]]
) -> tuple[T, str]:
    """The mesh whose number of unknowns is nearest to that asked for, of at most TRIES; in words if it is not near.

    Parameters
    ----------
    wanted : unknowns
    size, most : of elements: where the search begins, and the largest [m]
    power : by which of the size the number of unknowns falls
    mesh_of : the mesh with elements of a size, and its unknowns
    """
    found: list[tuple[float, T]] = []
    low, high = 0.0, np.inf  # sizes known as too small and too large
    for _ in range(TRIES):
        tried = min(size, most)
        mesh, unknowns = mesh_of(tried)
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
