"""Benchmarks that are no part of the program: figures of docs/, regenerated."""
