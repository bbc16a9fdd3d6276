"""Planar beams of several numbers of nodes: the four-bar from rest, linear and with co-rotational frames."""

from collections.abc import Sequence
from pathlib import Path

from benchmarks.loop import loop_time
from benchmarks.pages import script, table, write_page
from benchmarks.scenes import mechanisms
from kedfem.accuracy.histories import Histories, histories, relative_errors
from kedfem.accuracy.prepared import meshed
from kedfem.scene import Scene, scene_from

MESHES = (  # nodes of an element, elements a link
    (2, 16), (2, 32), (3, 4), (3, 8), (3, 16), (4, 2), (4, 4), (5, 1), (5, 2), (5, 3), (7, 1), (7, 2), (9, 1),
)  # fmt: skip
QUICK = ((3, 4), (7, 1))
FINEST = (9, 2)
STEPS, TURNS = 2000, 3
BY_STEP = (500, 1000, 2000, 4000)
PROBE = "probes/probe/stress"


def bench_beams(folder: Path, quick: bool) -> None:
    """Errors of both equations by mesh and by step; tables go to the folder."""
    meshes, steps = (QUICK, BY_STEP[1:3]) if quick else (MESHES, BY_STEP)
    finest = {}
    for frames in ("rigid-body", "co-rotational"):
        finest[frames] = _run(*FINEST, frames, STEPS)[0]
    rows: list[Sequence[str]] = []
    for nodes, elements in meshes:
        found = {frames: _run(nodes, elements, frames, STEPS) for frames in finest}
        errors = [_percent(found[frames][0], finest[frames]) for frames in finest]
        times = [f"{1e6 * found[frames][1]:.1f}" for frames in finest]
        rows.append((f"beam{nodes}", str(elements), str(3 * (elements * (nodes - 1) + 1)), *errors, *times))
    header = ("element", "elements a link", "unknowns a link", "error, rigid-body frames", "error, co-rotational",
              "step, rigid-body [µs]", "step, co-rotational [µs]")  # fmt: skip
    write_page(folder, "performance/beams", [table(header, rows), _by_step(steps)])


def _by_step(steps: Sequence[int]) -> list[str]:
    reference = _run(*FINEST, "co-rotational", 2 * max(steps))[0]
    rows = []
    for count in steps:
        rows.append((f"{count:,}", _percent(_run(*FINEST, "co-rotational", count)[0], reference)))
    return table(("steps a revolution", "error, co-rotational"), rows)


def _run(nodes: int, elements: int, frames: str, steps: int) -> tuple[Histories, float]:
    """Channels over the turns, and seconds of a step in the loop alone."""
    ready = meshed(_scene(nodes, elements, frames, steps))
    return histories(ready), loop_time(ready, 5)


def _scene(nodes: int, elements: int, frames: str, steps: int) -> Scene:
    raw = mechanisms()["beam four-bar"]
    links = {
        name: {**link, "element": f"beam{nodes}", "mesh": {"elements": elements}} for name, link in raw["links"].items()
    }
    analysis = {"revolutions": TURNS, "steps_per_revolution": steps, "initial": "rest", "frames": frames}
    return scene_from({**raw, "links": links, "analysis": analysis})


def _percent(found: Histories, reference: Histories) -> str:
    return f"{100 * relative_errors(found, reference)[PROBE]:.2g} %"


if __name__ == "__main__":
    script(bench_beams)
