"""Modes: bases of reduced links and segments, their truncation errors, natural frequencies of links and linkages."""
