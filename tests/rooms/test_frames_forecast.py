"""What the trial of a plan says of rigid-body frames is what the run itself says, and what co-rotational frames show."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.accuracy.choices import chosen_frames, frames_allowed, open_beams, with_beams
from kedfem.accuracy.geometric import GeometricError
from kedfem.accuracy.histories import Histories, histories, relative_errors, worst
from kedfem.accuracy.plan import Plan, Share
from kedfem.accuracy.prepared import meshed
from kedfem.accuracy.trials import Trials
from kedfem.scene import scene_from
from kedfem.tables.run import plan_tables

LENGTH, ANGLE = 1.6, np.radians(18)


def lift(slot: bool, **analysis: Any) -> dict[str, Any]:
    """A scissor lift with a cylinder between its arms; its platform, with 800 kg above it, is a beam in space.

    The upper end of one arm is a pin in a slot of the platform, or turns in a block that slides along it.
    """
    c, s = LENGTH * np.cos(ANGLE), LENGTH * np.sin(ANGLE)
    A, R, D, S, E = [0, 0], [c, 0], [0, s], [c, s], [1.6, s]
    M = np.array([c, s]) / 2
    P = M - 0.35 * np.array([np.cos(ANGLE), np.sin(ANGLE)])
    Q = M + 0.55 * np.array([-np.cos(ANGLE), np.sin(ANGLE)])

    def beam(a: Any, b: Any, width: float, thickness: float) -> dict[str, Any]:
        section = {"kind": "box", "width": width, "thickness": thickness, "wall": 0.005}
        shape = {"kind": "polyline", "points": [list(a), list(b)], "section": section}
        return {"model": "beam", "material": "steel", "shape": shape}

    def round_bar(a: Any, b: Any) -> dict[str, Any]:
        section = {"kind": "round", "diameter": 0.06}
        return {
            "model": "rigid",
            "material": "steel",
            "shape": {"kind": "polyline", "points": [list(a), list(b)], "section": section},
        }

    def hinge(a: str, b: str, at: Any) -> dict[str, Any]:
        return {"kind": "revolute", "links": [a, b], "at": list(at)}

    links = {
        "arm1": beam(A, S, 0.1, 0.06), "arm2": beam(R, D, 0.1, 0.06), "platform": beam(D, E, 0.08, 0.2),
        "barrel": round_bar(P, P + 0.7 * (Q - P)), "piston": round_bar(P + 0.3 * (Q - P), Q),
        "roller": {"model": "rigid", "mass": 5},
    }  # fmt: skip
    joints: dict[str, Any] = {
        "A": hinge("ground", "arm1", A), "M": hinge("arm1", "arm2", M), "D": hinge("arm2", "platform", D),
        "R": hinge("arm2", "roller", R), "P": hinge("arm1", "barrel", P), "Q": hinge("arm2", "piston", Q),
        "floor": {"kind": "prismatic", "links": ["roller", "ground"], "at": R, "axis": "x"},
        "cylinder": {
            "kind": "prismatic", "links": ["piston", "barrel"], "at": list((P + Q) / 2),
            "axis": [*(Q - P) / np.linalg.norm(Q - P), 0],
        },
    }  # fmt: skip
    if slot:
        joints["S"] = {"kind": "slot", "links": ["arm1", "platform"], "at": S, "axis": "x"}
    else:
        links["block"] = {"model": "rigid", "mass": 0.01, "centre": S, "inertia": [0.1, 0.1, 0.1, 0, 0, 0]}
        joints["S"] = hinge("arm1", "block", S)
        joints["track"] = {"kind": "prismatic", "links": ["block", "platform"], "at": S, "axis": "x"}
    return {
        "gravity": [0, -9.81],
        "links": links,
        "joints": joints,
        "bodies": {
            "payload": {
                "kind": "rigid_body", "link": "platform", "at": [0.7, s], "mass": 800,
                "inertia": [60, 100, 60, 0, 0, 0], "centre": [0.7, s + 0.4],
            }
        },
        "drive": {"joint": "cylinder", "motion": {"kind": "polynomial", "travel": 0.25, "rise": 4}},
        "damping": {"ratio": 0.02, "frequencies": [5, 200]},
        "analysis": {"end_time": 0.5, "initial": "quasi-static", **analysis},
        "output": {"probes": {"deck": {"link": "platform", "at": [0.7, s], "quantity": "deflection"}}},
    }  # fmt: skip


def ran(raw: dict[str, Any]) -> tuple[Histories, float]:
    """A run with two beam5 between joints, and what it estimates of its frames."""
    scene = scene_from(raw)
    ready = meshed(with_beams(scene, open_beams(scene), ("beam5", 2)))
    found = GeometricError(ready.model)
    return histories(ready, look=found.add), found.worst


def test_a_forecast_of_rigid_body_frames_is_what_the_run_says() -> None:
    """The trial's links are reduced, the slopes of the platform too; 740 % had been forecast of 1 %."""
    raw = lift(slot=True, end_time=4.5)
    scene, forecast = chosen_frames(Trials(0.1, lambda name: None), scene_from(raw))
    assert scene.analysis.frames == "rigid-body"
    _, estimate = ran(lift(slot=True, end_time=4.5, step=0.0125))
    assert_allclose(forecast, estimate, rtol=0.05)


@pytest.mark.long
def test_rigid_body_frames_of_a_lift_are_off_by_what_is_estimated() -> None:
    """With a slot as with a slide and a hinge, of which co-rotational frames know the truth: 0.6 %.

    These find the same with both: 0.06 %.
    """
    truth, _ = ran(lift(slot=False, frames="co-rotational", step=0.005))
    assert worst(relative_errors(ran(lift(slot=True, frames="co-rotational", step=0.005))[0], truth)) < 1e-3
    for slot in (True, False):
        found, estimate = ran(lift(slot, frames="rigid-body", step=0.005))
        assert 0.5 < estimate / worst(relative_errors(found, truth)) < 2


def test_errors_in_tables_are_percent_of_a_sensible_size() -> None:
    scene = scene_from(lift(slot=True))
    share = Share("frames", 7.4, frames_allowed(Trials(0.01, lambda name: None), scene))
    budget = plan_tables(Plan(scene, 0.01, 1.0, (share, replace(share, what="mesh", error=0.0013)), ()))[0]
    assert list(budget.columns[1].cells) == ["over 100 %", "0.13 %", "over 100 %"]
    assert list(budget.columns[2].cells) == ["0.5 %", "0.5 %", "1 %"]  # of beams half of what is asked for
