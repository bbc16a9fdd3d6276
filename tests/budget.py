"""The budget of runs against finest runs: ``python -m tests.budget`` writes docs/performance/budget.md.

Truth is the largest difference in time of the worst channel of a kind, of its peak, from a run that has frames that
follow where links bend, elements some times as fine and steps some times as short.
"""

import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kedfem.accuracy.error_budget import Budget, by_kind
from kedfem.accuracy.estimates import budget, error_monitor
from kedfem.accuracy.histories import histories, relative_errors
from kedfem.accuracy.prepared import Prepared, meshed
from kedfem.accuracy.reduction import first_reduced
from kedfem.scene import scene_from

EXAMPLES = Path(__file__).parents[1] / "examples"
PAGE = Path("docs/performance/budget.md")
COUNTED = 1e-3  # truths below are not judged: nobody asks whether 0.01 % is 0.03 %
Raw = dict[str, Any]


@dataclass(frozen=True)
class Case:
    """A run, and the finest one that it is judged by; meshed links reduced as tightly as the truth needs, or in full."""

    name: str
    raw: Raw
    fine: Raw
    full: bool = False

    def ready(self, raw: Raw) -> Prepared:
        """The run or its finest one, before its steps."""
        every = meshed(scene_from(raw))
        return every if self.full else first_reduced(every, 1e-4)


@dataclass(frozen=True)
class Judged:
    """What a run says of its errors, and what they are, by kind."""

    name: str
    found: Budget
    true: dict[str, float]

    @property
    def least(self) -> float:
        """The smallest ratio of estimate and truth, over kinds whose truth counts."""
        ratios = [self.found.together[kind] / true for kind, true in self.true.items() if true > COUNTED]
        return min(ratios, default=1.0)

    @property
    def worst(self) -> tuple[float, float]:
        """Estimate and truth of the worst kind."""
        return self.found.worst, max(self.true.values())

    @property
    def ratio(self) -> float:
        """Of these."""
        said, true = self.worst
        return max(said, COUNTED) / max(true, COUNTED)


def four_bar(speed: float, steps: int, links: Raw, revolutions: float = 1.0, **analysis: Any) -> Raw:
    raw = tomllib.loads((EXAMPLES / "four_bar_beams" / "scene.toml").read_text())
    raw["drive"]["motion"]["speed"] = f"{speed} rpm"
    raw["analysis"] = {"revolutions": revolutions, "steps_per_revolution": steps, "initial": "quasi-static", **analysis}
    for link in raw["links"].values():
        link.update(links)
    return raw


def arm(steps: int, links: Raw, sudden: bool, frames: str) -> Raw:
    """An arm that swings, or that is struck at its tip while it does."""
    shape = {"kind": "bar", "between": [[0, 0], [0.5, 0]], "width": 0.02, "thickness": 0.02}
    raw: Raw = {
        "links": {"arm": {"material": "steel", "shape": shape, "model": "beam", **links}},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0]}},
        "drive": {"joint": "A", "motion": {"kind": "cycloidal", "angle": 1, "rise": 0.2}},
        "damping": {"ratio": 0.02, "frequencies": [50, 500]},
        "analysis": {"end_time": 0.25, "step": 0.25 / steps, "frames": frames},
        "output": {"probes": {
            "tip": {"link": "arm", "at": [0.5, 0], "quantity": "displacement"},
            "root": {"link": "arm", "at": [0.1, 0.01], "quantity": "stress"},
        }},
    }  # fmt: skip
    if sudden:
        raw["loads"] = {"blow": {"kind": "force", "link": "arm", "at": [0.5, 0], "vector": [0, 50, 0]}}
    return raw


def beams(element: str, count: int) -> Raw:
    return {"element": element, "mesh": {"elements": count}}


FINE = beams("beam5", 4)


def cases() -> Iterator[Case]:
    """Thirty: beams, plane, solid; rigid-body and co-rotational; 60 to 600 rpm; smooth, sudden. Then unreduced."""
    for speed in (60, 150, 300, 600):
        fine = four_bar(speed, 4320, FINE, frames="co-rotational")
        for element, count in (("beam3", 1), ("beam5", 1), ("beam5", 3)):
            name = f"{speed} rpm, {count} {element} a link, rigid-body"
            yield Case(name, four_bar(speed, 720, beams(element, count)), fine)
        for element, count in (("beam3", 2), ("beam5", 2)) if speed > 60 else ():
            raw = four_bar(speed, 720, beams(element, count), frames="co-rotational")
            yield Case(f"{speed} rpm, {count} {element} a link, co-rotational", raw, fine)
    for speed in (60, 150):
        fine = four_bar(speed, 4320, FINE, frames="co-rotational")
        yield Case(f"{speed} rpm, 2 beam5, 120 steps a revolution", four_bar(speed, 120, beams("beam5", 2)), fine)
        rest = {"initial": "rest", "revolutions": 0.5}
        raw = four_bar(speed, 1440, beams("beam5", 1), **rest)
        yield Case(f"{speed} rpm, 1 beam5, from rest", raw, four_bar(speed, 11520, FINE, frames="co-rotational", **rest))
    for model, tail in (("plane", []), ("solid", [1])):
        fine = four_bar(60, 1440, {"model": model, "mesh": {"elements": [16, 2, *tail]}}, 0.5)
        for along in (4, 8):
            links = {"model": model, "mesh": {"elements": [along, 1, *tail]}}
            yield Case(f"60 rpm, {model} {along} × 1 a link", four_bar(60, 720, links, 0.5), fine)
    for sudden in (False, True):
        word = "struck" if sudden else "swung"
        fine = arm(8000, FINE, sudden, "co-rotational")
        for frames, count in (("rigid-body", 1), ("co-rotational", 2)):
            yield Case(f"arm {word}, {count} beam3, {frames}", arm(1000, beams("beam3", count), sudden, frames), fine)

    yield from in_full()


def in_full() -> Iterator[Case]:
    """Six with hexahedra that are not reduced, meshes small."""
    for speed in (60, 150):
        fine = four_bar(speed, 1440, solids(16, 2), 0.5, frames="co-rotational" if speed > 60 else "rigid-body")
        for along in (4, 8):
            raw = four_bar(speed, 720, solids(along, 1), 0.5)
            yield Case(f"{speed} rpm, solid {along} × 1 a link, unreduced", raw, fine, full=True)
    for sudden in (False, True):
        fine = arm(4000, solids(20, 2), sudden, "co-rotational")
        raw = arm(1000, solids(8, 1), sudden, "rigid-body")
        yield Case(f"arm {'struck' if sudden else 'swung'}, solid 8 × 1, unreduced", raw, fine, full=True)


def solids(along: int, across: int) -> Raw:
    return {"model": "solid", "mesh": {"elements": [along, across, 1]}}


def judged(case: Case, known: dict[str, Any] | None = None) -> Judged:
    """Run a case and its finest one."""
    ready = case.ready(case.raw)
    seen = error_monitor(ready)
    base = histories(ready, look=seen.add)
    found = budget(ready, seen, None, base)
    key = repr((case.full, case.fine))
    if known is None or key not in known:
        fine = histories(case.ready(case.fine))
        if known is not None:
            known[key] = fine
    else:
        fine = known[key]
    return Judged(case.name, found, by_kind(relative_errors(base, fine)))


def page(found: list[Judged]) -> str:
    """The table of docs/performance/budget.md."""
    ratios = np.array([each.ratio for each in found])
    within = np.mean((ratios > 1 / 3) & (ratios < 3))
    lines = [
        "# What a run says of its errors, against what they are", "",
        "Written by `python -m tests.budget`. True error: the largest difference over time of the worst channel of a",
        "kind, relative to its peak, from a run with co-rotational frames, finer elements and shorter steps. In percent:",
        "estimate / true error. The last column compares the largest of each. True errors below 0.1 % are not judged.",
        "",
        f"Of {len(found)} runs {100 * within:.0f} % are within a factor of three at their worst; the least ratio of",
        f"estimate and true error of any kind is {min(each.least for each in found):.2f}.", "",
        "| run | displacement | stress | joint forces | drive | ratio at worst |",
        "| --- | ---: | ---: | ---: | ---: | ---: |",
    ]  # fmt: skip
    for each in found:
        cells = [_cell(each, kind) for kind in ("displacement", "stress", "joint forces", "drive")]
        lines.append(f"| {each.name} | {' | '.join(cells)} | {each.ratio:.2f} |")
    return "\n".join(lines) + "\n"


def _cell(each: Judged, kind: str) -> str:
    return f"{100 * each.found.together[kind]:.2g} / {100 * each.true[kind]:.2g}" if kind in each.true else "-"


def main(say: Callable[[str], None] = print) -> None:
    known: dict[str, Any] = {}
    found = []
    for case in cases():
        found.append(judged(case, known))
        said, true = found[-1].worst
        say(f"{case.name}: {100 * said:.2g} / {100 * true:.2g} %, least ratio {found[-1].least:.2f}")
    PAGE.write_text(page(found), encoding="utf-8")


if __name__ == "__main__":
    main()
