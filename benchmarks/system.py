"""Steps a second of a system beside the solvers that it replaces, in one run: `python -m benchmarks.system`."""

from collections.abc import Callable
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numpy as np
from tests.moving import bar, rising
from tests.rooms.test_force_elements_on_links import four_bar as hinged

from kedfem.accuracy.prepared import meshed
from kedfem.accuracy.reduction import prepared
from kedfem.dynamics.matrices.substructure import factored
from kedfem.dynamics.model import Model
from kedfem.dynamics.rigid_body import forcings, motions
from kedfem.dynamics.stepping.scheme import generalised_alpha
from kedfem.dynamics.stepping.solvers import CONVERGED, steps_of
from kedfem.dynamics.stepping.start import started
from kedfem.dynamics.stepping.transient import transient
from kedfem.dynamics.system.build import system_of
from kedfem.dynamics.system.march import march
from kedfem.dynamics.system.ready import Ready, ready
from kedfem.dynamics.system.sparse import SparsePart
from kedfem.dynamics.system.starts.initial_states import rest
from kedfem.dynamics.system.steps import Steps, scene_system
from kedfem.motion.rigid import rigid_motion
from kedfem.results.recording import recording, rows
from kedfem.scene import path_parameter, read_scene, scene_from, time_grid

STEPS, TURNS = 2000, 3


def four_bar(elements: int = 1, **more: Any) -> dict[str, Any]:
    """The four-bar of the source's example, steel bars, one quadratic beam a link; a drive that speeds up."""
    A, B, C, D = (0.0, 0.0), (0.3048, 0.0), (0.9, 0.69), (0.9144, 0.0)
    ends = {"crank": (A, B), "coupler": (B, C), "rocker": (C, D)}
    joints = {"A": ("ground", "crank"), "B": ("crank", "coupler"), "C": ("coupler", "rocker"), "D": ("rocker", "ground")}
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


PAIRS = ((200, 30), (60, 6), (40, 4), (20, 3))  # steps, and how often they are taken, solves after them each time
SOLIDS = {  # elements of crank, coupler and rocker
    "a solid link of 951 unknowns beside two reduced ones": ([4, 1, 1], [16, 2, 1], [4, 1, 1]),
    "solids of 5,265 unknowns each": ([24, 4, 3],) * 3,
    "solids of 9,792 unknowns each": ([24, 5, 5],) * 3,
    "solids of 28,839 unknowns each": ([40, 8, 6],) * 3,
}


STAGE = Path(__file__).parents[1] / "examples" / "four_bar_solids"


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
    solve = bare_solves(model, of)
    steps, solves = [], []
    for _ in range(turns + 1):
        began = process_time()
        solver.advance(state, forcings(model, motion), motion)
        steps.append(process_time() - began)
        solves.append(solve(count))
    return 1e6 * min(steps[1:]) / count, 1e6 * min(solves[1:]) / count


def bare_solves(model: Model, of: Ready) -> Callable[[int], float]:
    """Processor time of so many triangular solves of each sparse link [s]."""
    links = zip(of.parts, model.links, of.system.model.joints, strict=True)
    bare = [
        (factored(link, joint, of.c.c_M, of.c.c_K), np.ones(link.X.shape))
        for part, link, joint in links
        if isinstance(part, SparsePart)
    ]

    def solve(count: int) -> float:
        began = process_time()
        for _ in range(count):
            for part, r in bare:
                part.solve(r)
        return process_time() - began

    return solve


def example_beside_solves(path: Path, turns: int) -> tuple[float, float, float, float]:
    """Processor time of a run's start, its steps, these with all channels and the account of energy, and of the bare
    solves of as many steps [s]; no frames, no stresses of whole links."""
    made, _ = prepared(read_scene(path))
    scene, model = made.scene, made.model
    solver = steps_of(scene, model)
    solve = bare_solves(model, solver.ready)
    every = []
    for _ in range(turns + 1):
        taken = []
        for channels in ([], recording(scene, model)):
            began = process_time()
            blocks = transient(scene, made.linkage, made.path, model, solver)
            rows(channels, next(blocks))
            first = process_time()
            for block in blocks:
                rows(channels, block)
            taken += [first - began, process_time() - first]
        every.append((taken[0], taken[1], taken[3], solve(time_grid(scene).steps)))
    start, steps, recorded, solves = np.min(every[1:], axis=0).tolist()
    return start, steps, recorded, solves


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
    print("\n| scene | start, s | steps, s | recorded too, s | solves, s | ratio | recorded | with the start |")
    print("|---|---:|---:|---:|---:|---:|---:|---:|")
    start, steps, recorded, solves = example_beside_solves(STAGE / "scene.toml", 8)
    seconds = " | ".join(f"{x:.3f}" for x in (start, steps, recorded, solves))
    ratios = " | ".join(f"{x / solves:.2f}" for x in (steps, recorded, start + recorded))
    print(f"| {STAGE.name} | {seconds} | {ratios} |", flush=True)


if __name__ == "__main__":
    main()
