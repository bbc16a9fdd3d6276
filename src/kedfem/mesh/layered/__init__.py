"""Solids made of layers: one plan of all sections, meshed and swept."""
