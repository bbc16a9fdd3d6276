"""Surfaces of links: what they offer to joints, how joints find and hold them, what is told where nothing is found."""
