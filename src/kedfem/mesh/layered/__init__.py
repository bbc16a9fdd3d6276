"""Solids made of layers: the plan of all their sections, its mesh, and the sweep."""
