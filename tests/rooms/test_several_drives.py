"""Several drives on one joint: names of their channels, tables, arrows, loads and linear systems."""

import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.accuracy.prepared import moving
from kedfem.analysis import analyse
from kedfem.export.linear_system import state_space
from kedfem.loads import loads
from kedfem.motion.coordinates import driven_names
from kedfem.motion.rigid import rigid_motion
from kedfem.output.frames import DRIVE_FORCE, DRIVE_TORQUE, joint_field
from kedfem.results import read_results
from kedfem.scene import Scene, drive_angle, path_parameter, scene_from
from tests.several_drives import SEVERAL, at_once

Raw = dict[str, Any]
DOCS = Path(__file__).parents[2] / "docs" / "mechanisms.md"


def drilling() -> Raw:
    """The quill of the docs with its two drives, and a tool."""
    (tables,) = re.findall(
        r"^```toml\n(\[joints\.quill\].*?)^```$", DOCS.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE
    )
    shape = {"kind": "bar", "between": [[0, 0, 0], [0, 0, -0.1]], "width": 0.01, "thickness": 0.01, "up": "x"}
    return {
        "links": {"tool": {"model": "beam", "material": "steel", "shape": shape, "mesh": {"elements": 2}}},
        **tomllib.loads(tables),
        "analysis": {"end_time": 0.02, "step": 5e-4, "initial": "quasi-static", "accuracy": "quick"},
        "output": {"picture": False, "plots": False, "animation": {"frames_per_revolution": 4}},
    }


def test_a_drive_has_its_joint_s_name_and_one_of_its_own_where_there_are_several() -> None:
    raw = at_once("cylindrical", "beam", "z", "crank")
    scene = scene_from(raw)
    assert list(scene.all_drives) == ["J.turn", "J.push", "foot"]
    assert {name: len(drives) for name, drives in scene.driven_joints.items()} == {"J": 2, "foot": 1}


@pytest.mark.parametrize(
    ("kind", "wanted"),
    [
        ("cylindrical", ["angle", "travel"]), ("universal", ["angle_about_ground", "angle_about_arm"]),
        ("planar", ["angle"]),  # directions in the plane are any
    ],
)  # fmt: skip
def test_all_driven_coordinates_are_known(kind: str, wanted: list[str]) -> None:
    assert driven_names(scene_from(at_once(kind, "beam", "oblique")), "J") == wanted


def test_results_and_loads_name_joint_and_drive(tmp_path: Path) -> None:
    run = analyse(scene_from(drilling(), tmp_path))
    results = read_results(run.folder / "results.h5")
    efforts = {name: x[0].description for name, x in results.channels.items() if name.startswith("drive/")}
    for name, what, own in (("rotate", "torque", "rotate"), ("feed", "force", "feed")):
        assert efforts.pop(f"drive/quill.{name}/{what}") == f"{what} of the drive {own} on link tool"
        assert efforts.pop(f"drive/quill.{name}/rigid_{what}").endswith("on link tool with all links rigid")
    assert not efforts
    found = loads(run.folder)
    assert set(found.drives) == {"quill.rotate", "quill.feed"}
    assert {x.name for x in found.folder.glob("drive *.csv")} == {"drive quill.rotate.csv", "drive quill.feed.csv"}
    power = found.drives["quill.feed"]["largest power [W]"]
    t = results.time
    F, v = (
        results.channels["drive/quill.feed/force"][1][:, 0],
        drive_angle(scene_from(drilling()).drives["feed"].motion, t)[1],
    )
    assert abs(power) == pytest.approx(np.abs(F * v).max(), rel=1e-9)


def at(scene: Scene, t: float) -> tuple[Any, Any]:
    link, along = moving(scene)
    times = np.array([t])
    return link, rigid_motion(link, along, times, path_parameter(scene, times))


@pytest.mark.parametrize("kind", SEVERAL)
def test_arrows_of_all_drives_together_have_their_power(kind: str) -> None:
    """Σ effort · rate = torque · ω + force · v of the joint's link at its point, on the ground."""
    scene = scene_from(at_once(kind, "beam", "oblique"))
    link, motion = at(scene, 0.012)
    efforts = {name: 3.0 + 2.0 * k for k, name in enumerate(SEVERAL[kind])}
    rows = {"joints/J/force": np.zeros((1, 3))}
    rows |= {f"drive/J.{x}/{what}": np.full((1, 1), Q) for x, Q in efforts.items() for what in ("torque", "force")}
    field = joint_field(scene, link, motion, rows, 0)
    assert field is not None
    none = np.zeros((1, 3))
    torque, force = (field.vectors.get(key, none)[0] for key in (DRIVE_TORQUE, DRIVE_FORCE))
    body = link.bodies.index("arm")
    got = torque @ motion.omega[0, body] + force @ motion.velocity(body, np.asarray(scene.joints["J"].at))[0]
    rates = {name: drive_angle(scene.drives[name].motion, motion.t)[1][0] for name in efforts}
    wanted = sum(efforts[name] * rates[name] for name in efforts)
    assert min(map(abs, rates.values())) > 1e-3
    assert got == pytest.approx(wanted, rel=1e-8)


def test_drives_that_let_go_are_inputs_of_their_own() -> None:
    """Of a rigid body: the push accelerates its mass, the torque its inertia about the axis, neither the other."""
    raw = drilling()
    raw["links"]["tool"] = {"model": "rigid", "mass": 2.0, "centre": [0, 0, -0.05], "inertia": [0.1, 0.1, 0.03, 0, 0, 0]}
    space, _ = state_space(scene_from(raw), 2, free=True)
    assert space.inputs == ("drive/quill.rotate/torque", "drive/quill.feed/force")
    speeds = [space.outputs.index(f"drive/quill.{name}/speed") for name in ("rotate", "feed")]
    assert_allclose((space.C @ space.B)[speeds], np.diag([1 / 0.03, 1 / 2.0]), atol=1e-6)
