"""Speeds at the start where a drive begins away from the reference position: those of the same scene drawn there."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from kedfem.accuracy.prepared import moving
from kedfem.errors import MotionError
from kedfem.motion.initial import initial_twists
from kedfem.scene import scene_from
from tests.runs import ran

AXIS = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
P, TIP = np.array([0.2, 0.1, -0.1]), np.array([0.35, 0.05, 0.0])
SPEED, RATE, BEGUN = 0.7, 1.75, 0.8  # of the joint [m/s or rad/s], of the drive [rad/s], where it begins [rad]
KINDS = ("revolute", "prismatic", "cylindrical", "screw", "slot")


def arm_with(kind: str, drawn: float, order: tuple[str, str], **asked: Any) -> dict[str, Any]:
    """A driven arm with another body on a joint, drawn where the drive is at an angle, begun at BEGUN."""
    R = Rotation.from_rotvec(drawn * AXIS).as_matrix()
    axis = (R @ [0.6, 0.0, 0.8]).tolist()
    joint: dict[str, Any] = {"kind": kind, "links": list(order), "at": (R @ P).tolist(), "axis": axis}
    if kind == "screw":
        joint["lead"] = 0.3
    body = {"model": "rigid", "mass": 1.0, "inertia": [0.02, 0.02, 0.02, 0, 0, 0]}
    times = np.linspace(0, 0.1, 4)
    return {
        "links": {"arm": {**body, "centre": (R @ P).tolist()}, "tool": {**body, "centre": (R @ TIP).tolist()}},
        "joints": {
            "A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0, 0], "axis": AXIS.tolist()},
            "B": joint,
        },
        "drive": {
            "joint": "A",
            "motion": {"kind": "curve", "time": times.tolist(), "value": (BEGUN - drawn + RATE * times).tolist()},
        },
        "analysis": {"end_time": 0.01, "step": 0.001, "frames": "co-rotational", "accuracy": "quick", **asked},
    }


@pytest.mark.parametrize("order", [("tool", "arm"), ("arm", "tool")], ids=lambda x: x[0])
@pytest.mark.parametrize("kind", KINDS)
def test_speeds_of_joints_are_those_of_the_scene_drawn_where_the_drive_begins(kind: str, order: tuple[str, str]) -> None:
    """Of the first link against the second; of a slot its pin, which then moves along the line of the other link."""
    speeds = {"initial_speeds": {"B": SPEED}}
    here, there = (ran(arm_with(kind, drawn, order, **speeds)) for drawn in (0.0, BEGUN))
    R = Rotation.from_rotvec(BEGUN * AXIS).as_matrix()
    assert_allclose(here.position("tool", TIP), there.position("tool", R @ TIP), atol=1e-9)  # m: of steps that converge
    ready = there.ready
    v, omega = initial_twists(ready.scene, ready.linkage, ready.path)
    k, other = (ready.linkage.bodies.index(link) for link in order)
    axis, at = np.array(ready.scene.joints["B"].axis), np.array(ready.scene.joints["B"].at)
    apart = v[k] - v[other] + np.cross(omega[k] - omega[other], at)
    turns = axis @ (omega[k] - omega[other])
    assert (turns if kind in {"revolute", "screw"} else axis @ apart) == pytest.approx(SPEED, rel=1e-9)


@pytest.mark.parametrize("drawn", [0.0, BEGUN])
def test_motions_of_links_are_those_beside_the_ground_with_the_drive_moving(drawn: float) -> None:
    """The arm moves at RATE; the tool on its ball is asked for a rotation in the world, and has that."""
    R = Rotation.from_rotvec(drawn * AXIS).as_matrix()
    asked = [1.0, -2.0, 0.5]
    raw = arm_with(
        "spherical", drawn, ("tool", "arm"), initial_motions={"tool": {"at": (R @ P).tolist(), "angular_velocity": asked}}
    )
    del raw["joints"]["B"]["axis"]
    run = ran(raw)
    first = run.blocks[0]
    body = run.ready.linkage.bodies.index("tool")
    now = Rotation.from_rotvec((BEGUN - drawn) * AXIS).as_matrix()
    rates = [
        first.motion.velocity(body, R @ x)[0] + run.displaced("tool", R @ x, "v")[0] for x in (P, TIP)
    ]  # of the ball and of the tip, in the world
    assert_allclose(rates[0], np.cross(RATE * AXIS, now @ R @ P), atol=1e-9)
    assert_allclose(rates[1] - rates[0], np.cross(asked, now @ R @ (TIP - P)), atol=1e-9)


def test_a_speed_against_the_drive_is_refused_with_what_is_possible() -> None:
    """The tool slides on the driven arm and turns as this does, about z at RATE times the axis' z component, 0.808."""
    raw = arm_with("prismatic", 0.0, ("tool", "arm"))
    raw["analysis"]["initial_motions"] = {"tool": {"at": [0, 0, 0], "angular_velocity": [0, 0, 0]}}
    with pytest.raises(MotionError, match=r"angular_velocity along z = 0 rad/s \(closest possible 1\.41421\)"):
        moving(scene_from(raw))
