"""Mesh files: each form read as it is, then as a mesh of one kind of elements with its named faces."""
