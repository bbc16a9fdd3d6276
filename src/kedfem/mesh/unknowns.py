"""Meshes of about as many unknowns as asked for."""

from collections.abc import Callable
from typing import TypeVar

import numpy as np

NEAR = 1.3  # ratio of unknowns got and asked for that is near enough
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
    ratios: list[float] = []
    for _ in range(TRIES):
        mesh, unknowns = mesh_of(min(size, most))
        ratios.append(unknowns / wanted)
        found.append((abs(np.log(ratios[-1])), mesh))
        if 1 / NEAR < ratios[-1] < NEAR or ratios[-1] in ratios[:-1]:
            break
        size *= ratios[-1] ** (1 / power)
    off, mesh = min(found, key=lambda each: each[0])
    return mesh, "" if off <= np.log(NEAR) else f"the nearest found to the {wanted:,} unknowns asked for"
