"""Solids that are swept: bars along a path, solids of revolution, single blocks, and what their blends leave out."""
