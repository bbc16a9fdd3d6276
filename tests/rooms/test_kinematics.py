"""The rigid mechanism on its own: coordinates, transmission angles, channels, animation, the command and what it says."""

import csv
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmarks.scenes import mechanisms
from numpy.testing import assert_allclose
from PIL import Image

from kedfem.accuracy.prepared import moving
from kedfem.cli import USER_ERROR
from kedfem.dynamics.inertias import inertias_of_links
from kedfem.kinematics import coarse, kinematics, rigid_links, worst_angle
from kedfem.links.build import bare_links
from kedfem.mesh.cad.sides import boundary_sides
from kedfem.motion.coordinates import coordinates, unwrapped
from kedfem.motion.linkage import linkage
from kedfem.motion.transmission import transmissions
from kedfem.output.frames import drawn_bodies, rigid_fields
from kedfem.results import read_results
from kedfem.results.kinematic import coordinate_channel, kinematics_of, plane_normal
from kedfem.scene import Scene, drive_angle, scene_from
from tests.frames import frames
from tests.laws.test_limits import AXES

from ..linkages import (
    RISE,
    RSSR_CRANK,
    RSSR_PIVOT,
    RSSR_ROCKER,
    body,
    cardan,
    four_bar,
    linkage_scene,
    motion_at,
    moved_scene,
    place,
    rssr,
    rssr_points,
    slider_crank,
    spatial_slider_crank,
)
from .test_cli import Command, run_kedfem

__all__ = ["run_kedfem"]  # a fixture

Array = np.ndarray
TURN = np.linspace(0.0, 2 * np.pi, 61)
SKETCH = """
title = "Sketch"
[points]
A = [0, 0]
D = [0.9144, 0]
B = { from = "A", distance = 0.3048, angle = "60 deg" }
C = { from = ["B", "D"], distances = [0.9144, 0.762], side = "left" }
[links]
crank = {}
coupler = {}
rocker = {}
[joints]
A = { kind = "revolute", links = ["ground", "crank"], at = "A" }
B = { kind = "revolute", links = ["crank", "coupler"], at = "B" }
C = { kind = "revolute", links = ["coupler", "rocker"], at = "C" }
D = { kind = "revolute", links = ["rocker", "ground"], at = "D" }
[drive]
joint = "A"
motion = { kind = "constant_speed", speed = "60 rpm" }
[analysis]
revolutions = 2
steps_per_revolution = 90
[output]
plots = false
"""


def transmission_of(joints: Any) -> tuple[Array, str, str]:
    """The one transmission angle over a revolution, [deg]."""
    scene = linkage_scene(joints)
    (found,) = transmissions(scene, linkage(scene))
    return np.degrees(found.angle(motion_at(scene, TURN))), found.coupler, found.driven


def drawn_rssr(ball: bool) -> tuple[dict[str, tuple[Any, ...]], Array]:
    """RSSR drawn at φ = 0, and its rocker's angle over the turn from |Q − P| = constant."""
    psi = 1.2
    P, Q = rssr_points(np.zeros(()), np.asarray(psi))
    length2 = float((Q - P) @ (Q - P))
    out = []
    for phi in TURN:
        w = RSSR_CRANK * np.array([np.cos(phi), np.sin(phi), 0.0]) - RSSR_PIVOT
        # |w|² + r² − 2 r (w_y cos ψ + w_z sin ψ) = L²
        c = (w @ w + RSSR_ROCKER**2 - length2) / (2 * RSSR_ROCKER)
        middle, half = np.arctan2(w[2], w[1]), np.arccos(c / np.hypot(w[1], w[2]))
        psi = min((middle + half, middle - half), key=lambda x: abs(np.angle(np.exp(1j * (x - psi)))))
        out.append(psi)
    return rssr(1.2, ball), np.array(out)


def test_transmission_angle_of_a_four_bar_is_that_between_coupler_and_rocker() -> None:
    a, b, c, d, drawn = 0.1, 0.3, 0.25, 0.35, 0.4
    got, *names = transmission_of(four_bar(a, b, c, d, drawn))
    # law of cosines in the triangle B C D
    wanted = np.degrees(np.arccos((b**2 + c**2 - a**2 - d**2 + 2 * a * d * np.cos(drawn + TURN)) / (2 * b * c)))
    assert_allclose(got, wanted, atol=1e-9)
    assert names == ["coupler", "rocker"]
    assert got.min() < 60
    assert got.max() > 90


def test_transmission_angle_of_a_slider_crank_is_the_rods_against_the_normal_of_the_slide() -> None:
    r, rod, drawn = 0.1, 0.25, 0.3
    got, *names = transmission_of(slider_crank(r, rod, drawn))
    assert_allclose(got, 90 - np.degrees(np.arcsin(np.abs(r / rod * np.sin(drawn + TURN)))), atol=1e-6)
    assert names == ["rod", "slider"]


@pytest.mark.parametrize("ball", [False, True])
def test_transmission_angle_in_space_is_the_coupler_against_the_balls_direction(ball: bool) -> None:
    joints, psi = drawn_rssr(ball)
    if ball:  # the coupler may turn about itself, which nothing drives
        scene = linkage_scene(joints, frames="co-rotational")
        (found,) = transmissions(scene, linkage(scene))
        assert (found.coupler, found.driven) == ("coupler", "rocker")
        return
    got, *names = transmission_of(joints)
    P, Q = rssr_points(TURN, psi)
    u = (P - Q) / np.linalg.norm(P - Q, axis=1, keepdims=True)
    moves = np.stack([0 * psi, -np.sin(psi), np.cos(psi)], axis=1)
    lever = -np.stack([0 * psi, np.cos(psi), np.sin(psi)], axis=1)
    sine = np.degrees(np.arcsin(np.abs((u * moves).sum(axis=1))))
    assert_allclose(got, np.where((u * lever).sum(axis=1) < 0, 180 - sine, sine), atol=1e-6)
    assert names == ["coupler", "rocker"]  # past the cross


def test_transmission_angles_turn_with_the_scene() -> None:
    R = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    R *= np.linalg.det(R)
    plain, *_ = transmission_of(spatial_slider_crank(0.3))
    turned, *_ = transmission_of(moved_scene(spatial_slider_crank(0.3), R, np.array([1.0, 2.0, 3.0])))
    assert_allclose(turned, plain, atol=1e-8)


def test_a_chain_of_two_loops_has_the_couplers_seen_from_the_drive() -> None:
    joints = four_bar(0.1, 0.3, 0.25, 0.35, 0.4)
    E, F = np.array([0.5, 0.2, 0.0]), np.array([0.7, 0.0, 0.0])
    middle = (np.asarray(joints["C"][3]) + np.asarray(joints["D"][3])) / 2
    z = (0.0, 0.0, 1.0)
    more = {
        "E1": ("revolute", "rocker", "second", middle, z),
        "E2": ("revolute", "second", "last", E, z),
        "F": ("revolute", "last", "ground", F, z),
    }
    scene = linkage_scene({**joints, **more})
    assert [(x.coupler, x.driven) for x in transmissions(scene, linkage(scene))] == [
        ("coupler", "rocker"), ("second", "last")
    ]  # fmt: skip


def test_a_cardan_joints_cross_is_no_coupler() -> None:
    scene = linkage_scene(cardan(0.3))
    assert transmissions(scene, linkage(scene)) == []


def test_joint_coordinates_are_counted_beyond_a_turn() -> None:
    r, rod, drawn = 0.1, 0.25, 0.3
    scene = linkage_scene(slider_crank(r, rod, drawn))
    t = np.linspace(0.0, 15.0, 301)
    motion = motion_at(scene, t)
    found = {(x.joint, x.name): x.values(motion) for x in coordinates(scene, linkage(scene))}
    q = drawn + t

    def travel(q: Array) -> Array:
        return r * np.cos(q) + np.sqrt(rod**2 - (r * np.sin(q)) ** 2)

    inclination = -np.arcsin(r / rod * np.sin(q))
    assert_allclose(unwrapped(found["A", "angle"][:, None], None)[:, 0], t, atol=1e-9)
    # of the first link, the crank, against the rod
    against = t - (inclination - inclination[0])
    assert_allclose(unwrapped(found["B", "angle"][:, None], None)[:, 0], against, atol=1e-7)
    assert_allclose(found["guide", "travel"], travel(q) - travel(drawn), atol=1e-9)
    assert set(found) == {("A", "angle"), ("B", "angle"), ("C", "angle"), ("guide", "travel")}


def test_a_universal_joint_turns_about_both_its_axes() -> None:
    """As the hinges of a cross that is a body of its own."""
    beta = 0.5
    joints = cardan(beta)
    axes = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    shafts = linkage_scene({key: joints[key] for key in "AD"}, drive=None, frames="co-rotational").model_dump()
    cross = {"kind": "universal", "links": ("shaft1", "shaft2"), "at": (0.0, 0.0, 0.0), "axes": axes}
    raw = {
        **{key: shafts[key] for key in ("links", "analysis", "materials")},
        "joints": {**shafts["joints"], "U": cross},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 1.0}},
    }
    del raw["analysis"]["frames"]
    whole, crossed = scene_from(raw), linkage_scene(joints)
    motion, other = (motion_at(scene, TURN) for scene in (whole, crossed))
    turns = {(x.joint, x.name): x.values(motion) for x in coordinates(whole, linkage(whole))}
    hinges = {x.joint: x.values(other) for x in coordinates(crossed, linkage(crossed))}
    off = turns["D", "angle"] - hinges["D"]
    assert_allclose(np.exp(1j * off), 1.0, atol=1e-9)  # half a revolution is π or -π
    # B: shaft 1 against the cross about the arm in shaft 1; C: the cross against shaft 2 about that in shaft 2
    assert_allclose(turns["U", "angle_about_shaft1"], -hinges["B"], atol=1e-9)
    assert_allclose(turns["U", "angle_about_shaft2"], hinges["C"], atol=1e-9)
    assert np.ptp(hinges["B"]) > beta


def test_velocities_and_accelerations_are_the_derivatives() -> None:
    scene = linkage_scene(rssr(1.2), motion={**RISE, "angle": 1.5})
    h = 1e-3
    t = 0.3 + h * np.arange(9)
    linked, along = moving(scene)
    motion = motion_at(scene, t)
    got = kinematics_of(scene, linked, along, inertias_of_links(scene, linked, {})).rows(motion)
    eight = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
    for name, values in got.items():
        for kind, rate in (("position", "velocity"), ("velocity", "acceleration"),
                           ("angular_velocity", "angular_acceleration")):  # fmt: skip
            if name.endswith(f"/{kind}"):
                other = got[f"{name.removesuffix(kind)}{rate}"]
                size = max(np.abs(other).max(), 1e-3)
                assert_allclose(eight @ values / h, other[4], rtol=0, atol=1e-7 * size, err_msg=name)
    assert plane_normal(along) is None
    assert got["links/coupler/rotation"].shape == (9, 3)


def test_planar_motion_in_any_plane_is_recorded_as_angles() -> None:
    R = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    R *= np.linalg.det(R)
    scene = linkage_scene(moved_scene(four_bar(0.1, 0.3, 0.25, 0.35, 0.4), R, np.zeros(3)))
    linked, along = moving(scene)
    normal = plane_normal(along)
    assert normal is not None
    assert_allclose(np.abs(normal @ R[:, 2]), 1.0, atol=1e-12)
    motion = motion_at(scene, np.array([0.7]))
    crank = body(scene, "crank")
    got = kinematics_of(scene, linked, along, inertias_of_links(scene, linked, {})).rows(motion)
    assert_allclose(got["links/crank/rotation"], [[0.7 * (normal @ R[:, 2])]], atol=1e-9)
    at, v, a = place(motion, crank, np.asarray(scene.joints["A"].at))
    assert_allclose(got["links/crank/position"], at)
    assert_allclose((v, a), 0.0, atol=1e-9)


def test_boundary_sides_of_two_hexahedra_leave_out_the_one_between() -> None:
    cells = np.array([[0, 1, 2, 3, 4, 5, 6, 7], [4, 5, 6, 7, 8, 9, 10, 11]])
    sides = {tuple(sorted(side)) for side in boundary_sides(cells)}
    assert len(sides) == 10
    assert (4, 5, 6, 7) not in sides


def test_coarse_links_have_the_mass_of_fine_ones() -> None:
    scene = scene_from(mechanisms()["solid four-bar"])
    fine, found = bare_links(scene), rigid_links(scene)
    for name, link in found.items():
        assert link.unknowns <= fine[name].unknowns
        exact = fine[name].volume @ fine[name].one
        # the bores' circles by second-order elements
        assert_allclose(link.volume @ link.one, exact, rtol=2e-3)
    assert coarse(scene.links["crank"]).mesh.elements_across == 1


# -- the command ----------------------------------------------------------------------------------------------


def test_a_sketch_of_joints_alone_is_enough(run_kedfem: Command, tmp_path: Path) -> None:
    path = tmp_path / "sketch.toml"
    path.write_text(SKETCH, encoding="utf-8")
    said = run_kedfem("kinematics", path)
    assert said.code == 0, said.err
    # 0.3048, 0.9144, 0.762, 0.9144: the least transmission angle is acos(3/4), crank and frame in line
    assert re.search(r"coupler +│ rocker +│ +41\.41° │ +92\.87° │ +41\.41° │ +300\.0°", said.out)
    assert re.search(r"A +│ angle \(driven\) +│ +0\.00° │ +720\.00° │ +720\.00°", said.out)
    flat = " ".join(said.err.split())
    assert "links without shape and material are taken to have no mass: crank, coupler, rocker" in flat
    assert "transmission angle" not in flat
    folder = tmp_path / "sketch-kinematics"
    results = read_results(folder / "results.h5")
    assert (results.status, len(results.time)) == ("complete", 181)
    with (folder / "results.csv").open(encoding="utf-8") as file:
        heading, *rows = csv.reader(file)
    assert heading[:2] == ["time [s]", "drive angle [rad]"]
    assert len(rows) == 181
    assert not list(folder.glob("plots"))
    shown = frames(folder)
    assert len(shown) == 73  # 36 a turn, and the first
    assert set(shown[0].celltypes) == {3}  # lines
    assert shown[0].n_cells == 3
    crank = shown[0].extract_cells(shown[0].cell_data["link"] == 0)
    assert np.linalg.norm(crank.points - [0.1524, 0.3048 * np.sqrt(0.75), 0.0], axis=1).min() < 1e-6
    assert run_kedfem("run", path).code == USER_ERROR  # which needs shapes


def test_the_angle_of_a_drive_between_links_says_of_which_against_which(run_kedfem: Command, tmp_path: Path) -> None:
    """An elbow: that of the link named first, which is easily taken the other way round."""
    path = tmp_path / "robot.toml"
    path.write_text(ROBOT, encoding="utf-8")
    said = run_kedfem("kinematics", path)
    assert re.search(r"S +│ angle \(driven\) +│", said.out)
    assert re.search(r"E +│ angle of fore against upper \(driven\) +│", said.out)


ROBOT = """
[links]
upper = {}
fore = {}

[joints]
S = { kind = "revolute", links = ["ground", "upper"], at = [0, 0] }
E = { kind = "revolute", links = ["fore", "upper"], at = [0.6, 0] }

[drives]
S = { joint = "S", motion = { kind = "cycloidal", angle = "90 deg", rise = 1 } }
E = { joint = "E", motion = { kind = "cycloidal", angle = "60 deg", rise = 1 } }

[analysis]
end_time = 1

[output]
plots = false
"""


BLOCK = """
[points]
A = [0, 0]
B = [0, 0.1]
D = [-0.3, 0]

[links]
crank = {{}}
block = {{ model = "rigid"{mass} }}
rocker = {{ model = "rigid"{other} }}

[joints]
A = {{ kind = "revolute", links = ["ground", "crank"], at = "A" }}
B = {{ kind = "revolute", links = ["crank", "block"], at = "B" }}
slide = {{ kind = "prismatic", links = ["rocker", "block"], at = "B", axis = [3, 1] }}
D = {{ kind = "revolute", links = ["rocker", "ground"], at = "D" }}

[drive]
joint = "A"
motion = {{ kind = "constant_speed", speed = "60 rpm" }}

[analysis]
revolutions = 1

[output]
plots = false
"""


def test_rigid_links_of_a_sketch_need_no_shape_and_a_block_may_have_mass(run_kedfem: Command, tmp_path: Path) -> None:
    """The rocker bears nothing, so the crank's pin holds the block on its circle."""
    path = tmp_path / "block.toml"
    path.write_text(BLOCK.format(mass=", mass = 0.2", other=""), encoding="utf-8")
    said = run_kedfem("kinematics", path)
    assert said.code == 0, said.err
    channels = read_results(tmp_path / "block-kinematics" / "results.h5").channels
    force = np.linalg.norm(channels["joints/B/rigid_force"][1], axis=1)
    assert_allclose(force, 0.2 * 0.1 * (2 * np.pi) ** 2, rtol=1e-9)
    pin = 0.1 * np.exp(1j * (np.pi / 2 + channels["joints/A/angle"][1][:, 0])) + 0.3
    assert_allclose(channels["joints/D/angle"][1][:, 0], np.angle(pin) - np.arctan2(1, 3), atol=1e-10)
    path.write_text(BLOCK.format(mass="", other="").replace("crank = {}", 'crank = { model = "rigid", mass = 1 }'))
    said = run_kedfem("kinematics", path)
    assert said.code == USER_ERROR
    assert "links.crank.mass: must be that of what slides [kg], got 1 without a prismatic joint" in " ".join(
        said.err.split()
    )


def test_a_coupler_that_jams_is_warned_of(run_kedfem: Command, tmp_path: Path) -> None:
    path = tmp_path / "sketch.toml"
    path.write_text(SKETCH.replace("distances = [0.9144, 0.762]", "distances = [0.52, 0.762]"), encoding="utf-8")
    flat = " ".join(run_kedfem("kinematics", path).err.split())
    least = np.degrees(np.arccos((0.52**2 + 0.762**2 - 1.2192**2) / (2 * 0.52 * 0.762)))
    assert f"links.coupler: transmission angle {least:.1f}° at drive angle 120.0°, beyond the usual 40° to 140°" in flat


def test_without_a_drive_the_linkage_rests_and_the_command_says_so(run_kedfem: Command, tmp_path: Path) -> None:
    path = tmp_path / "free.toml"
    text = re.sub(
        r"\[drive\].*\[analysis\]\nrevolutions = 2\nsteps_per_revolution = 90",
        "[analysis]\nend_time = 1\nstep = 0.1",
        SKETCH,
        flags=re.S,
    )
    path.write_text(text, encoding="utf-8")
    said = run_kedfem("kinematics", path)
    assert said.code == USER_ERROR
    wanted = "drive: is required for kinematics, got none: without one the linkage rests in the reference position"
    assert wanted in " ".join(said.err.split())
    assert not (tmp_path / "free-kinematics").exists()


def test_a_linkage_that_locks_is_the_users_error(run_kedfem: Command, tmp_path: Path) -> None:
    path = tmp_path / "locks.toml"
    path.write_text(SKETCH.replace("distances = [0.9144, 0.762]", "distances = [0.45, 0.45]"), encoding="utf-8")
    said = run_kedfem("kinematics", path)
    assert said.code == USER_ERROR
    assert "joints." in said.err


def test_the_results_of_a_run_are_left_alone(run_kedfem: Command, tmp_path: Path) -> None:
    path = tmp_path / "sketch.toml"
    path.write_text(SKETCH, encoding="utf-8")
    run = tmp_path / "sketch-results"
    run.mkdir()
    (run / "results.h5").write_text("kept")
    assert run_kedfem("kinematics", path).code == 0
    assert (run / "results.h5").read_text() == "kept"


def test_plots_group_what_belongs_together(tmp_path: Path) -> None:
    raw = scene_with_plots()
    raw.output.fill(plots="each")
    moved = kinematics(raw, tmp_path)
    names = {path.name for path in (tmp_path / "plots").glob("*.png")}
    assert {"links-arm-motion.png", "links-arm-rotation.png", "drive-rigid_torque.png"} <= names
    assert not any("velocity" in name for name in names)
    with Image.open(tmp_path / "plots" / "links-arm-motion.png") as image:
        assert image.convert("L").getextrema()[0] < 100  # something is drawn
    assert set(moved.seconds) == {"motion", "masses", "steps", "table", "plots"}


def scene_with_plots() -> Scene:
    bar = {"kind": "bar", "between": ["A", "B"], "width": 0.01, "thickness": 0.02}
    return scene_from(
        {
            "points": {"A": [0, 0], "B": [0.5, 0]},
            "gravity": [0, -9.81, 0],
            "links": {"arm": {"material": "steel", "shape": bar, "model": "beam"}},
            "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": "A"}},
            "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 3.0}},
            "analysis": {"revolutions": 1, "steps_per_revolution": 36},
            "output": {"animation": False, "probes": {"tip": {"link": "arm", "at": "B", "quantity": "stress"}}},
        }
    )


def test_an_arm_is_held_against_gravity_and_its_centrifugal_force(tmp_path: Path) -> None:
    scene = scene_with_plots()
    scene.output.fill(plots=False)
    found = kinematics(scene, tmp_path).results
    m, r, w = scene.materials["steel"].density * 0.01 * 0.02 * 0.5, 0.25, 3.0
    q = found.angle
    assert_allclose(found.channels["drive/rigid_torque"][1][:, 0], m * 9.81 * r * np.cos(q), atol=1e-9)
    force = m * np.stack([-(w**2) * r * np.cos(q), -(w**2) * r * np.sin(q) + 9.81, 0 * q], axis=1)
    assert_allclose(found.channels["joints/A/rigid_force"][1], force, atol=1e-9)
    tip = found.channels["probes/tip/acceleration"][1]
    assert_allclose(tip, -(w**2) * 0.5 * np.stack([np.cos(q), np.sin(q), 0 * q], axis=1), atol=1e-9)


def test_frames_show_velocities_of_bodies_and_a_dot_for_a_slider() -> None:
    scene = linkage_scene(slider_crank(0.1, 0.25, 0.3), sliders=("slider",))
    linked = linkage(scene)
    seen = drawn_bodies(scene, linked, bare_links(scene))
    assert [x.cell_type for x in seen] == ["quad", "quad", "vertex"]
    motion = motion_at(scene, np.array([0.0, 0.4]))
    (dot,) = rigid_fields(seen, motion, 1)[2:]
    at, v, a = place(motion, body(scene, "slider"), np.asarray(scene.joints["C"].at))
    assert_allclose((dot.points[0], dot.velocity[0], dot.acceleration[0]), (at[1], v[1], a[1]), atol=1e-12)
    assert drive_angle(scene.motion, np.array([0.4]))[0][0] == pytest.approx(0.4)


def test_the_angle_furthest_from_square_is_the_worst() -> None:
    angle, drive = np.radians([60.0, 100.0, 150.0]), np.array([0.0, 1.0, 2.0])
    assert worst_angle(angle, drive) == pytest.approx((np.radians(150.0), 2.0))


@pytest.mark.parametrize("axis", AXES.values(), ids=list(AXES))
def test_travels_of_a_planar_joint_are_along_the_directions_that_are_told(axis: np.ndarray) -> None:
    """A crank whose point on a plane across its axis goes round: (R − I) X along both directions."""
    at = np.array([0.3, -0.2, 0.4])
    scene = linkage_scene(
        {"A": ("revolute", "ground", "crank", (0, 0, 0), axis), "P": ("planar", "ground", "crank", at, axis)}
    )
    linked, motion = linkage(scene), motion_at(scene, np.linspace(0, 1, 5))
    gone = motion.R[:, 1] @ at - at
    directions = []
    for each in coordinates(scene, linked)[-2:]:
        channel, rows = coordinate_channel(each, linked)
        told = re.search(r"along \((.*)\) there$", channel.description)
        assert told is not None
        directions.append(np.array(told[1].split(", "), float))
        assert_allclose(rows(motion)[:, 0], gone @ directions[-1], atol=1e-4)
    assert_allclose(np.cross(*directions), axis, atol=1e-3)
