"""Every fault of a scene has its message: where, what was wanted, what was got; all faults come at once."""

import copy
import re
import tomllib
from pathlib import Path

import pytest

from kedfem.errors import SceneError
from kedfem.motion.linkage import linkage
from kedfem.scene import Bar, Scene, read_scene, scene_from, time_grid

GOOD = """
[points]
A = [0, 0]
D = [0.3, 0]
B = { from = "A", distance = 0.1, angle = "60 deg" }
C = { from = ["B", "D"], distances = [0.3, 0.25] }
M = { between = ["C", "D"], offset = 0.012 }

[materials.mine]
density = 2796
youngs_modulus = 7.031e10
shear_modulus = 2.712e10

[links.crank]
material = "mine"
shape = { kind = "bar", between = ["A", "B"], width = 0.02, thickness = 0.01 }

[links.coupler]
material = "steel"
shape = { kind = "plate_link", between = ["B", "C"], width = 0.02, thickness = 0.01, bore_diameter = 0.01 }

[links.rocker]
material = "steel"
mesh = { size = 0.005 }

[links.rocker.shape]
kind = "extrusion"
outline = [[0.29, -0.02], [0.31, -0.02], [0.32, 0.26], { via = [0.3, 0.28], to = [0.28, 0.26] }]
holes = [{ at = "C", diameter = 0.01 }, { at = "D", diameter = 0.01 }]
thickness = 0.01

[joints.A]
kind = "revolute"
links = ["ground", "crank"]
at = "A"
[joints.B]
kind = "revolute"
links = ["crank", "coupler"]
at = "B"
[joints.C]
kind = "revolute"
links = ["coupler", "rocker"]
at = "C"
[joints.D]
kind = "revolute"
links = ["rocker", "ground"]
at = "D"

[drive]
joint = "A"
motion = { kind = "constant_speed", speed = "600 rpm" }

[loads.push]
kind = "force"
link = "rocker"
at = "C"
vector = [0, -100]

[bodies.wheel]
kind = "flywheel"
link = "rocker"
at = "joints.D"
inertia = 0.08

[damping]
ratio = 0.02
frequencies = [10, 1000]

[analysis]
revolutions = 2
steps_per_revolution = 360

[output.probes.middle]
link = "rocker"
at = "M"
quantity = "stress"
"""

BEAMS = """
[links.arm]
model = "beam"
material = "steel"
shape = { kind = "bar", between = [[0, 0], [1, 0]], width = 0.02, thickness = 0.01 }
[links.shoe]
model = "rigid"
mass = 0.5
[joints.A]
kind = "revolute"
links = ["ground", "arm"]
at = [0, 0]
[joints.B]
kind = "revolute"
links = ["arm", "shoe"]
at = [1, 0]
[joints.S]
kind = "prismatic"
links = ["shoe", "ground"]
at = [1, 0]
axis = "x"
[drive]
joint = "A"
motion = { kind = "cycloidal", angle = 1.5, rise = 0.5 }
[analysis]
end_time = 1.0
step = 0.001
"""

FREE = """
gravity = [0, -9.81, 0]
[links.arm]
material = "steel"
segments = 2
shape = { kind = "bar", between = [[0, 0], [1, 0]], width = 0.02, thickness = 0.01 }
[links.rod]
model = "beam"
material = "steel"
shape = { kind = "bar", between = [[1, 0], [2, 0]], width = 0.02, thickness = 0.01 }
[links.shoe]
model = "rigid"
mass = 0.5
[joints.A]
kind = "revolute"
links = ["ground", "arm"]
at = [0, 0]
[joints.B]
kind = "revolute"
links = ["arm", "rod"]
at = [1, 0]
[joints.C]
kind = "spherical"
links = ["rod", "shoe"]
at = [2, 0]
[joints.S]
kind = "prismatic"
links = ["shoe", "ground"]
at = [2, 0]
axis = "x"
[motors.m]
joint = "A"
torque = { over = "speed", at = [0, "600 rpm"], value = ["5 N*m", 0] }
[motors.push]
joint = "S"
force = { over = "travel", at = ["0 mm", "5 mm"], value = [0, 10] }
[springs.pull]
kind = "spring"
between = [{ link = "rod", at = [2, 0] }, { link = "ground", at = [2, 1] }]
stiffness = "2 N/mm"
[springs.turn]
kind = "torsion"
joint = "B"
stiffness = 3
damping = 0.1
free_angle = "30 deg"
[analysis]
end_time = 1
step = 0.001
initial_speeds = { A = "60 rpm" }
initial_motions = { rod = { at = [1, 0], velocity = [0, 6] } }
"""

BASES = {"solid": GOOD, "beam": BEAMS, "free": FREE}
CASES = [
    pytest.param(
        base, case.get("change", {}), case.get("gone", []), expected, "in_full" in case, id=f"{base}{i}: {expected[0]}"
    )
    for base, cases in tomllib.loads((Path(__file__).parent / "bad_scenes.toml").read_text("utf-8")).items()
    for i, case in enumerate(cases)
    for expected in [case.get("faults") or case["in_full"]]
]


def changed(text, change, gone=()):
    """The scene of a TOML text with values at paths (a/b/0) replaced or added, and others taken out."""
    scene = tomllib.loads(text)
    for path, value in change.items():
        table, key = parent(scene, path)
        table[key] = copy.deepcopy(value)
    for path in gone:
        table, key = parent(scene, path)
        del table[key]
    return scene


def parent(table, path):
    *above, last = path.split("/")
    for key in above:
        table = table[int(key)] if isinstance(table, list) else table.setdefault(key, {})
    return table, int(last) if isinstance(table, list) else last


def faults_of(call, *arguments):
    with pytest.raises(SceneError) as caught:
        call(*arguments)
    return [str(fault) for fault in caught.value.faults]


@pytest.mark.parametrize("text", BASES.values(), ids=BASES)
def test_the_scenes_are_good_before_they_are_changed(text):
    assert scene_from(tomllib.loads(text)).links


def says(fault, expected):
    """Whether a fault is at a place, word for word, and its message holds the phrases after it, in their order."""
    place, _, phrases = expected.partition(": ")
    words = ".*".join(rf"(?<!\w){re.escape(phrase)}(?!\w)" for phrase in phrases.split(" … "))
    return re.match(rf"{re.escape(place)}: .*?{words}", fault) is not None


@pytest.mark.parametrize(("base", "change", "gone", "expected", "in_full"), CASES)
def test_a_fault_has_its_message(base, change, gone, expected, in_full):
    faults = faults_of(scene_from, changed(BASES[base], change, gone))
    if in_full:
        assert faults == expected
    else:
        assert len(faults) == len(expected), faults
        for fault, wanted in zip(faults, expected, strict=True):
            assert says(fault, wanted), f"{fault!r} does not say {wanted!r}"


@pytest.mark.parametrize(
    ("fault", "heard"),
    [
        ("links.a.width: has to be positive [m], but -4 was given", True),  # other words for the same
        ("links.b.width: must be positive [m], got -4", False),  # another place
        ("links.a.width: must be positive, got -4", False),  # no unit
        ("links.a.width: must be positive [m], got -42", False),  # another value
        ("links.a.width: must be positive [m]", False),
    ],
)
def test_a_message_may_be_reworded_but_keeps_place_and_substance(fault, heard):
    assert says(fault, "links.a.width: positive … [m] … -4") is heard


def test_faults_of_all_tables_of_a_scene_come_at_once():
    change = {
        "links/crank/shape/width": -0.04,
        "links/crank/material": "stel",
        "links/coupler/shape/bore_diameter": "600 rpm",
        "links/rocker/colour": "red",
        "points/C/distances": [0.05, 0.05],
        "joints/B/links": ["crank", "couple"],
        "joints/D/kind": "hinge",
        "drive/joint": "Q",
        "damping/alpha": 3,
        "analysis/end_time": 1,
        "output/probes/middle/link": "roker",
        "bodies/wheel/inertia": 0,
    }
    assert sorted(faults_of(scene_from, changed(GOOD, change))) == [
        "analysis.revolutions: cannot be combined with end_time, got both",
        "bodies.wheel.inertia: must be positive [kg*m^2], got 0",
        "damping.ratio: cannot be combined with alpha and beta, got both",
        "drive.joint: must name a joint, got 'Q', known: A, B, C, D",
        "joints.B.links[1]: must name a link, got 'couple', did you mean 'coupler'?",
        "joints.D.kind: must be one of revolute, spherical, weld, prismatic, cylindrical, screw, universal, planar, "
        "slot, got 'hinge'",
        "links.coupler.shape.bore_diameter: must be a length [m], got '600 rpm': the unit 'rpm' is of another kind",
        "links.crank.material: must name a material, got 'stel', did you mean 'steel'?",
        "links.crank.shape.width: must be positive [m], got -0.04",
        "links.rocker.colour: unknown key, known: model, reduction, material, shape, mass, centre, inertia, "
        "mesh, element, min_quality, shear_coefficient, beam, frames, segments",
        "output.probes.middle.link: must name a link, got 'roker', did you mean 'rocker'?",
        "points.C: circles of radius 0.05 and 0.05 must meet [m], got centres 0.264575 apart: a gap of 0.164575",
    ]


def test_a_record_that_has_not_been_checked_is_refused():
    bare = Scene(**dict(scene_from(tomllib.loads(GOOD))))
    wanted = "the scene: must be made by scene_from or read_scene, got a record that has not been checked"
    assert faults_of(linkage, bare) == [wanted]
    assert scene_from(bare) == scene_from(tomllib.loads(GOOD))
    linkage(scene_from(bare))


def test_a_scene_must_be_a_table():
    assert faults_of(scene_from, [1]) == ["must be a table of keys, got [1]"]


def test_a_name_cannot_be_looked_up_outside_a_scene():
    with pytest.raises(ValueError, match="must be coordinates in a record that is made outside a scene, got 'A'"):
        Bar(between=("A", (1, 0)), width=1, thickness=1)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "{path}: must be a file, got nothing there"),
        (b"", "{path}: must hold at least one key, got an empty file"),
        (b"# nothing yet\n", "{path}: must hold at least one key, got an empty file"),
        (b"a = 1\nb = \n", "{path}, line 2: must be valid TOML, got: Invalid value"),
        (b"a = 1\na = 2\n", "{path}, line 2: must be valid TOML, got: Cannot overwrite a value"),
        (b"[points\nA = 1", "{path}, line 1: must be valid TOML, got: Expected ']' at the end of a table declaration"),
        (b'title = "half', "{path}, line 1: must be valid TOML, got: Unterminated string (at end of document)"),
        (b"a = '\xff'", "{path}: must be text in UTF-8, got other bytes at position 5"),
    ],
)
def test_a_scene_file_that_cannot_be_read(tmp_path, content, message):
    path = tmp_path / "scene.toml"
    if content is not None:
        path.write_bytes(content)
    assert faults_of(read_scene, path) == [message.format(path=path)]


def test_a_folder_is_no_scene_file(tmp_path):
    assert faults_of(read_scene, tmp_path) == [f"{tmp_path}: must be a readable file, got: Is a directory"]


PART = {"links/rocker/shape": {"kind": "part", "file": "part.toml", "between": ["C", "D"]}}
PLATE = """
outline = [[-0.1, -0.1], [0.4, -0.1], [0.4, 0.1], [-0.1, 0.1]]
thickness = 0.01
origin = [0, 0]
x_point = [0.25, 0]
"""


@pytest.mark.parametrize(
    ("plate", "message"),
    [
        (
            PLATE.replace("0.25", "0.26"),
            "between: must be as far apart as origin and x_point of the part 0.26 [m], got 0.25",
        ),
        (PLATE.replace("0.25", "0"), "file: part.toml: x_point: must differ from the origin, got the same point"),
        (PLATE.replace("thickness", "thicknes"), "file: part.toml: thickness: is required [m], got nothing"),
        (PLATE.replace("thickness = 0.01", "thickness = -1"), "file: part.toml: thickness: must be positive [m], got -1"),
        (PLATE.replace("[0, 0]", '"O"'), "file: part.toml: origin: must name a point, got 'O', known: none"),
        (
            PLATE + "[points]\nP = [1]",
            "file: part.toml: points.P: must be a point: a name, two or three coordinates [m], or a construction, "
            "got [1]",
        ),
    ],
)
def test_a_part_that_does_not_fit(tmp_path, plate, message):
    (tmp_path / "part.toml").write_text(plate)
    faults = faults_of(scene_from, changed(GOOD, PART, ["links/rocker/mesh"]), tmp_path)
    assert f"links.rocker.shape.{message}" in faults


def test_a_part_that_fits_is_no_fault(tmp_path):
    (tmp_path / "part.toml").write_text(PLATE)
    assert scene_from(changed(GOOD, PART, ["links/rocker/mesh"]), tmp_path).links["rocker"].shape.file == "part.toml"


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("0, 0\n1; 2\n", "motion.csv, line 2: must be two numbers, time and angle, got '1; 2'"),
        ("t, phi, omega\n0, 0\n", "motion.csv, line 1: must head two columns, time and angle, got 't, phi, omega'"),
        (
            "t [s], phi [mm]\n0, 0\n",
            "motion.csv, line 1: must have units of time and angle, got: the unit 'mm' is of another kind",
        ),
        (
            "t_ms, phi_deg\n0, 0\n",
            "motion.csv, line 1: must have units of time and angle, got: 't_ms'; units stand in brackets, as in [ms]",
        ),
        (
            "t in s, phi/deg\n0, 0\n",
            "motion.csv, line 1: must have units of time and angle, got: 'phi/deg'; units stand in brackets, as in [deg]",
        ),
        ("angle, time\n0, 0\n", "motion.csv, line 1: must head two columns, time and angle, got 'angle, time'"),
        ("time, speed\n0, 0\n", "motion.csv, line 1: must head two columns, time and angle, got 'time, speed'"),
        ("0, O\n1, 1\n", "motion.csv, line 1: must be two numbers, time and angle, got '0, O'"),
    ],
)
def test_a_motion_table_that_cannot_be_read(tmp_path, table, message):
    (tmp_path / "motion.csv").write_text(table)
    change = {"drive/motion": {"kind": "curve", "file": "motion.csv"}, "analysis": {"end_time": 1, "step": 0.1}}
    assert faults_of(scene_from, changed(GOOD, change), tmp_path) == [f"drive.motion.file: {message}"]


def test_a_motion_table_is_in_a_file_or_in_the_scene():
    motion = {"kind": "curve", "file": "motion.csv", "time": [0, 1], "value": [0, 1]}
    change = {"drive/motion": motion, "analysis": {"end_time": 1, "step": 0.1}}
    assert faults_of(scene_from, changed(GOOD, change)) == [
        "drive.motion.file: cannot be combined with at and value, got both"
    ]


ODD = [None, -1, 2.5, "", "x", "crank", "5 °", "9**9**9 m", [], {}, True, [[1]], {"kind": ["x"]}, 10**400, "joints.A"]


def paths(table, above=""):
    for key, value in table.items() if isinstance(table, dict) else enumerate(table):
        yield f"{above}{key}"
        if isinstance(value, (dict, list)):
            yield from paths(value, f"{above}{key}/")


@pytest.mark.parametrize("base", [pytest.param(x, marks=() if x == "beam" else pytest.mark.long) for x in BASES])
def test_no_odd_value_anywhere_gives_more_than_lines_of_faults(base):
    """Every odd value at every third place of the long scenes, and another third for the next one."""
    every = 1 if base == "beam" else 3
    for k, path in enumerate(paths(tomllib.loads(BASES[base]))):
        for odd in ODD[k % every :: every]:
            try:
                scene_from(changed(BASES[base], {path: odd}))
            except SceneError as error:
                for line in map(str, error.faults):
                    assert "\n" not in line, line
                    assert ", got " in line or "unknown key, " in line, line
                    assert "function-" not in line, line
                    assert "Input should" not in line, line


def test_a_table_rounded_to_whole_degrees_is_refused_with_its_place_and_remedy(tmp_path):
    rows = [f"{k / 100},{round(90 * k / 100 * k / 100)}" for k in range(101)]
    (tmp_path / "motion.csv").write_text("\n".join(["time [s],angle [deg]", *rows]))
    motion = {"kind": "curve", "file": "motion.csv"}
    change = {"drive/motion": motion, "analysis": {"end_time": 1, "step": 0.1}}
    (fault,) = faults_of(scene_from, changed(GOOD, change), tmp_path)
    assert fault.startswith(
        "drive.motion.value: must be smooth enough for its acceleration to shake nothing (more digits"
    )
    assert "smoothing = 0.01" in fault  # twice the 0.005 rad that rounding to 1 deg scatters by: 0.0175/√12
    change["drive/motion"] = {**motion, "smoothing": "0.5 deg"}
    assert scene_from(changed(GOOD, change), tmp_path).motion.smoothing == pytest.approx(0.00873, abs=1e-5)


def test_a_table_of_travel_is_read_in_its_unit(tmp_path):
    (tmp_path / "motion.csv").write_text("Time (ms),Travel (mm)\n0,0\n500,3\n1000,20\n")
    change = {"drive": {"joint": "S", "motion": {"kind": "curve", "file": "motion.csv"}}}
    motion = scene_from(changed(BEAMS, change), tmp_path).motion
    assert motion.time == (0.0, 0.5, 1.0)
    assert motion.value == pytest.approx((0.0, 0.003, 0.02))


def test_a_file_of_travel_is_refused_on_a_hinge(tmp_path):
    (tmp_path / "motion.csv").write_text("time [s], travel [mm]\n0,0\n1,20\n")
    change = {"drive/motion": {"kind": "curve", "file": "motion.csv"}, "analysis": {"end_time": 1, "step": 0.1}}
    (fault,) = faults_of(scene_from, changed(GOOD, change), tmp_path)
    assert fault.startswith("drive.motion.value[0]: must be an angle [rad], got '0.0 m'")


def test_a_curve_of_motion_that_repeats_itself_needs_no_end():
    motion = {"kind": "curve", "time": [0, 0.25, 0.5, 0.75], "value": [0, 1, 0, -1], "period": 1}
    scene = scene_from(changed(GOOD, {"drive/motion": motion, "analysis": {"kind": "steady", "step": 0.1}}))
    assert time_grid(scene).end == pytest.approx(1.0)


def test_a_fault_of_a_motion_that_repeats_itself_has_no_echo():
    """Whatever it is of: the analysis still needs no end."""
    curve = {"kind": "curve", "time": [0, 0.5], "value": [0, "x"], "period": 1}
    back = {"kind": "cycloidal", "angle": "x", "rise": 1.0, "return_time": 1.0}
    for motion in (curve, back, {"kind": "constant_speed", "speed": "x"}):
        for kind in ("steady", "static", "quasi-static"):
            faults = faults_of(scene_from, changed(GOOD, {"drive/motion": motion, "analysis": {"kind": kind}}))
            assert [fault[:12] for fault in faults] == ["drive.motion"]
