"""Matrices of a step: sparse factors, small dense links, links condensed onto their ports, the common system."""
