"""Five mechanisms from a scene to the last step, links unreduced and reduced: where the time goes."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from benchmarks.pages import script, table, write_page
from benchmarks.scenes import mechanisms, with_reduced_links
from kedfem.accuracy.histories import worst
from kedfem.accuracy.prepared import meshed
from kedfem.accuracy.reduction import Reduction, reduced
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.dynamics.system.steps import Steps
from kedfem.results.recording import recording, rows
from kedfem.scene import Scene, scene_from, time_grid
from kedfem.stepping import Clock

REPEATS = 3
STAGES = ("motion", "mesh and matrices", "modes", "factor", "steps")


@dataclass(frozen=True, slots=True)
class _Measured:
    """Unknowns, steps, seconds per stage (medians), error that the reduction estimates for itself."""

    unknowns: int
    steps: int
    seconds: dict[str, float]
    estimate: float | None

    @property
    def whole(self) -> float:
        return sum(self.seconds.values())


def bench_suite(folder: Path, quick: bool) -> None:
    """Seconds of every stage of every mechanism; table and plot go to the folder."""
    cases = list(mechanisms().items())[: 1 if quick else None]
    found: list[tuple[str, _Measured]] = []
    for name, raw in cases:
        for kind, keys in (("full", raw), ("reduced", with_reduced_links(raw))):
            found.append((f"{name}, {kind}", _measured(scene_from(keys), 1 if quick else REPEATS)))
    header = ("scene", "unknowns", "motion [s]", "mesh, matrices [s]", "modes [s]", "factor [s]", "steps [s]",
              "a step [µs]", "whole [s]", "estimated error")  # fmt: skip
    write_page(folder, "performance/suite", [table(header, [_row(*each) for each in found])])
    _plot(folder / "suite.png", found)


def _measured(scene: Scene, repeats: int) -> _Measured:
    _once(scene)  # libraries are loaded, the loop compiled
    runs = [_once(scene) for _ in range(repeats)]
    seconds = {stage: median(run[0].get(stage, 0.0) for run in runs) for stage in STAGES}
    _, unknowns, reduction = runs[0]
    estimate = None if reduction is None else worst(reduction.estimate)
    return _Measured(unknowns, time_grid(scene).steps, seconds, estimate)


def _once(scene: Scene) -> tuple[dict[str, float], int, Reduction | None]:
    """A run without files: seconds per stage, unknowns."""
    clock = Clock(lambda stage, done, total: None)
    ready, reduction = meshed(scene, clock.stage), None
    chosen = [name for name, link in scene.links.items() if link.reduced]
    if chosen:
        reduction = reduced(ready, chosen, scene.analysis.reduction_tolerance, stage=clock.stage)
        ready = reduction.ready
    solver: Steps = clock.timed("factor", lambda: steps_of(scene, ready.model))

    def stepped() -> None:
        recorded = recording(scene, ready.model)
        for block in transient(scene, ready.linkage, ready.path, ready.model, solver):
            rows(recorded, block)

    clock.timed("steps", stepped)
    spent = dict(clock.seconds)
    spent["modes"] = spent.get("modes", 0.0) + spent.pop("error of the reduction", 0.0)
    return spent, ready.model.unknowns, reduction


def _row(name: str, found: _Measured) -> Sequence[str]:
    times = [f"{found.seconds[stage]:.3f}" for stage in STAGES]
    estimate = "-" if found.estimate is None else f"{100 * found.estimate:.2g} %"
    step = f"{1e6 * found.seconds['steps'] / found.steps:,.0f}"
    return name, f"{found.unknowns:,}", *times, step, f"{found.whole:.2f}", estimate


def _plot(path: Path, found: Sequence[tuple[str, _Measured]]) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 0.42 * len(found) + 1.4), layout="constrained")
    axes = figure.add_subplot()
    names = [name for name, _ in found]
    before = [0.0] * len(found)
    for stage in STAGES:
        widths = [each.seconds[stage] for _, each in found]
        axes.barh(names, widths, left=before, label=stage, height=0.7)
        before = [a + b for a, b in zip(before, widths, strict=True)]
    axes.invert_yaxis()
    axes.set_xlabel("seconds")
    axes.grid(visible=True, axis="x", alpha=0.3)
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), frameon=False)
    figure.savefig(path, dpi=130)


if __name__ == "__main__":
    script(bench_suite)
