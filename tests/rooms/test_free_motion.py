"""Linkages that nothing drives, or that a drive releases: mobility, rigid-body motion, velocities at the start."""

from typing import Any

import numpy as np
import pytest

from kedfem.accuracy.prepared import moving
from kedfem.errors import MotionError, SceneError
from kedfem.motion.initial import initial_twists
from kedfem.motion.linkage import linkage
from kedfem.motion.rigid import rigid_motion
from kedfem.scene import Scene, scene_from
from tests.laws.test_limits import AXES
from tests.linkages import JointTable, Z, body, four_bar, linkage_scene, motion_at, place, slider_crank, turned

BAR = four_bar(0.3, 0.9, 0.7, 0.9, 1.0)
PENDULUM: JointTable = {
    "A": ("revolute", "ground", "upper", (0.2, 0.1, 0.0), Z),
    "B": ("revolute", "upper", "lower", (0.7, 0.1, 0.0), Z),
}
FOLLOWING = {"frames": "co-rotational"}


def twists(joints: JointTable, **asked: Any) -> tuple[Scene, np.ndarray, np.ndarray]:
    sliders = ("slider",) if "guide" in joints else ()
    scene = linkage_scene(joints, drive=None, sliders=sliders, **asked)
    return scene, *initial_twists(scene, *moving(scene))


def velocity(v: np.ndarray, omega: np.ndarray, k: int, at: Any) -> np.ndarray:
    return v[k] + np.cross(omega[k], at)


# -- mobility and rigid-body motion ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("joints", "mobility"),
    [
        (BAR, 1),
        (PENDULUM, 2),
        ({"A": ("spherical", "ground", "top", (0, 0, 0))}, 3),
        ({"A": ("weld", "ground", "post", (0, 0, 0))}, 0),
        ({"A": ("revolute", "ground", "post", (0, 0, 0), Z), "B": ("revolute", "ground", "post", (1, 0, 0), Z)}, 0),
    ],
)  # fmt: skip
def test_an_undriven_linkage_keeps_all_its_motions(joints: JointTable, mobility: int) -> None:
    assert linkage(linkage_scene(joints, drive=None)).mobility == mobility


def test_links_that_no_joint_holds_fly_with_six_motions_each() -> None:
    scene = linkage_scene({"A": ("weld", "one", "other", (0, 0, 0))}, drive=None)
    assert linkage(scene).mobility == 6
    loose = scene.model_copy(update={"joints": {}})
    assert linkage(loose).mobility == 12


def test_an_undriven_linkage_rests_in_its_rigid_body_motion() -> None:
    scene = linkage_scene(PENDULUM, drive=None)
    t = np.linspace(0, 1, 5)
    motion = motion_at(scene, t)
    np.testing.assert_array_equal(motion.R, np.broadcast_to(np.eye(3), motion.R.shape))
    assert not any(getattr(motion, name).any() for name in ("p", "v", "omega", "alpha", "R2", "p2", "phi"))
    assert motion.R.shape == (5, 3, 3, 3)
    assert (motion.part(1, 3).t == t[1:3]).all()


def test_a_pendulum_on_a_driven_crank_is_held_in_the_rigid_body_motion_as_drawn() -> None:
    motion = motion_at(linkage_scene(PENDULUM, **FOLLOWING), np.linspace(0, 7, 40))
    np.testing.assert_allclose(motion.R[:, 2], motion.R[:, 1], atol=1e-12)  # turns with the crank
    np.testing.assert_allclose(turned(motion, 1, np.array(Z)), motion.phi, atol=1e-9)
    hinge = np.array(PENDULUM["B"][3])
    for one, other in zip(place(motion, 1, hinge), place(motion, 2, hinge), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9)


def test_a_five_bar_with_one_drive_moves_as_a_four_bar() -> None:
    P = [(0, 0, 0), (0, 0.2, 0), (0.4, 0.6, 0), (0.9, 0.6, 0), (1.0, 0, 0)]
    names = ["ground", "crank", "one", "two", "rocker", "ground"]
    joints = {x: ("revolute", names[k], names[k + 1], P[k], Z) for k, x in enumerate("ABCDE")}
    scene = linkage_scene(joints, **FOLLOWING)
    assert linkage(scene).mobility == 1
    motion = motion_at(scene, np.linspace(0, 0.5, 9))
    for name, k in (("B", 1), ("C", 2), ("D", 3)):
        at = np.array(joints[name][3], float)
        np.testing.assert_allclose(place(motion, k, at)[2], place(motion, k + 1, at)[2], atol=1e-9)
    relative = [np.swapaxes(motion.R[:, k], 1, 2) @ motion.R[:, k + 1] for k in (1, 2, 3)]
    held = [np.abs(R - np.eye(3)).max() < 1e-9 for R in relative]
    assert sum(held) == 1 or np.abs(motion.R[:, 4] - np.eye(3)).max() < 1e-9


def test_rigid_body_frames_leave_nothing_free() -> None:
    scene = linkage_scene(PENDULUM)
    with pytest.raises(MotionError, match=r"link 'lower' can turn about z.*\"co-rotational\""):
        linkage(scene)
    raw = scene.model_dump(by_alias=True, exclude_none=True)
    raw["links"]["upper"]["frames"] = "co-rotational"
    with pytest.raises(MotionError, match="link 'lower' can turn"):
        linkage(scene_from(raw))
    raw["links"]["lower"]["frames"] = "co-rotational"
    assert linkage(scene_from(raw)).mobility == 1


# -- velocities at the start --------------------------------------------------------------------------------


@pytest.mark.parametrize("joints", [BAR, slider_crank(0.3, 0.8, 0.4)], ids=["four-bar", "slider-crank"])
@pytest.mark.parametrize("shift", [0.0, 50.0])
def test_a_crank_set_going_moves_the_linkage_as_a_drive_would(joints: JointTable, shift: float) -> None:
    far = {name: (*x[:3], np.asarray(x[3]) + shift, *x[4:]) for name, x in joints.items()}
    _, v, omega = twists(far, initial_speeds={"A": -3.0})
    sliders = ("slider",) if "guide" in joints else ()
    law = {"kind": "constant_speed", "speed": -3.0}
    driven = motion_at(linkage_scene(far, motion=law, sliders=sliders), np.zeros(1))
    np.testing.assert_allclose(omega, driven.omega[0], atol=1e-9)
    np.testing.assert_allclose(v, driven.v[0], atol=1e-9 * max(1, shift))


def test_speeds_are_of_the_first_link_that_is_not_the_ground() -> None:
    """Of links = [lower, upper] it is the lower one's against the upper one."""
    swapped = {**PENDULUM, "B": ("revolute", "lower", "upper", *PENDULUM["B"][3:])}
    for joints, sign in ((PENDULUM, 1), (swapped, -1)):
        _, _, omega = twists(joints, initial_speeds={"B": 2.0, "A": 0.0})
        np.testing.assert_allclose(omega[:, 2], [0, 0, -2.0 * sign], atol=1e-12)


def test_joints_that_are_not_named_stand_still_where_they_can() -> None:
    _, v, omega = twists(PENDULUM, initial_speeds={"A": 5.0})
    np.testing.assert_allclose(omega, [[0, 0, 0], [0, 0, 5], [0, 0, 5]], atol=1e-12)
    np.testing.assert_allclose(velocity(v, omega, 2, (0.7, 0.1, 0)), [0, 2.5, 0], atol=1e-12)


def test_a_slider_set_going_turns_the_crank() -> None:
    """Crank 0.3, rod 0.8: the slider's speed is that of the derivative of x(φ)."""
    phi, r, rod, speed = 0.7, 0.3, 0.8, 1.5
    joints = slider_crank(r, rod, phi)
    _, _, omega = twists(joints, initial_speeds={"guide": speed})
    h = 1e-6
    x = [r * np.cos(a) + np.sqrt(rod**2 - (r * np.sin(a)) ** 2) for a in (phi - h, phi + h)]
    assert omega[1, 2] == pytest.approx(speed / ((x[1] - x[0]) / (2 * h)), rel=1e-8)


@pytest.mark.parametrize("axis", AXES.values(), ids=list(AXES))
@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize(
    ("kind", "turns", "travels"),
    [
        ("revolute", 3.0, 0.0),
        ("screw", 3.0, -0.3 * 3.0 / (2 * np.pi)),
        ("prismatic", 0.0, 3.0),
        ("cylindrical", 0.0, 3.0),
    ],
)
def test_a_speed_is_that_of_its_joint(kind: str, turns: float, travels: float, swapped: bool, axis: np.ndarray) -> None:
    """Of the first link against the other, about its axis or along it; a cylindrical joint does not turn then."""
    at = np.array([0.7, 0.1, 0.3])
    pair = ("one", "two") if swapped else ("two", "one")
    more = ({"lead": -0.3},) if kind == "screw" else ()
    joints: JointTable = {
        "A": ("revolute", "ground", "one", (0.2, 0.1, 0.0), (1.0, 2.0, -1.0)),
        "J": (kind, *pair, at, axis, *more),
    }
    _, v, omega = twists(joints, initial_speeds={"J": 3.0})
    sign = -1 if swapped else 1
    apart = velocity(v, omega, 2, at) - velocity(v, omega, 1, at)
    np.testing.assert_allclose((omega[2] - omega[1]), sign * turns * axis, atol=1e-9)
    np.testing.assert_allclose(apart, sign * travels * axis, atol=1e-9)


@pytest.mark.parametrize("kind", ["universal", "planar", "spherical", "weld"])
def test_a_joint_without_one_speed_is_asked_for_none(kind: str) -> None:
    axis = {"universal": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))}.get(kind, (1.0, 0.0, 0.0))
    with pytest.raises(
        SceneError, match=r"initial_speeds\.J: must be of a revolute, prismatic, cylindrical, screw or slot joint"
    ):
        twists({"J": (kind, "ground", "one", (0, 0, 0), axis)}, initial_speeds={"J": 1.0})


@pytest.mark.parametrize(("kind", "given"), [("screw", "1 m/s"), ("cylindrical", "60 rpm")])
def test_a_speed_of_another_kind_is_refused(kind: str, given: str) -> None:
    """A screw's is a rotational speed, as its angle is its coordinate; a cylindrical joint's is along its axis."""
    with pytest.raises(SceneError, match=rf"initial_speeds\.J: must be .* for a {kind} joint, got '{given}'"):
        twists(
            {"J": (kind, "ground", "one", (0, 0, 0), (1.0, 0, 0), {"lead": 0.1} if kind == "screw" else {})},
            initial_speeds={"J": given},
        )


def test_speeds_that_contradict_each_other_are_refused() -> None:
    with pytest.raises(MotionError) as error:
        twists(BAR, initial_speeds={"A": 1.0, "D": 1.0})
    message = str(error.value)
    assert message.startswith("analysis: the joints must allow the speeds at the start together, got ")
    assert "analysis.initial_speeds.A = 1 rad/s (closest possible " in message
    assert "analysis.initial_speeds.D = 1 rad/s (closest possible " in message


def test_a_structure_cannot_start_to_move() -> None:
    post = {"A": ("weld", "ground", "post", (0, 0, 0))}
    scene = linkage_scene(post, drive=None, initial_motions={"post": {"at": [1, 0, 0], "velocity": [0, 2, 0]}})
    with pytest.raises(MotionError, match=r"post\.velocity along y = 2 m/s \(closest possible 0\)"):
        moving(scene)


@pytest.mark.parametrize("given", [(0, 1, 2), (0.1, 0.7, -0.3), (0, 0, 3)])
@pytest.mark.parametrize("at", [(0.5, 0, 0), (0.1, 0.2, 0.7)])
def test_a_zero_speed_is_reached_but_for_rounding(given: tuple[float, ...], at: tuple[float, ...]) -> None:
    """A link that moves without a rotation, or turns about a point that stands: which rounding gives some 1e-16."""
    for v, omega in ((given, (0, 0, 0)), ((0, 0, 0), given)):
        asked = {"one": {"at": list(at), "velocity": list(v), "angular_velocity": list(omega)}}
        _, v0, turning = twists({"J": ("spherical", "one", "two", (0.3, 0, 0))}, initial_motions=asked)
        np.testing.assert_allclose(velocity(v0, turning, 1, at), v, atol=1e-12)
        np.testing.assert_allclose(turning[1], omega, atol=1e-12)


def test_a_link_that_flies_starts_as_it_is_told() -> None:
    joints = {"A": ("weld", "one", "other", (0.3, 0, 0))}
    asked = {"one": {"at": [1, 2, 3], "velocity": [1, 0, -2], "angular_velocity": [3, 2, 1]}}
    _, v, omega = twists(joints, initial_motions=asked)
    for k in (1, 2):  # the weld takes the other along
        np.testing.assert_allclose(omega[k], [3, 2, 1], atol=1e-12)
        np.testing.assert_allclose(velocity(v, omega, k, (1, 2, 3)), [1, 0, -2], atol=1e-12)


def test_what_the_drive_holds_does_not_start_to_move() -> None:
    scene = linkage_scene(PENDULUM, initial_speeds={"B": 4.0}, **FOLLOWING)
    link, along = moving(scene)
    v, omega = initial_twists(scene, link, along)
    np.testing.assert_allclose(omega[:, 2], [0, 0, -4.0], atol=1e-12)
    np.testing.assert_allclose(velocity(v, omega, 2, (0.7, 0.1, 0)), 0, atol=1e-12)
    assert rigid_motion(link, along, np.zeros(1), (np.zeros(1),) * 3).omega.shape == (1, 3, 3)


def test_without_speeds_all_is_at_rest() -> None:
    scene, v, omega = twists(BAR)
    assert not v.any()
    assert not omega.any()
    assert body(scene, "rocker") == 3
