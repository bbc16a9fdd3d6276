"""Any solid: tetrahedra cut into four hexahedra each, relaxed on the surface from CAD."""
