"""Planar beams of several numbers of nodes: the four-bar from rest, linear and with co-rotational frames."""

from collections.abc import Sequence
from pathlib import Path

from kedfem.accuracy.histories import Histories, histories, relative_errors
from kedfem.accuracy.prepared import meshed
from kedfem.bench.loop import loop_time
from kedfem.bench.machine import Watch, markdown, table, write_page
from kedfem.bench.scenes import mechanisms
from kedfem.scene import Scene, scene_from

MESHES = (  # nodes of an element, elements a link
    (2, 16), (2, 32), (3, 4), (3, 8), (3, 16), (4, 2), (4, 4), (5, 1), (5, 2), (5, 3), (7, 1), (7, 2), (9, 1),
)  # fmt: skip
QUICK = ((3, 4), (7, 1))
FINEST = (9, 2)
STEPS, TURNS = 2000, 3
BY_STEP = (500, 1000, 2000, 4000)
PROBE = "probes/probe/stress"


def bench_beams(folder: Path, quick: bool, watch: Watch) -> str:
    """Errors of both equations by mesh and by step; tables go to the folder."""
    meshes, steps = (QUICK, BY_STEP[1:3]) if quick else (MESHES, BY_STEP)
    total = 2 * (len(meshes) + 1) + len(steps) + 1
    finest = {}
    for number, frames in enumerate(("rigid-body", "co-rotational")):
        watch("beams", number, total)
        finest[frames] = _run(*FINEST, frames, STEPS)[0]
    rows: list[Sequence[str]] = []
    for number, (nodes, elements) in enumerate(meshes):
        watch("beams", 2 + 2 * number, total)
        found = {frames: _run(nodes, elements, frames, STEPS) for frames in finest}
        errors = [_percent(found[frames][0], finest[frames]) for frames in finest]
        times = [f"{1e6 * found[frames][1]:.1f}" for frames in finest]
        rows.append((f"beam{nodes}", str(elements), str(3 * (elements * (nodes - 1) + 1)), *errors, *times))
    header = ("element", "elements a link", "unknowns a link", "error, rigid-body frames", "error, following",
              "step, nominal [µs]", "step, following [µs]")  # fmt: skip
    after = [*_by_step(steps, watch, total), "", *_NOTE]
    text = markdown("Beams of many nodes", "kedfem bench beams", header, rows, "\n".join(after))
    write_page(folder, "beams", text)
    return text


def _by_step(steps: Sequence[int], watch: Watch, total: int) -> list[str]:
    watch("beams", total - len(steps) - 1, total)
    reference = _run(*FINEST, "co-rotational", 2 * max(steps))[0]
    rows = []
    for number, count in enumerate(steps):
        watch("beams", total - len(steps) + number, total)
        rows.append((f"{count:,}", _percent(_run(*FINEST, "co-rotational", count)[0], reference)))
    return table(("steps a turn", "error, following"), rows)


def _run(nodes: int, elements: int, frames: str, steps: int) -> tuple[Histories, float]:
    """Channels over the turns, and seconds of a step in the loop alone."""
    ready = meshed(_scene(nodes, elements, frames, steps))
    return histories(ready), loop_time(ready, 5)


def _scene(nodes: int, elements: int, frames: str, steps: int) -> Scene:
    raw = mechanisms()["beam four-bar"]
    links = {
        name: {**link, "element": f"beam{nodes}", "mesh": {"elements": elements}}
        for name, link in raw["links"].items()
    }
    analysis = {"revolutions": TURNS, "steps_per_revolution": steps, "initial": "rest", "frames": frames}
    return scene_from({**raw, "links": links, "analysis": analysis})


def _percent(found: Histories, reference: Histories) -> str:
    return f"{100 * relative_errors(found, reference)[PROBE]:.2g} %"


_NOTE = (
    f"The source's four-bar from rest at 600 rpm, 2 % damping, {TURNS} turns. Error: largest difference of the stress "
    "on the outer side of the rocker's midpoint over all time, of its peak. First table: against 2 elements of 9 nodes a "
    f"link, all with {STEPS:,} steps a turn, each equation against itself. Second table: 2 elements of 9 nodes against "
    "the same with twice as many steps as the last line; of second order. A step: median of the loop alone, compiled, "
    "rigid motion and loads known.",
)
