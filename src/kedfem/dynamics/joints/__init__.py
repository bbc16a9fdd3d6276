"""Joints in the dynamics: shared port points, constraint equations whose directions vary in time, rigid couplings."""
