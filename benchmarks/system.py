"""Steps a second of a system beside the solvers that it replaces, in one run: `python -m benchmarks.system`."""

from time import perf_counter
from typing import Any

import numpy as np
from tests.moving import bar, rising
from tests.rooms.test_system_steps import condensed

from kedfem.accuracy.prepared import meshed
from kedfem.dynamics.actions import actions
from kedfem.dynamics.scheme import generalised_alpha
from kedfem.dynamics.segment import CONVERGED
from kedfem.dynamics.system.build import system_of
from kedfem.dynamics.system.march import march, ready
from kedfem.dynamics.system.start import rest
from kedfem.dynamics.transient import steps_of, transient
from kedfem.motion.rigid import rigid_motion
from kedfem.scene import following, path_parameter, scene_from, time_grid

STEPS, TURNS = 2000, 3


def four_bar(elements: int = 1, **more: Any) -> dict[str, Any]:
    """The four-bar of the source's example, steel bars, one quadratic beam a link; a drive that speeds up."""
    A, B, C, D = (0.0, 0.0), (0.3048, 0.0), (0.9, 0.69), (0.9144, 0.0)
    ends = {"crank": (A, B), "coupler": (B, C), "rocker": (C, D)}
    joints = {
        "A": ("ground", "crank"),
        "B": ("crank", "coupler"),
        "C": ("coupler", "rocker"),
        "D": ("rocker", "ground"),
    }
    at = {"A": A, "B": B, "C": C, "D": D}
    return {
        "links": {name: bar("beam", *each, elements) for name, each in ends.items()},
        "joints": {k: {"kind": "revolute", "links": list(x), "at": list(at[k])} for k, x in joints.items()},
        "drive": {"joint": "A", "motion": rising(1.0)},
        "analysis": {"end_time": STEPS * 5e-5, "step": 5e-5, "rho_inf": 0.9, "initial": "rest"},
        **more,
    }


def with_spring() -> dict[str, Any]:
    """The same, and a spring from the middle pin to the ground."""
    ends = [{"link": "coupler", "at": [0.9, 0.69]}, {"link": "ground", "at": [0.9, 1.5]}]
    return four_bar(springs={"s": {"kind": "spring", "between": ends, "stiffness": 1e4, "free_length": 0.8}})


def speeds(raw: dict[str, Any], few: int) -> tuple[float, float, float]:
    """Steps a second of the solver that is replaced, over a few steps, and of the system to the same tolerance."""
    scene = scene_from(raw)
    made = meshed(scene)
    grid = time_grid(scene)
    short = scene_from({**raw, "analysis": {**raw["analysis"], "end_time": few * grid.step}})
    old = []
    for _ in range(TURNS):
        every = actions(short, made.model)
        solver = (
            condensed(short, made.model) if every and not following(short) else steps_of(short, made.model)
        )
        began = perf_counter()
        for _ in transient(short, made.linkage, made.path, made.model, solver):
            pass
        old.append(perf_counter() - began)
    scheme = generalised_alpha(grid.step, scene.analysis.rho_inf)
    of = ready(system_of(scene, made.linkage, made.path), scheme, CONVERGED)

    def motion(t: np.ndarray) -> Any:
        return rigid_motion(made.linkage, made.path, t, path_parameter(scene, t))

    state, t = rest(of, motion), grid.step * np.arange(1, STEPS + 1)
    new = []
    for _ in range(TURNS + 1):
        began = perf_counter()
        after, _ = march(of, state, motion(t))
        new.append(perf_counter() - began)
    return few / min(old), STEPS / min(new[1:]), float(after.passes[0]) / STEPS


def main() -> None:
    """Print the table of docs/system.md."""
    cases = {
        "four-bar of beams, nominal": (four_bar(), STEPS),
        "the same with one spring": (with_spring(), 100),
        "four-bar of beams, co-rotational": (
            four_bar(2, analysis={**four_bar()["analysis"], "frames": "following"}),
            STEPS,
        ),
    }
    print(
        "| scene | solver that it replaces, steps/s | system, steps/s | its passes a step |\n|---|---:|---:|---:|"
    )
    for name, (raw, few) in cases.items():
        print("| {} | {:.0f} | {:.0f} | {:.1f} |".format(name, *speeds(raw, few)), flush=True)


if __name__ == "__main__":
    main()
