"""One run of the source's four-bar from rest: its curve of stress, and the processor time of its steps."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from time import process_time
from typing import Any

import numpy as np
from jaxtyping import Float

from benchmarks.scenes import four_bar_of
from kedfem.accuracy.prepared import Prepared, meshed
from kedfem.accuracy.reduction import prepared
from kedfem.dynamics.history import Forcing
from kedfem.dynamics.rigid_body import forcings, motions
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.start import started
from kedfem.dynamics.stepping.transient import transient
from kedfem.dynamics.system.ready import Motion
from kedfem.dynamics.system.steps import Steps
from kedfem.motion.rigid import RigidMotion, rigid_motion
from kedfem.results.recording import recording
from kedfem.scene import Scene, path_parameter, scene_from

END, SAMPLES = 0.3, 600  # s; times at which curves are compared
STRESS = "probes/stress/stress"
BLOCKS, POINTS = 6, 20  # of steps whose cost is compared

Curve = Float[np.ndarray, " T"]


@dataclass(frozen=True, slots=True)
class Ran:
    """One run.

    curve : stress on the outer side of the rocker's middle at SAMPLES + 1 times [Pa]
    seconds : processor time of all steps, least of some repeats; rigid motion and loads apart
    iterations : of a step
    factorised : matrices, over all step sizes
    """

    curve: Curve
    seconds: float
    unknowns: int
    iterations: float
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
    iterations, factorised = getattr(solver, "iterations", 0) / steps, solver.factorisations
    times = [stepping(ready, solver, steps) for _ in range(repeats)]
    return Ran(
        stress[:: steps // SAMPLES], min(times, default=float("nan")), ready.model.unknowns, iterations, factorised
    )


def stepping(ready: Prepared, solver: Any, steps: int) -> float:
    """Processor time of the solver's first steps alone [s]."""
    scene, total = ready.scene, 0.0
    state = first_state(ready, solver)
    for first, motion in motions(scene, ready.linkage, ready.path):
        part = motion.part(0, max(0, steps + 1 - first))
        if not len(part.t):
            break
        total += _timed(ready, solver, state, part)[0]
    return total


def cost(scene: Scene) -> tuple[float, Steps]:
    """Processor time of a step [s], the least of some blocks; the solver."""
    ready = meshed(scene)
    solver: Any = steps_of(scene, ready.model)
    times = []
    state = first_state(ready, solver)
    _, motion = next(motions(scene, ready.linkage, ready.path))
    for k in range(0, BLOCKS * POINTS, POINTS):
        part = motion.part(k, k + POINTS)
        seconds, state = _timed(ready, solver, state, part)
        times.append(seconds / POINTS)
    return min(times), solver


def _motion_at(ready: Prepared) -> Motion:
    """Rigid-body motion at given times."""
    return lambda t: rigid_motion(ready.linkage, ready.path, t, path_parameter(ready.scene, t))


def first_state(ready: Prepared, solver: Any) -> Any:
    """A solver's own state at the start."""
    return started(ready.scene, ready.linkage, ready.path, ready.model, solver)


def advanced(ready: Prepared, solver: Any, state: Any, forcing: Sequence[Forcing], motion: RigidMotion) -> Any:
    """What a solver hands on of some steps: links first, its state last."""
    return solver.advance(state, forcing, motion, _motion_at(ready))


def _timed(ready: Prepared, solver: Any, state: Any, motion: RigidMotion) -> tuple[float, Any]:
    forcing = forcings(ready.model, motion)
    since = process_time()
    state = advanced(ready, solver, state, forcing, motion)[-1]
    return process_time() - since, state
