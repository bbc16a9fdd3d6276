"""What a run will cost, estimated from the sizes alone; docs/performance.md has the measurements behind it."""

from dataclasses import dataclass
from time import perf_counter

import numpy as np

from kedfem.dynamics.model import Model
from kedfem.scene import Scene, time_grid

FILL, FILL_POWER = 12.0, 1.28  # entries of a link's factor: FILL · unknowns^FILL_POWER
FLOPS_PER_ENTRY2 = 2.5e-3  # factorisation flops ≈ this · entries² / unknowns · 1e3
OVERHEAD = 2.0e-4  # seconds of a step beside the solves: coupling, probes


@dataclass(frozen=True, slots=True)
class Cost:
    """Estimated seconds to factor and to step, bytes of memory, bytes of one animation frame."""

    factor: float
    steps: float
    memory: float
    frame_bytes: float


def estimated_cost(scene: Scene, model: Model) -> Cost:
    """Cost of the condensed solver from the links' unknowns and this machine's memory and arithmetic speed."""
    N = np.array([3.0 * link.n for link in model.links])
    entries = FILL * N**FILL_POWER
    bandwidth, rate = _machine()
    return Cost(
        factor=float((entries**2 / N).sum() / rate),
        steps=time_grid(scene).steps * float(OVERHEAD + (2.3 * 8 * entries / bandwidth).sum()),
        memory=float(8 * entries.sum() + 2500 * N.sum()),
        frame_bytes=float(40 * N.sum()),
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
