"""Steps and levels that a plan chooses: ``python -m tests.planned_steps`` writes docs/performance/planned_steps.md.

The source's four-bar over two revolutions. Truth is the largest difference in time of the worst channel, of its peak,
from three levels of a quarter of the step, on the same links. Work is the steps of all levels.
"""

import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from kedfem.accuracy.choices import chosen_step
from kedfem.accuracy.histories import histories, relative_errors, worst
from kedfem.accuracy.plan import STEP
from kedfem.accuracy.prepared import Prepared, meshed
from kedfem.accuracy.reduction import first_reduced
from kedfem.accuracy.trials import Trials
from kedfem.accuracy.variants import with_analysis, with_steps
from kedfem.scene import Scene, scene_from, time_grid

EXAMPLE = Path(__file__).parents[1] / "examples" / "four_bar_beams" / "scene.toml"
PAGE = Path("docs/performance/planned_steps.md")
ASKED = 0.01
TURNS = 2
BEAMS = {"element": "beam5", "mesh": {"elements": 3}}
SOLIDS = {"model": "solid", "mesh": {"elements": [8, 1, 1]}, "reduction": "modal"}


@dataclass(frozen=True)
class Planned:
    """A choice: the scene with it, its error as expected and in truth, that of one level in 2,000 steps a revolution."""

    scene: Scene
    expected: float
    true: float
    plain: float
    seconds: tuple[float, float]

    @property
    def work(self) -> float:
        """Steps of all levels in a turn."""
        return (2 ** (self.scene.analysis.extrapolation_levels or 1) - 1) * time_grid(self.scene).steps / TURNS

    @property
    def needed(self) -> float:
        """Steps a turn that a single level would need for what is allowed."""
        return 2000 * float(np.sqrt(self.plain / (STEP * ASKED)))


def four_bar(speed: float, links: Mapping[str, Any], **analysis: Any) -> Scene:
    """The source's four-bar with its step left open."""
    raw = tomllib.loads(EXAMPLE.read_text(encoding="utf-8"))
    raw["drive"]["motion"]["speed"] = f"{speed} rpm"
    raw["analysis"] = {"revolutions": TURNS, "initial": "quasi-static", "frames": "rigid-body", **analysis}
    for link in raw["links"].values():
        link.update(links)
    return scene_from(raw)


def judged(scene: Scene) -> Planned:
    """Choose, and compare with the truth."""
    since = process_time()
    chosen, expected = chosen_step(Trials(ASKED, lambda name: None), scene, STEP * ASKED)
    planning = process_time() - since
    ready: Prepared = first_reduced(meshed(chosen), 1e-4)
    since = process_time()
    found = histories(ready)
    running = process_time() - since
    steps = time_grid(chosen).steps
    fine = histories(replace(ready, scene=with_analysis(with_steps(chosen, 4 * steps), extrapolation_levels=3)))
    plain = histories(replace(ready, scene=with_analysis(with_steps(chosen, 2000 * TURNS), extrapolation_levels=1)))
    return Planned(chosen, expected, *(worst(relative_errors(x, fine)) for x in (found, plain)), (planning, running))


def cases() -> Iterator[tuple[str, Scene]]:
    """Slow and fast; rigid-body and co-rotational; beams and solids; smooth and from rest."""
    for speed in (60, 600):
        yield f"{speed} rpm, beams, rigid-body", four_bar(speed, BEAMS)
        yield f"{speed} rpm, beams, co-rotational", four_bar(speed, BEAMS, frames="co-rotational")
        yield f"{speed} rpm, solids, rigid-body", four_bar(speed, SOLIDS)
    yield ("600 rpm, beams, co-rotational, from rest", four_bar(600, BEAMS, frames="co-rotational", initial="rest"))


def main(say: Callable[[str], None] = print) -> None:
    lines = [
        "# The step that a plan chooses", "",
        "Written by `python -m tests.planned_steps`: the source's four-bar, two revolutions, 0.3 % allowed.",
        "Truth: the largest difference over time of the worst channel, relative to its peak, from three levels of a",
        "quarter of the step. Work: steps of all levels in a revolution; the last column is the number of steps that",
        "a single level, of order 2, would need for the 0.3 %.", "",
        "| run | chosen, a revolution | expected | truth | work | choosing, running | order 2 needs |",
        "|---|---|---:|---:|---:|---:|---:|",
    ]  # fmt: skip
    for name, scene in cases():
        one = judged(scene)
        steps, levels = (round(time_grid(one.scene).steps / TURNS), one.scene.analysis.extrapolation_levels or 1)
        marches = " + ".join(f"{steps * 2**k:,}" for k in range(levels))
        seconds = ", ".join(f"{x:.1f} s" for x in one.seconds)
        lines.append(
            f"| {name} | {marches} | {100 * one.expected:.2g} % | {100 * one.true:.2g} % | {one.work:,.0f} "
            f"| {seconds} | {float(f'{one.needed:.2g}'):,.0f} |"
        )
        say(lines[-1])
    PAGE.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
