"""Fatigue damage at the surfaces of links by periodic stresses."""
