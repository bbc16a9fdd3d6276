"""Steady motions: the map of a period, its fixed point, and the multipliers of small vibrations."""
