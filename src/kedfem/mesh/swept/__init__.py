"""Swept solids: bars along a path, solids of revolution, single blocks, and solids without their small blends."""
