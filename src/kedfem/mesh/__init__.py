"""Meshes of links: hexahedra (8, 20, 27 nodes), tetrahedra (10), quadrilaterals (9); no other room speaks to gmsh."""

from kedfem.mesh.cad.file import ENDINGS as CAD_ENDINGS
from kedfem.mesh.elements.hexahedra import Face, SolidMesh
from kedfem.mesh.elements.quality import Quality, checked_mesh, mesh_quality
from kedfem.mesh.isolated import side_by_side
from kedfem.mesh.link import link_mesh, part_mesh, plane_mesh
from kedfem.mesh.planar.flat import QuadMesh
