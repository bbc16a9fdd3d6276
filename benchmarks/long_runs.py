"""Runs of up to a million steps: seconds, and memory as they step and at their end. Each in its own process."""

import tempfile
from pathlib import Path

from benchmarks.memory import memory_held, most_memory
from benchmarks.pages import ROOT, apart, script, table, write_page
from kedfem.analysis import analyse
from kedfem.scene import read_keys, scene_from

COUNTS = (10_000, 100_000, 1_000_000)
STEP = 1e-4  # s
EXAMPLE = ROOT / "examples" / "four_bar_beams" / "scene.toml"


def bench_long_runs(folder: Path, quick: bool) -> None:
    """Seconds and memory of the four-bar of beams by its number of steps."""
    rows = []
    for count in COUNTS[:1] if quick else COUNTS:
        found = apart("benchmarks.long_runs", "one", count)
        rows.append(
            (f"{count:,}", f"{found['seconds']:.1f}", f"{1e6 * found['steps'] / count:.0f}",
             *(f"{found[key] / 1e6:.0f}" for key in ("before", "stepped", "peak", "rows")))
        )  # fmt: skip
    header = ("steps", "whole run [s]", "stage steps, a step [µs]", "memory as steps begin [MB]", "as they end [MB]",
              "peak of the run [MB]", "its rows [MB]")  # fmt: skip
    write_page(folder, "performance/long_runs", [table(header, rows)])


def one(count: int) -> dict[str, float]:
    """One run of so many steps, without pictures and frames, measured."""
    raw, _ = read_keys(EXAMPLE)
    raw["analysis"] = {"end_time": count * STEP, "step": STEP, "accuracy": "quick", "initial": "quasi-static"}
    probes = raw["output"]["probes"]
    held: list[float] = []

    def watch(stage: str, done: int, total: int) -> None:
        if stage == "steps":
            held.append(memory_held())

    with tempfile.TemporaryDirectory() as place:
        raw["output"] = {
            "plots": False, "picture": False, "animation": False, "probes": probes, "folder": str(Path(place) / "out")
        }  # fmt: skip
        run = analyse(scene_from(raw, place), watch)
        size = sum(x.nbytes for _, x in run.results.channels.values())
    return {
        "seconds": sum(run.seconds.values()), "steps": run.seconds["steps"], "before": held[0], "stepped": held[-1],
        "peak": most_memory(), "rows": float(size),
    }  # fmt: skip


if __name__ == "__main__":
    script(bench_long_runs)
