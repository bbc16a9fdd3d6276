"""The element size of a swept mesh: as asked for, smaller if elements are bad, larger if they are too many."""

from collections.abc import Callable
from typing import TypeVar

from kedfem.errors import KedfemError
from kedfem.mesh.cad.solids import MANY_UNKNOWNS, OtherMethodError, Sizing, Solid
from kedfem.mesh.elements.hexahedra import SolidMesh
from kedfem.mesh.elements.quality import mesh_quality
from kedfem.mesh.places import in_mm

GOOD = 0.3  # scaled Jacobian from which no smaller size is tried
SHARES = (1.0, 0.75, 0.5)  # of the size asked for, tried in turn
_LEAST = 0.1  # scaled Jacobian below which another method may be better
_COARSER = (1.4, 2.0)  # factors on the size

T = TypeVar("T")


def first_good(mesh_of: Callable[[float], T], quality: Callable[[T], float]) -> tuple[float, T]:
    """Quality and mesh: the first good mesh at some shares of the size, else the best one.

    An OtherMethodError says why the whole size fails if every share does.

    Parameters
    ----------
    mesh_of : function from a share of the size to the mesh
    quality : function from a mesh to its least scaled Jacobian [-]
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


def sized(solid: Solid, sizing: Sizing, mesh_of: Callable[[float], SolidMesh]) -> SolidMesh:
    """The first good mesh at some shares of the size, or a coarser good one if it has many unknowns; else the best.

    An OtherMethodError is raised if all are bad.

    Parameters
    ----------
    mesh_of : function from a share of the size to the mesh
    """
    least, mesh = first_good(mesh_of, lambda each: mesh_quality(each).least)
    return _cheaper(sizing, mesh, mesh_of) if least >= GOOD else good_enough(solid, mesh)


def _cheaper(sizing: Sizing, mesh: SolidMesh, mesh_of: Callable[[float], SolidMesh]) -> SolidMesh:
    """The mesh, or a good one with larger elements if it has many unknowns that nobody asked for."""
    for share in _COARSER if sizing.size is None and sizing.across <= 2 else ():
        if 3 * len(mesh.points) <= MANY_UNKNOWNS:
            break
        try:
            other = mesh_of(share)
        except KedfemError:
            continue
        if len(other.points) < len(mesh.points) and mesh_quality(other).least >= GOOD:
            mesh = other
    return mesh


def good_enough(solid: Solid, mesh: SolidMesh, what: str = "a sweep") -> SolidMesh:
    """The mesh itself; an OtherMethodError if its quality is too low."""
    quality = mesh_quality(mesh)
    if quality.least < _LEAST:
        raise OtherMethodError(
            f"{solid.name}: {what} must give a scaled Jacobian of at least {_LEAST:g}, got {quality.least:.3g} "
            f"at {in_mm(quality.centre)}"
        )
    return mesh
