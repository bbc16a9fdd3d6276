"""Damage at the surfaces of links by stresses that repeat themselves."""
