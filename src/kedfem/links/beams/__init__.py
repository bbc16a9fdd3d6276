"""Beams: planar and in space, their axes and sections, stresses and stress stiffness."""
