"""Patterns of scenes: what they write out, beside scenes written by hand; what they refuse."""

from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.analysis import analyse
from kedfem.errors import SceneError
from kedfem.scene import Scene, scene_from
from kedfem.scene.checks.hints import below, field_hint, marks, members, models
from kedfem.scene.read.files import outside
from kedfem.scene.records.analysis import Output
from kedfem.scene.records.base import NameOf
from kedfem.scene.records.patterns import SECTIONS

Raw = dict[str, Any]
SHAPE = {"kind": "bar", "width": 0.02, "thickness": 0.01}
BEAM = {"model": "beam", "material": "steel"}
PRESSURE = {"over": "angle", "at": ["0 deg", "90 deg", "180 deg"], "value": [1.0, 0.5, 0.0], "period": "360 deg"}


def radial(count: int) -> Raw:
    """A radial engine: all rods on one pin, cylinders a part of a turn apart, gas on the pistons in turn."""
    rod = {"from": "B", "distance": "120 mm", "along": ["A", [0.2, 0]]}
    return {
        "parameters": {"n": count},
        "gravity": [0, -9.81],
        "points": {"A": [0, 0], "B": [0.02, 0.02]},
        "links": {"crank": {**BEAM, "shape": {**SHAPE, "between": ["A", "B"]}}},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "crank"], "at": "A"}},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": "600 rpm"}},
        "patterns": {
            "cylinders": {
                "count": "=n", "rotation": "=360 deg / n", "phase": "=360 deg / n",
                "points": {"C": rod},
                "links": {
                    "rod": {**BEAM, "shape": {**SHAPE, "between": ["B", "C"]}},
                    "piston": {"model": "rigid", "mass": "0.3 kg"},
                },
                "joints": {
                    "B": {"kind": "revolute", "links": ["crank", "rod"], "at": "B"},
                    "C": {"kind": "revolute", "links": ["rod", "piston"], "at": "C"},
                    "guide": {"kind": "prismatic", "links": ["ground", "piston"], "at": "C", "axis": "x"},
                },
                "loads": {
                    "gas": {"kind": "force", "link": "piston", "at": "C", "vector": ["-2 kN", 0], "factor": PRESSURE}
                },
                "probes": {"piston": {"link": "rod", "at": "C", "quantity": "position"}},
            }
        },
        "analysis": {"accuracy": "quick", "revolutions": 0.1, "steps_per_revolution": 200},
        "output": {"plots": False, "picture": False, "animation": False},
    }  # fmt: skip


def by_hand(count: int) -> Raw:
    """The same, one cylinder after the other."""
    raw = radial(count)
    del raw["patterns"], raw["parameters"]
    raw["loads"], raw["output"]["probes"] = {}, {}
    crank = np.array([0.02, 0.02])
    for k in range(count):
        angle = 2 * np.pi * k / count
        d = np.array([np.cos(angle), np.sin(angle)])
        foot = crank @ d
        at = [*(foot + np.sqrt(0.12**2 - (crank @ crank - foot**2))) * d]
        n = k + 1
        raw["links"][f"rod_{n}"] = {**BEAM, "shape": {**SHAPE, "between": ["B", at]}}
        raw["links"][f"piston_{n}"] = {"model": "rigid", "mass": 0.3}
        raw["joints"][f"B_{n}"] = {"kind": "revolute", "links": ["crank", f"rod_{n}"], "at": "B"}
        raw["joints"][f"C_{n}"] = {"kind": "revolute", "links": [f"rod_{n}", f"piston_{n}"], "at": at}
        raw["joints"][f"guide_{n}"] = {
            "kind": "prismatic", "links": ["ground", f"piston_{n}"], "at": at, "axis": [*d],
        }  # fmt: skip
        factor = {**PRESSURE, "at": [angle, angle + np.pi / 2, angle + np.pi]}
        load = {"kind": "force", "link": f"piston_{n}", "at": at, "vector": [*(-2000 * d)], "factor": factor}
        raw["loads"][f"gas_{n}"] = load
        raw["output"]["probes"][f"piston_{n}"] = {"link": f"rod_{n}", "at": at, "quantity": "position"}
    return raw


def test_a_radial_engine_is_the_one_that_is_written_by_hand(tmp_path: Path) -> None:
    found, expected = (analyse(scene_from(raw(4), tmp_path)).results for raw in (radial, by_hand))
    assert set(found.channels) == set(expected.channels)
    for name, (_, value) in expected.channels.items():
        if name.startswith(("probes", "drive")):
            assert_allclose(found.channels[name][1], value, rtol=1e-9, atol=1e-12 * np.abs(value).max(), err_msg=name)


def written_out(pattern: Raw, **sections: Any) -> Any:
    """The scene that a pattern makes, as records."""
    raw = {"links": {}, "analysis": {"end_time": 1.0, "step": 0.1}, **sections, "patterns": {"p": pattern}}
    return scene_from(raw)


def test_a_turn_about_any_axis_moves_points_axes_and_vectors() -> None:
    """By Rodrigues: a third of a revolution about (1, 1, 1) sends x to y to z, about a centre that stays."""
    body = {
        "kind": "rigid_body", "link": "arm", "at": [1, 0, 0], "mass": 1.0, "inertia": [1, 2, 2.5, 0.1, 0.2, 0.3],
        "centre": [1, 0, 0],
    }  # fmt: skip
    bar = {**BEAM, "shape": {**SHAPE, "between": [[0, 0, 0], "P"], "up": "z"}}
    scene = written_out(
        {
            "count": 3, "rotation": "120 deg", "about": [1, 1, 1], "centre": [0, 0, 0], "points": {"P": [1, 0, 0]},
            "links": {"arm": bar},
            "joints": {"foot": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0, 0]}},
            "loads": {"pull": {"kind": "force", "link": "arm", "at": "P", "vector": ["1 kN", "2 kN", 0]}},
            "bodies": {"tip": body},
        }
    )  # fmt: skip
    turn = np.roll(np.eye(3), 1, axis=0)
    for k, n in ((0, "1"), (1, "2"), (2, "3")):
        R = np.linalg.matrix_power(turn, k)
        assert_allclose(scene.links[f"arm_{n}"].shape.between[1], R[:, 0], atol=1e-15)
        assert_allclose(scene.links[f"arm_{n}"].shape.up, R[:, 2], atol=1e-15)
        assert_allclose(scene.joints[f"foot_{n}"].axis, R[:, 2], atol=1e-15)  # which was left out
        assert_allclose(scene.loads[f"pull_{n}"].vector, R @ [1000, 2000, 0], atol=1e-12)
        J = np.array([[1, 0.1, 0.3], [0.1, 2, 0.2], [0.3, 0.2, 2.5]])
        turned = (R @ J @ R.T)[[0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]
        assert_allclose(scene.bodies[f"tip_{n}"].inertia, turned, atol=1e-14)
        assert scene.joints[f"foot_{n}"].links == ("ground", f"arm_{n}")


def test_a_shift_moves_points_of_the_pattern_and_leaves_those_of_the_scene() -> None:
    bar = {**BEAM, "shape": {**SHAPE, "between": ["F", ["30 mm", 0.5]]}}
    scene = written_out({"count": 3, "shift": ["20 mm", 0], "links": {"stay": bar}}, points={"F": [0, 0]})
    ends = [scene.links[f"stay_{n}"].shape.between for n in (1, 2, 3)]
    assert_allclose([a for a, _ in ends], np.zeros((3, 3)))
    assert_allclose([b for _, b in ends], [[0.03, 0.5, 0], [0.05, 0.5, 0], [0.07, 0.5, 0]], atol=1e-15)


@pytest.mark.parametrize(
    "shape",
    [{"file": "a.step"}, {"kind": "cad", "file": "a.step", "towards": [1, 0, 0]}, {"file": "a.msh"}],
    ids=["alone", "towards a point", "a mesh"],
)
def test_a_shift_moves_files_that_are_drawn_in_their_place(shape: Raw, tmp_path: Path) -> None:
    for name in ("a.step", "a.msh"):
        (tmp_path / name).write_text("")
    pattern = {"count": 3, "shift": [0, "20 mm", 0.1], "links": {"a": {"material": "steel", "shape": shape}}}
    raw = {"links": {}, "analysis": {"end_time": 1.0, "step": 0.1}, "patterns": {"p": pattern}}
    scene = scene_from(raw, tmp_path)
    for k in range(3):
        moved = scene.links[f"a_{k + 1}"].shape
        assert_allclose(moved.origin, [0, 0.02 * k, 0.1 * k], atol=1e-15)
        assert moved.towards is None or moved.towards == pytest.approx((1, 0.02 * k, 0.1 * k))


@pytest.mark.parametrize(
    ("pattern", "message"),
    [
        ({"count": 2}, r"patterns\.p\.rotation: is required, or a shift"),
        ({"count": 0, "rotation": 1.0}, r"patterns\.p\.count: must be at least 1"),
        ({"count": 2, "rotation": 1.0, "abuot": "z"}, r"patterns\.p\.abuot: unknown key, did you mean 'about'"),
        ({"phase": 1.0, "loads": {"f": {"factor": {"time": [0, 1], "value": [0, 1]}}}}, r"p\.phase: must be of factors"),
        ({"links": {"a": {**BEAM, "width": 1}}}, r"^patterns\.p\.links\.a\.width: unknown key"),
        ({"links": {"a": {"shape": {"file": "a.step"}}}}, r"patterns\.p\.links\.a: must not be a part of a file"),
        ({"links": {"a": {"shape": {"kind": "plate_link"}}}, "about": "x"}, r"patterns\.p\.links\.a: must be a bar"),
        ({"links": {"a": {**BEAM, "shape": {**SHAPE, "between": [[0, 0], [0, 0, 1]]}}}}, r"p\.links\.a: .* `up`"),
        ({"joints": {"j": {"bushing": {"stiffness": [1, 2, 3]}}}}, r"patterns\.p\.joints\.j: must have a bushing alike"),
        ({"points": {"P": {"from": [0, 0], "distance": 1, "angle": 1}}, "about": "x"}, r"p\.points\.P: .*angle"),
        ({"points": {"P": {"between": [[0, 0], [0, 1]], "offset": 0.1}}, "about": "x"}, r"p\.points\.P: .*offset"),
        ({"points": {"P": {"from": [[0, 0], [0, 1]], "distances": [1, 1]}}, "about": "y"}, r"\.P: .*distances"),
        ({"links": {"a": {**BEAM, "shape": {**SHAPE, "between": [[0, 0], [1, 0]]}}}, "about": "x"}, r"links\.a: .* `up`"),
    ],
)  # fmt: skip
def test_what_a_pattern_cannot_be(pattern: Raw, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        written_out(pattern if "count" in pattern else {"count": 2, "rotation": 1.0, **pattern})


def test_a_cad_file_of_a_pattern_is_among_those_that_must_be_within_the_folder(tmp_path: Path) -> None:
    raw = {"patterns": {"p": {"links": {"a": {"shape": {"file": "../a.step"}}}}}}
    assert [str(fault) for fault in outside(raw, tmp_path)] == [
        "patterns.p.links.a.shape.file: must be within the scene's folder (--within), got '../a.step'"
    ]


def test_a_name_with_a_number_must_be_free() -> None:
    arm = {**BEAM, "shape": {**SHAPE, "between": [[0, 0], [1, 0]]}}
    with pytest.raises(SceneError, match=r"patterns\.p\.links\.arm: must have a name that is free .* 'arm_2' twice"):
        written_out({"count": 2, "rotation": 1.0, "links": {"arm": arm}}, links={"arm_2": arm})


def test_names_of_links_and_joints_are_known_as_such_in_all_tables_that_a_pattern_repeats() -> None:
    """Else a copy would name the entry that is written, which there is no longer."""
    words, checked = {"link", "links", "joint", "joints", "about"}, 0
    for section in set(SECTIONS) - {"points"}:
        kind = below(Output, "probes", {}) if section == "probes" else below(Scene, section, {})
        for model in models(below(kind, "any", {})):
            for key in words & set(model.model_fields):
                hint = field_hint(model.model_fields[key])
                inner = [hint, *(x for part in members(hint) for x in get_args(part))]
                assert any(marks(x, NameOf) for x in inner), (section, model.__name__, key)
                checked += 1
    assert checked > 20


def test_a_torque_on_a_joint_of_a_pattern_is_on_that_of_each_copy() -> None:
    scene = scene_from({
        "patterns": {"arms": {
            "count": 2, "shift": [0, 0.2, 0],
            "links": {"arm": {**BEAM, "shape": {**SHAPE, "between": [[0, 0, 0], [0.1, 0, 0]]}}},
            "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0, 0]}},
            "loads": {"t": {"kind": "torque", "link": "arm", "joint": "A", "vector": [0, 0, 1]}},
        }},
        "links": {}, "analysis": {"end_time": 0.1, "step": 0.01},
    })  # fmt: skip
    assert [load.joint for load in scene.loads.values()] == ["A_1", "A_2"]
