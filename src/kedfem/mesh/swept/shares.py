"""The size of a swept mesh: what is asked for, smaller where elements are poor, larger where they are plenty."""

from collections.abc import Callable

from kedfem.errors import KedfemError
from kedfem.mesh.cad.solids import Sizing, Solid
from kedfem.mesh.elements.hexahedra import SolidMesh
from kedfem.mesh.elements.quality import mesh_quality
from kedfem.mesh.layered.layers import not_too_bad
from kedfem.mesh.layered.shares import GOOD, first_good

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
    OtherMethodError
        None is made, or all are poor.
    """
    least, mesh = first_good(mesh_of, lambda each: mesh_quality(each).least)
    return _cheaper(sizing, mesh, mesh_of) if least >= GOOD else not_too_bad(solid, mesh)


def _cheaper(sizing: Sizing, mesh: SolidMesh, mesh_of: Callable[[float], SolidMesh]) -> SolidMesh:
    """The mesh, or a good one of larger elements where nobody asked for so many."""
    for share in _COARSER if sizing.size is None and sizing.across <= 2 else ():
        if 3 * len(mesh.points) <= _PLENTY:
            break
        try:
            other = mesh_of(share)
        except KedfemError:
            continue
        if len(other.points) < len(mesh.points) and mesh_quality(other).least >= GOOD:
            mesh = other
    return mesh
