"""Co-rotational frames where they cannot be had: what is refused, and in which words."""

from typing import Any

import pytest

from kedfem.accuracy.prepared import meshed
from kedfem.errors import KedfemError
from kedfem.scene import scene_from
from tests import scenes
from tests.scenes import bar, constant_speed


def arm(**analysis: Any) -> dict[str, Any]:
    """A solid bar on a drive, four elements long."""
    analysis = {"end_time": 0.1, "step": 1e-3, "frames": "co-rotational", **analysis}
    return scenes.arm(bar(mesh={"elements": [4, 1, 1]}), constant_speed(10), analysis=analysis)


def fault(raw: dict[str, Any]) -> str:
    with pytest.raises(KedfemError) as found:
        meshed(scene_from(raw))
    return str(found.value)


def test_a_link_without_mass() -> None:
    raw = arm()
    raw["materials"] = {"air": {"density": 0, "youngs_modulus": 2e11, "poisson_ratio": 0.3}}
    raw["links"]["arm"]["material"] = "air"
    assert fault(raw) == "materials.air.density: must be positive [kg/m^3], got 0"


def test_a_rigid_slider_has_no_frames_of_its_own() -> None:
    raw = arm()
    raw["links"]["shoe"] = {"model": "rigid", "mass": 0.3, "frames": "co-rotational"}
    raw["joints"]["B"] = {"kind": "revolute", "links": ["arm", "shoe"], "at": [0.5, 0]}
    raw["joints"]["S"] = {"kind": "prismatic", "links": ["shoe", "ground"], "at": [0.5, 0], "axis": "x"}
    assert "links.shoe.frames: must be left out for a rigid link without a shape, got 'co-rotational'" in fault(raw)


def test_segments_finer_than_the_mesh() -> None:
    raw = arm()
    raw["links"]["arm"]["segments"] = 6
    said = fault(raw)
    assert said.startswith("links.arm.segments: must be at most ")
    assert said.endswith("got 6; take a finer mesh")


def test_a_start_that_the_joints_do_not_allow() -> None:
    """The speed asked for is across the slide."""
    raw = arm()
    del raw["drive"]
    raw["analysis"]["initial_motions"] = {"arm": {"at": [0, 0], "velocity": [1, 0]}}
    said = fault(raw)
    assert said.startswith("analysis: the joints must allow the speeds at the start together, got ")
    assert "analysis.initial_motions.arm.velocity along x = 1 m/s (closest possible 0)" in said


def test_a_speed_at_the_start_of_the_joint_that_is_driven() -> None:
    said = fault(arm(initial_speeds={"A": 3}))
    assert said == "analysis.initial_speeds.A: must be of a joint that the drive does not move, got 'A'"


def test_stiffening_beside_frames_that_follow() -> None:
    assert fault(arm(stiffening=True)) == (
        "analysis.stiffening: must be combined with rigid-body frames (co-rotational ones know all of it), "
        "got it with co-rotational frames: leave stiffening out"
    )
