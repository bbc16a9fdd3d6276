"""What `kedfem check` forecasts of a run, beside the run: seconds to factor and to step, memory; in a process each."""

from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.memory import forget_most, memory_held, most_memory
from benchmarks.pages import ROOT, apart, script, table, write_page
from benchmarks.scenes import mechanisms, with_reduced_links
from kedfem.precompile import precompile
from kedfem.scene import Scene, read_scene, scene_from

EXAMPLES = (
    "four_bar_beams", "four_bar_corotational", "four_bar_solids", "slider_crank_solids", "quick_return", "rssr",
    "engine", "motor_four_bar", "spinning_bar",
)  # fmt: skip
QUIET = {"animation": None, "plots": False, "picture": False, "report": False, "csv": False}


def bench_forecasts(folder: Path, quick: bool) -> None:
    """Forecast and run of mechanisms unreduced and reduced, and of examples; table to the folder."""
    precompile(lambda stage, done, total: None)
    names = [*_cases(), *EXAMPLES]
    rows = []
    for name in names[:2] if quick else names:
        expected, run = apart("benchmarks.forecasts", "expected", name), apart("benchmarks.forecasts", "run", name)
        cells = [name, f"{run['unknowns']:,.0f}", f"{run['steps']:,.0f}"]
        for key, unit, form in (("time", 1.0, ".2f"), ("memory", 1e6, ".0f")):
            cells += [f"{expected[key] / unit:{form}}", f"{run[key] / unit:{form}}", f"{expected[key] / run[key]:.2f}"]
        rows.append(tuple(cells))
    header = ["scene", "unknowns", "steps"]
    for what in ("factors and steps [s]", "memory [MB]"):
        header += [f"{what}, forecast", "taken", "ratio"]
    write_page(folder, "performance/forecasts", [table(header, rows)])


def _cases() -> dict[str, dict[str, object]]:
    """The suite's mechanisms unreduced and reduced."""
    out: dict[str, dict[str, object]] = {}
    for name, raw in mechanisms().items():
        out |= {f"{name}, full": raw, f"{name}, reduced": with_reduced_links(raw)}
    return out


def _scene(name: str) -> Scene:
    cases = _cases()
    scene = scene_from(cases[name]) if name in cases else read_scene(ROOT / "examples" / name / "scene.toml")
    return scene.model_copy(update={"output": scene.output.model_copy(update=QUIET)})


def _into(scene: Scene, folder: str) -> Scene:
    return scene.model_copy(update={"output": scene.output.model_copy(update={"folder": folder})})


def expected(name: str) -> dict[str, float]:
    """What the check says of a scene."""
    from kedfem.accuracy.plan import plan_for
    from kedfem.accuracy.reduction import prepared
    from kedfem.tables.check import forecast

    scene = _scene(name)
    plan = plan_for(scene, lambda stage: None)
    cost, _ = forecast(prepared(plan.scene if plan else scene)[0])
    return {"time": cost.factor + cost.steps, "memory": cost.memory}


def run(name: str) -> dict[str, float]:
    """What a run takes, and what memory it adds to a process that has run a small one."""
    from kedfem.analysis import analyse
    from kedfem.precompile import KINDS, few_steps

    few_steps(*KINDS)
    forget_most()
    held = memory_held()
    with TemporaryDirectory() as folder:
        done = analyse(_into(_scene(name), folder))
    seconds = done.seconds
    unknowns = sum(float(each.get("unknowns", 0.0)) for each in done.results.links.values())
    return {
        "time": seconds.get("factor", 0.0) + seconds["steps"], "memory": most_memory() - held,
        "unknowns": unknowns, "steps": len(done.results.time) - 1,
    }  # fmt: skip


if __name__ == "__main__":
    script(bench_forecasts)
