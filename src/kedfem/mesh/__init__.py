"""Meshes of links: hexahedra with 8, 20 or 27 nodes; the only room that speaks to gmsh."""

from kedfem.mesh.hexahedra import HexMesh
from kedfem.mesh.link import link_mesh
from kedfem.mesh.quality import Quality, checked_mesh, mesh_quality

__all__ = ["HexMesh", "Quality", "checked_mesh", "link_mesh", "mesh_quality"]
