"""Rigid motion where it is difficult: close to dead points, after many revolutions, with axes almost parallel."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.errors import MotionError
from tests.linkages import body, four_bar, linkage_scene, motion_at, place, slider_crank, turned

Z = np.array([0.0, 0.0, 1.0])


def rocker_angle(a: float, b: float, c: float, d: float, crank: np.ndarray) -> np.ndarray:
    """Rocker angle of a four-bar with C to the left of B → D: two triangles."""
    x, y = a * np.cos(crank) - d, a * np.sin(crank)  # from D to B
    s2 = x**2 + y**2
    return np.unwrap(np.arctan2(y, x) - np.arccos((c**2 + s2 - b**2) / (2 * c * np.sqrt(s2))))


def rocker_error(lengths: tuple[float, float, float, float], drawn: float, t: np.ndarray, scale: float = 1.0) -> float:
    scene = linkage_scene(four_bar(*(scale * x for x in lengths), drawn))
    got = turned(motion_at(scene, t), body(scene, "rocker"), Z)
    wanted = rocker_angle(*lengths, drawn + t)
    return float(np.abs((got - got[0]) - (wanted - wanted[0])).max())


@pytest.mark.parametrize("beside", [5.0, 1.0, 0.1])  # degrees between coupler and rocker where they are nearest to a line
def test_passing_close_to_a_dead_point_stays_on_the_branch(beside: float) -> None:
    """a + d < b + c by so little that the diagonal at crank angle 180° leaves a triangle of this angle.

    The smallest singular value is then of order `beside`: errors of 1e-16 grow to about 1e-16/beside².
    """
    b, c, d = 0.6, 0.5, 0.8
    bend = np.radians(beside)
    a = np.sqrt(b**2 + c**2 + 2 * b * c * np.cos(bend)) - d  # cosine rule with the angle π − bend at C
    t = np.linspace(0, 2 * np.pi, 1441)
    assert rocker_error((a, b, c, d), 0.6, t) < 1e-14 / bend**2


def test_stopping_just_short_of_the_dead_point() -> None:
    """Non-Grashof crank driven to 0.1° before its limit: closed form still met, accelerations finite."""
    lengths = (0.5, 0.6, 0.5, 1.0)
    end = np.arccos((0.5**2 + 1.0 - 1.1**2) / (2 * 0.5)) - np.radians(0.1)  # cosine rule, diagonal b + c
    t = np.linspace(0, end - 0.7, 301)
    assert rocker_error(lengths, 0.7, t) < 1e-11


def test_a_parallelogram_follows_between_its_change_points_and_is_refused_through_them() -> None:
    joints = four_bar(0.3, 0.9, 0.3, 0.9, np.radians(60))
    scene = linkage_scene(joints)
    m = motion_at(scene, np.linspace(np.radians(-59), np.radians(119), 90))  # 1° short of both
    assert_allclose(m.R[:, body(scene, "coupler")], np.broadcast_to(np.eye(3), (90, 3, 3)), atol=1e-12)
    assert_allclose(m.R[:, body(scene, "rocker")], m.R[:, body(scene, "crank")], atol=1e-12)
    with pytest.raises(MotionError, match="could go on in two ways"):
        motion_at(scene, np.linspace(0, np.radians(121), 90))


@pytest.mark.parametrize("gap", [0.05, 0.5, 2.0, 5.0])
def test_a_narrow_range_that_cannot_be_assembled_is_not_stepped_over(gap: float) -> None:
    """Crank 0.5, frame 1: coupler and rocker are in line that many degrees before and after 180°, too short between."""
    reach = np.sqrt(0.5**2 + 1.0 + np.cos(np.radians(gap)))
    with pytest.raises(MotionError, match=r"locks \(dead point\) at drive angle") as refused:
        motion_at(linkage_scene(four_bar(0.5, reach - 0.6, 0.6, 1.0, 1.0)), np.linspace(0, 2 * np.pi, 90))
    angle = float(str(refused.value).split("drive angle ")[1].split()[0])
    assert angle + np.degrees(1.0) == pytest.approx(180.0 - gap, abs=0.02)


def test_two_change_points_at_once_are_not_stepped_over() -> None:
    """Two parallelograms on one crank, mirrored: both branch at the same angle, so that the orientation stays."""
    joints = four_bar(0.3, 0.9, 0.3, 0.9, np.radians(60))
    B, beside = joints["B"][3], np.array([-0.9, 0.0, 0.0])
    joints["E"] = ("revolute", "crank", "coupler2", B, Z)
    joints["F"] = ("revolute", "coupler2", "rocker2", B + beside, Z)
    joints["G"] = ("revolute", "rocker2", "ground", beside, Z)
    with pytest.raises(MotionError, match=r"at drive angle 120\.00 deg, where the linkage could go on in two ways"):
        motion_at(linkage_scene(joints), np.linspace(0, 2 * np.pi, 90))


def test_a_thousand_turns_do_not_drift() -> None:
    """Random phases of a thousand turns against the closed form at the same (rounded) angle."""
    lengths = (0.3048, 0.9144, 0.762, 0.9144)
    random = np.random.default_rng(1)
    t = np.concatenate([[0.0], np.sort(random.uniform(0, 2000 * np.pi, 2000))])
    scene = linkage_scene(four_bar(*lengths, 1.0))
    m = motion_at(scene, t)
    angle = np.arctan2(m.R[:, body(scene, "rocker"), 1, 0], m.R[:, body(scene, "rocker"), 0, 0])
    phase = 1.0 + np.mod(t, 2 * np.pi)
    x, y = 0.3048 * np.cos(phase) - 0.9144, 0.3048 * np.sin(phase)
    s = np.hypot(x, y)
    wanted = np.arctan2(y, x) - np.arccos((0.762**2 + s**2 - 0.9144**2) / (2 * 0.762 * s))
    error = np.angle(np.exp(1j * ((angle - angle[0]) - (wanted - wanted[0]))))
    assert np.abs(error).max() < 2e-12  # 6283 rad are rounded by 9e-13


@pytest.mark.parametrize("tilt", [1e-12, 1e-9, 1e-7])
def test_axes_parallel_up_to_rounding_of_a_drawing_are_accepted(tilt: float) -> None:
    """A tilt below any bearing's clearance: the motion is that of parallel axes up to the tilt."""
    straight = four_bar(0.3, 0.9, 0.7, 0.9, 1.0)
    askew = {**straight, "C": (*straight["C"][:4], (tilt, 0.0, 1.0))}
    t = np.linspace(0, 2 * np.pi, 181)
    wanted, got = (motion_at(linkage_scene(joints), t) for joints in (straight, askew))
    assert_allclose(got.R, wanted.R, atol=20 * tilt + 1e-12)
    assert_allclose(got.p2, wanted.p2, atol=200 * tilt + 1e-11)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e4])
def test_the_size_of_the_linkage_does_not_matter(size: float) -> None:
    """From micromechanisms to kilometres: angles do not depend on the unit of length."""
    t = np.linspace(0, 2 * np.pi, 91)
    assert rocker_error((0.3048, 0.9144, 0.762, 0.9144), 1.0, t, scale=size) < 1e-12


def test_a_short_crank_far_from_the_origin_is_still_right() -> None:
    """Crank 1 mm, rod 1 m, 1 km from the origin: coordinates are rounded by 1e-13 m, 1e-10 of the crank."""
    r, rod, drawn = 1e-3, 1.0, 0.5
    shift = np.array([1000.0, -500.0, 200.0])
    joints = {k: (*j[:3], np.asarray(j[3]) + shift, *j[4:]) for k, j in slider_crank(r, rod, drawn).items()}
    scene = linkage_scene(joints, sliders=("slider",))
    t = np.linspace(0, 2 * np.pi, 91)
    C = np.asarray(joints["guide"][3])
    x = place(motion_at(scene, t), body(scene, "slider"), C)[0][:, 0] - shift[0]
    wanted = r * np.cos(drawn + t) + np.sqrt(rod**2 - (r * np.sin(drawn + t)) ** 2)
    assert_allclose(x, wanted, atol=1e-11)


@pytest.mark.long
def test_a_chain_of_many_loops_is_followed() -> None:
    """Eight four-bars one behind the other: the rocker of each is the crank of the next, and closes at all times."""
    joints = dict(four_bar(0.3, 0.95, 0.35, 1.0, 1.2))
    for k in range(7):
        rocker, arm, pivot = f"rocker{k or ''}", *(np.asarray(joints[f"{x}{k or ''}"][3]) for x in "CD")
        radius = float(np.linalg.norm(arm - pivot))
        corotational = four_bar(radius, 0.95, 0.35, 1.0, float(np.arctan2(*(arm - pivot)[1::-1])))
        pairs = {"B": (rocker, f"coupler{k + 1}"), "C": (f"coupler{k + 1}", f"rocker{k + 1}")}
        pairs["D"] = (f"rocker{k + 1}", "ground")
        for x, links in pairs.items():
            joints[f"{x}{k + 1}"] = ("revolute", *links, corotational[x][3] + pivot, Z)
    scene = linkage_scene(joints)
    m = motion_at(scene, np.linspace(-0.1, 0.1, 11))
    for joint in scene.joints.values():
        i, j = (0 if name == "ground" else body(scene, name) for name in joint.links)
        at = np.array(joint.at)
        assert_allclose(place(m, i, at)[2], place(m, j, at)[2], atol=1e-10)
