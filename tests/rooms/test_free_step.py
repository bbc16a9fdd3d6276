"""The step of scenes without a drive: what a plan chooses is within the accuracy of far shorter steps, or it says so."""

from typing import Any

import pytest

from kedfem.accuracy import free_step
from kedfem.accuracy.choices import chosen_step
from kedfem.accuracy.histories import histories, relative_errors, worst
from kedfem.accuracy.plan import STEP, plan_for
from kedfem.accuracy.prepared import meshed
from kedfem.accuracy.trials import Trials
from kedfem.accuracy.variants import with_steps
from kedfem.scene import scene_from, time_grid

ASKED = 0.01
PLANES = {"xy": (0, 1, 2), "yz": (1, 2, 0), "zx": (2, 0, 1)}


def chain(plane: str = "xy", links: int = 1, model: str = "beam", **analysis: Any) -> dict[str, Any]:
    """Bars of 0.4 m in a row, hinged to the ground and to each other, which fall from the horizontal; in any plane."""
    first, second, axis = PLANES[plane]

    def at(along: float, across: float = 0.0) -> list[float]:
        out = [0.0, 0.0, 0.0]
        out[first], out[second] = along, across
        return out

    def bar(k: int) -> dict[str, Any]:
        ends = [at(0.4 * k), at(0.4 * (k + 1))]
        shape: dict[str, Any] = {"kind": "polyline", "points": ends}
        mesh: dict[str, Any] = {"element": "beam5", "mesh": {"elements": 2}}
        if model == "solid":
            shape, mesh = {"kind": "bar", "between": ends}, {"mesh": {"elements": [4, 1, 1]}}
        return {"model": model, "material": "pom", "shape": {**shape, "width": 0.02, "thickness": 0.01}, **mesh}

    joints = {
        f"J{k}": {"kind": "revolute", "links": [f"a{k - 1}" if k else "ground", f"a{k}"], "at": at(0.4 * k)}
        | ({} if plane == "xy" else {"axis": "xyz"[axis]})
        for k in range(links)
    }
    return {
        "gravity": at(0.0, -9.81),
        "links": {f"a{k}": bar(k) for k in range(links)},
        "joints": joints,
        "damping": {"beta": 1e-4},
        "analysis": {"end_time": 0.3, **analysis},
        "output": {"probes": {
            "end": {"link": f"a{links - 1}", "at": at(0.4 * links), "quantity": "position"},
            "bent": {"link": "a0", "at": at(0.2), "quantity": "deflection"},
        }},
    }  # fmt: skip


def sprung(plane: str) -> dict[str, Any]:
    raw = chain(plane)
    end, above = raw["output"]["probes"]["end"]["at"], [0.0, 0.0, 0.0]
    above[PLANES[plane][0]], above[PLANES[plane][1]] = 0.4, 0.3
    ends = [{"link": "a0", "at": end}, {"link": "ground", "at": above}]
    raw["springs"] = {"s": {"kind": "spring", "between": ends, "stiffness": 500}}
    return raw


def motored(plane: str) -> dict[str, Any]:
    raw = chain(plane)
    raw["motors"] = {"m": {"joint": "J0", "torque": {"over": "speed", "at": [0, 20], "value": [3, 0]}}}
    return raw


def free(plane: str) -> dict[str, Any]:
    raw = chain(plane)
    del raw["joints"]
    return raw


SCENES = {
    "pendulum, xy": chain(), "pendulum, yz": chain("yz"), "pendulum, zx": chain("zx"),
    "double pendulum, xy": chain(links=2), "double pendulum, zx": chain("zx", 2),
    "spring, xy": sprung("xy"), "spring, yz": sprung("yz"), "motor, xy": motored("xy"), "motor, zx": motored("zx"),
    "free, xy": free("xy"), "solid": chain(model="solid"),
}  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize(("name", "asked"), [("pendulum, yz", 0.05), *((name, ASKED) for name in SCENES)])
def test_the_step_of_what_nothing_drives_is_within_the_accuracy_or_told(name: str, asked: float) -> None:
    """Against steps four times shorter than the chosen, in which at most a quarter or so of the error is left."""
    scene, search = scene_from(SCENES[name]), Trials(asked, lambda text: None)
    chosen, expected = chosen_step(search, scene, STEP * asked)
    fine = meshed(with_steps(chosen, 4 * time_grid(chosen).steps))
    true = worst(relative_errors(histories(meshed(chosen)), histories(fine)))
    if expected > STEP * asked:
        assert "the step's error stays at" in search.notes[0]
    else:
        assert true < 3 * expected + 1e-9


@pytest.mark.long
def test_a_chaotic_motion_is_told_and_not_claimed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(free_step, "FIRST", 100)
    monkeypatch.setattr(free_step, "MOST", 800)
    raw = chain(links=2, end_time=3.0, initial_speeds={"J0": 20.0})
    plan = plan_for(scene_from(raw))
    assert plan is not None
    assert not plan.reached
    assert any("agree within 1 % until t = " in note for note in plan.notes)
    assert any("time step limits it" in note for note in plan.notes)


def test_differences_that_do_not_fall_promise_nothing() -> None:
    halved = free_step.finest_error
    assert halved([0.16, 0.04, 0.01]) == pytest.approx(0.01 / 3)
    assert halved([0.01, 0.01, 0.01]) == 0.01
    assert halved([0.1, 0.3, 0.001]) == 0.3
    assert halved([1e-4, 1e-5]) == 1.0


def test_a_solid_that_moves_freely_has_its_step_chosen_and_keeps_its_mesh(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(free_step, "FIRST", 100)
    monkeypatch.setattr(free_step, "MOST", 800)
    scene = scene_from(chain(model="solid", end_time=0.05))
    plan = plan_for(scene)
    assert plan is not None
    assert plan.scene.links == scene.links
    assert plan.scene.analysis.step is not None
    assert [share.what for share in plan.shares] == ["time step"]
    assert plan_for(scene_from(chain(model="solid", end_time=0.05, step=1e-4))) is None
