"""What a run will cost, estimated from the sizes alone: right within a factor of two or three."""

from dataclasses import dataclass
from time import perf_counter

import numpy as np

from kedfem.dynamics.dense import SMALL
from kedfem.dynamics.model import Model
from kedfem.scene import Scene, time_grid

# of a link of N unknowns, from `kedfem bench growth` and slender bars (27-node hexahedra, CHOLMOD)
FACTOR_FLOPS, SOLVE_BYTES, FACTOR_BYTES = 1.0e4, 45.0, 22.0  # times N^1.5
LINK_BYTES, ASSEMBLY_BYTES = (
    5e3,
    1.5e4,
)  # times N: kept for each link; for one link at a time while it is assembled
PLANE_FILL = 0.1  # of that a plane mesh has, from 18,000 to 240,000 unknowns
SWEEPS = 4.0  # times the work of a step with nominal frames, where frames follow
OVERHEAD = 2.5e-4  # seconds of a step beside the links' arrays: coupling, probes
LOOP = 5e-5  # the same where all links are small: one compiled loop, recording by blocks
ARRAY_PASSES = 60  # arrays of a link read or written in a step beside the solve


@dataclass(frozen=True, slots=True)
class Cost:
    """Estimated seconds to factor and to step, bytes of memory, bytes of one animation frame."""

    factor: float
    steps: float
    memory: float
    frame_bytes: float


def estimated_cost(scene: Scene, model: Model) -> Cost:
    """Cost of the condensed solver from the links' unknowns and this machine's memory and arithmetic speed."""
    N = np.array([float(link.unknowns) for link in model.links])
    fill = N**1.5 * [PLANE_FILL if link.kind == "plane" else 1.0 for link in model.links]
    bandwidth, rate = _machine()
    small = bool((N <= SMALL).all())
    step = (LOOP if small else OVERHEAD) + float(
        (SOLVE_BYTES * fill + 8 * ARRAY_PASSES * N).sum()
    ) / bandwidth
    if any(link.fit is not None for link in model.links):
        step *= SWEEPS
    return Cost(
        factor=FACTOR_FLOPS * float(fill.sum()) / rate,
        steps=time_grid(scene).steps * step,
        memory=float((FACTOR_BYTES * fill + LINK_BYTES * N).sum()) + ASSEMBLY_BYTES * float(N.max()),
        frame_bytes=120.0 * sum((link.full or link).n for link in model.links),
    )


def _machine() -> tuple[float, float]:
    """Bytes read per second and floating point operations per second, measured on the spot."""
    a = np.ones(4_000_000)
    t0 = perf_counter()
    a.sum()
    t1 = perf_counter()
    b = np.ones((600, 600))
    b @ b
    return 8 * len(a) / (t1 - t0), 2 * 600**3 / (perf_counter() - t1)
