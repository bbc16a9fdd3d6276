"""Joints in the dynamics: shared interface points, constraint equations that vary in time, rigid couplings."""
