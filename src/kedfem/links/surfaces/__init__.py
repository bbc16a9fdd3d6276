"""Surfaces of links: candidates for joints, selection of facets, coupling surfaces, messages where none is found."""
