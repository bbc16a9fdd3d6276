"""Springs, motors and limits count the revolutions of their joints, or time points that are too far apart are refused."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.analysis import analyse
from kedfem.errors import MotionError
from kedfem.kinematics import kinematics
from kedfem.scene import scene_from
from tests.laws.test_limits import AXES
from tests.moving import beam_in_space, channels, ran
from tests.spatial_joints import rigid_in_space

Raw = dict[str, Any]
RATIO, STIFFNESS = -3.0, 0.2


def geared(n: np.ndarray, steps: int, frames: str = "rigid-body", kind: str = "static", **more: Any) -> Raw:
    """A rigid crank turns a wheel three times as fast, which a torsion spring holds back; all about one direction."""
    d = np.cross(n, [0.3, 0.5, 0.9])
    d /= np.linalg.norm(d)
    away, axis = 0.3 * d, n.tolist()
    wheel = beam_in_space(away.tolist(), (away + 0.1 * np.cross(n, d)).tolist(), 1)
    return {
        "links": {"crank": rigid_in_space(np.zeros(3), 0.1 * d), "wheel": wheel},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "crank"], "at": [0, 0, 0], "axis": axis},
                   "B": {"kind": "revolute", "links": ["ground", "wheel"], "at": away.tolist(), "axis": axis}},
        "gears": {"g": {"joints": ["A", "B"], "ratio": RATIO}},
        "springs": {"s": {"kind": "torsion", "joint": "B", "stiffness": STIFFNESS}},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 0.1}},
        "analysis": {"kind": kind, "revolutions": 0.5, "steps_per_revolution": steps, "accuracy": "quick",
                     "frames": frames},
        **more,
    }  # fmt: skip


CASES = [("x", "static", "rigid-body"), ("y", "quasi-static", "co-rotational"), ("z", "static", "co-rotational"),
         ("oblique", "quasi-static", "rigid-body")]  # fmt: skip


@pytest.mark.parametrize(("axis", "kind", "frames"), CASES)
def test_gears_of_a_rigid_crank_and_a_spring_that_is_wound_up_for_turns(axis: str, kind: str, frames: str) -> None:
    """T = i² k φ at the drive, of which gears bear all, and a moment of the hub that is the drive's torque alone."""
    values = channels(*ran(geared(AXES[axis], 8, frames, kind)))
    phi = 2 * np.pi * np.arange(5) / 8
    torque = RATIO**2 * STIFFNESS * phi
    assert_allclose(values["springs/s/angle"][:, 0], RATIO * phi, atol=1e-3)
    assert_allclose(values["springs/s/torque"][:, 0], -RATIO * STIFFNESS * phi, atol=1e-3 * torque[-1])
    for name in ("drive/torque", "drive/rigid_torque"):
        assert_allclose(values[name][:, 0], torque, atol=1e-3 * torque[-1])
    assert_allclose(values["gears/g/torque"][:, 0], -torque, atol=1e-3 * torque[-1])
    assert_allclose(values["joints/A/moment"], values["joints/A/rigid_moment"], atol=1e-3 * torque[-1])


@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
def test_turns_that_nobody_can_count_are_refused(frames: str, tmp_path: Path) -> None:
    """Three quarters of a turn forwards look like a quarter backwards: its spring would be wound up the other way."""
    scene = scene_from(geared(AXES["z"], 4, frames), tmp_path)
    said = r"springs.s: joint 'B' must rotate by less than 162 deg .* got 270 deg: take 1.7 times as many"
    for command in (analyse, kinematics):
        with pytest.raises(MotionError, match=said):
            command(scene)


def test_nothing_counts_turns_of_gears_alone(tmp_path: Path) -> None:
    """With rigid-body frames they need no count; with co-rotational ones they do."""
    kinematics(scene_from(geared(AXES["z"], 4, springs={}), tmp_path))
    with pytest.raises(MotionError, match=r"gears.g: joint 'B' must rotate by less"):
        kinematics(scene_from(geared(AXES["z"], 4, "co-rotational", springs={}), tmp_path))
