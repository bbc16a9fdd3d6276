"""Several drives, slides, gears, racks and screws against closed forms; accelerations against differences."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from kedfem.errors import MotionError
from kedfem.motion.linkage import linkage
from kedfem.motion.path import path
from kedfem.motion.rigid import RigidMotion, rigid_motion
from kedfem.scene import Scene, path_parameter
from tests.linkages import RISE, JointTable, Z, body, drive_rates, linkage_scene, motion_at, place, slider_crank, turned

X, Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
T = np.linspace(0.0, 1.0, 61)
STENCIL = np.array([-1 / 60, 3 / 20, -3 / 4, 0, 3 / 4, -3 / 20, 1 / 60])  # central difference of order 6


def drives(**motions: tuple[str, dict[str, object]]) -> dict[str, object]:
    return {"drives": {name: {"joint": joint, "motion": law} for name, (joint, law) in motions.items()}}


def steady(speed: float) -> dict[str, object]:
    return {"kind": "constant_speed", "speed": speed}


def check_accelerations(scene: Scene, t: np.ndarray, X: np.ndarray, link: str) -> None:
    """v = x', p'' = v' of a point, ω' = α: sixth-order differences, h = 1e-3: error h⁶/140 · 7th derivative + 1e-15/h."""
    h, near = 1e-3, np.arange(-3, 4)
    m = motion_at(scene, (t[:, None] + h * near).ravel())
    k = body(scene, link)
    x, v, a = (q.reshape(len(t), 7, 3) for q in place(m, k, X))
    omega, alpha = (q[:, k].reshape(len(t), 7, 3) for q in (m.omega, m.alpha))
    for value, rate in ((x, v), (v, a), (omega, alpha)):
        slope = np.einsum("tsk,s->tk", value, STENCIL) / h
        assert_allclose(rate[:, 3], slope, atol=1e-10 * max(1.0, np.abs(slope).max()))


# -- couplings -------------------------------------------------------------------------------------------------------


def test_a_screw_travels_its_lead_in_a_turn() -> None:
    """A spindle turned at the ground's hinge, a nut that cannot turn: travel = −lead · φ/2π; left-handed too."""
    for lead in (0.005, -0.02):
        joints: JointTable = {
            "A": ("revolute", "ground", "spindle", (0.0, 0.0, 0.0), X),
            "S": ("screw", "spindle", "nut", (0.1, 0.0, 0.0), X, {"lead": lead}),
            "G": ("prismatic", "nut", "ground", (0.1, 0.05, 0.0), X),
        }
        scene = linkage_scene(joints, motion={**RISE, "angle": 50.0}, sliders=("nut",))
        m = motion_at(scene, T)
        nut = body(scene, "nut")
        # q of the screw is that of the spindle against the nut: −travel of the nut = lead · φ/2π
        assert_allclose(m.p[:, nut, 0], -lead * m.phi / (2 * np.pi), atol=1e-13)
        assert_allclose(m.R[:, nut], np.tile(np.eye(3), (len(T), 1, 1)), atol=1e-13)
        _, _, a = place(m, nut, np.zeros(3))
        assert_allclose(a[:, 0], -lead * 50 * 2 * np.pi * np.sin(2 * np.pi * T) / (2 * np.pi), atol=1e-11)


def pair(**gear: object) -> tuple[JointTable, dict[str, object]]:
    joints: JointTable = {
        "A": ("revolute", "ground", "pinion", (0.0, 0.0, 0.0), Z),
        "B": ("revolute", "wheel", "ground", (0.3, 0.0, 0.0), Z),
    }
    return joints, {"gears": {"g": {"joints": ["A", "B"], **gear}}}


@pytest.mark.parametrize(
    ("gear", "ratio"),
    [
        ({"ratio": -2.5}, -2.5),
        ({"teeth": [20, 40]}, -0.5),
        ({"teeth": [17, 51], "internal": True}, 1 / 3),
        pytest.param({"ratio": 61.7}, 61.7, marks=pytest.mark.long),
    ],
)
def test_gears_turn_in_proportion(gear: dict[str, object], ratio: float) -> None:
    joints, sections = pair(**gear)
    scene = linkage_scene(joints, motion={**RISE, "angle": 8.0}, sections=sections)
    m = motion_at(scene, T)
    angle, wheel = ratio * m.phi, body(scene, "wheel")
    assert_allclose(m.R[:, wheel, 0, 0], np.cos(angle), atol=1e-12 * max(1, abs(ratio)))
    assert_allclose(m.R[:, wheel, 1, 0], np.sin(angle), atol=1e-12 * max(1, abs(ratio)))
    assert_allclose(m.omega[:, wheel, 2], ratio * 8 * (1 - np.cos(2 * np.pi * T)), atol=1e-12 * abs(ratio) * 16)
    assert_allclose(m.alpha[:, wheel, 2], ratio * 16 * np.pi * np.sin(2 * np.pi * T), atol=1e-12 * abs(ratio) * 100)


@pytest.mark.parametrize(
    ("gear", "revolutions"),
    [({"teeth": [3, 5]}, 5), pytest.param({"teeth": [24, 59]}, 59, marks=pytest.mark.long), ({"ratio": 1.5}, 2)],
)
def test_a_pair_of_gears_repeats_after_as_many_turns_as_its_teeth_ask_for(
    gear: dict[str, object], revolutions: int
) -> None:
    """Teeth z1, z2 without a common factor: after z2 turns; then 10⁴ turns are as exact as the first few."""
    joints, sections = pair(**gear)
    scene = linkage_scene(joints, motion=steady(2 * np.pi), sections=sections)
    link = linkage(scene)
    along = path(link, 0.0, 2e4 * np.pi)
    assert along.period == pytest.approx(2 * np.pi * revolutions, rel=1e-12)
    ratio = gear["ratio"] if "ratio" in gear else -gear["teeth"][0] / gear["teeth"][1]  # type: ignore[index]
    t = 1e4 - np.linspace(0, 3, 40)
    m = rigid_motion(link, along, t, path_parameter(scene, t))
    angle = ratio * np.remainder(t, revolutions) * 2 * np.pi  # exact: a wheel is back after its turns
    off = Rotation.from_matrix(m.R[:, body(scene, "wheel")]).inv() * Rotation.from_rotvec(np.outer(angle, Z))
    assert off.magnitude().max() < 3e-11  # φ itself, 6e4 rad, is known to 7e-12


def test_gears_that_are_not_quite_whole_drift_as_they_must() -> None:
    """Ratio 2 + 1e-11: the path repeats to 6e-11 rad, yet after 10⁴ turns the wheel is 6.3e-7 rad ahead."""
    joints, sections = pair(ratio=2 + 1e-11)
    scene = linkage_scene(joints, motion=steady(2 * np.pi), sections=sections)
    link = linkage(scene)
    along = path(link, 0.0, 2e4 * np.pi)
    assert along.periodic
    t = np.array([1e4 - 0.5, 1e4])
    m = rigid_motion(link, along, t, path_parameter(scene, t))
    ahead = np.arctan2(m.R[:, body(scene, "wheel"), 1, 0], m.R[:, body(scene, "wheel"), 0, 0])
    assert_allclose(ahead, 1e-11 * 2 * np.pi * t, atol=3e-11)


def test_a_rack_travels_by_the_radius_per_radian() -> None:
    joints: JointTable = {
        "A": ("revolute", "ground", "pinion", (0.0, 0.0, 0.0), Z),
        "B": ("prismatic", "rack", "ground", (0.0, -0.04, 0.0), X),
    }
    sections = {"gears": {"g": {"joints": ["A", "B"], "radius": "40 mm"}}}
    scene = linkage_scene(joints, motion={**RISE, "angle": 9.0}, sliders=("rack",), sections=sections)
    m = motion_at(scene, T)
    assert_allclose(m.p[:, body(scene, "rack"), 0], 0.04 * m.phi, atol=1e-14)
    assert_allclose(m.v[:, body(scene, "rack"), 0], 0.36 * (1 - np.cos(2 * np.pi * T)), atol=1e-13)


def test_a_planetary_gear_obeys_willis() -> None:
    """Sun, planet, fixed ring: planet against arm −z_s/z_p, ring against arm z_p/z_r; ω_arm = ω_sun z_s/(z_s + z_r).

    R. Willis, Principles of Mechanism (1841). Sun 24, planet 18, ring 60: arm 24/84 of the sun.
    """
    joints: JointTable = {
        "S": ("revolute", "sun", "ground", (0.0, 0.0, 0.0), Z),
        "arm to sun": ("revolute", "sun", "arm", (0.0, 0.0, 0.0), Z),
        "P": ("revolute", "planet", "arm", (0.21, 0.0, 0.0), Z),
        "R": ("revolute", "ring", "arm", (0.0, 0.0, 0.1), Z),
        "held": ("weld", "ring", "ground", (0.0, 0.5, 0.0)),
    }
    sections = {
        "gears": {
            "outer": {"joints": ["arm to sun", "P"], "teeth": [24, 18]},
            "inner": {"joints": ["P", "R"], "teeth": [18, 60], "internal": True},
        }
    }
    scene = linkage_scene(joints, "S", {**RISE, "angle": 30.0}, sections=sections)
    m = motion_at(scene, T)
    omega = 30 * (1 - np.cos(2 * np.pi * T))
    arm = 24 / 84
    assert_allclose(m.omega[:, body(scene, "arm"), 2], arm * omega, atol=1e-11)
    assert_allclose(m.omega[:, body(scene, "planet"), 2], (arm - (1 - arm) * 24 / 18) * omega, atol=1e-11)
    angle = arm * m.phi
    assert_allclose(m.R[:, body(scene, "arm"), :2, 0], np.stack([np.cos(angle), np.sin(angle)], 1), atol=1e-11)


# -- several drives --------------------------------------------------------------------------------------------------


def five_bar(rod: float = 0.4) -> JointTable:
    """Cranks 0.2 m about (0, 0) and (0.3, 0), rods that meet above; cranks drawn at 130° and 50°."""
    P = np.array([0.2 * np.cos(np.radians(130)), 0.2 * np.sin(np.radians(130)), 0.0])
    Q = np.array([0.3 + 0.2 * np.cos(np.radians(50)), 0.2 * np.sin(np.radians(50)), 0.0])
    return {
        "A": ("revolute", "ground", "left", (0.0, 0.0, 0.0), Z),
        "B": ("revolute", "left", "rod", P, Z),
        "C": ("revolute", "rod", "other rod", meeting(P, Q, rod), Z),
        "D": ("revolute", "other rod", "right", Q, Z),
        "E": ("revolute", "right", "ground", (0.3, 0.0, 0.0), Z),
    }


def meeting(P: np.ndarray, Q: np.ndarray, rod: float = 0.4) -> np.ndarray:
    """Where rods from P and Q meet, to the left of P → Q."""
    d = Q - P
    s = np.linalg.norm(d, axis=-1, keepdims=True)
    return (P + Q) / 2 + np.sqrt(rod**2 - s**2 / 4) * np.cross(Z, d) / s


FIVE = drives(
    left=("A", {"kind": "cycloidal", "angle": 0.9, "rise": 1.0}),
    right=("E", {"kind": "polynomial", "order": 7, "angle": -0.6, "rise": 1.0}),
)


def test_a_five_bar_with_two_drives_is_two_circles_that_meet() -> None:
    scene = linkage_scene(five_bar(), None, sections=FIVE)
    m = motion_at(scene, T)
    one = 0.9 * (T - np.sin(2 * np.pi * T) / (2 * np.pi))
    other = -0.6 * T**4 * (35 - 84 * T + 70 * T**2 - 20 * T**3)
    assert_allclose(m.drives, np.stack([one, other], 1), atol=1e-14)
    assert_allclose(m.phi, one, atol=1e-14)
    arms = [np.radians(130) + one, np.radians(50) + other]
    P, Q = (0.2 * np.stack([np.cos(a), np.sin(a), 0 * a], 1) for a in arms)
    C = np.asarray(five_bar()["C"][3])
    for link in ("rod", "other rod"):
        assert_allclose(place(m, body(scene, link), C)[0], meeting(P, Q + np.array([0.3, 0, 0])), atol=1e-12)
    check_accelerations(scene, np.linspace(0.05, 0.95, 9), C, "rod")


def test_rates_per_drive_add_up() -> None:
    """v = Σ (∂p/∂q_d) q_d', and each is the difference of the poses that this drive alone makes."""
    scene = linkage_scene(five_bar(), None, sections=FIVE)
    m = motion_at(scene, T)
    linked = linkage(scene)
    each = [drive_rates(linked, path(linked, 0.0, 1.0), T, drive) for drive in (0, 1)]
    rates = [0.9 * (1 - np.cos(2 * np.pi * T)), -0.6 * 140 * T**3 * (1 - T) ** 3]
    total = sum(v * rate[:, None, None] for (v, _), rate in zip(each, rates, strict=True))
    assert_allclose(m.v, total, atol=1e-13)
    first = linkage_scene(five_bar(), None, sections=drives(left=("A", steady(1.0)), right=("E", steady(0.0))))
    alone = motion_at(first, np.zeros(1))
    assert_allclose(alone.v[0], each[0][0][0], atol=1e-13)
    assert_allclose(alone.omega[0], each[0][1][0], atol=1e-13)


AXES = (Z, Y, Y, X, Y, X)
SPOTS = np.array([[0, 0, 0], [0, 0, 0.4], [0, 0, 0.8], [0.3, 0, 0.8], [0.5, 0, 0.8], [0.6, 0, 0.8]], float)


def arm() -> tuple[Scene, list[np.ndarray]]:
    """A six-axis arm, every joint driven by a law of its own, those between moving links too."""
    links = ["ground", *(f"link{k}" for k in range(1, 7))]
    joints: JointTable = {
        f"J{k}": ("revolute", *((links[k + 1], links[k]) if k % 2 else (links[k], links[k + 1])), SPOTS[k], AXES[k])
        for k in range(6)
    }
    height = [1.1, -0.7, 0.9, 2.0, -1.4, 3.0]
    laws = {f"d{k}": (f"J{k}", {"kind": "cycloidal", "angle": h, "rise": 1.0 + 0.1 * k}) for k, h in enumerate(height)}
    x = [T / (1.0 + 0.1 * k) for k in range(6)]
    q = [h * (u - np.sin(2 * np.pi * u) / (2 * np.pi)) for h, u in zip(height, x, strict=True)]
    # where a joint's first link is the lower one of two moving links, its turn is that of the lower against the upper
    signs = [1 if k % 2 or k == 0 else -1 for k in range(6)]
    return linkage_scene(joints, None, sections=drives(**laws)), [s * a for s, a in zip(signs, q, strict=True)]


def test_an_open_arm_with_six_drives_is_a_product_of_rotations() -> None:
    scene, q = arm()
    m = motion_at(scene, T)
    R, p = np.tile(np.eye(3), (len(T), 1, 1)), np.zeros((len(T), 3))
    for k in range(6):
        p = p + R @ SPOTS[k]
        R = R @ Rotation.from_rotvec(np.outer(q[k], AXES[k])).as_matrix()
        p = p - R @ SPOTS[k]
        assert_allclose(m.R[:, k + 1], R, atol=1e-12)
        assert_allclose(m.p[:, k + 1], p, atol=1e-12)
    check_accelerations(scene, np.linspace(0.1, 0.9, 7), np.array([0.8, 0.0, 0.8]), "link6")


def test_two_steady_drives_repeat_after_their_common_period() -> None:
    """2 and 3 rad/s: after 2π s; then 10⁴ s later all is as at first."""
    joints: JointTable = {
        "A": ("revolute", "ground", "lower", (0.0, 0.0, 0.0), Z),
        "B": ("revolute", "upper", "lower", (0.3, 0.0, 0.0), Z),
    }
    scene = linkage_scene(joints, None, sections=drives(a=("A", steady(2.0)), b=("B", steady(-3.0))))
    link = linkage(scene)
    along = path(link, 0.0, 1e4)
    assert along.period == pytest.approx(2 * np.pi)
    t = np.linspace(9990.0, 1e4, 50)
    m = rigid_motion(link, along, t, path_parameter(scene, t))
    assert_allclose(m.R[:, 1, 0, 0], np.cos(2 * t), atol=1e-11)
    assert_allclose(m.R[:, 2, 0, 0], np.cos(-t), atol=1e-11)


# -- slides ----------------------------------------------------------------------------------------------------------


def test_a_driven_slider_turns_the_crank() -> None:
    """Slider-crank backwards: x = r cos θ + √(l² − r² sin² θ) solved for θ by the cosine rule."""
    r, rod, drawn = 0.1, 0.3, np.radians(60)
    joints = slider_crank(r, rod, drawn)
    law = {"kind": "cycloidal", "travel": "-60 mm", "rise": 1.0}
    scene = linkage_scene(joints, "guide", law, sliders=("slider",))
    m = motion_at(scene, T)
    x = joints["guide"][3][0] + m.phi
    theta = np.arccos((x**2 + r**2 - rod**2) / (2 * r * x))
    assert_allclose(drawn + turned(m, body(scene, "crank"), np.array(Z)), theta, atol=1e-12)
    assert_allclose(m.p[:, body(scene, "slider"), 0], m.phi, atol=1e-14)
    check_accelerations(scene, np.linspace(0.1, 0.9, 7), np.array([0.1, 0.05, 0.0]), "rod")


def test_a_slide_between_moving_links_is_driven_as_a_hydraulic_cylinder() -> None:
    """A boom on a hinge, lifted by a cylinder: cosine rule with the cylinder's length."""
    base, eye = np.array([0.3, 0.0, 0.0]), np.array([0.4, 0.5, 0.0])
    along = (eye - base) / np.linalg.norm(eye - base)
    joints: JointTable = {
        "A": ("revolute", "ground", "boom", (0.0, 0.0, 0.0), Z),
        "B": ("revolute", "ground", "barrel", base, Z),
        "C": ("revolute", "rod", "boom", eye, Z),
        "S": ("prismatic", "rod", "barrel", (base + eye) / 2, along),
    }
    scene = linkage_scene(joints, "S", {"kind": "cycloidal", "travel": 0.2, "rise": 1.0})
    m = motion_at(scene, T)
    a, b, c = np.linalg.norm(base), np.linalg.norm(eye), np.linalg.norm(eye - base) + m.phi
    wanted = np.arccos((a**2 + b**2 - c**2) / (2 * a * b)) - np.arctan2(0.5, 0.4)
    assert_allclose(turned(m, body(scene, "boom"), np.array(Z)), wanted, atol=1e-12)
    check_accelerations(scene, np.linspace(0.1, 0.9, 7), eye, "boom")


# -- refusals --------------------------------------------------------------------------------------------------------


def refused(scene: Scene, t: np.ndarray = T) -> str:
    with pytest.raises(MotionError) as error:
        motion_at(scene, t)
    return str(error.value)


def test_more_drives_than_motions_are_refused() -> None:
    scene = linkage_scene(
        slider_crank(0.1, 0.3, 0.7), None, sliders=("slider",),
        sections=drives(a=("A", steady(1.0)), b=("guide", steady(1.0))),
    )  # fmt: skip
    wanted = "joints.A, joints.guide: there must be no more drives than the linkage's mobility, 1, got 2"
    assert refused(scene) == wanted


def test_gears_against_each_other_are_a_structure() -> None:
    """A loop of three wheels with outer teeth locks."""
    at = ((0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.15, 0.26, 0.0))
    joints: JointTable = {name: ("revolute", "ground", f"wheel {name}", x, Z) for name, x in zip("ABC", at, strict=True)}
    gears = {f"{a}{b}": {"joints": [a, b], "ratio": -1} for a, b in ("AB", "BC", "CA")}
    assert "got a structure without any mobility" in refused(linkage_scene(joints, sections={"gears": gears}))


def test_a_slide_driven_too_far_is_told_the_travel() -> None:
    """Crank and rod in line at x = 0.4 m: 0.4 − x_drawn."""
    joints = slider_crank(0.1, 0.3, np.radians(60))
    scene = linkage_scene(joints, "guide", {"kind": "cycloidal", "travel": 0.2, "rise": 1.0}, sliders=("slider",))
    message = refused(scene)
    assert "joints.guide" in message
    travel = re.search(r"locks \(dead point\) at drive travel (\S+) mm", message)
    assert travel is not None
    assert float(travel[1]) == pytest.approx(1e3 * (0.4 - joints["guide"][3][0]), abs=0.1)


def test_several_drives_are_told_the_time() -> None:
    """Cranks turned apart until the rods, 0.3 m, are in line: 0.3 + 0.4 cos(50° − 1.5 t) = 0.6, t = 0.09995 s."""
    scene = linkage_scene(five_bar(0.3), None, sections=drives(a=("A", steady(1.5)), b=("E", steady(-1.5))))
    message = refused(scene)
    assert "must follow its drives joints.A, joints.E" in message
    found = float(message.rsplit("t = ", 1)[1].split()[0])
    assert found == pytest.approx((np.radians(50) - np.arccos(0.75)) / 1.5, abs=1e-5)


def test_one_million_steps_in_ten_thousand_turns_do_not_drift() -> None:
    """The last turn of a slider-crank against its closed form; in blocks, as an analysis takes them."""
    scene = linkage_scene(slider_crank(0.1, 0.3, 0.7), motion=steady(2 * np.pi), sliders=("slider",))
    link = linkage(scene)
    along = path(link, 0.0, 2e4 * np.pi)
    t = 1e4 * np.arange(1_000_001 - 200, 1_000_001) / 1e6
    m: RigidMotion = rigid_motion(link, along, t, path_parameter(scene, t))
    phi = 0.7 + 2 * np.pi * np.remainder(t, 1.0)
    x = 0.1 * np.cos(phi) + np.sqrt(0.3**2 - (0.1 * np.sin(phi)) ** 2)
    drawn = 0.1 * np.cos(0.7) + np.sqrt(0.3**2 - (0.1 * np.sin(0.7)) ** 2)
    assert_allclose(m.p[:, body(scene, "slider"), 0], x - drawn, atol=2e-12)  # φ is known to 7e-12
