"""The time step against what moves: local errors, first frequencies, harmonics of the drive."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.accuracy.prepared import meshed
from kedfem.accuracy.reduction import prepared
from kedfem.accuracy.resolution import StepError, local_error, resolution, resolution_warnings, resonances, step_error
from kedfem.dynamics.stepping.scheme import generalised_alpha
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.scene import scene_from
from kedfem.tables.check import resolution_table
from tests import scenes
from tests.scenes import bar, constant_speed, material

L, B, H, E, RHO = 0.5, 0.02, 0.01, 2.1e11, 7850.0  # an arm [m], B along z, of steel
FIRST = 1.8751040687**2 / (2 * np.pi * L**2) * np.sqrt(E * H**2 / 12 / RHO)  # Euler-Bernoulli's cantilever [Hz]


def arm(model: str, **analysis: Any) -> dict[str, Any]:
    elements: dict[str, Any] = {"beam": 8, "solid": [12, 1, 1], "plane": [12, 1]}
    return scenes.arm(
        bar(L, H, B, model=model, mesh={"elements": elements[model]}),
        constant_speed(20),
        materials={"steel": material(RHO, E)},
        gravity=[0, -9.81, 0],
        analysis={"revolutions": 1, "steps_per_revolution": 720, **analysis},
    )


@pytest.mark.parametrize("model", ["beam", "solid", "plane"])
@pytest.mark.parametrize("reduced", [False, True])
def test_an_arm_vibrates_as_a_cantilever(model: str, reduced: bool) -> None:
    raw = arm(model)
    if reduced:
        raw["links"]["arm"]["reduction"] = 12
    found = resolution(prepared(scene_from(raw))[0])
    assert found is not None
    assert_allclose(found.first, FIRST, rtol=0.01)  # shear, and the mean held at the root instead of all of it


def test_steps_in_a_period_are_counted_and_too_few_are_said() -> None:
    turn = 2 * np.pi / 20
    for per_period, said in ((8, True), (40, False)):
        steps = round(per_period * FIRST * turn)
        found = resolution(meshed(scene_from(arm("beam", steps_per_revolution=steps))))
        assert found is not None
        assert_allclose(found.steps_per_period, per_period, rtol=0.02)
        assert ["steps in a period" in x for x in resolution_warnings(found)] == [True] * said
        assert not resolution_warnings(found, 0.002)  # what it does not follow is that little
        assert ["error is estimated to be 10 %: vibration is not" in x for x in resolution_warnings(found, 0.1)] == [
            True
        ] * said


def test_a_harmonic_that_meets_the_first_frequency_is_said() -> None:
    raw = arm("beam")
    for speed, met in ((FIRST / 3, [3]), (FIRST / 3 * 1.1, []), (FIRST / 6, [])):
        raw["drive"]["motion"]["speed"] = 2 * np.pi * speed
        found = resolution(meshed(scene_from(raw)))
        assert found is not None
        assert [x.harmonic for x in found.resonances] == met
        assert ["harmonic 3 " in x for x in resolution_warnings(found)] == [True] * len(met)


def test_a_frequency_that_changes_over_the_turn_is_met_between_poses() -> None:
    first, angles = np.array([10.0, 16.0, 13.0]), np.array([0.0, 2.0, 4.0])
    assert [(x.harmonic, x.angle) for x in resonances(first, angles, 6.0)] == [(2, 0.0)]  # 12 Hz, from 10 to 16
    assert [x.harmonic for x in resonances(first, angles, 3.0)] == [4, 5]
    assert resonances(first, angles, 0.0) == []


@pytest.mark.parametrize("rho_inf", [1.0, 0.9, 0.5, 0.0])
def test_the_constant_is_of_the_error_that_a_step_makes(rho_inf: float) -> None:
    """x'' = −x exactly for long, then one step of Newmark's formula with accelerations of the method: h³ x''' C."""
    h, t = 1e-2, 0.7
    s = generalised_alpha(h, rho_inf)
    shift = (s.alpha_m - s.alpha_f) * h
    a0, a1 = -np.cos(t + shift), -np.cos(t + h + shift)
    stepped = np.cos(t) - h * np.sin(t) + h**2 * ((0.5 - s.beta) * a0 + s.beta * a1)
    # the method's rate differs from the exact one too, by terms of its own second order, (γ − ½ + θ) = 0 of first
    assert_allclose(stepped - np.cos(t + h), local_error(s) * (a1 - a0), rtol=0.05)


@pytest.mark.parametrize("rho_inf", [0.9, 0.5])
def test_error_of_a_step_is_that_of_a_swinging_mass(rho_inf: float) -> None:
    """Let go under its weight it swings by u (1 − cos ω t), up to 2 u: a step errs by ω³ h³ (1 + 3 θ²)/12 of u."""
    raw = arm("beam")
    raw["drive"]["motion"]["speed"] = 0.1
    raw["bodies"] = {"tip": {"kind": "point_mass", "link": "arm", "at": [L, 0], "mass": 100.0}}
    ready = meshed(scene_from(raw))
    first = resolution(ready)
    assert first is not None
    h = 1 / (40 * first.first[0])
    raw["analysis"] = {"end_time": 40 * h, "step": h, "rho_inf": rho_inf}
    ready = meshed(scene_from(raw))
    watcher: StepError = step_error(ready)
    solver = steps_of(ready.scene, ready.model)
    for block in transient(ready.scene, ready.linkage, ready.path, ready.model, solver):
        watcher.add(block)
    theta = (1 - rho_inf) / (1 + rho_inf)  # |α_m − α_f|
    wanted = (2 * np.pi / 40) ** 3 * (1 + 3 * theta**2) / 12 / 2
    assert_allclose(watcher.relative, wanted, rtol=0.05)  # the arm's own mass, and 40 steps see no maximum exactly


def test_positions_have_no_steps_in_a_period() -> None:
    for kind, said in (("quasi-static", False), ("transient", True)):
        ready = meshed(scene_from(arm("beam", kind=kind)))
        found = resolution(ready)
        assert found is not None
        rows = [str(cell) for cell in resolution_table(found, ready.scene).columns[0].cells]
        assert ("steps in a period" in rows) is said
