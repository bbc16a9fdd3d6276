"""Forecast of the time of a run: from a few steps of its solver, for large models from their sizes alone."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.matrices.dense import SMALL
from kedfem.dynamics.model import Model, factor_bytes
from kedfem.dynamics.stepping.levels import level_steps
from kedfem.dynamics.stepping.solvers import block_length
from kedfem.dynamics.system.steps import Steps
from kedfem.mesh.memory_forecast import ASSEMBLY_BYTES, LINK_BYTES, PLANE_FILL
from kedfem.scene import Scene, time_grid

# of a link of N unknowns, from `benchmarks.growth` and slender bars (27-node hexahedra, CHOLMOD)
FACTOR_FLOPS, SOLVE_BYTES = 1.0e4, 45.0  # times N^1.5
ITERATIONS = 4.0  # times the work of a step with rigid-body frames, with co-rotational ones
OVERHEAD = 2.5e-4  # seconds of a step beside the links' arrays: coupling, probes
LOOP = 5e-5  # the same where all links are small: one compiled loop, recording by blocks
ARRAY_PASSES = 60  # arrays of a link read or written in a step beside the solve
RUN_BYTES = 1e7  # beside libraries, of the smallest runs
TRIED = 60_000  # unknowns of a model, of solids, that is factored (in seconds) only to try its steps
# steps that are tried: a few, then so many times as many until they take ENOUGH [s] more, and twice as long in all: work
# that is done once, as for modes of an envelope, takes about as long as the start and would count as a cost of each step
FIRST, MORE, MOST = (4, 4, 16_384)
ENOUGH = 0.5


@dataclass(frozen=True, slots=True)
class Cost:
    """Estimated seconds to factor and to step, bytes of memory and of one animation frame; how many steps were tried."""

    factor: float
    steps: float
    memory: float
    frame_bytes: float
    tried: int = 0


def estimated_cost(scene: Scene, model: Model) -> Cost:
    """Cost of the condensed solver from the links' unknowns and this machine's memory and arithmetic speed."""
    N, fill, levels = _unknowns(model), _fill(model), scene.analysis.extrapolation_levels or 1
    bandwidth, rate = _machine()
    small = bool((N <= SMALL).all())
    step = (LOOP if small else OVERHEAD) + float((SOLVE_BYTES * fill + 8 * ARRAY_PASSES * N).sum()) / bandwidth
    if any(link.fit is not None for link in model.links):
        step *= ITERATIONS
    return Cost(
        factor=levels * FACTOR_FLOPS * float(fill.sum()) / rate,
        steps=(2**levels - 1) * time_grid(scene).steps * step,
        memory=levels * factor_bytes(model) + _held(model) + _blocks(scene, model),
        frame_bytes=120.0 * sum((link.full or link).n for link in model.links),
    )


def _held(model: Model) -> float:
    """Bytes of a run's libraries and of the links: of reduced ones those that they were made from."""
    whole = float(sum((link.full or link).unknowns for link in model.links))
    largest = float(max((link.unknowns for link in model.links if link.full is None), default=0))
    return RUN_BYTES + LINK_BYTES * whole + ASSEMBLY_BYTES * largest


def _blocks(scene: Scene, model: Model) -> float:
    """Bytes of the time points that are kept together, and of what is made of them."""
    states = 9 * 8 * model.unknowns * min(block_length(model), time_grid(scene).steps)
    return (4.0 if any(link.fit is not None for link in model.links) else 2.0) * states


def factor_words(model: Model) -> str:
    """The progress message before factorisation, for large models with the memory that it takes."""
    unknowns = float(_unknowns(model).sum())
    if unknowns <= TRIED:
        return "factor"
    return f"factor: {unknowns:,.0f} unknowns, about {factor_bytes(model) / 1e9:.2g} GB"


def _unknowns(model: Model) -> Float[np.ndarray, " L"]:
    return np.array([float(link.unknowns) for link in model.links])


def _fill(model: Model) -> Float[np.ndarray, " L"]:
    thin = [PLANE_FILL if link.kind == "plane" else 1.0 for link in model.links]
    return np.asarray(_unknowns(model) ** 1.5 * thin)


def tried_cost(scene: Scene, model: Model, run: Callable[[Scene, list[Steps]], None]) -> Cost:
    """Cost from some real steps of the solver that the run will have; of large models from their sizes.

    Parameters
    ----------
    run : takes all steps of a scene, with all that is made of them

    Raises
    ------
    SolveError
        If the first steps cannot be taken.
    """
    cost = estimated_cost(scene, model)
    N = _unknowns(model)
    weight = float((N * [PLANE_FILL if link.kind == "plane" else 1.0 for link in model.links]).sum())
    if weight > TRIED:
        return cost
    start = perf_counter()
    solvers = level_steps(scene, model)
    factor, total = perf_counter() - start, time_grid(scene).steps

    def seconds(steps: int) -> float:
        first = perf_counter()
        run(_begun(scene, steps), solvers)
        return perf_counter() - first

    few = tried = min(FIRST, total)
    seconds(few)  # compiled code is loaded
    once = took = seconds(few)
    while tried < min(MOST, total) and took - once < max(ENOUGH, once):
        tried = min(MORE * tried, MOST, total)
        took = seconds(tried)
    step = max(took - once, 0.0) / (tried - few) if tried > few else once / few
    return replace(cost, factor=factor, steps=once + step * (total - few), tried=tried)


def _begun(scene: Scene, steps: int) -> Scene:
    """The first steps of a scene's analysis."""
    h = time_grid(scene).step
    changed = {"end_time": steps * h, "revolutions": None, "step": h, "steps_per_revolution": None}
    return scene.model_copy(update={"analysis": scene.analysis.model_copy(update=changed)})


def _machine() -> tuple[float, float]:
    """Bytes read per second and floating point operations per second, measured on the spot."""
    a = np.ones(4_000_000)
    t0 = perf_counter()
    a.sum()
    t1 = perf_counter()
    b = np.ones((600, 600))
    b @ b
    return 8 * len(a) / (t1 - t0), 2 * 600**3 / (perf_counter() - t1)
