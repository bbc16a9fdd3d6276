"""Elements of meshes: the record, shape functions of hexahedra and tetrahedra, bounds of det J and quality."""
