"""What a steady motion costs beside marching until it has settled: `python -m benchmarks.steady`.

Marches over a period, and processor time: to find the steady state, to find multipliers beside it, and from rest until
what is left of the vibration of the start is 1e-6 of the state. Ratios count.
"""

import sys
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from time import process_time
from typing import Any

from kedfem.accuracy.prepared import Prepared, meshed
from kedfem.accuracy.reduction import prepared
from kedfem.dynamics.stepping.levels import level_steps
from kedfem.dynamics.stepping.solvers import block_length
from kedfem.dynamics.stepping.start import coarse_map, started
from kedfem.dynamics.system.period.map import PeriodMap
from kedfem.dynamics.system.period.search import Periodic, periodic
from kedfem.motion.period import over_one_period
from kedfem.motion.rigid import rigid_motion
from kedfem.scene import Scene, path_parameter, scene_from, time_grid

LEFT, MOST = 1e-6, 400
EXAMPLES = Path(__file__).parents[1] / "examples"
#: example, its damping where it is changed, whether its links are reduced where they are not
CASES: dict[str, tuple[str, float] | tuple[str, float, bool]] = {
    "four_bar_beams": ("four_bar_beams", 0.0),
    "the same, 1 % damping ": ("four_bar_beams", 0.01),
    "the same, 0.2 % damping": ("four_bar_beams", 0.002),
    "four_bar_corotational": ("four_bar_corotational", 0.0),
    "the same, 0.2 % damping ": ("four_bar_corotational", 0.002),
    "quick_return": ("quick_return", 0.0),
    "rssr": ("rssr", 0.0),
    "universal_joint_shaft": ("universal_joint_shaft", 0.0),
    "the same, 0.1 % damping": ("universal_joint_shaft", 0.001),
    "four_bar_solids": ("four_bar_solids", 0.0),
    "the same, 1 % damping": ("four_bar_solids", 0.01),
    "the same, 1 % damping, reduced": ("four_bar_solids", 0.01, True),
    "connecting_rod": ("connecting_rod", 0.0),
}


def scene_of(name: str, damping: float, reduced: bool = False) -> Scene:
    """An example as a steady motion."""
    raw = tomllib.loads((EXAMPLES / name / "scene.toml").read_text(encoding="utf-8"))
    gone = ("revolutions", "end_time", "initial", "accuracy")
    analysis = {key: value for key, value in raw["analysis"].items() if key not in gone}
    raw["analysis"] = {**analysis, "kind": "steady", "accuracy": "quick"}
    if damping:
        raw["damping"]["ratio"] = damping
    for link in raw["links"].values() if reduced else ():
        link["reduction"] = "modal"
    return over_one_period(scene_from(raw, EXAMPLES / name))


def map_of(ready: Prepared) -> PeriodMap:
    """The map of its period, from rest."""
    scene = ready.scene.model_copy(update={"analysis": ready.scene.analysis.model_copy(update={"kind": "transient"})})
    solver = level_steps(scene, ready.model)[0]
    start = started(scene, ready.linkage, ready.path, ready.model, solver)

    def motion_at(t: Any) -> Any:
        return rigid_motion(ready.linkage, ready.path, t, path_parameter(scene, t))

    return PeriodMap(solver.ready, start, motion_at, time_grid(scene).end, block_length(ready.model))


def searched(ready: Prepared, over: PeriodMap, stability: bool) -> Periodic:
    """The steady motion; that of reduced links, which preconditions the search, counts."""
    small = coarse_map(ready.scene, ready.linkage, ready.path, ready.model) if over.linear else None
    return periodic(over, stability, small=small)


def timed(work: Callable[..., Any], *given: Any) -> tuple[Any, float]:
    """Its result, and seconds of processor time."""
    began = process_time()
    return work(*given), process_time() - began


def marched(over: PeriodMap, until: Periodic) -> int:
    """Periods from rest until what is left is LEFT of the state, MOST at most."""
    x, wanted = over.vector(over.start), over.vector(until.state)
    for count in range(1, MOST + 1):
        x = over(x)
        if over.size(over.change(x, wanted)) <= LEFT * over.size(wanted):
            return count
    return MOST


def main(named: Sequence[str] = ()) -> None:
    """A line for each case, or for some."""
    steady = "steady: marches, s | with multipliers: marches, s"
    print(f"| scene | unknowns | left after a period | {steady} | marching: periods, s |")
    print("|---|---:|---:|---:|---:|---:|")
    for name in named or CASES:
        case = CASES[name]
        scene = scene_of(*case)
        reduced = any(link.reduced for link in scene.links.values())
        ready = prepared(scene, lambda stage: None)[0] if reduced else meshed(scene)
        over = map_of(ready)
        over(over.vector(over.start))  # compiled
        alone, seconds = timed(searched, ready, map_of(ready), False)
        whole, more = timed(searched, ready, map_of(ready), True)
        count, slow = timed(marched, over, alone)
        said = f"{count}{'+' * (count == MOST)}"
        print(
            f"| {name} | {ready.model.unknowns:,} | {100 * whole.growth:.3g} % | {alone.marches}, {seconds:.2f} | "
            f"{whole.marches}, {more:.2f} | {said}, {slow:.2f} |",
            flush=True,
        )


if __name__ == "__main__":
    main(sys.argv[1:])
