"""Benchmarks: every figure in docs/performance.md comes from here, by `python -m benchmarks.WHAT`."""
