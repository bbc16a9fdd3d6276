"""Mesh files: their contents in each format, then a mesh of one kind of elements with named faces."""
