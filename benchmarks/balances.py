"""Starts and static positions of a suspension whose lower arm is a solid, growing. Each size in its own process."""

import tomllib
from importlib.resources import files
from itertools import islice
from pathlib import Path
from typing import Any

from benchmarks.pages import apart, script, table, write_page

SIZES = (0.008, 0.0045, 0.0034)  # of elements [m]
POSITIONS = 8


def bench_balances(folder: Path, quick: bool) -> None:
    """Processor time of factors, of the start and of positions; the table goes to the folder."""
    found = [apart("benchmarks.balances", "one_size", size) for size in (SIZES[:1] if quick else SIZES)]
    rows = [
        (f"{f['unknowns']:,}", f"{f['factor']:.2f}", f"{f['start']:.1f}", f"{f['first']:.1f}", f"{1e3 * f['next']:.0f}")
        for f in found
    ]
    header = ("unknowns", "factors [s]", "quasi-static start [s]", "first static position [s]", "each further one [ms]")
    write_page(folder, "performance/balances", [table(header, rows)])


def suspension(size: float, **analysis: Any) -> dict[str, Any]:
    """The template `wishbone` with a plate for its lower arm, of several segments."""
    raw = tomllib.loads((files("kedfem") / "templates" / "wishbone.toml").read_text(encoding="utf-8"))
    outline = [[0.17, 0.17], [0.63, 0.16], [0.63, 0.22], [0.44, 0.23], [0.17, 0.23]]
    holes = [{"at": end, "diameter": 0.02} for end in "AB"]
    shape = {"kind": "extrusion", "outline": outline, "holes": holes, "thickness": 0.02}
    raw["links"]["lower_arm"] = {"material": "steel", "shape": shape, "mesh": {"size": size}}
    raw["output"] = {}
    raw["analysis"] = {"end_time": 0.05, "step": 2e-4, "frames": "co-rotational", **analysis}
    return raw


def one_size(size: float) -> dict[str, float]:
    """Measure one size of elements; compiled code is loaded before by a run of beams."""
    from time import process_time

    from kedfem.accuracy.prepared import meshed
    from kedfem.dynamics.stepping.solvers import steps_of
    from kedfem.dynamics.stepping.start import begun
    from kedfem.dynamics.stepping.transient import transient
    from kedfem.scene import scene_from

    def started(raw: dict[str, Any]) -> tuple[float, float, float]:
        """Unknowns, and the time of factors and start."""
        ready = meshed(scene_from(raw))
        since = process_time()
        solver = steps_of(ready.scene, ready.model)
        factored = process_time()
        begun(ready.scene, ready.linkage, ready.path, ready.model, solver)
        return ready.model.unknowns, factored - since, process_time() - factored

    started(suspension(0.03, initial="quasi-static"))  # loads, or compiles, what the others need
    unknowns, factor, start = started(suspension(size, initial="quasi-static"))
    ready = meshed(scene_from(suspension(size, kind="static")))
    times, solver = [process_time()], steps_of(ready.scene, ready.model)
    for _ in islice(transient(ready.scene, ready.linkage, ready.path, ready.model, solver), POSITIONS):
        times.append(process_time())
    further = (times[-1] - times[1]) / (POSITIONS - 1)
    return {
        "unknowns": unknowns,
        "factor": factor,
        "start": start,
        "first": times[1] - times[0] - factor,
        "next": further,
    }


if __name__ == "__main__":
    script(bench_balances)
