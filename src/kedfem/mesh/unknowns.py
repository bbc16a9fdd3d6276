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
    for _ in range(TRIES):
        mesh, unknowns = mesh_of(min(size, most))
        ratio = unknowns / wanted
        known = any(ratio == before for before, _ in found)
        found.append((ratio, mesh))
        if known or 1 / NEAR < ratio < NEAR:
            break
        size *= ratio ** (1 / power)
    ratio, mesh = min(found, key=lambda each: abs(np.log(each[0])))
    note = f"the nearest found to the {wanted:,} unknowns asked for"
    return mesh, "" if 1 / NEAR < ratio < NEAR else note
