"""Scenes: units, points by construction, defaults, files, round trips, and the reference of keys."""

import json
import math
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from reference.scene import scene_reference

from kedfem.cli import KINDS
from kedfem.errors import Fault, SceneError
from kedfem.scene import (
    Analysis,
    Bar,
    ConstantSpeed,
    Drive,
    Extrusion,
    Joint,
    LinkScene,
    Material,
    Scene,
    part_geometry,
    read_scene,
    scene_from,
    time_grid,
)
from kedfem.scene.records.units import KINDS as QUANTITIES
from kedfem.scene.records.units import USUAL, si_number, unit_registry

ROOT = Path(__file__).parents[2]
TEMPLATES = sorted((ROOT / "src" / "kedfem" / "templates").glob("*.toml"))

ARM = """
[points]
A = [0, 0]
B = ["300 mm", 0]
[links.arm]
model = "beam"
material = "steel"
shape = { kind = "bar", between = ["A", "B"], width = 0.01, thickness = 0.01 }
[joints.A]
kind = "revolute"
links = ["ground", "arm"]
at = "A"
[drive]
joint = "A"
motion = { kind = "constant_speed", speed = 10 }
[analysis]
revolutions = 1
"""


def arm(tmp_path, text="", name="arm.toml"):
    path = tmp_path / name
    path.write_text(ARM + text, encoding="utf-8")
    return path


def with_points(points):
    """Coordinates of points, resolved in a small scene."""
    raw = read_raw()
    raw["points"].update(points)
    return scene_from(raw).points


def read_raw():
    return tomllib.loads(ARM)


@pytest.mark.parametrize(
    ("text", "unit", "number"),
    [
        ("914.4 mm", "m", 0.9144),
        ("3 in", "m", 0.0762),
        ("25.4mm", "m", 0.0254),
        ("600 rpm", "rad/s", 20.0 * math.pi),
        ("-90 deg/s", "rad/s", -math.pi / 2),
        ("60 deg", "rad", math.pi / 3),
        ("2 turns", "rad", 4.0 * math.pi),
        ("2 rev", "rad", 4.0 * math.pi),
        ("30 rev/min", "rad/s", math.pi),
        ("7850 kg/m^3", "kg/m^3", 7850.0),
        ("7.85 g/cm**3", "kg/m^3", 7850.0),
        ("70 GPa", "Pa", 70e9),
        ("10 N/mm²", "Pa", 1e7),
        ("-1.5e3 kN", "N", -1.5e6),
        ("1 kN/m^3", "N/m^3", 1000.0),
        ("5 ms", "s", 5e-3),
        ("2 kHz", "Hz", 2000.0),
        ("806.5 kg*cm^2", "kg*m^2", 8.065e-2),
        ("1 %", "1", 0.01),
        ("9.81 m/s^2", "m/s^2", 9.81),
    ],
)
def test_a_number_with_a_unit_becomes_si(text, unit, number):
    assert_allclose(si_number(text, unit), number, rtol=1e-14)  # rounding of one product


@pytest.mark.parametrize(
    ("text", "unit"),
    [(f"2 {prefix}Hz", "rad/s") for prefix in ("", "k", "m", "M")]
    + [("2 cps", "rad/s"), ("2 Bq", "rad/s"), ("2 count/s", "rad/s")]
    + [(f"2 {speed}", "Hz") for speed in ("rpm", "krpm", "mrad/s", "turn/s", "rev/s", "gon/s")]
    + [(f"5 {length}", "m") for length in ("mm/turn", "mm/rev", "mm/rad", "mm/deg", "m*rad")]
    + [("600 rpm", "1/s"), ("90 deg", "1"), ("3 N*m/deg", "N*m"), ("1 m*rad/s", "m/s")],
)
def test_what_is_off_by_an_angle_or_a_turn_is_refused(text, unit):
    """A lead of 5 mm/turn was 0.8 mm, a speed of 1 kHz 1000 rad/s."""
    with pytest.raises(ValueError, match=r"revolutions or radians per second|is of another kind"):
        si_number(text, unit)


@pytest.mark.parametrize(("text", "unit"), [("3 N*m", "N*m/rad"), ("3 N*m*s", "N*m*s/rad")])
def test_radians_may_be_left_out(text, unit):
    assert si_number(text, unit) == 3.0


def test_four_bar_is_drawn_from_its_four_lengths():
    # the crank of Nath and Ghosh (1980) at 60 degrees: distances of the constructed points are the lengths
    points = with_points(
        {
            "D": ["914.4 mm", 0],
            "P": {"from": "A", "distance": 0.3048, "angle": "60 deg"},
            "Q": {"from": ["P", "D"], "distances": [0.9144, 0.762], "side": "left"},
            "R": {"from": ["P", "D"], "distances": [0.9144, 0.762], "side": "right"},
        }
    )
    P, Q, R, D = (np.array(points[name]) for name in "PQRD")
    for X in (Q, R):
        assert_allclose(np.linalg.norm(X - P), 0.9144, rtol=1e-14)
        assert_allclose(np.linalg.norm(X - D), 0.762, rtol=1e-14)
    left, right = (np.cross(D - P, X - P)[2] for X in (Q, R))
    assert left > 0 > right


lengths = st.floats(0.1, 10.0)


@given(st.floats(-5, 5), st.floats(-5, 5), lengths, lengths, st.floats(0.01, 0.99))
def test_circles_that_meet_are_met_at_their_radii(x, y, a, b, part):
    apart = abs(a - b) + part * (a + b - abs(a - b))
    points = with_points({"P": [x, y, 2], "Q": [x + apart, y, 2], "R": {"from": ["P", "Q"], "distances": [a, b]}})
    assert_allclose(math.dist(points["R"], points["P"]), a, rtol=1e-9)  # cancellation where circles nearly touch
    assert_allclose(math.dist(points["R"], points["Q"]), b, rtol=1e-9)
    assert points["R"][1] > y
    assert points["R"][2] == 2


def test_touching_circles_meet_in_one_point():
    points = with_points({"T": {"from": ["A", "B"], "distances": [0.1, 0.2]}})
    assert_allclose(points["T"], (0.1, 0.0, 0.0), atol=1e-8)  # sqrt of rounding


def test_points_on_and_beside_lines():
    points = with_points(
        {
            "M": {"between": ["A", "N"]},
            "N": [0, 2, 1],
            "S": {"between": ["A", "N"], "fraction": 0.25, "offset": 0.1},
            "F": {"from": [0.3, 0.3], "distance": 0.5, "along": ["A", "B"]},
            "G": {"from": [0.3, 0.3], "distance": "500 mm", "along": ["A", "B"], "end": "near"},
            "J": "joints.A",
        }
    )
    assert points["M"] == (0.0, 1.0, 0.5)
    assert_allclose(points["S"], (-0.1, 0.5, 0.25))  # left of the direction of y is −x
    assert_allclose(points["F"], (0.7, 0.0, 0.0), atol=1e-15)  # 3-4-5 triangles
    assert_allclose(points["G"], (-0.1, 0.0, 0.0), atol=1e-15)
    assert points["J"] == (0.0, 0.0, 0.0)


def test_materials_hold_all_moduli():
    steel = Material(density=7850, youngs_modulus="210 GPa", poisson_ratio=0.3)
    assert_allclose(steel.shear_modulus, 210e9 / 2.6)
    lame, mu = steel.lame()
    assert_allclose(lame + 2.0 * mu / 3.0, 210e9 / (3.0 * 0.4))  # bulk modulus E / 3(1 − 2ν)
    assert mu == steel.shear_modulus
    assert_allclose(
        Material(density=2796, youngs_modulus=7.031e10, shear_modulus=2.712e10).poisson_ratio, 0.29628, atol=1e-5
    )


def test_a_material_of_the_scene_replaces_a_built_in_one(tmp_path):
    own = "".join(
        f"[materials.{name}]\ndensity = 1\nyoungs_modulus = 1\npoisson_ratio = 0\n" for name in ("steel", "spare")
    )
    scene = read_scene(arm(tmp_path, own))
    assert scene.materials["steel"].density == 1.0
    assert sorted(scene.materials) == ["spare", "steel"]
    assert read_scene(arm(tmp_path)).materials["steel"].density == 7850.0


def test_defaults_that_depend_on_other_keys(tmp_path):
    scene = read_scene(arm(tmp_path))
    link = scene.links["arm"]
    assert (link.element, link.mesh.elements, scene.joints["A"].axis) == ("beam3", 1, (0.0, 0.0, 1.0))
    assert scene.gravity == (0.0, 0.0, 0.0)
    assert scene.output.animation.frames_per_revolution == 36
    assert scene.results_folder == tmp_path / "arm-results"
    assert scene.folder == tmp_path
    assert scene.source == ARM
    solid = Bar(between=((0, 0), (0.3, 0)), width=0.02, thickness=0.01)
    assert LinkScene(material="steel", shape=solid).mesh.elements == (10, 2, 1)  # about 1.5 widths long
    assert LinkScene(material="steel", shape=solid).element == "hex20"


def test_an_axis_becomes_a_unit_vector_and_a_factor_a_table():
    joint = Joint(kind="prismatic", links=("ground", "slider"), at=(0, 0), axis=[3, 4])
    assert_allclose(joint.axis, (0.6, 0.8, 0.0))
    raw = read_raw()
    raw["loads"] = {"push": {"kind": "force", "link": "arm", "at": "B", "vector": ["1 kN", 0], "factor": 2}}
    load = scene_from(raw).loads["push"]
    assert load.vector == (1000.0, 0.0, 0.0)
    assert (load.factor.time, load.factor.value) == ((0.0,), (2.0,))


def test_a_scene_from_records_is_the_scene_from_its_file(tmp_path):
    A, B = (0, 0), (0.3, 0)
    records = Scene(
        points={"A": A, "B": B},
        links={"arm": LinkScene(model="beam", material="steel", shape=Bar(between=(A, B), width=0.01, thickness=0.01))},
        joints={"A": Joint(kind="revolute", links=("ground", "arm"), at=A)},
        drive=Drive(joint="A", motion=ConstantSpeed(speed=10)),
        analysis=Analysis(revolutions=1),
    )
    scene = scene_from(records)
    assert scene.model_dump() == read_scene(arm(tmp_path)).model_dump()
    assert scene.source is None


def test_numpy_values_are_numbers():
    bar = Bar(between=(np.zeros(2), np.array([1, 2, 3])), width=np.int64(2), thickness=np.float32(0.5))
    assert bar.between == ((0.0, 0.0, 0.0), (1.0, 2.0, 3.0))
    assert (bar.width, bar.thickness) == (2.0, 0.5)
    raw = read_raw()
    raw["points"]["B"] = np.array([0.3, 0.0, 0.0])
    raw["links"]["arm"]["shape"]["width"] = np.float64(0.02)
    scene = scene_from(raw)
    assert scene.points["B"] == (0.3, 0.0, 0.0)
    assert scene.links["arm"].shape.width == 0.02


@pytest.mark.parametrize("path", TEMPLATES, ids=lambda path: path.stem)
def test_a_template_is_a_scene_and_survives_a_round_trip(path):
    scene = read_scene(path)
    assert time_grid(scene).steps > 100
    assert Scene.model_validate(scene.model_dump()).model_dump() == scene.model_dump()
    assert scene_from(json.loads(scene.model_dump_json()), path.parent).model_dump() == scene.model_dump()
    assert Scene(**dict(scene)).model_dump() == scene.model_dump()


def test_templates_are_those_that_kedfem_new_offers():
    assert [path.stem for path in TEMPLATES] == sorted(kind.replace("-", "_") for kind in KINDS)


def test_no_animation_survives_a_round_trip(tmp_path):
    scene = read_scene(arm(tmp_path, "[output]\nanimation = false\n"))
    assert scene.output.animation is None
    assert scene_from(scene.model_dump()).output.animation is None


def test_a_scene_is_frozen(tmp_path):
    scene = read_scene(arm(tmp_path))
    with pytest.raises(ValueError, match="frozen"):
        scene.title = "other"


def test_a_byte_order_mark_is_no_fault(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_text(ARM, encoding="utf-8-sig")
    assert read_scene(path).links


@pytest.mark.parametrize("heading", ["time [ms], angle [deg]", "t (ms),crank angle (deg)"])
def test_a_motion_table_comes_from_a_file_with_units(tmp_path, heading):
    (tmp_path / "motion.csv").write_text(f"{heading}\n0, 0\n500, 90\n\n1000, 180\n")
    raw = read_raw()
    raw["drive"]["motion"] = {"kind": "curve", "file": "motion.csv"}
    raw["analysis"] = {"end_time": 1.0, "step": 0.01}
    motion = scene_from(raw, tmp_path).drive.motion
    assert_allclose(motion.time, (0.0, 0.5, 1.0))
    assert_allclose(motion.value, (0.0, math.pi / 2, math.pi))
    assert motion.file is None


def test_a_part_is_read_from_its_file(tmp_path):
    (tmp_path / "plate.toml").write_text(
        'outline = [[0, -0.01], "L", { via = [0.09, 0], to = [0.08, 0.01] }, [0, 0.01]]\n'
        'holes = [{ at = "E", diameter = 0.008 }]\nthickness = "5 mm"\norigin = [0, 0]\nx_point = "E"\n'
        'points = { E = ["80 mm", 0], L = { from = "E", distance = 0.01, angle = "-90 deg" } }\n'
    )
    part = part_geometry(tmp_path / "plate.toml")
    assert part.thickness == 0.005
    assert part.x_point == (0.08, 0.0, 0.0)
    assert_allclose(part.outline[1], (0.08, -0.01, 0.0), atol=1e-17)
    assert part.outline[2].to == (0.08, 0.01, 0.0)


@pytest.mark.parametrize("path", sorted((ROOT / "geometry").glob("*.toml")), ids=lambda path: path.stem)
def test_the_parts_of_the_examples_are_good(path):
    assert part_geometry(path).thickness > 0


def test_an_outline_that_repeats_its_first_point_is_closed_once():
    corners = [(0, 0), (1, 0), (1, 1), (0, 0)]
    assert len(Extrusion(outline=corners, thickness=1).outline) == 3


def test_a_fault_of_a_lone_record_is_a_value_error():
    with pytest.raises(ValueError, match="must be positive"):
        Bar(between=((0, 0), (1, 0)), width=-1, thickness=1)


def test_importing_the_scene_leaves_heavy_libraries_alone():
    code = (
        "import sys, kedfem.scene;"
        "print([name for name in ('pint', 'gmsh', 'pyvista', 'matplotlib', 'scipy', 'meshio', 'skfem', 'shapely')"
        " if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_usual_units_are_those_of_pint():
    for name, (unit, factor) in USUAL.items():
        quantity = unit_registry().Quantity(1.0, name)
        assert quantity.check(unit_registry().parse_units(unit).dimensionality)
        assert_allclose(factor, quantity.m_as(unit), rtol=1e-15)
        assert si_number(f"3.7 {name}", unit) == 3.7 * factor
    assert {unit for unit, _ in USUAL.values()} <= set(QUANTITIES)


def test_a_scene_of_usual_units_is_read_without_a_library_of_units():
    scene = ROOT / "examples" / "four_bar_beams" / "scene.toml"
    code = f"import sys, kedfem.scene; kedfem.scene.read_scene({str(scene)!r}); print('pint' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_docs_hold_the_reference_of_keys_as_it_is():
    written = (ROOT / "docs" / "scene.md").read_text(encoding="utf-8")
    assert written == scene_reference(), "python -m reference.scene > docs/scene.md"


def test_every_key_has_a_meaning():
    rows = [line for line in scene_reference().splitlines() if line.startswith("| `")]
    assert len(rows) > 90
    for row in rows:
        assert row.split("|")[5].strip(), row


def test_faults_are_lines_of_one_error():
    first = Fault(("links", "arm", "shape", "between", 1), "must be another point, got the first")
    error = SceneError([first, "c: d", first])
    assert error.faults == (first, Fault((), "c: d"))
    assert str(error) == "links.arm.shape.between[1]: must be another point, got the first\nc: d"


def test_a_fault_says_which_keys_lead_to_it(tmp_path):
    raw = read_raw()
    raw["links"]["arm"]["shape"]["width"] = -1
    raw["joints"]["A"]["links"][1] = "leg"
    raw["drive"]["motion"] = {"kind": "curve", "file": "no.csv"}
    with pytest.raises(SceneError) as caught:
        scene_from(raw, tmp_path)
    places = {fault.where for fault in caught.value.faults}
    assert places >= {
        ("links", "arm", "shape", "width"), ("joints", "A", "links", 1), ("drive", "motion", "file"),
    }  # fmt: skip
