"""Plane meshes of quadrilaterals: areas within a boundary, plate links in blocks."""
