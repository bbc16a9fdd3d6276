"""Modes: bases of reduced links and segments, what they leave out, natural frequencies of links and linkages."""
