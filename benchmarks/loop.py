"""The compiled loop of small links: microseconds a step, and the least that they could be."""

from copy import deepcopy
from time import perf_counter
from typing import Any

import numpy as np

from benchmarks.corotational_run import advanced, first_state
from benchmarks.pages import seconds
from benchmarks.scenes import mechanisms
from kedfem.accuracy.prepared import Prepared, meshed
from kedfem.accuracy.reduction import reduced
from kedfem.dynamics.history import Block
from kedfem.dynamics.rigid_body import forcings, motions
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.results.recording import recording, rows
from kedfem.scene import Scene, scene_from, time_grid


def four_bar_with(functions: int) -> tuple[Prepared, Prepared]:
    """The solid four-bar in full, and with so many functions per link; three probes."""
    raw = mechanisms()["solid four-bar"]
    probes = {
        "stress": {"link": "rocker", "at": "M", "quantity": "stress"},
        "middle": {"link": "coupler", "at": "N", "quantity": "displacement"},
        "velocity": {"link": "coupler", "at": "N", "quantity": "velocity"},
    }
    scene = scene_from({**raw, "output": {"probes": probes}})
    full = meshed(scene)
    return full, with_modes(full, functions)


def with_modes(full: Prepared, functions: int) -> Prepared:
    """All links with so many of kedfem's functions."""
    counts = {link.name: functions for link in full.model.links}
    return reduced(full, list(counts), full.scene.analysis.reduction_tolerance, counts).ready


def loop_time(ready: Prepared, repeats: int = 9) -> float:
    """Seconds of a step in the loop alone: one block of 256 time points, forcing known."""
    scene, model = ready.scene, ready.model
    solver: Any = steps_of(scene, model)
    _, motion = next(motions(scene, ready.linkage, ready.path))
    forcing = forcings(model, motion)
    start = first_state(ready, solver)

    def whole() -> None:
        advanced(ready, solver, deepcopy(start), forcing, motion)

    whole()  # compiled
    return seconds(whole, repeats) / len(motion.t)


def recorded_rate(ready: Prepared) -> float:
    """Steps a second with all probes and joint forces at every step; the rigid motion is known."""
    scene, model = ready.scene, ready.model
    known = list(motions(scene, ready.linkage, ready.path))
    recorded = recording(scene, model)
    solver: Any = steps_of(scene, model)

    def all_steps() -> None:
        state = first_state(ready, solver)
        for first, motion in known:
            links, *_, state = advanced(ready, solver, state, forcings(model, motion), motion)
            rows(recorded, Block(first, motion, links))

    all_steps()
    return time_grid(scene).steps / seconds(all_steps, 3)


def least_time(ready: Prepared, bandwidth: float, rate: float) -> tuple[float, float]:
    """Seconds that a step's products need at a machine's speed: by memory (all from RAM), by arithmetic."""
    solver: Any = steps_of(ready.scene, ready.model)
    numbers = sum(x.G.size + 2 * x.Y.size + x.S.size + x.W.size for x in solver.ready.parts)  # Y is used twice
    read = sum(x.G.size + x.Y.size + x.S.size + x.W.size for x in solver.ready.parts)
    return 8 * read / bandwidth, 2 * numbers / rate


def machine_speed() -> tuple[float, float]:
    """Bytes read and floating point operations per second, one thread's BLAS."""
    a, b = np.ones(16_000_000), np.ones((800, 800))
    a @ a
    b @ b
    return 8 * len(a) / seconds(a.sum, 5), 2 * 800**3 / seconds(lambda: b @ b, 5)


def preparation() -> tuple[int, float, float]:
    """An arm of 27-node hexahedra as `benchmarks.growth` has them: unknowns, seconds to factor it, to reduce it."""
    from kedfem.dynamics.modes.reduction import static_parts

    full = meshed(_thick_arm())
    factor = seconds(lambda: static_parts(full.model), 3)
    since = perf_counter()
    reduced(full, ["arm"], 1e-3)
    return full.model.unknowns, factor, perf_counter() - since


def _thick_arm() -> Scene:
    shape = {"kind": "bar", "between": ["A", "B"], "width": 0.22, "thickness": 0.02}
    return scene_from({
        "points": {"A": [0, 0], "B": [1, 0]},
        "links": {"arm": {"material": "steel", "shape": shape, "element": "hex27", "mesh": {"elements": [64, 14, 2]}}},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": "A"}},
        "drive": {"joint": "A", "motion": {"kind": "cycloidal", "angle": "60 deg", "rise": 0.5}},
        "analysis": {"end_time": 0.6, "step": 1e-3},
        "output": {"probes": {"tip": {"link": "arm", "at": "B", "quantity": "displacement"}}},
    })  # fmt: skip
