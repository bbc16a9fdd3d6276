"""Meshes of links: hexahedra (8, 20, 27 nodes), tetrahedra (10), quadrilaterals (9); the only package that uses gmsh."""

from typing import TYPE_CHECKING, Any

from kedfem.mesh.cad.file import ENDINGS as CAD_ENDINGS
from kedfem.mesh.elements.hexahedra import Face, SolidMesh
from kedfem.mesh.elements.quality import Quality, checked_mesh, mesh_quality
from kedfem.mesh.isolated import side_by_side
from kedfem.mesh.planar.flat import QuadMesh

if TYPE_CHECKING:
    from kedfem.mesh.link import link_mesh, part_mesh, plane_mesh


def __getattr__(name: str) -> Any:
    """Load the meshing code only when a mesh is made: beams need none, and meshes are kept between runs."""
    if name not in {"link_mesh", "part_mesh", "plane_mesh"}:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from kedfem.mesh import link

    return getattr(link, name)
