"""Signs as docs/conventions.md shows them, each in a small scene."""

from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from kedfem.scene import Joint
from tests.moving import channels, ran

Raw = dict[str, Any]
PAGE = Path(__file__).parents[2] / "docs" / "conventions.md"
WEIGHT = 0.4 * 0.02 * 0.03 * 7850 * 9.81
ROD = {"kind": "bar", "between": [[0, 0], [0.4, 0]], "width": 0.03, "thickness": 0.02}


def found(joint: Raw, speed: float | None, **more: Any) -> dict[str, np.ndarray]:
    """A rod along x from a joint with the ground at the origin; gravity along -y."""
    raw: Raw = {
        "gravity": [0, -9.81],
        "links": {"rod": {"model": "beam", "material": "steel", "shape": ROD, "mesh": {"elements": 2}}},
        "joints": {"A": {"at": [0, 0], **joint}},
        "analysis": {"kind": "static"},
        "output": {"probes": {
            "end": {"link": "rod", "at": [0.4, 0], "quantity": "position"},
            "middle": {"link": "rod", "at": [0.2, -0.015], "quantity": "stress"},
        }},
    }  # fmt: skip
    if speed is not None:
        raw["drive"] = {"joint": "A", "motion": {"kind": "constant_speed", "speed": speed}}
        raw["analysis"] |= {"end_time": 0.1, "step": 0.05}
    return channels(*ran({**raw, **more}))


def test_every_kind_of_joint_is_on_the_page() -> None:
    kinds = get_args(Joint.model_fields["kind"].annotation)
    assert len(kinds) > 5
    page = PAGE.read_text(encoding="utf-8")
    assert [kind for kind in kinds if f"| `{kind}` |" not in page] == []


@pytest.mark.parametrize("links", [["rod", "ground"], ["ground", "rod"]])
def test_a_drive_rotates_and_lifts_by_the_right_hand(links: list[str]) -> None:
    """Whichever link is named first: from x to y, with a positive torque, the joint pushing the rod up."""
    got = found({"kind": "revolute", "links": links}, 5.0)
    end = got["probes/end/position"]
    assert end[1, 1] > 0.05
    assert got["drive/torque"][0, 0] == pytest.approx(0.2 * WEIGHT, rel=1e-3)
    assert got["joints/A/force"][0, 1] == pytest.approx(WEIGHT, rel=1e-3)
    assert got["probes/middle/stress"][0, 0] < -1e4  # below, where its own weight presses it


@pytest.mark.parametrize("links", [["rod", "ground"], ["ground", "rod"]])
def test_a_slide_travels_along_its_axis(links: list[str]) -> None:
    got = found({"kind": "prismatic", "links": links, "axis": "y"}, 0.2)
    assert got["probes/end/position"][-1, 1] > 0.01
    assert got["drive/force"][0, 0] == pytest.approx(WEIGHT, rel=1e-3)


def test_springs_push_back_and_pull_in_tension() -> None:
    """A rod that sags on a torsion spring, and on a spring from above its end."""
    hinge = {"kind": "revolute", "links": ["rod", "ground"]}
    torsion = {"kind": "torsion", "joint": "A", "stiffness": 2000.0}
    got = found(hinge, None, springs={"s": torsion})
    assert got["springs/s/angle"][0, 0] == pytest.approx(-0.2 * WEIGHT / 2000, rel=1e-2)
    assert got["springs/s/torque"][0, 0] == pytest.approx(0.2 * WEIGHT, rel=1e-2)
    line = {"kind": "spring", "stiffness": 1e5,
            "between": [{"link": "rod", "at": [0.4, 0]}, {"link": "ground", "at": [0.4, 0.3]}]}  # fmt: skip
    got = found(hinge, None, springs={"s": line})
    assert got["springs/s/force"][0, 0] == pytest.approx(0.5 * WEIGHT, rel=1e-2)
    assert got["springs/s/length"][0, 0] > 0.3


@pytest.mark.parametrize(("key", "gravity", "sign"), [("lower", -9.81, 1.0), ("upper", 9.81, -1.0)])
def test_a_stop_pushes_the_coordinate_back_between_its_limits(key: str, gravity: float, sign: float) -> None:
    """It bears the moment of the weight about the hinge, m g L/2."""
    stop = {"kind": "angle", "joint": "A", key: 0.0, "stiffness": 1e7}
    hinge = {"kind": "revolute", "links": ["rod", "ground"]}
    run = found(hinge, None, gravity=[0, gravity], limits={"stop": stop})
    assert run["limits/stop/torque"][-1] == pytest.approx(sign * WEIGHT * 0.2, rel=1e-4)


def test_gears_that_lift_a_rod_exert_a_positive_torque_on_it() -> None:
    """The moment of the weight about the hinge, m g L/2, as in a drive on the hinge itself."""
    wheel = {"shape": {**ROD, "between": [[1, 0], [1.4, 0]]}, "model": "rigid", "material": "steel"}
    links = {"rod": {"model": "beam", "material": "steel", "shape": ROD, "mesh": {"elements": 2}}, "wheel": wheel}
    joints = {"A": {"at": [0, 0], "links": ["rod", "ground"], "kind": "revolute"},
              "B": {"at": [1, 0], "links": ["wheel", "ground"], "kind": "revolute"}}  # fmt: skip
    drive = {"joint": "B", "motion": {"kind": "constant_speed", "speed": -1.0}}
    analysis = {"kind": "static", "end_time": 0.1, "step": 0.05}
    gears = {"pair": {"joints": ["A", "B"], "ratio": -1.0}}
    run = found({}, None, links=links, joints=joints, drive=drive, analysis=analysis, gears=gears)
    assert run["probes/end/position"][-1, 1] > 0.03
    assert run["gears/pair/torque"][0] == pytest.approx(WEIGHT * 0.2, rel=1e-4)
