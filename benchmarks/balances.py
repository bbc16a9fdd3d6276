"""Starts and positions of mechanisms with a solid link that grows: a suspension's lower arm moves freely, an excavator's
bucket rotates with a drive. Each size in its own process."""

import tomllib
from importlib.resources import files
from itertools import islice
from pathlib import Path
from typing import Any

from benchmarks.pages import apart, script, table, write_page

SIZES = (0.008, 0.0045, 0.0034)  # of elements [m]
BUCKETS = (0.06, 0.045)
POSITIONS, ROTATED = 8, 3


def bench_balances(folder: Path, quick: bool) -> None:
    """Processor time of factors, of the start and of positions; the table goes to the folder."""
    found = [apart("benchmarks.balances", "one_size", size) for size in (SIZES[:1] if quick else SIZES)]
    rows = [
        (f"{f['unknowns']:,}", f"{f['factor']:.2f}", f"{f['start']:.1f}", f"{f['first']:.1f}", f"{1e3 * f['next']:.0f}")
        for f in found
    ]
    header = ("unknowns", "factors [s]", "quasi-static start [s]", "first static position [s]", "each further one [ms]")
    driven = [apart("benchmarks.balances", "one_bucket", size) for size in (BUCKETS[:1] if quick else BUCKETS)]
    rotating = [(f"{f['unknowns']:,}", *(f"{f[key]:.1f}" for key in ("start", "start before", "next", "next before")))
                for f in driven]  # fmt: skip
    unreduced = "the same unreduced [s]"
    columns = ("unknowns", "quasi-static start [s]", unreduced, "each quasi-static position [s]", unreduced)
    write_page(folder, "performance/balances", [table(header, rows), table(columns, rotating)])


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


def excavator(size: float, **analysis: Any) -> dict[str, Any]:
    """The template `excavator`, co-rotational, with a plate for its bucket."""
    raw = tomllib.loads((files("kedfem") / "templates" / "excavator.toml").read_text(encoding="utf-8"))
    outline = [[4.9, -0.4], [5.5, -0.55], [6.3, -1.2], [5.9, -1.5], [4.9, -0.7]]
    holes = [{"at": at, "diameter": 0.06} for at in "HG"]
    shape = {"kind": "extrusion", "outline": outline, "holes": holes, "thickness": 0.1}
    raw["links"]["bucket"] = {"material": "steel", "shape": shape, "mesh": {"size": size}}
    raw["output"] = {}
    raw["analysis"] = {"end_time": 2.5, "step": 5e-3, "frames": "co-rotational", **analysis}
    return raw


def one_bucket(size: float) -> dict[str, float]:
    """The same of a body that rotates with a drive, in static modes and unreduced (`before`)."""
    from time import process_time
    from unittest.mock import patch

    from kedfem.accuracy.prepared import meshed
    from kedfem.dynamics.stepping.solvers import steps_of
    from kedfem.dynamics.stepping.start import begun
    from kedfem.dynamics.stepping.transient import transient
    from kedfem.scene import scene_from

    def measured(size: float) -> tuple[float, float, float]:
        """Unknowns, and the time of a start and of a position after the first."""
        ready = meshed(scene_from(excavator(size, initial="quasi-static")))
        solver, since = steps_of(ready.scene, ready.model), process_time()
        begun(ready.scene, ready.linkage, ready.path, ready.model, solver)
        start = process_time() - since
        ready = meshed(scene_from(excavator(size, kind="quasi-static")))
        solver, times = steps_of(ready.scene, ready.model), []
        for _ in islice(transient(ready.scene, ready.linkage, ready.path, ready.model, solver), ROTATED):
            times.append(process_time())
        return ready.model.unknowns, start, (times[-1] - times[0]) / (ROTATED - 1)

    measured(0.3)  # loads, or compiles, what the others need
    unknowns, start, further = measured(size)
    with patch("kedfem.dynamics.system.starts.condensed._is_large", lambda part, link: False):
        _, old_start, old_further = measured(size)
    return {"unknowns": unknowns, "start": start, "next": further, "start before": old_start, "next before": old_further}


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
