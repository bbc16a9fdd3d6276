"""Benchmarks: every figure in docs/performance.md comes from here, by `kedfem bench WHAT`."""

from collections.abc import Callable
from pathlib import Path

from kedfem.bench.accuracy import bench_accuracy
from kedfem.bench.beams import bench_beams
from kedfem.bench.corotational import bench_corotational
from kedfem.bench.elements import bench_elements
from kedfem.bench.growth import bench_growth
from kedfem.bench.kinematics import bench_kinematics
from kedfem.bench.levels import bench_levels
from kedfem.bench.machine import Watch
from kedfem.bench.plane import bench_plane
from kedfem.bench.ports import bench_ports
from kedfem.bench.reduction import bench_reduction
from kedfem.bench.solvers import bench_solvers
from kedfem.bench.start import bench_start
from kedfem.bench.steps import bench_steps
from kedfem.bench.suite import bench_suite

BENCHMARKS: dict[str, Callable[[Path, bool, Watch], str]] = {
    "steps": bench_steps,
    "growth": bench_growth,
    "solvers": bench_solvers,
    "plane": bench_plane,
    "ports": bench_ports,
    "start": bench_start,
    "elements": bench_elements,
    "corotational": bench_corotational,
    "beams": bench_beams,
    "levels": bench_levels,
    "suite": bench_suite,
    "kinematics": bench_kinematics,
    "reduction": bench_reduction,
    "accuracy": bench_accuracy,
}
