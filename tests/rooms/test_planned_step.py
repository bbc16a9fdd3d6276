"""The step and the levels in time that a plan chooses: right, no dearer than needed, only what the scene leaves open."""

from typing import Any

import pytest

from kedfem.accuracy import choices
from kedfem.accuracy.choices import chosen_step, with_beams
from kedfem.accuracy.error_budget import percent
from kedfem.accuracy.histories import histories, relative_errors, worst
from kedfem.accuracy.plan import STEP, plan_for
from kedfem.accuracy.prepared import meshed
from kedfem.accuracy.trials import Trials
from kedfem.accuracy.variants import with_analysis
from kedfem.scene import Scene, corotational, scene_from, time_grid
from tests import scenes
from tests.planned_steps import ASKED, Planned, four_bar, judged
from tests.scenes import bar, constant_speed

ALLOWED = STEP * ASKED
BEAMS = {"element": "beam5", "mesh": {"elements": 1}}


def chosen(scene: Scene) -> tuple[Scene, float, list[str]]:
    search = Trials(ASKED, lambda name: None)
    return *chosen_step(search, scene, ALLOWED), search.notes


def held(found: Planned) -> None:
    """Allowed, and expected within a factor 3; no more work than twice what a single level of the right step has."""
    assert found.true < ALLOWED
    assert found.true / 1.1 < found.expected <= ALLOWED
    assert found.work < 2 * found.needed


def test_at_speed_levels_do_with_less_work_than_order_2() -> None:
    found = judged(four_bar(600, BEAMS))
    held(found)
    assert found.scene.analysis.extrapolation_levels in {2, 3}
    assert found.work < 0.9 * found.needed


def test_vibration_that_is_hardly_in_step_is_left_to_short_steps() -> None:
    """At 60 rpm the channels hold vibration of 0.3 % whose order a trial does not show."""
    held(judged(four_bar(60, BEAMS)))


def struck(**analysis: Any) -> Scene:
    """A cantilever, 2 % damped, turned once a second; a force on its tip is let go within a thousandth of one."""
    raw = scenes.arm(
        bar(model="beam", mesh={"elements": 2}, element="beam5"),
        constant_speed("60 rpm"),
        damping={"ratio": 0.02, "frequencies": [50, 2000]},
        loads={"P": {
            "kind": "force", "link": "arm", "at": [0.5, 0], "vector": [0, -100], "frame": "link",
            "factor": {"time": [0, 0.5, 0.501, 1], "value": [1, 1, 0, 0]},
        }},
        analysis={"end_time": 1.0, "initial": "quasi-static", "frames": "rigid-body", **analysis},
    )  # fmt: skip
    return scene_from(raw)


def test_vibration_that_short_steps_resolve_is_followed_where_that_costs_seconds(monkeypatch: pytest.MonkeyPatch) -> None:
    """The trials that are usual end before; where steps would be dear they are told, with the longer step taken."""
    scene, error, notes = chosen(struck())
    assert error <= ALLOWED
    assert not notes
    fine = with_analysis(scene, step=time_grid(scene).step / 4)
    assert worst(relative_errors(histories(meshed(scene)), histories(meshed(fine)))) < 1.5 * ALLOWED
    monkeypatch.setattr(choices, "CHEAP", 1e5)
    longer, worse, (note,) = chosen(struck())
    assert time_grid(longer).steps < time_grid(scene).steps / 4
    assert worse > 3 * ALLOWED
    assert "or a shorter analysis.step of your own" in note
    assert f"stays at {percent(worse)} with " in note


@pytest.mark.long
def test_co_rotational_links_from_rest() -> None:
    held(judged(four_bar(600, BEAMS, frames="co-rotational", initial="rest")))


def test_levels_and_steps_that_the_scene_states_stay() -> None:
    for levels in (1, 2, 3):
        scene, error, _ = chosen(four_bar(600, BEAMS, extrapolation_levels=levels, revolutions=0.5))
        assert scene.analysis.extrapolation_levels == levels
        assert error <= ALLOWED
    scene, error, notes = chosen(four_bar(600, BEAMS, steps_per_revolution=360, revolutions=0.5))
    assert scene.analysis.extrapolation_levels is None
    assert time_grid(scene).steps == 180
    assert error > ALLOWED
    assert notes[0].startswith("the scene states its step; its error is about")
    assert "analysis.extrapolation_levels = 2" in notes[0]
    both, better, _ = chosen(with_analysis(scene, extrapolation_levels=2))
    assert both.analysis.extrapolation_levels == 2
    assert better < 0.5 * error


def test_factors_that_do_not_fit_twice_leave_one_level(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(choices, "most_levels", lambda model: 1)
    scene, _, _ = chosen(four_bar(600, BEAMS, revolutions=0.5))
    assert scene.analysis.extrapolation_levels == 1


def test_what_nothing_drives_has_its_beams_chosen() -> None:
    """A beam that a joint lets fall: its step stays, frames are co-rotational, and one beam3 is not taken unseen."""
    raw: dict[str, Any] = {
        "gravity": [0, -9.81, 0],
        "links": {"arm": {
            "model": "beam", "material": "pom",
            "shape": {"kind": "bar", "between": [[0, 0], [0.6, 0]], "width": 0.008, "thickness": 0.02},
        }},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0]}},
        "damping": {"beta": 1e-4},
        "analysis": {"end_time": 0.3, "step": 3e-4},
        "output": {"probes": {
            "bent": {"link": "arm", "at": [0.3, 0], "quantity": "deflection"},
            "root": {"link": "arm", "at": [0.15, 0.004], "quantity": "stress"},
        }},
    }  # fmt: skip
    plan = plan_for(scene_from(raw))
    assert plan is not None
    assert plan.scene.links["arm"].element == "beam5"
    assert time_grid(plan.scene).steps == 1000
    assert corotational(plan.scene)
    assert not any(share.what == "frames" for share in plan.shares)
    coarse, chosen_, fine = (
        histories(meshed(with_beams(plan.scene, ["arm"], each) if each else plan.scene))
        for each in (("beam3", 1), None, ("beam5", 8))
    )
    assert worst(relative_errors(coarse, fine)) > 0.05  # 9.7 %, in the stress
    assert worst(relative_errors(chosen_, fine)) < 0.01
    raw["links"]["arm"]["model"] = "solid"
    assert plan_for(scene_from(raw)) is None
