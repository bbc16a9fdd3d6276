"""Parameters, expressions and included files: what they come to, and every fault at its place."""

import copy
import os
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kedfem.errors import SceneError
from kedfem.results.differences import flat
from kedfem.scene import read_scene, scene_from
from kedfem.scene.read.parameters import Parameters
from kedfem.scene.records.expressions import evaluated

GOOD = """
[parameters]
r = "25 mm"
n = 4
omega = "300 rpm"
width = "=r/5 + 15 mm"

[links.arm]
material = "steel"
model = "beam"
shape = { kind = "bar", between = [[0, 0], ["=20*r", 0]], width = "=width", thickness = "=hypot(12 mm, 16 mm)" }
mesh = { elements = "=n^2/2" }

[joints.A]
kind = "revolute"
links = ["ground", "arm"]
at = [0, 0]

[drive]
joint = "A"
motion = { kind = "constant_speed", speed = "=2*omega" }

[damping]
ratio = "=2 %"
frequencies = ["=omega/(6 rad)", 500]

[analysis]
revolutions = "=1/n"
steps_per_revolution = 400
"""


def raw(changes: dict[str, Any] | None = None) -> dict[str, Any]:
    """The good scene with some keys, dotted paths, changed."""
    out = copy.deepcopy(tomllib.loads(GOOD))
    for path, value in (changes or {}).items():
        *tables, last = path.split(".")
        at = out
        for name in tables:
            at = at.setdefault(name, {})
        at[last] = value
    return out


def faults(changes: dict[str, Any]) -> list[str]:
    with pytest.raises(SceneError) as caught:
        scene_from(raw(changes))
    return [str(fault) for fault in caught.value.faults]


def test_any_number_of_a_scene_may_be_an_expression() -> None:
    scene = scene_from(raw())
    shape = scene.links["arm"].shape
    assert shape.between[1] == pytest.approx((0.5, 0.0, 0.0), rel=1e-15)
    assert (shape.width, shape.thickness) == pytest.approx((0.02, 0.02), rel=1e-15)
    assert scene.links["arm"].mesh.elements == 8
    assert scene.drive.motion.speed == pytest.approx(20.0 * np.pi, rel=1e-15)
    assert (*scene.damping.ratio, scene.analysis.revolutions) == pytest.approx((0.02, 0.02, 0.25), rel=1e-15)


def test_the_stored_scene_is_complete_and_gives_itself_again() -> None:
    scene = scene_from(raw())
    assert scene_from(scene.model_dump()).model_dump() == scene.model_dump()
    assert scene_from(scene.model_dump(mode="json", exclude_unset=True)).links == scene.links
    changed = scene_from(raw({"parameters.r": "26 mm"}))
    stored, other = flat(scene.model_dump(mode="json")), flat(changed.model_dump(mode="json"))
    differ = [key for key in stored if stored[key] != other[key]]
    assert differ == ["parameters.r", "links.arm.shape.between", "links.arm.shape.width"]
    assert scene.as_given["links"]["arm"]["shape"]["width"] == "=width"


@pytest.mark.parametrize(
    ("text", "wanted", "unit"),
    [
        ("2*r + 5 mm", 0.055, "m"),
        ("-r^2", -0.000625, "m^2"),
        ("2 mm^2", 2e-6, "m^2"),
        ("1/5 N/m", 0.2, "m/N"),
        ("2^3^2/2^8 * 1 m", 2.0, "m"),
        ("sqrt(r*4 m/(10000))", np.sqrt(0.025 * 4 / 1e4), "m"),
        ("sin(30 deg) + cos(pi/3) - tan(45 deg)", 0.0, ""),
        ("atan2(r, r)", np.pi / 4, "rad"),
        ("max(r, 1 cm, 3 mm) - min(r, 1 cm)", 0.015, "m"),
        ("asin(1)/(1 deg)", 90.0, ""),
        ("exp(log(3)) + abs(-1)", 4.0, ""),
        ("600 rpm * r", 0.5 * np.pi, "m/s"),
        ("2*pi*1 rad*50 Hz", 100 * np.pi, "rad/s"),
        ("3 N m/rad", 3.0, "N*m/rad"),
        ("70 GPa * 2·r·r", 70e9 * 2 * 0.025**2, "N"),
    ],
)
def test_what_an_expression_comes_to(text: str, wanted: float, unit: str) -> None:
    found = evaluated(text, Parameters({"r": "25 mm"}))
    assert found.m_as(unit) == pytest.approx(wanted, rel=1e-14, abs=1e-15)


@pytest.mark.parametrize(
    ("changes", "where", "words"),
    [
        ({"links.arm.shape.width": "=2*witdh"}, "links.arm.shape.width", ["'witdh'", "'width'"]),
        ({"links.arm.shape.width": "=r/(n - 4)"}, "links.arm.shape.width", ["divides by zero"]),
        ({"links.arm.shape.width": "=r + n"}, "links.arm.shape.width", ["mixes units", "'mm'", "without"]),
        ({"links.arm.shape.width": "=r + 1 s"}, "links.arm.shape.width", ["mixes units", "'mm'", "'s'"]),
        ({"links.arm.shape.width": "=r*r"}, "links.arm.shape.width", ["a length", "another kind"]),
        ({"links.arm.shape.width": "=-r"}, "links.arm.shape.width", ["positive", "=-r", "-25 mm"]),
        ({"links.arm.shape.width": "=" + "r+" * 500 + "r"}, "links.arm.shape.width", ["at most 1000"]),
        ({"links.arm.shape.width": "=r.real"}, "links.arm.shape.width", ["'.'"]),
        ({"links.arm.shape.width": "=3 r"}, "links.arm.shape.width", ["write 3*r"]),
        ({"links.arm.shape.width": "=r*mm"}, "links.arm.shape.width", ["'mm'", "follows its number"]),
        ({"links.arm.shape.width": "=foo(r)"}, "links.arm.shape.width", ["a function", "'foo'"]),
        ({"links.arm.shape.width": "=r^1000"}, "links.arm.shape.width", ["exponent", "at most 9"]),
        ({"links.arm.shape.width": "=r^r"}, "links.arm.shape.width", ["exponent", "without a unit"]),
        ({"links.arm.shape.width": "=9^9^9^9 m"}, "links.arm.shape.width", ["exponent"]),
        ({"links.arm.shape.width": "=__import__('os')"}, "links.arm.shape.width", ["'_'"]),
        ({"links.arm.shape.width": "=(lambda: 1)()"}, "links.arm.shape.width", ["':'"]),
        ({"links.arm.shape.width": "=r if n else r"}, "links.arm.shape.width", ["not an expression"]),
        ({"links.arm.shape.width": "="}, "links.arm.shape.width", ["not an expression"]),
        ({"links.arm.mesh.elements": "=n/3"}, "links.arm.mesh.elements", ["whole number", "1.33"]),
        ({"links.arm.mesh.elements": "=r"}, "links.arm.mesh.elements", ["whole number", "25 mm"]),
        ({"springs": {"k": {"kind": "torsion", "joint": "A", "free_angle": "=1/6 turn"}}}, "springs.k.free_angle",
         ["0.166667 1/turn", "another kind"]),
        ({"drive.motion.speed": "=2*pi*50 Hz"}, "drive.motion.speed", ["revolutions or radians per second"]),
        ({"drive.motion.speed": "=omega + 1 Hz"}, "drive.motion.speed", ["mixes cycles and turns"]),
        ({"drive.motion.speed": "=10 rad*(3 + 5 deg)/(1 s)"}, "drive.motion.speed", ["mixes units"]),
        ({"parameters.r": "=width"}, "parameters.width", ["itself: r → width → r"]),
        ({"parameters.r": "=r"}, "parameters.r", ["itself: r → r"]),
        ({"parameters.r": "2*3"}, "parameters.r", ["begins with ="]),
        ({"parameters.r": "25 mmm"}, "parameters.r", ["'mmm'"]),
        ({"parameters.r": True}, "parameters.r", ["a number", "true"]),
        ({"parameters.r": [1]}, "parameters.r", ["a number", "[1]"]),
        ({"parameters.sin": 1}, "parameters.sin", ["a name", "know already"]),
        ({"parameters.a b": 1}, "parameters.a b", ["a name", "'a b'"]),
        ({"parameters.m": 1, "links.arm.shape.width": "=1 N/m"}, "links.arm.shape.width", ["the unit 'm' or"]),
        ({"parameter": {"r": 1}}, "parameter", ["'parameters'"]),
        ({"parameters": 3}, "parameters", ["table"]),
    ],
)  # fmt: skip
def test_a_fault_of_an_expression_is_told_at_its_place(changes: dict[str, Any], where: str, words: list[str]) -> None:
    found = [each.removeprefix(f"{where}: ") for each in faults(changes) if each.startswith(f"{where}: ")]
    assert len(found) == 1, faults(changes)
    at = 0
    for word in words:
        assert (at := found[0].find(word, at)) >= 0, (word, found[0])


def test_a_parameter_with_a_fault_is_reported_once() -> None:
    """Neither the parameters nor the keys in which it stands are faults of their own."""
    (found,) = faults({"parameters.r": "25 mmm"})
    assert found.startswith("parameters.r: must be a number")
    (found,) = faults({"parameters.a": "=b", "parameters.b": "=a", "parameters.c": "=2*a", "damping.ratio": "=c"})
    assert found.endswith("it must not be defined by itself: a → b → a")


def test_titles_are_no_expressions() -> None:
    assert scene_from(raw({"title": "=r"})).title == "=r"


def test_a_long_expression_is_worked_out() -> None:
    found = evaluated("r+" * 499 + "r", Parameters({"r": "1 mm"}))
    assert found.m_as("m") == pytest.approx(0.5, rel=1e-12)


def test_parameters_may_be_many_and_chained() -> None:
    many = {f"p{k}": "1 mm" if k == 0 else f"=p{k - 1} + 1 mm" for k in range(2000)}
    scene = scene_from(raw({"parameters.p0": "1 mm"}) | {"parameters": raw()["parameters"] | many})
    assert len(scene.parameters) == 2004
    backwards = {f"p{k}": f"=p{k + 1}" for k in range(200)} | {"p200": 1}
    assert "30 deep" in "\n".join(faults({"parameters": raw()["parameters"] | backwards}))


leaves = st.sampled_from(["r", "n", "2", "5 mm", "3 s", "0", "1e300", "pi", "q", "9"])
trees = st.recursive(
    leaves,
    lambda inner: st.one_of(
        st.builds("({} {} {})".format, inner, st.sampled_from("+-*/^"), inner),
        st.builds("{}({})".format, st.sampled_from(["sqrt", "sin", "abs", "exp", "f"]), inner),
        st.builds("-{}".format, inner),
    ),
    max_leaves=12,
)


@given(trees | st.text(st.sampled_from("rn25.+-*/^()e _[]'mµ°%,·⁻²=:"), max_size=30))
@settings(max_examples=300, deadline=None)
def test_whatever_is_written_is_a_finite_number_or_a_sentence(text: str) -> None:
    try:
        found = evaluated(text, Parameters({"r": "25 mm", "n": 4}))
    except ValueError:
        return
    assert np.isfinite(found.magnitude)


def written(folder: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return folder / next(iter(files))


def test_included_tables_are_joined_and_the_scenes_own_keys_stand(tmp_path: Path) -> None:
    own = """include = ["parts/base.toml", "parts/other.toml"]
[parameters]
r = "30 mm"
[drive.motion]
kind = "ramp"
speed = "=omega"
time = "0.1 s"
"""
    other = "[parameters]\nomega = '600 rpm'\n[bodies]\n"
    path = written(tmp_path, {"scene.toml": own, "parts/base.toml": GOOD, "parts/other.toml": other})
    scene = read_scene(path)
    assert scene.links["arm"].shape.between[1][0] == pytest.approx(0.6, rel=1e-15)
    assert scene.drive.motion.kind == "ramp"
    assert scene.drive.motion.speed == pytest.approx(20 * np.pi, rel=1e-15)
    assert scene.drive.joint == "A"
    stored = tomllib.loads(scene.source)
    assert "include" not in stored
    assert scene_from(stored).model_dump() == scene.model_dump()


def test_file_names_in_an_included_file_are_relative_to_it(tmp_path: Path) -> None:
    motion = '[drive]\njoint = "A"\nmotion = { kind = "curve", file = "motion.csv" }\n'
    plain = GOOD[: GOOD.index("[drive]")] + GOOD[GOOD.index("[damping]") :].replace(
        'revolutions = "=1/n"\nsteps_per_revolution = 400', "end_time = 0.01\nstep = 1e-3"
    )
    path = written(
        tmp_path,
        {
            "scene.toml": 'include = "a/one.toml"\n' + plain,
            "a/one.toml": 'include = "b/two.toml"',
            "a/b/two.toml": motion,
            "a/b/motion.csv": "0, 0\n0.005, 0.1\n0.01, 0.2",
        },
    )
    assert read_scene(path, within=True).drive.motion.value == (0.0, 0.1, 0.2)


@pytest.mark.parametrize(
    ("files", "words"),
    [
        ({"scene.toml": 'include = "scene.toml"\n'}, "itself, got scene.toml → scene.toml"),
        ({"scene.toml": 'include = "b.toml"', "b.toml": 'include = "scene.toml"'}, "scene.toml → b.toml → scene"),
        ({"scene.toml": 'include = "none.toml"'}, "none.toml: must be a file"),
        ({"scene.toml": 'include = "."'}, "must be a readable file"),
        ({"scene.toml": "include = 3"}, "include: must be the name of a scene file"),
        ({"scene.toml": "include = [3]"}, "include[0]: must be a text"),
        ({"scene.toml": 'include = ""'}, "include[0]: must be a text that is not empty"),
        ({"scene.toml": 'include = "b.toml"', "b.toml": "x ="}, "b.toml, line 1: must be valid TOML"),
        (
            {"scene.toml": 'include = ["0.toml", "0.toml"]'}
            | {f"{k}.toml": f'include = ["{k + 1}.toml", "{k + 1}.toml"]' for k in range(20)}
            | {"20.toml": "title = 'x'"},
            "at most 100 files",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_included_is_a_sentence(files: dict[str, str], words: str, tmp_path: Path) -> None:
    with pytest.raises(SceneError) as caught:
        read_scene(written(tmp_path, files))
    assert words in str(caught.value)


def test_only_regular_files_within_the_folder_where_that_is_asked_for(tmp_path: Path) -> None:
    path = written(tmp_path, {"in/scene.toml": 'include = "../secret.toml"', "secret.toml": GOOD})
    assert read_scene(path).links
    with pytest.raises(SceneError, match=r"include: must be within the scene's folder \(--within\)"):
        read_scene(path, within=True)
    (tmp_path / "in" / "link.toml").symlink_to(tmp_path / "secret.toml")
    with pytest.raises(SceneError, match="--within"):
        read_scene(written(tmp_path / "in", {"scene.toml": 'include = "link.toml"'}), within=True)
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "in" / "pipe.toml")
        with pytest.raises(SceneError, match="must be a regular file"):
            read_scene(written(tmp_path / "in", {"scene.toml": 'include = "pipe.toml"'}))
    nested = {"scene.toml": 'include = "b.toml"', "b.toml": '[links.arm]\nshape.file = "../../part.step"\n'}
    with pytest.raises(SceneError, match=r"links.arm.shape.file: must be within"):
        read_scene(written(tmp_path / "in", nested), within=True)
