"""Meshes of links: hexahedra with 8, 20 or 27 nodes, quadrilaterals with 9; the only room that speaks to gmsh."""

from kedfem.mesh.flat import QuadMesh
from kedfem.mesh.hexahedra import Face, HexMesh
from kedfem.mesh.link import link_mesh, part_mesh, plane_mesh
from kedfem.mesh.quality import Quality, checked_mesh, mesh_quality

__all__ = [
    "Face",
    "HexMesh",
    "QuadMesh",
    "Quality",
    "checked_mesh",
    "link_mesh",
    "mesh_quality",
    "part_mesh",
    "plane_mesh",
]
