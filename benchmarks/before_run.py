"""One run of a scene in a process of its own, by whichever kedfem is on the path: `benchmarks.before` runs it with two.

Keys, folder of the example and name of the output come as a JSON file; processor seconds of every stage, notes and
channels go to files of that name. It must run with both, so it takes of kedfem only what has stayed.
"""

import json
import sys
from pathlib import Path
from resource import RUSAGE_CHILDREN, RUSAGE_SELF, getrusage
from time import perf_counter
from typing import Any

import numpy as np

BEGAN = perf_counter()


def used() -> float:
    """Processor time of this process and of those that it has waited for [s]."""
    return sum(each.ru_utime + each.ru_stime for each in map(getrusage, (RUSAGE_SELF, RUSAGE_CHILDREN)))


def main() -> None:
    """Run the scene; a stage begins where progress is first reported of it."""
    from kedfem.analysis import analyse
    from kedfem.scene import scene_from

    given = json.loads(Path(sys.argv[1]).read_text())
    scene = scene_from(given["raw"], given["folder"])
    stages: dict[str, float] = {}
    last = ("scene", 0.0)

    def watch(stage: str, done: int, total: int) -> None:
        nonlocal last
        if stage != last[0]:
            now = used()
            stages[last[0]] = stages.get(last[0], 0.0) + now - last[1]
            last = (stage, now)

    run = analyse(scene, watch)
    watch("", 0, 0)
    results = run.results
    found = {
        "wall": perf_counter() - BEGAN,
        "processor": used(),
        "stages": stages,
        "steps": len(results.time) - 1,
        "notes": {name: str(value) for name, value in results.notes.items()},
        "warnings": list(run.warnings),
    }
    channels: dict[str, Any] = {name: values for name, (_, values) in results.channels.items()}
    np.savez(Path(given["out"]).with_suffix(".npz"), **channels)
    Path(given["out"]).write_text(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
