"""The size of a swept mesh: what is asked for, smaller where elements are poor, larger where they are plenty."""

from collections.abc import Callable

from kedfem.errors import KedfemError
from kedfem.mesh.cad.solids import OtherWayError, Sizing, Solid
from kedfem.mesh.elements.hexahedra import SolidMesh
from kedfem.mesh.elements.quality import mesh_quality
from kedfem.mesh.layered.layers import not_too_bad

_GOOD = 0.3  # scaled Jacobian from which no smaller size is tried
_SHARES = (1.0, 0.75, 0.5)  # of the size that is asked for
_PLENTY = 45_000  # unknowns above which a part whose size nobody gave is meshed coarser, as with tetrahedra
_COARSER = (1.4, 2.0)  # times the size


def sized(solid: Solid, sizing: Sizing, mesh_of: Callable[[float], SolidMesh]) -> SolidMesh:
    """The first good mesh of some shares of the size, or a cheaper one; else the best.

    Parameters
    ----------
    solid, sizing : what is meshed, and how fine
    mesh_of : the mesh with elements of a share of that size

    Raises
    ------
    OtherWayError
        None is made, or all are poor.
    """
    found: list[tuple[float, SolidMesh]] = []
    refusals: list[str] = []
    for share in _SHARES:
        try:
            mesh = mesh_of(share)
        except KedfemError as error:
            refusals.append(str(error))
            continue
        found.append((mesh_quality(mesh).least, mesh))
        if found[-1][0] >= _GOOD:
            return _cheaper(sizing, mesh, mesh_of)
    if not found:
        raise OtherWayError(refusals[0])
    return not_too_bad(solid, max(found, key=lambda each: each[0])[1])


def _cheaper(sizing: Sizing, mesh: SolidMesh, mesh_of: Callable[[float], SolidMesh]) -> SolidMesh:
    """The mesh, or a good one of larger elements where nobody asked for so many."""
    for share in _COARSER if sizing.size is None and sizing.across <= 2 else ():
        if 3 * len(mesh.points) <= _PLENTY:
            break
        try:
            other = mesh_of(share)
        except KedfemError:
            continue
        if len(other.points) < len(mesh.points) and mesh_quality(other).least >= _GOOD:
            mesh = other
    return mesh
