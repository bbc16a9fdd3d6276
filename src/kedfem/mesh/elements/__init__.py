"""Elements of meshes: records, shape functions of hexahedra and tetrahedra, bounds of det J, quality."""
