"""Whole runs of the source's four-bar, reduced solids in co-rotational segments: where time goes, how good they are."""

import os
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from unittest.mock import patch

from tests.verification.large_deflection import largest_difference

from benchmarks.corotational_run import STRESS, four_bar
from benchmarks.pages import script, table, write_page
from kedfem.analysis import analyse
from kedfem.scene import Scene

EXACT = "four_bar_600_damped"
SCENES = (((24, 2, 1), 6), ((24, 2, 1), 8))  # elements and segments of a link
STEPS, TOLERANCE, REPEATS = 3600, 0.01, 3  # the first repeat loads compiled loops
PARTS = {
    "mesh and matrices": ("motion", "mesh and matrices"),
    "modes": ("modes",),
    "their error": ("error of the reduction",),
    "steps": ("steps", "start"),
    "errors of step and mesh": ("estimates",),
}
PREPARED = ("mesh and matrices", "modes", "their error")


class _Stages:
    """Processor time of each stage of a run [s]."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._name, self._since = "", process_time()

    def __call__(self, stage: str, done: int, total: int) -> None:
        """A stage begins, or goes on."""
        if stage != self._name:
            now = process_time()
            self.seconds[self._name] = self.seconds.get(self._name, 0.0) + now - self._since
            self._name, self._since = stage, now


def whole_runs(quick: bool) -> list[str]:
    """Stages of whole runs, nothing kept from earlier ones but compiled loops, and the stress against exact beams."""
    rows = []
    for elements, segments in SCENES[:1] if quick else SCENES:
        link = {"model": "solid", "mesh": {"elements": list(elements)}, "reduction": "modal", "segments": segments}
        scene = four_bar(link, STEPS, frames="co-rotational", reduction_tolerance=TOLERANCE)
        found = [_run(scene) for _ in range(2 if quick else REPEATS)]
        seconds, estimate, error = min(found, key=lambda each: each[0]["whole"])
        parts = {part: sum(seconds.get(stage, 0.0) for stage in stages) for part, stages in PARTS.items()}
        steps = parts.pop("steps")
        prepared = sum(parts[part] for part in PREPARED)
        shares = (f"{each / steps:.2f}" for each in (*parts.values(), prepared, seconds["whole"]))
        rows.append((str(segments), f"{1e3 * steps:.0f}", *shares, f"{100 * estimate:.2g} %", f"{100 * error:.2g} %"))
    every = (*(part for part in PARTS if part != "steps"), "preparation", "whole run")
    shown = "modes' estimate", "stress off exact beams"
    header = ("segments", "steps [ms]", *(f"{part} : steps" for part in every), *shown)
    return table(header, rows)


def _run(scene: Scene) -> tuple[dict[str, float], float, float]:
    """Processor time of each stage and of the whole [s], the estimated error of the modes, that of the stress."""
    stages, since = _Stages(), process_time()
    with TemporaryDirectory() as folder, patch.dict(os.environ, KEDFEM_CACHE="off"):
        plain = {"folder": folder, "animation": None, "plots": False, "picture": False}
        run = analyse(scene.model_copy(update={"output": scene.output.model_copy(update=plain)}), stages)
        whole = process_time() - since
        stages("", 0, 0)
        error = largest_difference(EXACT, run.results.time, run.results.channels[STRESS][1][:, :1])
    estimate = max(run.reduction.estimate.values()) if run.reduction else 0.0
    return {**stages.seconds, "whole": whole}, estimate, error


def bench_whole(folder: Path, quick: bool) -> None:
    """Whole runs; the first table of the page."""
    write_page(folder, "performance/corotational", [whole_runs(quick)])


if __name__ == "__main__":
    script(bench_whole)
