"""The step's estimated error after a sudden start, with weak and strong numerical damping, against far shorter steps."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kedfem.accuracy import damping
from kedfem.accuracy.damping import damped_errors
from kedfem.accuracy.error_budget import Budget
from kedfem.accuracy.estimates import budget, error_monitor
from kedfem.accuracy.histories import Histories, histories, is_judged, relative_errors
from kedfem.accuracy.prepared import Prepared, meshed
from kedfem.accuracy.reduction import prepared
from kedfem.accuracy.resolution import resolution
from kedfem.accuracy.step_estimate import StepErrorMonitor
from kedfem.accuracy.variants import with_analysis, with_steps
from kedfem.results.recording import recording
from kedfem.scene import scene_from, time_grid
from tests import scenes
from tests.moving import turned
from tests.scenes import bar, constant_speed, material

from .test_audit import example

LEAST, MOST = (
    0.5,
    2.3,
)  # estimate over true error, in every channel: 0.57 to 2.0 here, 0.3 and more without the comparison
SEVERAL = 0.45, 5.0  # the same of two and three levels: 0.48 to 4.0
TENTH = 10  # times the steps, with ρ∞ = 0.95: the truth
FIRST = 67.4  # of the arm, a cantilever [Hz]
OBLIQUE = np.linalg.qr(np.array([[2.0, 1, 1], [1, 3, 2], [1, 0, 4]]))[0] * [-1, -1, 1]
"""A rotation that leaves no axis in place."""


def arm(model: str = "beam", per_period: int = 40, frames: str = "rigid-body", **sections: Any) -> dict[str, Any]:
    """An arm whose weight acts at once, over eight periods of its first vibration."""
    elements: dict[str, Any] = {"beam": 8, "plane": [8, 1], "solid": [8, 1, 1]}
    link = bar(0.5, 0.02, 0.02, model=model, mesh={"elements": elements[model]})
    probes = {
        "tip": {"link": "arm", "at": [0.5, 0], "quantity": "displacement"},
        "root": {"link": "arm", "at": [0.02, 0.01], "quantity": "stress"},
    }
    sections.setdefault("materials", {"steel": material(7850, 2.1e11)})
    return scenes.arm(
        link, constant_speed(0.1), gravity=[0, -9.81, 0],
        analysis={"end_time": 8 / FIRST, "step": 1 / (per_period * FIRST), "initial": "rest", "frames": frames},
        output={"probes": probes}, **sections,
    )  # fmt: skip


def struck(per_period: int = 40) -> dict[str, Any]:
    """The arm from rest, with a load that comes at once in the fourth of its periods."""
    raw = arm(per_period=per_period)
    at = 3.7 / FIRST
    load = {"kind": "force", "link": "arm", "at": [0.5, 0], "vector": [0, -100.0]}
    return raw | {"loads": {"blow": load | {"factor": {"at": [at, at * (1 + 1e-9)], "value": [0, 1]}}}}


def four_bar(steps: int, frames: str = "rigid-body", name: str = "four_bar_beams", **link: Any) -> dict[str, Any]:
    links = link or {"mesh": {"elements": 2}}
    return example(name, steps, links, revolutions=0.5, initial="rest", frames=frames)


def in_space() -> dict[str, Any]:
    """The arm as a beam in space, in no plane of coordinates."""
    raw = arm()
    raw["links"]["arm"]["beam"] = "spatial"
    return turned(raw, OBLIQUE)


SOLIDS = {"mesh": {"size": 0.05}, "reduction": "modal"}
KINDS = {
    "beam": arm(),
    "beam in long steps": arm(per_period=20),
    "beam in short steps": arm(per_period=80),
    "damped beam": arm(damping={"ratio": 0.02, "frequencies": [60, 600]}),
    "co-rotational beam": arm(frames="co-rotational"),
    "beam in space": in_space(),
    "plane": arm("plane"),
    "solid": arm("solid"),
    "struck later": struck(),
    "four-bar": four_bar(720),
    "four-bar in long steps": four_bar(180),
    "co-rotational four-bar": four_bar(720, "co-rotational"),
    "four-bar of solids": four_bar(720, name="four_bar_solids", **SOLIDS),
}
DAILY = "beam in long steps", "plane"


def fine_of(ready: Prepared) -> Histories:
    """The channels in steps of a tenth, with little numerical damping."""
    scene = with_analysis(with_steps(ready.scene, TENTH * time_grid(ready.scene).steps), rho_inf=0.95)
    return histories(replace(ready, scene=scene))


def with_damping(ready: Prepared, rho_inf: float, levels: int = 1) -> Prepared:
    return replace(ready, scene=with_analysis(ready.scene, rho_inf=rho_inf, extrapolation_levels=levels))


def estimated(ready: Prepared) -> tuple[Budget, Histories]:
    """The budget of a run, and its channels."""
    seen = error_monitor(ready)
    recorded = [x for x in recording(ready.scene, ready.model) if is_judged(x.channel.name)]
    errors = StepErrorMonitor(ready, recorded, seen.running)
    base = histories(ready, look=seen.add, follow=errors.add)
    levels = ready.scene.analysis.extrapolation_levels or 1
    return budget(ready, seen, None, base, errors.estimate.errors if levels > 1 else None), base


def ratios(ready: Prepared, fine: Histories) -> dict[str, float]:
    """Channel → estimated over true error of the step."""
    found, base = estimated(ready)
    return {name: found.step[name] / error for name, error in relative_errors(base, fine).items()}


@pytest.mark.parametrize("kind", [x if x in DAILY else pytest.param(x, marks=pytest.mark.long) for x in KINDS])
def test_the_steps_error_after_a_sudden_start_is_told_with_any_numerical_damping(kind: str) -> None:
    ready, _ = prepared(scene_from(KINDS[kind]))
    fine = fine_of(ready)
    for rho_inf in (0.0, 0.3, 0.6, 0.9):
        for name, ratio in ratios(with_damping(ready, rho_inf), fine).items():
            assert LEAST < ratio < MOST, (rho_inf, name, ratio)


@pytest.mark.parametrize("levels", [2, 3])
@pytest.mark.parametrize("kind", ["beam", pytest.param("four-bar of solids", marks=pytest.mark.long)])
def test_levels_in_time_are_told_of_as_well(kind: str, levels: int) -> None:
    """They leave what all of them damp away: 0.3 to 0.5 of the error without the comparison."""
    ready, _ = prepared(scene_from(KINDS[kind]))
    fine = fine_of(ready)
    for rho_inf in (0.0, 0.3, 0.6, 0.95):
        for name, ratio in ratios(with_damping(ready, rho_inf, levels), fine).items():
            assert SEVERAL[0] < ratio < SEVERAL[1], (rho_inf, name, ratio)


@pytest.mark.parametrize("rho_inf", [0.0, 0.3, 0.6, 0.9])
def test_a_mass_that_is_let_go_swings_for_ever(rho_inf: float) -> None:
    """Exactly by u (1 − cos ω t) on an arm without mass; in 10 steps a period of which little is left at ρ∞ = 0."""
    raw = arm(materials={"steel": material(1.0, 2.1e11)})
    raw["bodies"] = {"tip": {"kind": "point_mass", "link": "arm", "at": [0.5, 0], "mass": 10.0}}
    raw["drive"]["motion"] = constant_speed(1e-6)
    first = resolution(meshed(scene_from(raw)))
    assert first is not None
    frequency = float(first.first[0])
    raw["analysis"] = {"end_time": 20 / frequency, "step": 0.1 / frequency, "initial": "rest", "rho_inf": rho_inf}
    found, base = estimated(meshed(scene_from(raw)))
    exact = -9.81 / (2 * np.pi * frequency) ** 2 * (1 - np.cos(2 * np.pi * frequency * base.time))
    name = "probes/tip/displacement"
    error = np.abs(base.channels[name][1][:, 1] - exact).max() / np.abs(exact).max()
    assert LEAST < found.step[name] / error < MOST


def test_weak_damping_is_not_compared_and_strong_damping_is_named() -> None:
    ready = meshed(scene_from(arm()))
    shares = {rho_inf: estimated(with_damping(ready, rho_inf))[0].of("step") for rho_inf in (0.3, 0.9)}
    assert "analysis.rho_inf = 0.3 damps vibration" in ((shares[0.3] and shares[0.3].remedy) or "")
    assert (shares[0.9] and shares[0.9].remedy) == ""
    assert damped_errors(with_damping(ready, 0.9), histories(ready)) == {}


def test_a_smooth_start_without_vibration_loses_nothing_to_damping() -> None:
    """With a quasi-static start at constant speed errors fall with the step, and steps twice as long show them."""
    raw = four_bar(720)
    raw["analysis"]["initial"] = "quasi-static"
    raw["drive"]["motion"]["speed"] = "60 rpm"
    ready = meshed(scene_from(raw))
    fine = fine_of(ready)
    for name, ratio in ratios(with_damping(ready, 0.0), fine).items():
        assert SEVERAL[0] < ratio < SEVERAL[1], (name, ratio)


def test_steps_that_rotate_links_far_have_no_comparison_in_which_vibration_grows(monkeypatch: pytest.MonkeyPatch) -> None:
    """Co-rotational links that turn by 0.2 rad in a step bear ρ∞ = 0.75 at most."""
    tried: list[float] = []

    def watched(ready: Prepared, **given: Any) -> Histories:
        tried.append(ready.scene.analysis.rho_inf)
        return histories(ready, **given)

    monkeypatch.setattr(damping, "histories", watched)
    raw = arm(frames="co-rotational")
    raw["drive"]["motion"] = constant_speed(20.0)
    for turn, wanted in ((0.2, []), (0.1, [0.8]), (0.03, [0.95])):
        raw["analysis"] |= {"end_time": turn, "step": turn / 20.0, "rho_inf": 0.0}
        ready = meshed(scene_from(raw))
        tried.clear()
        assert bool(damped_errors(ready, histories(ready))) is bool(wanted)
        assert tried == wanted
