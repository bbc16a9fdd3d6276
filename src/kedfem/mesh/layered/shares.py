"""Smaller sizes than asked for, where elements are poor."""

from collections.abc import Callable
from typing import TypeVar

from kedfem.errors import KedfemError
from kedfem.mesh.cad.solids import OtherMethodError

GOOD = 0.3  # scaled Jacobian from which no smaller size is tried
SHARES = (1.0, 0.75, 0.5)  # of the size that is asked for

T = TypeVar("T")


def first_good(mesh_of: Callable[[float], T], quality: Callable[[T], float]) -> tuple[float, T]:
    """The first good mesh of some shares of the size, else the best, after its quality.

    Parameters
    ----------
    mesh_of : the mesh with elements of a share of the size
    quality : its least scaled Jacobian

    Raises
    ------
    OtherMethodError
        None is made; why not of the whole size.
    """
    found: list[tuple[float, T]] = []
    refusals: list[str] = []
    for share in SHARES:
        try:
            mesh = mesh_of(share)
        except KedfemError as error:
            refusals.append(str(error))
            continue
        found.append((quality(mesh), mesh))
        if found[-1][0] >= GOOD:
            return found[-1]
    if not found:
        raise OtherMethodError(refusals[0])
    return max(found, key=lambda each: each[0])
