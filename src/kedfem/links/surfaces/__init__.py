"""Surfaces of links: what they offer to joints, how joints find and hold them, messages where nothing is found."""
