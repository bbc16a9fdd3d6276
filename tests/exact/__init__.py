"""Geometrically exact planar beams: an oracle for links that bend far, sharing no code with kedfem."""
