"""Processor time of the stress envelope beside that of the steps, on every example that moves."""

from pathlib import Path
from time import process_time

from benchmarks.pages import ROOT, script, table, write_page
from kedfem.accuracy.prepared import Prepared
from kedfem.accuracy.reduction import prepared
from kedfem.dynamics.history import Block
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.links.recovery import stress_recovery
from kedfem.results.stresses.envelope import Envelope
from kedfem.scene import read_scene

EXAMPLES = (
    "bennett", "connecting_rod", "five_bar_robot", "four_bar_accuracy", "four_bar_beams", "four_bar_corotational",
    "four_bar_solids", "motor_four_bar", "quick_return", "rssr", "slider_crank_solids", "spinning_bar",
    "universal_joint_shaft",
)  # fmt: skip
QUICK = ("four_bar_beams", "bennett")


def bench_envelope(folder: Path, quick: bool) -> None:
    """Seconds of all steps of an example, of its envelope, and how many points and times that examined; a table."""
    header = ("example", "points", "steps", "the steps [s]", "the envelope [s]", "ratio", "examined", "with all modes")
    rows = [_measured(name) for name in (QUICK if quick else EXAMPLES)]
    write_page(folder, "performance/envelope", [table(header, rows)])


def _measured(name: str) -> tuple[str, ...]:
    ready, _ = prepared(read_scene(ROOT / "examples" / name / "scene.toml"))
    links = [*ready.model.links, *(prescribed.link for prescribed in ready.model.prescribed)]
    recoveries = [stress_recovery(link) for link in links]
    for _ in range(2):  # the first time compiles
        blocks, steps = _stepped(ready)
        envelope, since = Envelope(ready.model, recoveries), process_time()
        for block in blocks:
            envelope.add(block)
        envelope.flush()
        took = process_time() - since
    count, points = sum(map(len, blocks)), sum(recovery.stressed for recovery in recoveries)
    shares = (envelope.examined / count / points, envelope.evaluated / count / points)
    return (
        name, f"{points:,}", f"{count:,}", f"{steps:.3g}", f"{took:.2g}", f"{took / steps:.2g}",
        *(f"{100 * share:.2g} %" for share in shares),
    )  # fmt: skip


def _stepped(ready: Prepared) -> tuple[list[Block], float]:
    """All blocks and the time they took."""
    solver = steps_of(ready.scene, ready.model)
    since = process_time()
    blocks = list(transient(ready.scene, ready.linkage, ready.path, ready.model, solver))
    return blocks, process_time() - since


if __name__ == "__main__":
    script(bench_envelope)
