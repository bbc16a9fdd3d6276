"""Scenes without a drive from file to the first step: what they are checked for, the state that they start from."""

import re
import tomllib
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from kedfem.accuracy.prepared import Prepared, meshed
from kedfem.accuracy.resolution import resolution, stability_warning
from kedfem.dynamics.joints.attachments import interface_matrix
from kedfem.dynamics.loads import applied
from kedfem.dynamics.rigid_body import drive_range, forcings, motions
from kedfem.dynamics.stepping.start import initial_rates
from kedfem.errors import MeshError, SceneError
from kedfem.links.record import as_rows, mass_times
from kedfem.motion.rigid import resting
from kedfem.scene import (
    corotational,
    corotational_links,
    link_frames,
    read_scene,
    revolution_steps,
    scene_from,
    time_grid,
)
from kedfem.stepping import frame_steps
from kedfem.tables import check_tables, moment
from tests.scenes import arm, bar

ARM = """
gravity = [0, -9.81]
[links.arm]
model = "beam"
material = "aluminium"
shape = { kind = "bar", between = [[0, 0], [0.6, 0]], width = 0.01, thickness = 0.02 }
mesh = { elements = 2 }
[links.shoe]
model = "rigid"
mass = 0.3
[joints.A]
kind = "revolute"
links = ["ground", "crank"]
at = [0, 0.2]
[links.crank]
model = "rigid"
material = "steel"
shape = { kind = "polyline", points = [[0, 0.2], [0, 0]], width = 0.01, thickness = 0.02 }
[joints.B]
kind = "revolute"
links = ["crank", "arm"]
at = [0, 0]
[joints.C]
kind = "revolute"
links = ["arm", "shoe"]
at = [0.6, 0]
[joints.S]
kind = "prismatic"
links = ["shoe", "ground"]
at = [0.6, 0]
axis = "x"
[motors.m]
joint = "A"
torque = { over = "speed", at = [0, 20], value = [5, 0] }
[springs.s]
kind = "spring"
between = [{ link = "shoe", at = [0.6, 0] }, { link = "ground", at = [1, 0] }]
stiffness = 200
[springs.t]
kind = "torsion"
joint = "B"
damping = 0.01
[analysis]
end_time = 0.5
step = 0.0011
initial_speeds = { A = "60 rpm" }
[output.animation]
frames_per_revolution = 20
"""


def prepared(**change: Any) -> Prepared:
    return meshed(scene_from(tomllib.loads(ARM) | change))


def test_frames_are_following_unless_a_drive_or_the_scene_says_otherwise() -> None:
    scene = scene_from(tomllib.loads(ARM))
    assert scene.analysis.frames == "co-rotational"
    assert corotational(scene)
    assert corotational_links(scene) == {"arm", "crank", "shoe"}
    raw = tomllib.loads(ARM)
    for key in ("motors", "springs"):
        del raw[key]
    raw["drive"] = {"joint": "A", "motion": {"kind": "constant_speed", "speed": 6}}
    del raw["analysis"]["initial_speeds"]
    driven = scene_from(raw)
    assert driven.analysis.frames == "rigid-body"
    assert not corotational(driven)
    raw["links"]["arm"]["frames"] = "co-rotational"
    assert corotational_links(scene_from(raw)) == {"arm"}
    raw["analysis"]["frames"] = "co-rotational"
    raw["links"]["arm"]["frames"] = "rigid-body"
    assert {x: link_frames(scene_from(raw), x) for x in ("arm", "crank")} == {
        "arm": "rigid-body",
        "crank": "co-rotational",
    }


def test_what_is_filled_in_reads_back_equal() -> None:
    scene = scene_from(tomllib.loads(ARM))
    assert type(scene).model_validate_json(scene.model_dump_json()) == scene


def test_time_and_frames_are_counted_over_the_whole_analysis() -> None:
    scene = scene_from(tomllib.loads(ARM))
    grid = time_grid(scene)
    assert (grid.steps, grid.end) == (455, pytest.approx(0.5))
    assert revolution_steps(scene) is None
    steps = frame_steps(scene)
    assert (len(steps), steps[0], steps[-1]) == (21, 0, 455)
    assert drive_range(scene) == (0.0, 0.0)
    assert moment(scene, 0.0123, 0.0) == "12.3 ms"
    assert stability_warning(scene) == ()


def test_the_rigid_body_motion_rests_and_loads_are_those_of_the_drawn_position() -> None:
    ready = prepared()
    scene, model = ready.scene, ready.model
    assert sum(len(m.t) for _, m in motions(scene, ready.linkage, ready.path)) == time_grid(scene).steps
    still = resting(len(ready.linkage.bodies), np.array([0.1, 0.2]))
    for link, loads, forcing in zip(model.links, model.loads, forcings(model, still), strict=True):
        gravity = link.m1 * as_rows(link, np.array([0, -9.81, 0]))
        np.testing.assert_allclose(forcing.F, [gravity, gravity], rtol=1e-12, atol=1e-15)
        np.testing.assert_array_equal(applied(link, loads, still, 1), forcing.F)
    assert not model.prescribed
    assert resolution(ready) is None  # it is free to move: K has no frequencies above zero to look for


def test_links_start_with_velocities_that_close_the_joints() -> None:
    """Crank 0.2 m at ω: the arm, drawn along the slide, moves along itself with ω · 0.2 and does not turn."""
    ready = prepared()
    links, joints = ready.model.links, ready.model.joints
    rates = initial_rates(ready.scene, ready.linkage, ready.path, ready.model)
    arm = [link.name for link in links].index("arm")
    np.testing.assert_allclose(rates[arm], np.outer(links[arm].one, [0.2 * 2 * np.pi, 0, 0]), atol=1e-12)
    ports = [joint.weights @ rate[joint.nodes] for joint, rate in zip(joints, rates, strict=True)]
    held = np.concatenate([x.ravel()[joint.keep] for x, joint in zip(ports, joints, strict=True)])
    B = interface_matrix(joints).toarray()
    z = np.linalg.lstsq(B, held)[0]
    np.testing.assert_allclose(B @ z, held, atol=1e-12)


@pytest.mark.parametrize("kind", ["beam", "plane", "solid", "rigid"])
def test_the_energy_at_the_start_is_that_of_a_rigid_bar(kind: str) -> None:
    """½ J ω² of a bar about its end, J = m (4 L² + h²)/12."""
    raw = arm(bar(0.6, 0.03, 0.02, model=kind) | {"material": "aluminium"}, None)
    raw["analysis"] = {"end_time": 1, "step": 0.01, "initial_speeds": {"A": 3}}
    ready = meshed(scene_from(raw))
    rates, links = initial_rates(ready.scene, ready.linkage, ready.path, ready.model), ready.model.links
    m = sum(float(link.one @ link.m1[:, 0]) for link in links)
    energy = 0.5 * sum(float(np.vdot(v, mass_times(x.mass, v))) for v, x in zip(rates, links, strict=True))
    assert energy == pytest.approx(0.5 * m * (4 * 0.6**2 + 0.03**2) / 12 * 3**2, rel=1e-9)


def test_a_scene_without_any_joint_can_be_built() -> None:
    raw = {
        "links": {"arm": bar(1, 0.03, 0.02, model="beam", mesh={"elements": 3})},
        "analysis": {"end_time": 1, "step": 0.01,
                     "initial_motions": {"arm": {"at": [0.5, 0], "velocity": [1, 2], "angular_velocity": [0, 0, 30]}}},
    }  # fmt: skip
    ready = meshed(scene_from(raw))
    assert ready.linkage.mobility == 3  # in its plane
    assert ready.model.coordinates == 21  # of seven nodes
    for link, rate in zip(
        ready.model.links, initial_rates(ready.scene, ready.linkage, ready.path, ready.model), strict=True
    ):
        x, one = link.X[:, 0], np.ones(link.n)
        np.testing.assert_allclose(rate, np.c_[one, 2 + 30 * (x - 0.5), 30 * one], atol=1e-12)


def test_check_tells_what_moves_and_by_what(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    path.write_text(ARM, encoding="utf-8")
    console = Console(width=100, file=StringIO())
    for table in check_tables(meshed(read_scene(path)), None, None):
        console.print(table)
    said = console.file.getvalue()
    for row in (
        r"drive .* none: the mechanism moves by itself",
        r"free motions .* 1 ",
        r"link crank starts with .* 6.283 rad/s",
        r"link arm starts with .* 1.257 m/s",
        r"m .* motor on joint A .* 0 N m to 5 N m over speed",
        r"s .* spring between shoe and ground .* 200 N/m",
        r"t .* spring about joint B .* 10 mN m s/rad",
    ):
        assert any(re.search(row, x) for x in said.splitlines()), row
    assert "dead point" not in said


def test_check_refuses_what_does_not_fit_its_link() -> None:
    spring = {"kind": "spring", "between": [{"link": "arm", "at": [0.3, 0.004]}, {"link": "ground", "at": [1, 0]}],
              "stiffness": 200}  # fmt: skip
    with pytest.raises((SceneError, MeshError), match=r"springs\.s\.between\[0\]\.at: must lie on the axis"):
        check_tables(prepared(springs={"s": spring}), None, None)
