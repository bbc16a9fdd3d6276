"""Forecasts: the steps that a run will take are tried, whatever its solver."""

from typing import Any

import pytest

from kedfem.accuracy.prepared import meshed
from kedfem.dynamics.stepping import cost
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.scene import scene_from, time_grid
from kedfem.stepping import frame_steps, stepped
from kedfem.tables import check
from kedfem.tables.check import forecast

from .test_dynamics import four_bar


def sprung(**analysis: Any) -> dict[str, Any]:
    raw = four_bar("bar", revolutions=1, **analysis)
    raw["springs"] = {"s": {"kind": "torsion", "joint": "B", "stiffness": 10.0}}
    return raw


@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
def test_springs_on_rigid_body_frames_and_frames_that_follow_are_tried(frames: str) -> None:
    """By steps of their own solver, whatever sizes would say."""
    raw = sprung(frames=frames, steps_per_revolution=120)
    for link in raw["links"].values():
        link.update(model="beam", mesh={"elements": 2}, element="beam3")
    ready = meshed(scene_from(raw))
    said, _ = forecast(ready)
    assert 24 <= said.tried <= 120
    assert said.steps > 0.0
    solver = steps_of(ready.scene, ready.model)
    assert solver.corotational == (frames != "rigid-body")


def test_what_is_too_large_to_be_tried_is_forecast_by_its_sizes(monkeypatch: pytest.MonkeyPatch) -> None:
    ready = meshed(scene_from(four_bar("bar", revolutions=1)))
    monkeypatch.setattr(cost, "TRIED", ready.model.unknowns - 1)
    assert forecast(ready)[0].tried == 0
    assert cost.estimated_cost(ready.scene, ready.model).steps > 0


def test_a_forecast_holds_all_that_a_run_makes_of_its_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """It tries the loop of the run itself, and the frames of the animation are counted, not those of the trial."""
    raw = sprung(steps_per_revolution=120)
    for link in raw["links"].values():
        link.update(model="beam", mesh={"elements": 2}, element="beam3")
    raw["output"] = {"animation": {"frames_per_revolution": 30}}
    ready, tried = meshed(scene_from(raw)), []

    def counted(now: Any, *told: Any) -> Any:
        tried.append((len(frame_steps(now.scene)), time_grid(now.scene).steps))
        return stepped(now, *told)

    monkeypatch.setattr(check, "stepped", counted)
    monkeypatch.setattr(check, "seconds_of_frame", lambda *told: 100.0)
    assert 3100 <= forecast(ready)[0].steps < 3200
    assert tried[:2] == [(0, 4), (0, 4)]
    assert all(frames == 0 and steps <= 120 for frames, steps in tried)
