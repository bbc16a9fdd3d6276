"""Plane meshes: outlines and areas of quadrilaterals, plate links in blocks."""
