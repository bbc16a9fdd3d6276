"""One run of the source's four-bar from rest: its curve of stress, and the processor time of its steps."""

from collections.abc import Mapping
from dataclasses import dataclass
from time import process_time
from typing import Any

import numpy as np
from jaxtyping import Float

from kedfem.accuracy.prepared import Prepared, meshed
from kedfem.accuracy.reduction import prepared
from kedfem.bench.scenes import four_bar_of
from kedfem.dynamics.following import FollowingSteps
from kedfem.dynamics.following_dense import FollowingDense
from kedfem.dynamics.transient import Steps, first_states, forcings, motions, steps_of, transient
from kedfem.results.recording import recording
from kedfem.scene import Scene, scene_from

END, SAMPLES = 0.3, 600  # s; times at which curves are compared
STRESS = "probes/stress/stress"
BLOCKS, POINTS = 6, 20  # of steps whose cost is compared

Curve = Float[np.ndarray, " T"]


@dataclass(frozen=True, slots=True)
class Ran:
    """One run.

    curve : stress on the outer side of the rocker's middle at SAMPLES + 1 times [Pa]
    seconds : processor time of all steps, least of some repeats; rigid motion and loads apart
    sweeps : of a step
    factorised : matrices, over all step sizes
    """

    curve: Curve
    seconds: float
    unknowns: int
    sweeps: float
    factorised: int


def four_bar(link: Mapping[str, Any], steps: int, damped: str = "damped", **analysis: Any) -> Scene:
    """[KED]'s four-bar (Nath and Ghosh 1980) from rest at 600 rpm, 0.3 s: stress on the rocker's outer side.

    Parameters
    ----------
    link : keys of all its links
    damped : "damped": 2 % at 20 and 200 Hz; "undamped"
    """
    raw = four_bar_of({"kind": "bar", "width": 0.0254, "thickness": 0.0254}, dict(link))
    raw["points"]["B"]["angle"] = 0
    if damped == "damped":
        raw["damping"] = {"ratio": 0.02, "frequencies": [20, 200]}
    raw["analysis"] = {"end_time": END, "step": END / steps, "initial": "rest", **analysis}
    raw["output"] = {"probes": {"stress": {"link": "rocker", "at": "M", "quantity": "stress"}}}
    return scene_from(raw)


def run(scene: Scene, repeats: int) -> Ran:
    """A whole run for its curve, and its steps again for their time."""
    ready = prepared(scene)[0] if any(link.reduced for link in scene.links.values()) else meshed(scene)
    solver = steps_of(ready.scene, ready.model)
    (rows,) = (each.rows for each in recording(ready.scene, ready.model) if each.channel.name == STRESS)
    blocks = transient(ready.scene, ready.linkage, ready.path, ready.model, solver)
    stress = np.concatenate([rows(block)[:, 0] for block in blocks])
    steps = len(stress) - 1
    sweeps, factorised = getattr(solver, "sweeps", 0) / steps, solver.factorisations
    times = [stepping(ready, solver, steps) for _ in range(repeats)]
    return Ran(
        stress[:: steps // SAMPLES],
        min(times, default=float("nan")),
        ready.model.unknowns,
        sweeps,
        factorised,
    )


def stepping(ready: Prepared, solver: Any, steps: int) -> float:
    """Processor time of the solver's first steps alone [s]."""
    scene, model, total = ready.scene, ready.model, 0.0
    state: Any = solver.begin(first_states(scene, ready.linkage, ready.path, model))
    for first, motion in motions(scene, ready.linkage, ready.path):
        part = motion.part(0, max(0, steps + 1 - first))
        if not len(part.t):
            break
        total += _timed(solver, state, forcings(model, part), part)[0]
    return total


def cost(scene: Scene) -> tuple[float, Steps]:
    """Processor time of a step [s], the least of some blocks; the solver."""
    ready = meshed(scene)
    solver: Any = steps_of(scene, ready.model)
    times = []
    states = first_states(scene, ready.linkage, ready.path, ready.model)
    state: Any = solver.begin(states)
    _, motion = next(motions(scene, ready.linkage, ready.path))
    for k in range(0, BLOCKS * POINTS, POINTS):
        part = motion.part(k, k + POINTS)
        seconds, state = _timed(solver, state, forcings(ready.model, part), part)
        times.append(seconds / POINTS)
    return min(times), solver


def _timed(solver: Steps, state: Any, forcing: Any, motion: Any) -> tuple[float, Any]:
    known = (forcing, motion) if isinstance(solver, FollowingDense | FollowingSteps) else (forcing,)
    since = process_time()
    _, state = solver.advance(state, *known)
    return process_time() - since, state
