"""Meshes of links: hexahedra (8, 20, 27 nodes), tetrahedra (10), quadrilaterals (9); no other room speaks to gmsh."""

from kedfem.mesh.cad.file import ENDINGS as CAD_ENDINGS
from kedfem.mesh.flat import QuadMesh
from kedfem.mesh.hexahedra import Face, SolidMesh
from kedfem.mesh.link import link_mesh, part_mesh, plane_mesh
from kedfem.mesh.quality import Quality, checked_mesh, mesh_quality
from kedfem.mesh.raw import ENDINGS as MESH_ENDINGS

__all__ = [
    "CAD_ENDINGS",
    "MESH_ENDINGS",
    "Face",
    "QuadMesh",
    "Quality",
    "SolidMesh",
    "checked_mesh",
    "link_mesh",
    "mesh_quality",
    "part_mesh",
    "plane_mesh",
]
