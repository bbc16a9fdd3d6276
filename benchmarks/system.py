"""Steps a second of a system beside the solvers that it replaces, in one run: `python -m benchmarks.system`."""

from time import perf_counter, process_time
from typing import Any

import numpy as np
from tests.moving import bar, rising
from tests.rooms.test_acted import four_bar as hinged

from kedfem.accuracy.prepared import meshed
from kedfem.accuracy.reduction import prepared
from kedfem.dynamics.matrices.substructure import factored
from kedfem.dynamics.rigid_body import forcings, motions
from kedfem.dynamics.segment import CONVERGED
from kedfem.dynamics.stepping.first_state import started
from kedfem.dynamics.stepping.scheme import generalised_alpha
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.dynamics.system.build import system_of
from kedfem.dynamics.system.march import march, ready
from kedfem.dynamics.system.sparse import SparsePart
from kedfem.dynamics.system.starts.start import rest
from kedfem.dynamics.system.steps import Steps, scene_system
from kedfem.motion.rigid import rigid_motion
from kedfem.scene import path_parameter, scene_from, time_grid

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
    """Steps a second of a run's solver, over a few steps, and of the system alone to the same tolerance."""
    scene = scene_from(raw)
    made = meshed(scene)
    grid = time_grid(scene)
    short = scene_from({**raw, "analysis": {**raw["analysis"], "end_time": few * grid.step}})
    old = []
    for _ in range(TURNS):
        solver = steps_of(short, made.model)
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


PAIRS = (
    (200, 30),
    (60, 6),
    (40, 4),
    (20, 3),
)  # steps, and how often they are taken, solves after them each time
SOLIDS = {  # elements of crank, coupler and rocker
    "a solid link of 951 unknowns beside two reduced ones": ([4, 1, 1], [16, 2, 1], [4, 1, 1]),
    "solids of 5,265 unknowns each": ([24, 4, 3],) * 3,
    "solids of 9,792 unknowns each": ([24, 5, 5],) * 3,
    "solids of 28,839 unknowns each": ([40, 8, 6],) * 3,
}


def solid(elements: tuple[list[int], ...]) -> dict[str, Any]:
    """A four-bar of solid links; those of four elements reduced."""
    raw = hinged("rigid-body", "solid", steps=360, analysis={"initial": "rest", "revolutions": 1})
    for link, count in zip(raw["links"].values(), elements, strict=True):
        link["mesh"] = {"elements": count}
        link["reduction"] = "modal" if count[0] == 4 else "none"
    return raw


def beside_solves(raw: dict[str, Any], count: int, turns: int) -> tuple[float, float]:
    """Processor time of a step, loads and histories too, and of the sparse links' triangular solves [µs]."""
    made, _ = prepared(scene_from(raw))
    scene, model = made.scene, made.model
    scheme = generalised_alpha(time_grid(scene).step, scene.analysis.rho_inf)
    solver = Steps(scene, scene_system(scene, model), model, scheme)
    state = started(scene, made.linkage, made.path, model, solver)
    _, motion = next(motions(scene, made.linkage, made.path))
    motion, of = motion.part(0, count), solver.ready
    large = [k for k, part in enumerate(of.parts) if isinstance(part, SparsePart)]
    bare = [
        (
            factored(model.links[k], of.system.model.joints[k], of.c.c_M, of.c.c_K),
            np.ones(model.links[k].X.shape),
        )
        for k in large
    ]
    steps, solves = [], []
    for _ in range(turns + 1):
        began = process_time()
        solver.advance(state, forcings(model, motion), motion)
        steps.append(process_time() - began)
        began = process_time()
        for _ in range(count):
            for part, r in bare:
                part.solve(r)
        solves.append(process_time() - began)
    return 1e6 * min(steps[1:]) / count, 1e6 * min(solves[1:]) / count


def main() -> None:
    """Print the tables of docs/system.md."""
    cases = {
        "four-bar of beams, rigid-body": (four_bar(), STEPS),
        "the same with one spring, which runs on the system": (with_spring(), STEPS),
        "four-bar of beams, co-rotational": (
            four_bar(2, analysis={**four_bar()["analysis"], "frames": "co-rotational"}),
            STEPS,
        ),
    }
    print("| scene | solver of a run, steps/s | system, steps/s | its passes a step |\n|---|---:|---:|---:|")
    for name, (raw, few) in cases.items():
        print("| {} | {:.0f} | {:.0f} | {:.1f} |".format(name, *speeds(raw, few)), flush=True)
    print("\n| scene | step, µs | triangular solves, µs | ratio |\n|---|---:|---:|---:|")
    for (name, elements), count in zip(SOLIDS.items(), PAIRS, strict=True):
        step, solves = beside_solves(solid(elements), *count)
        print(f"| {name} | {step:.0f} | {solves:.0f} | {step / solves:.2f} |", flush=True)


if __name__ == "__main__":
    main()
