"""CPU seconds of the stress envelope beside those of the steps; see envelope.md."""

import sys
from pathlib import Path
from time import process_time

from kedfem.accuracy.prepared import Prepared
from kedfem.accuracy.reduction import prepared
from kedfem.dynamics.history import Block
from kedfem.dynamics.stepping.transient import steps_of, transient
from kedfem.links.recovery import stress_recovery
from kedfem.results.stresses.envelope import Envelope
from kedfem.scene import read_scene

EXAMPLES = Path(__file__).parents[2] / "examples"


def stepped(ready: Prepared) -> tuple[list[Block], float]:
    """All blocks and the time they took."""
    solver = steps_of(ready.scene, ready.model)
    since = process_time()
    blocks = list(transient(ready.scene, ready.linkage, ready.path, ready.model, solver))
    return blocks, process_time() - since


def main(name: str) -> None:
    """Measure one example."""
    ready, _ = prepared(read_scene(EXAMPLES / name / "scene.toml"))
    links = [*ready.model.links, *(carried.link for carried in ready.model.carried)]
    recoveries = [stress_recovery(link) for link in links]
    for _ in range(2):  # the first time compiles
        blocks, steps = stepped(ready)
        envelope, since = Envelope(ready.model, recoveries), process_time()
        for block in blocks:
            envelope.add(block)
        envelope.flush()
        took = process_time() - since
    count, points = sum(map(len, blocks)), sum(recovery.stressed for recovery in recoveries)
    sys.stdout.write(
        f"{name}: {points} points, {count} steps, {steps:.3g} s, envelope {took:.3g} s, ratio {took / steps:.2g}, "
        f"{100 * envelope.looked / count / points:.2g} % "
        f"looked at, {100 * envelope.evaluated / count / points:.2g} % with all modes\n"
    )


if __name__ == "__main__":
    main(sys.argv[1])
