"""Does `analysis.accuracy` keep its word: errors of planned runs against a much finer one, and what they take."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

from benchmarks.mechanisms import MECHANISMS
from benchmarks.pages import script, table, write_page
from kedfem.accuracy.histories import Histories, histories, relative_errors, worst
from kedfem.accuracy.plan import Plan, planned
from kedfem.accuracy.reduction import prepared
from kedfem.accuracy.variants import families, of_family, refined, with_analysis, with_links, with_steps
from kedfem.scene import Scene, time_grid

ACCURACIES = (0.05, 0.01, 0.002)
FINER, SHORTER, TOLERANCE = 1.5, 4, 1e-5  # of the reference: elements, steps, reduction


@dataclass(frozen=True, slots=True)
class Kept:
    """One plan, what its run differs by from the reference, and the seconds to plan, prepare, and run."""

    plan: Plan
    errors: dict[str, float]
    seconds: tuple[float, float, float]

    @property
    def within(self) -> float:
        """Share of the channels that keep to what was asked for."""
        return sum(error <= self.plan.asked for error in self.errors.values()) / len(self.errors)


def bench_accuracy(folder: Path, quick: bool) -> None:
    """Five mechanisms, three accuracies each; a table goes to the folder."""
    cases = list(MECHANISMS.items())[-1:] if quick else list(MECHANISMS.items())
    rows: list[Sequence[str]] = []
    for name, scene_for in cases:
        rows += [_row(name, each) for each in kept(scene_for, ACCURACIES[:2] if quick else ACCURACIES)]
    header = ("mechanism", "asked for", "expected", "worst channel", "channels within", "chosen, steps",
              "plan [s]", "prepare [s]", "steps [s]")  # fmt: skip
    write_page(folder, "performance/accuracy", [table(header, rows)])


def kept(scene_for: Callable[[float], Scene], accuracies: Sequence[float]) -> list[Kept]:
    """Plans for accuracies, loosest first, run and compared with one reference."""
    done = [_planned_run(scene_for(accuracy)) for accuracy in accuracies]
    finest = histories(prepared(reference(scene_for(accuracies[-1]), done[-1][0]))[0])
    return [Kept(plan, relative_errors(run, finest), seconds) for plan, run, seconds in done]


def reference(scene: Scene, plan: Plan) -> Scene:
    """A scene that is much finer than its plan."""
    links = {
        name: refined(of_family(link, families(link)[-1], reduced=True), FINER * plan.finer)
        for name, link in scene.links.items() if link.model == "auto"
    }  # fmt: skip
    fine = with_steps(with_links(scene, links), SHORTER * time_grid(plan.scene).steps)
    return with_analysis(fine, accuracy="quick", reduction_tolerance=TOLERANCE)


def _planned_run(scene: Scene) -> tuple[Plan, Histories, tuple[float, float, float]]:
    since = perf_counter()
    plan = planned(scene)
    chosen = perf_counter()
    ready, _ = prepared(plan.scene)
    made = perf_counter()
    run = histories(ready)
    return plan, run, (chosen - since, made - chosen, perf_counter() - made)


def _row(name: str, found: Kept) -> Sequence[str]:
    links = [link for link in found.plan.scene.links.values() if link.shape is not None]
    kinds = ", ".join(f"{sum(x.category == kind for x in links)} {kind}" for kind in
                      sorted({link.category for link in links}))  # fmt: skip
    return (
        name, f"{100 * found.plan.asked:g} %", f"{100 * found.plan.error:.2g} %", f"{100 * worst(found.errors):.2g} %",
        f"{100 * found.within:.0f} %", f"{kinds}; {time_grid(found.plan.scene).steps}",
        *(f"{seconds:.2f}" for seconds in found.seconds),
    )  # fmt: skip


if __name__ == "__main__":
    script(bench_accuracy)
