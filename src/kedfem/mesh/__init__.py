"""Meshes of links: hexahedra with 8 or 27 nodes, quadrilaterals with 9; the only room that speaks to gmsh."""

from kedfem.mesh.flat import QuadMesh
from kedfem.mesh.hexahedra import HexMesh
from kedfem.mesh.link import link_mesh, plane_mesh
from kedfem.mesh.quality import Quality, checked_mesh, mesh_quality

__all__ = ["HexMesh", "QuadMesh", "Quality", "checked_mesh", "link_mesh", "mesh_quality", "plane_mesh"]
