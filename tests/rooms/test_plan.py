"""Plans for an accuracy: what is stated stays, shares add up, what cannot be reached is said; and accuracy kept."""

import json
import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmarks.accuracy import kept
from benchmarks.mechanisms import MECHANISMS
from typer.testing import CliRunner

from kedfem.accuracy.histories import histories, relative_errors, worst
from kedfem.accuracy.plan import MESH, MODEL, REDUCTION, STEP, Plan, plan_for, planned
from kedfem.accuracy.prepared import meshed
from kedfem.accuracy.reduction import prepared
from kedfem.accuracy.trials import Trials
from kedfem.analysis import analyse
from kedfem.cli import app
from kedfem.scene import scene_from, time_grid
from tests import scenes
from tests.scenes import bar, cycloidal

from .test_audit import EXAMPLES
from .test_driven_efforts import arm as whipped
from .test_dynamics import four_bar, slider_crank


@pytest.fixture(autouse=True)
def _no_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KEDFEM_CACHE", "off")


def arm(accuracy: float = 0.05, **link: Any) -> dict[str, Any]:
    return scenes.arm(
        bar(**link),
        cycloidal(1, 0.2),
        damping={"ratio": 0.02, "frequencies": [50, 500]},
        analysis={"end_time": 0.2, "accuracy": accuracy},
    )


def polyline_bar(kind: str, points: list[list[float]]) -> dict[str, Any]:
    return {"kind": kind, "points": points, "width": 0.02, "thickness": 0.02}


def test_what_the_scene_states_stays() -> None:
    raw = arm(model="solid", mesh={"elements": [8, 2, 1]})
    raw["analysis"]["step"] = 1e-3
    plan = planned(scene_from(raw))
    link = plan.scene.links["arm"]
    assert (link.model, link.reduced, link.mesh.elements) == ("solid", False, (8, 2, 1))
    assert time_grid(plan.scene).steps == 200
    assert "the scene states all meshes; the run reports their error" in plan.notes


def test_a_plan_that_was_kept_leaves_title_fatigue_and_output_as_the_scene_has_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They are none of what it depends on: runs again with `csv = true`, or other material data, had the first's."""
    monkeypatch.setenv("KEDFEM_CACHE", str(tmp_path / "cache"))
    raw = arm(model="beam")
    first = planned(scene_from(raw, tmp_path / "here"))
    monkeypatch.setattr("kedfem.accuracy.plan.found_plan", lambda *_: pytest.fail("it is kept"))
    materials = {"steel": {"group": "steel", "tensile_strength": "500 MPa"}}
    more = {"title": "again", "output": {"csv": True, "animation": False}, "fatigue": {"materials": materials}}
    again = planned(scene_from(raw | more, tmp_path / "there"))
    assert again.scene.links == first.scene.links
    assert again.scene.analysis == first.scene.analysis
    assert (again.scene.title, again.scene.output.csv, again.scene.output.animation) == ("again", True, None)
    assert again.scene.fatigue is not None
    assert again.scene.folder == tmp_path / "there"


def test_links_whose_steps_in_full_would_be_dear_are_reduced_unless_they_or_the_step_are_stated(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """And the reduced run is the full one as near as it says."""
    monkeypatch.setattr("kedfem.accuracy.meshes.LARGE", 100)
    monkeypatch.setattr("kedfem.accuracy.meshes.DEAR", 1e4)

    def plan(analysis: dict[str, Any], **link: Any) -> Plan:
        raw = arm(model="solid", mesh={"elements": [8, 2, 1]}, **link)
        raw["analysis"] |= analysis
        return planned(scene_from(raw))

    chosen, full = plan({}), plan({}, reduction="none")
    assert chosen.scene.links["arm"].reduced
    assert any("arm: reduced, as " in note for note in chosen.notes)
    assert not full.scene.links["arm"].reduced
    assert not plan({"step": 1e-3}).scene.links["arm"].reduced
    ready, found = prepared(chosen.scene)
    assert found is not None
    errors = relative_errors(histories(ready), histories(prepared(full.scene)[0]))
    assert worst(errors) <= chosen.scene.analysis.reduction_tolerance == pytest.approx(0.005)


@pytest.mark.long
@pytest.mark.parametrize("name", ["four_bar", "slider_crank"])
def test_a_template_is_right_to_two_hundredths_as_it_stands(name: str, tmp_path: Path) -> None:
    """With mesh and step left open, as a newcomer runs it."""
    raw = tomllib.loads((files("kedfem") / "templates" / f"{name}.toml").read_text(encoding="utf-8"))
    raw["output"] = {"folder": str(tmp_path), "probes": raw["output"]["probes"]}
    run = analyse(scene_from(raw))
    assert run.plan is not None
    assert all(link.reduced or link.model == "rigid" for link in run.plan.scene.links.values())
    assert run.budget is not None
    assert max(run.budget.together.values()) < 0.02


def test_a_stated_step_that_is_too_long_is_said() -> None:
    raw = arm(accuracy=0.002)
    raw["analysis"]["step"] = 4e-3
    plan = planned(scene_from(raw))
    assert time_grid(plan.scene).steps == 50
    assert not plan.reached
    assert any(note.startswith("the scene states its step; its error is about") for note in plan.notes)
    assert "time step limits it" in plan.notes[-1]


def test_an_open_link_becomes_the_simplest_that_is_near_enough_and_shares_add_up() -> None:
    plan = planned(scene_from(arm()))
    assert plan.scene.links["arm"].model == "beam"  # slenderness 25: shear and ends change 1 %
    assert plan.scene.analysis.accuracy == "quick"
    assert plan.reached
    assert plan.error == pytest.approx(sum(share.error for share in plan.shares))
    assert sum((STEP, MESH, MODEL, REDUCTION)) == pytest.approx(1.0)
    assert all(share.error <= share.allowed for share in plan.shares)


def test_the_same_scene_has_the_same_plan() -> None:
    first, second = (planned(scene_from(arm())) for _ in range(2))
    assert first.scene.model_dump() == second.scene.model_dump()
    assert first.notes == second.notes
    assert [x.error for x in first.shares] == [x.error for x in second.shares]


@pytest.mark.parametrize("elements", [None, [8, 2, 1]])
def test_links_of_trials_are_those_of_the_run_and_not_made_again(
    elements: list[int] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    raw = arm(model="solid", **({"mesh": {"elements": elements}} if elements else {}))
    plan = planned(scene_from(raw))
    fresh = meshed(plan.scene).model.links
    monkeypatch.setattr("kedfem.links.build.bare_link", None)
    taken = meshed(plan.scene, known=plan.links).model.links
    for one, other in zip(fresh, taken, strict=True):
        assert (one.K0 != other.K0).nnz == 0
        assert np.array_equal(one.X, other.X)


def test_a_start_that_no_step_resolves_is_said() -> None:
    """Undamped from rest at full speed: joint forces hold all frequencies of the mesh."""
    raw = arm(accuracy=0.01)
    raw["drive"]["motion"] = {"kind": "constant_speed", "speed": 60}
    raw["analysis"] = {"revolutions": 0.5, "accuracy": 0.01, "rho_inf": 1.0}
    del raw["damping"]
    raw["gravity"] = [0, -9.81, 0]
    plan = planned(scene_from(raw))
    assert not plan.reached
    assert "could not be reached: time step limits it" in plan.notes[-1]
    assert any("vibration beyond them" in note for note in plan.notes)
    assert plan.finer <= 1.5  # no mesh helps then, so that none is tried in vain


@pytest.mark.long
def test_planar_polylines_sliders_and_spatial_scenes_are_planned() -> None:
    raw = arm()
    raw["links"]["arm"]["shape"] = polyline_bar("polyline", [[0, 0], [0.3, 0], [0.5, 0.1]])
    plan = planned(scene_from(raw))
    assert plan.reached
    assert plan.scene.links["arm"].model == "beam"
    raw = slider_crank("rigid")
    raw["analysis"] = {"revolutions": 0.25, "accuracy": 0.05, "initial": "quasi-static"}
    for name in ("crank", "rod"):
        del raw["links"][name]["model"], raw["links"][name]["mesh"]
    plan = planned(scene_from(raw))
    assert plan.scene.links["piston"] == scene_from(raw).links["piston"]
    raw = arm()
    raw["gravity"] = [0, 0, -9.81]  # out of the plane
    plan = planned(scene_from(raw))
    assert plan.scene.links["arm"].model in {"beam", "solid"}
    assert plan.reached


def test_frames_follow_beams_in_space_that_bend_far() -> None:
    """The arm bends by 4.5 % of its length, which rigid-body frames cannot have; linear strains would lock."""
    raw = whipped("spatial", 2)
    raw["links"]["arm"]["shape"]["up"] = [0, 0, 1]
    del raw["analysis"]["frames"]
    raw["analysis"] |= {"accuracy": 0.02}
    plan = planned(scene_from(raw))
    assert plan.scene.analysis.frames == "co-rotational"
    assert any("frames are co-rotational" in note for note in plan.notes)


def test_trials_that_differ_in_the_step_share_their_model() -> None:
    raw = arm()
    trials = Trials(0.05, lambda name: None)
    scene = scene_from({**raw, "analysis": {"end_time": 0.2, "step": 1e-3}})
    other = scene_from({**raw, "analysis": {"end_time": 0.2, "step": 5e-4}})
    assert trials.ready(scene).model is trials.ready(other).model
    assert len(trials.links) == len(trials.models) == 1
    assert len(trials.run(other).time) == 401


def test_functions_of_an_unchanged_link_are_found_once() -> None:
    raw = four_bar("bar", revolutions=0.25, initial="quasi-static")
    for link in raw["links"].values():
        link["mesh"] = {"elements": [8, 2, 1]}
    trials = Trials(0.05, lambda name: None)
    first = trials.ready(scene_from(raw)).model
    raw["links"]["crank"]["mesh"] = {"elements": [10, 2, 1]}
    second = trials.ready(scene_from(raw)).model
    assert len(trials.links) == 4
    old, new = first.links[1], second.links[1]
    assert new.full is not None
    assert second.links[0].n != first.links[0].n or second.links[0].full is not first.links[0].full
    turned = old.Q.T @ (new.full.mass[0] @ new.Q)  # the same span: one basis is the other, turned
    np.testing.assert_allclose(turned.T @ turned, np.eye(new.n), rtol=0, atol=1e-10)


def test_check_shows_the_plan(tmp_path: Path) -> None:
    file = tmp_path / "scene.toml"
    file.write_text(TOML, encoding="utf-8")
    shown = CliRunner().invoke(app, ["check", str(file)], env={"COLUMNS": "200"})
    assert shown.exit_code == 0, shown.output
    for words in ("Accuracy asked for: 5 %", "time step", "simpler links", "reduced beam", "First frequency"):
        assert words in shown.output


TOML = """
[links.arm]
material = "steel"
shape = { kind = "bar", between = [[0, 0], [0.5, 0]], width = 0.02, thickness = 0.02 }
[joints]
A = { kind = "revolute", links = ["ground", "arm"], at = [0, 0] }
[drive]
joint = "A"
motion = { kind = "cycloidal", angle = 1, rise = 0.2 }
[damping]
ratio = 0.02
frequencies = [50, 500]
[analysis]
end_time = 0.2
accuracy = 0.05
"""


@pytest.mark.long
@pytest.mark.parametrize("name", ["swung arm", "four-bar of bars"])
def test_accuracy_is_kept(name: str) -> None:
    """Against solids with finer elements, shorter steps: docs/performance/accuracy.md has more."""
    done = kept(MECHANISMS[name], (0.05, 0.01))
    plans: list[Plan] = [each.plan for each in done]
    assert all(plan.reached for plan in plans)
    for each in done:
        assert each.within == 1.0
        assert max(each.errors.values()) < 1.5 * each.plan.error  # the estimate is no guess


def beams(speed: str, **analysis: Any) -> dict[str, Any]:
    """The source's four-bar with elements, step and frames left open."""
    raw = tomllib.loads((EXAMPLES / "four_bar_beams" / "scene.toml").read_text())
    raw["drive"]["motion"]["speed"] = speed
    raw["analysis"] = {"revolutions": 2, "initial": "quasi-static", **analysis}
    return raw


def test_at_60_rpm_frames_are_rigid_body_and_the_step_is_what_is_needed() -> None:
    """3,700 steps leave 0.13 % over two revolutions, 1,830 leave 0.29 % of the 0.3 % that the step may cost."""
    plan = planned(scene_from(beams("60 rpm")))
    assert plan.reached
    assert plan.scene.analysis.frames == "rigid-body"
    assert {link.element for link in plan.scene.links.values()} == {"beam5"}
    assert 1500 < time_grid(plan.scene).steps < 4500


def test_at_600_rpm_frames_follow_and_beams_of_five_nodes_are_few() -> None:
    """Three beam5 a link or four leave 0.3 % and less."""
    plan = planned(scene_from(beams("600 rpm")))
    assert plan.scene.analysis.frames == "co-rotational"
    assert all(link.element == "beam5" and link.mesh.elements <= 4 for link in plan.scene.links.values())
    assert any("rigid-body frames would be off by" in note for note in plan.notes)
    assert plan.reached


def test_a_scene_that_states_all_but_its_frames_has_no_other_trial() -> None:
    raw = beams("60 rpm", steps_per_revolution=90)
    for link in raw["links"].values():
        link["mesh"] = {"elements": 2}
    plan = planned(scene_from(raw))
    assert [share.what for share in plan.shares] == ["frames"]
    assert (time_grid(plan.scene).steps, plan.scene.links["crank"].element) == (180, "beam3")
    raw["analysis"]["frames"] = "rigid-body"
    assert plan_for(scene_from(raw)) is None
    assert plan_for(scene_from(beams("60 rpm", accuracy="quick"))) is None


def test_an_extrusion_is_written_and_read_again_without_a_warning() -> None:
    """Warnings are errors here: those of the library that writes scenes too."""
    scene = MECHANISMS["arm cut from plate"](0.05)
    assert scene_from(json.loads(scene.model_dump_json())).links == scene.links
