"""Runs of up to a million steps: processor time, and memory as they step and at their end. Each in its own process."""

import tempfile
from pathlib import Path
from time import process_time

from benchmarks.memory import memory_held, most_memory
from benchmarks.pages import ROOT, apart, script, table, write_page
from kedfem.analysis import analyse
from kedfem.scene import read_keys, scene_from

RUNS = ((10_000, 1), (100_000, 1), (1_000_000, 1), (1_000_000, 100))  # steps, and of how many one is written
STEP = 1e-4  # s
EXAMPLE = ROOT / "examples" / "four_bar_beams" / "scene.toml"


def bench_long_runs(folder: Path, quick: bool) -> None:
    """Processor time and memory of the four-bar of beams by its number of steps."""
    rows = []
    for count, every in RUNS[:1] if quick else RUNS:
        found = apart("benchmarks.long_runs", "one", (count, every))
        rows.append(
            (f"{count:,}", str(every), f"{found['seconds']:.1f}", f"{1e6 * found['steps'] / count:.0f}",
             *(f"{found[key] / 1e6:.0f}" for key in ("before", "stepped", "peak", "rows")))
        )  # fmt: skip
    header = ("steps", "`output.every`", "whole run [s]", "stage steps, a step [µs]", "memory as steps begin [MB]",
              "as they end [MB]", "peak of the run [MB]", "its rows [MB]")  # fmt: skip
    write_page(folder, "performance/long_runs", [table(header, rows)])


def one(asked: tuple[int, int]) -> dict[str, float]:
    """One run of so many steps, of which each so many has a row, without pictures and frames, measured."""
    count, every = asked
    raw, _ = read_keys(EXAMPLE)
    raw["analysis"] = {"end_time": count * STEP, "step": STEP, "accuracy": "quick", "initial": "quasi-static"}
    probes = raw["output"]["probes"]
    held: list[float] = []
    spent: list[float] = []
    began = process_time()

    def watch(stage: str, done: int, total: int) -> None:
        if stage == "steps":
            held.append(memory_held())
            spent.append(process_time())

    with tempfile.TemporaryDirectory() as place:
        raw["output"] = {
            "plots": False, "picture": False, "animation": False, "probes": probes, "every": every,
            "folder": str(Path(place) / "out"),
        }  # fmt: skip
        run = analyse(scene_from(raw, place), watch)
        size = sum(x.nbytes for _, x in run.results.channels.values())
    return {
        "seconds": process_time() - began, "steps": spent[-1] - spent[0], "before": held[0], "stepped": held[-1],
        "peak": most_memory(), "rows": float(size),
    }  # fmt: skip


if __name__ == "__main__":
    script(bench_long_runs)
