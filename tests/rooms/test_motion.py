"""The motion room: what it refuses and how it says so, what it reports of a linkage."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kedfem.errors import MotionError
from kedfem.motion.batch import RowSelection, SolvedMotion, newton_solution
from kedfem.motion.constraints import ConstraintEquation, coupled, joint_rows, stacked, travel_row, turn_row
from kedfem.motion.linkage import Linkage, linkage
from kedfem.motion.path import continuation, path
from kedfem.motion.rigid import rigid_motion
from kedfem.motion.values import Poses, convective, features, jacobian, residuals
from tests.linkages import (
    RISE,
    UNIT_SPEED,
    JointTable,
    Z,
    cardan,
    four_bar,
    linkage_scene,
    motion_at,
    revolute_loop,
    rssr,
    slider_crank,
)

TURN = np.linspace(0.0, 2 * np.pi, 9)
# the longest and the shortest link together are longer than the others: the crank cannot turn fully (Grashof)
NON_GRASHOF = (0.5, 0.6, 0.5, 1.0)
BAR = four_bar(0.3, 0.9, 0.7, 0.9, 1.0)


def limit(a: float, b: float, c: float, d: float) -> float:
    """Crank angle [deg] at which coupler and rocker lie in line: cosine rule, diagonal b + c."""
    return float(np.degrees(np.arccos((a**2 + d**2 - (b + c) ** 2) / (2 * a * d))))


def refusal(joints: JointTable, t: np.ndarray = TURN, sliders: tuple[str, ...] = ()) -> str:
    with pytest.raises(MotionError) as error:
        motion_at(linkage_scene(joints, sliders=sliders), t)
    return str(error.value)


def angle_in(message: str) -> float:
    found = re.search(r"drive angle (-?[\d.]+) deg", message)
    assert found
    return float(found[1])


# -- refusals ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("revolutions", [1, 1.3])
@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("drawn", [40, 43.21, 80])
def test_a_crank_driven_past_its_limit_is_told_the_joint_and_the_angle(
    drawn: float, direction: int, revolutions: float
) -> None:
    message = refusal(four_bar(*NON_GRASHOF, np.radians(drawn)), direction * revolutions * TURN)
    assert re.fullmatch(
        r"joints\.[BCD]: the linkage must follow its drive joints\.A over the whole range, "
        r"got: it locks \(dead point\) at drive angle -?[\d.]+ deg",
        message,
    )
    assert angle_in(message) == pytest.approx(direction * limit(*NON_GRASHOF) - drawn, abs=0.1)


def test_within_its_limits_the_same_crank_is_driven() -> None:
    scene = linkage_scene(four_bar(*NON_GRASHOF, np.radians(40)))
    reach = np.radians(limit(*NON_GRASHOF) - 40)
    assert np.isfinite(motion_at(scene, np.linspace(-0.5, 0.999 * reach, 20)).p2).all()


def test_a_crank_longer_than_the_rod_locks_at_the_rods_right_angle() -> None:
    """Crank 0.3 m, rod 0.1 m: sin φ = 1/3."""
    message = refusal(slider_crank(0.3, 0.1, 0.1), sliders=("slider",))
    assert angle_in(message) == pytest.approx(np.degrees(np.arcsin(1 / 3) - 0.1), abs=0.1)
    assert "locks (dead point)" in message


def test_a_threefold_bricard_locks_at_120_degrees() -> None:
    """cos θ + cos φ + cos θ cos φ = 0 has real φ up to cos θ = −1/2 (Chen, You, Tarnai 2005)."""
    second = np.arccos(-np.cos(0.6) / (1 + np.cos(0.6)))
    loop = revolute_loop(np.full(6, 0.3), np.pi / 2 * np.array([1, -1] * 3), np.array([0.6, second] * 3))
    assert angle_in(refusal(loop)) == pytest.approx(120 - np.degrees(0.6), abs=0.1)


def test_a_linkage_drawn_in_its_dead_point_is_refused() -> None:
    """Coupler and rocker in one line, from B to D: the crank cannot move them in a determined way."""
    B, D = np.array([0.3, 0.4, 0.0]), np.array([1.2, 0.0, 0.0])
    joints: JointTable = {
        "A": ("revolute", "ground", "crank", np.zeros(3), Z),
        "B": ("revolute", "crank", "coupler", B, Z),
        "C": ("revolute", "coupler", "rocker", 0.6 * B + 0.4 * D, Z),
        "D": ("revolute", "rocker", "ground", D, Z),
    }
    assert refusal(joints) == (
        "joints.A: the linkage locks (dead point) at drive angle 0 deg, the reference position: "
        "give it at another angle or drive joint B, C or D"
    )


def without(name: str) -> JointTable:
    return {key: joint for key, joint in BAR.items() if key != name}


def test_a_missing_joint_leaves_free_motion_and_the_message_says_of_what() -> None:
    message = refusal(without("D"))
    assert message.startswith(
        "joints: every motion must be constrained or driven, got free motion left at drive angle 0 deg, the reference "
        "position:"
    )
    assert "link 'rocker' can turn about z at joint C (revolute)" in message
    assert "links 'coupler' and 'rocker' can move together in one way, by joints B and C; free motions: 2" in message


def test_an_idle_spin_of_the_coupler_is_named_with_its_axis() -> None:
    """RSSR with two balls: the coupler can spin about the line between them."""
    joints = rssr(1.0, ball=True)
    line = joints["C"][3] - joints["B"][3]
    message = refusal(joints)
    assert "the line through joints B and C (both spherical); free motions: 1" in message
    assert "remedy: make joint B or C universal" in message
    found = re.search(r"link 'coupler' can turn about \(([^)]+)\)", message)
    assert found
    axis = np.array([float(x) for x in found[1].split(",")])
    assert np.linalg.norm(np.cross(axis, line / np.linalg.norm(line))) < 2e-3  # three digits are shown


def test_a_loose_link_is_named() -> None:
    joints = {**BAR, "E": ("revolute", "coupler", "arm", BAR["C"][3] + [0.1, 0.0, 0.0], Z)}
    assert "link 'arm' can turn about z at joint E (revolute); free motions: 1" in refusal(joints)


def test_a_slide_without_a_stop_is_named() -> None:
    joints = {**BAR, "E": ("prismatic", "ground", "block", (3.0, 0.0, 0.0), (0.0, 1.0, 0.0))}
    message = refusal(joints, sliders=("block",))
    assert "link 'block' can slide along y at joint E (prismatic); free motions: 1" in message


@pytest.mark.parametrize(
    ("change", "cure"),
    [
        ({"D": ("weld", "rocker", "ground", BAR["D"][3])}, "if joint D were spherical"),
        ({"C": ("revolute", "coupler", "rocker", BAR["C"][3], (0.0, 0.3, 1.0))}, "if joint C were spherical"),
        ({"E": ("revolute", "coupler", "ground", (0.2, 0.7, 0.0), Z)}, "without joint B or E"),
    ],
    ids=["a weld", "an askew axis", "one joint too many"],
)
def test_a_structure_is_refused_with_what_would_let_it_move(change: JointTable, cure: str) -> None:
    assert refusal({**BAR, **change}) == (
        "joints.A: its drive must be able to move the linkage, got a structure without any mobility "
        f"(it would move {cure}; is an axis askew, or one joint too many?)"
    )


def test_axes_that_are_slightly_askew_are_refused_where_they_no_longer_fit() -> None:
    """1e-5 rad: a first-order test of mobility cannot see it there; further on the joints come apart."""
    askew = {**BAR, "C": ("revolute", "coupler", "rocker", BAR["C"][3], (1e-5, 0.0, 1.0))}
    message = refusal(askew)
    assert re.match(r"joints\.[A-D]: the linkage must follow its drive joints\.A", message)
    assert "its redundant joints no longer fit together at drive angle" in message
    assert message.endswith("(is an axis askew, or one joint too many?)")


@pytest.mark.parametrize("drawn", [60.0, 61.3])
def test_a_change_point_within_the_range_is_refused_wherever_the_grid_lies(drawn: float) -> None:
    """A parallelogram is in line at a crank angle of 180°, and could go on as an antiparallelogram."""
    message = refusal(four_bar(0.3, 0.9, 0.3, 0.9, np.radians(drawn)))
    assert angle_in(message) == pytest.approx(180 - drawn, abs=0.01)
    assert message.endswith("where the linkage could go on in two ways")
    assert message.startswith("joints.")


def test_a_time_off_the_path_leaves_a_joint_open_and_the_message_gives_time_and_angle() -> None:
    link = linkage(linkage_scene(four_bar(*NON_GRASHOF, np.radians(40))))
    t = np.array([0.0, 2.0])
    drive = (t * np.radians(60), np.full(2, np.radians(60)), np.zeros(2))  # 120°: far beyond the limit
    with pytest.raises(MotionError, match=r"joints: .* at t = 2 s, drive angle 120 deg"):
        rigid_motion(link, path(link, 0.0, np.radians(40)), t, drive)


# -- rows and their derivatives --------------------------------------------------------------------------------


def open_rows(random: np.random.Generator) -> list[ConstraintEquation]:
    """Rows of all kinds between bodies 0, 1 and 2, couplings among them, drives on a turn and a travel."""
    axis = np.array([0.48, 0.6, 0.64])  # a unit vector
    turn, travel = turn_row("R", 2, 1, axis), travel_row("P", 1, 0, random.uniform(-1, 1, 3), axis)
    apart = [replace(row, a_j=random.uniform(-1, 1, 3)) for row in joint_rows("spherical", "S", 2, 0, axis, None)]
    return [
        *joint_rows("weld", "W", 2, 1, random.uniform(-1, 1, 3), None),
        *joint_rows("prismatic", "P", 1, 0, random.uniform(-1, 1, 3), axis),
        *joint_rows("revolute", "R", 2, 0, random.uniform(-1, 1, 3), axis),
        *apart,
        replace(turn, drive=0),
        coupled(travel, (-0.3, turn)),
        coupled(turn, (2.5, turn_row("Q", 1, 0, np.array([0.0, 0.6, 0.8]))), (-0.7, travel)),
        replace(travel, drive=1),
    ]


def test_derivatives_of_rows_are_their_differences_also_where_joints_are_open() -> None:
    """Three bodies on screw motions: r' = J q' − drives', r'' without accelerations; a subset of the rows gives the same.

    Central differences: truncation h², with h = 1e-4 below 1e-7; rounding 1e-16/h² = 1e-8.
    """
    random = np.random.default_rng(5)
    rows = stacked(open_rows(random))
    R0, p0, v, omega = Rotation.random(3, rng=6).as_matrix(), *random.uniform(-1, 1, (3, 3, 3))
    v[0] = omega[0] = 0  # the ground
    speeds, h = np.array([1.7, -0.6]), 1e-4
    t = np.array([-h, 0.0, h])
    R = np.stack([Rotation.from_rotvec(s * omega).as_matrix() @ R0 for s in t])
    poses, near = (R, p0 + t[:, None, None] * v), np.zeros((3, len(rows.angles)))
    near = features(rows, (R[1:2], p0[None]), near[:1]).value[rows.angles].T + 0 * near  # none at half a revolution
    f, q = features(rows, poses, near), 0.4 + speeds * t[:, None]
    r = residuals(rows, f, q)
    twist = np.concatenate([v, omega], axis=1)[1:].ravel()
    first = jacobian(rows, f, 3)[1] @ twist
    first[rows.drive >= 0] -= speeds[rows.drive[rows.drive >= 0]]
    np.testing.assert_allclose((r[2] - r[0]) / (2 * h), first, atol=1e-7)
    second = convective(rows, f, (np.tile(v, (3, 1, 1)), np.tile(omega, (3, 1, 1))))[1]
    np.testing.assert_allclose((r[2] - 2 * r[1] + r[0]) / h**2, second, atol=1e-6)
    which = np.array([2, 7, 18, 19, 20, 21])
    some, angles = rows.part(which)
    g = features(some, poses, near[:, angles])
    np.testing.assert_allclose(residuals(some, g, q), r[:, which], atol=1e-15)
    np.testing.assert_allclose(jacobian(some, g, 3, 0.3), jacobian(rows, f, 3, 0.3)[:, which], atol=1e-15)


def test_angles_count_on_beyond_a_turn_and_know_large_ones_to_rounding() -> None:
    """A body turned by 1e-9 more than 10⁴ turns: the row sees the 1e-9 (2π in floats is exact to 2.5e-16 · 10⁴)."""
    axis = np.array([0.0, 0.0, 1.0])
    rows = stacked([replace(turn_row("A", 1, 0, axis), drive=0)])
    many = 2e4 * np.pi
    exact = np.array([[np.cos(many + 1e-9), np.sin(many + 1e-9)]])
    c, s = exact[0]
    R = np.stack([np.eye(3), np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])])[None]
    q = np.array([[many]])
    f = features(rows, (R, np.zeros((1, 2, 3))), q)
    np.testing.assert_allclose(residuals(rows, f, q), 1e-9, atol=1.5e-11)  # the sum itself is rounded to 7e-12


def test_the_angle_of_tilted_axes_depends_on_no_mark() -> None:
    """Of bodies turned at random: the same from all directions across the axis, and its negative from the other body."""
    axis, R = np.array([0.48, 0.6, 0.64]), Rotation.random(3, rng=8).as_matrix()
    R[0] = np.eye(3)
    turn = turn_row("A", 2, 1, axis)
    marks = [Rotation.from_rotvec(angle * axis).apply(turn.a) for angle in (0.0, 0.4, 1.1)]
    rows = stacked([*(replace(turn, a=a) for a in marks), turn_row("A", 1, 2, axis)])
    f = features(rows, (R[None], np.zeros((1, 3, 3))), np.zeros((1, 4)))
    x, y, z, w = Rotation.from_matrix(R[1].T @ R[2]).as_quat()
    twist = 2 * np.arctan2(axis @ [x, y, z], w)
    assert abs(axis @ (R[1].T @ R[2] @ axis) - 1) > 0.1
    np.testing.assert_allclose(np.sin(f.value[:3, 0]), np.sin(twist), atol=1e-14)
    np.testing.assert_allclose(np.cos(f.value[:3, 0]), np.cos(twist), atol=1e-14)
    np.testing.assert_allclose(f.value[3], -f.value[0], atol=1e-14)
    np.testing.assert_allclose(f.about[:, 1:3, 0], f.about[:, [0, 0], 0], atol=1e-14)


# -- what is reported ----------------------------------------------------------------------------------------


def test_redundant_joints_of_a_planar_linkage_in_space_are_reported() -> None:
    """Kutzbach: 6·3 − 5·4 = −2, yet mobility 1: three rows too many, in joints of the loop."""
    link = linkage(linkage_scene(BAR))
    assert len(link.redundant) >= 1
    assert set(link.redundant) <= set("ABCD")


def test_a_ball_and_a_universal_joint_leave_nothing_redundant() -> None:
    assert linkage(linkage_scene(rssr(1.0))).redundant == ()


def test_a_spherical_linkage_is_redundant_as_well() -> None:
    """Cardan: 6·3 − 5·4 = −2, mobility 1."""
    assert linkage(linkage_scene(cardan(0.6))).redundant


def test_the_path_knows_that_a_turn_closes_and_where_the_linkage_is_weakest() -> None:
    """The weakest position of a crank-rocker is where coupler and rocker are nearest to one line: crank along AD."""
    link = linkage(linkage_scene(four_bar(0.3048, 0.9144, 0.762, 0.9144, 1.0)))
    along = path(link, 0.0, 7.0)
    assert along.periodic
    crank = (along.nearest_singularity[1] + 1.0) % (2 * np.pi)
    # the extremes of the transmission angle are at crank angles 0 and 180°: cosine rule, diagonals d ∓ a
    assert min(crank, 2 * np.pi - crank, abs(crank - np.pi)) < 0.25
    assert not path(link, -0.5, 0.5).periodic


def test_a_turn_is_followed_a_few_grid_points_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A drag link: 31 steps of 12° and smaller ones at first; the last point, predicted from far, is the first again."""
    followed = []

    def counted(link: Linkage, chosen: RowSelection, guess: Poses, *more: Any) -> SolvedMotion:
        followed.append(len(guess[1]))
        return newton_solution(link, chosen, guess, *more)

    monkeypatch.setattr(continuation, "newton_solution", counted)
    along = path(linkage(linkage_scene(four_bar(0.92, 0.82, 0.89, 0.57, 5.75))), 0.0, 6.3)
    assert along.periodic
    assert len(followed) <= 16
    assert 33 <= sum(followed) <= 45  # few are predicted in vain


def test_an_arm_alone_turns_with_its_drive() -> None:
    """One link, one revolute at rest in the origin: R is the rotation by φ, p = 0."""
    scene = linkage_scene({"A": ("revolute", "ground", "arm", (0.0, 0.0, 0.0), Z)}, motion={**UNIT_SPEED, "speed": 3.0})
    t = np.array([0.0, 0.3, 50.0])
    m = motion_at(scene, t)
    np.testing.assert_allclose(m.R[:, 1, 0, 0], np.cos(3 * t), atol=1e-13)
    np.testing.assert_allclose(m.R[:, 1, 1, 0], np.sin(3 * t), atol=1e-13)
    np.testing.assert_allclose(m.omega[:, 1], np.tile([0, 0, 3.0], (3, 1)), atol=1e-14)
    np.testing.assert_allclose(m.R2[:, 1, 0, 0], -9 * np.cos(3 * t), atol=1e-12)
    assert not m.p.any()


def test_welded_links_move_as_one() -> None:
    end = BAR["C"][3] + np.array([0.2, 0.1, 0.0])
    scene = linkage_scene({**BAR, "E": ("weld", "coupler", "arm", end)}, motion={**RISE, "angle": 1.0})
    m = motion_at(scene, np.linspace(0, 1, 11))
    coupler, arm = (1 + list(scene.links).index(name) for name in ("coupler", "arm"))
    np.testing.assert_allclose(m.R[:, arm], m.R[:, coupler], atol=1e-13)
    np.testing.assert_allclose(m.p2[:, arm], m.p2[:, coupler], atol=1e-11)


def test_the_drive_turns_its_link_as_drawn_whichever_way_the_joint_names_it() -> None:
    """Positive from x to y about +z, for links = [ground, crank] and [crank, ground]."""
    for pair in (("ground", "crank"), ("crank", "ground")):
        scene = linkage_scene({**BAR, "A": ("revolute", *pair, np.zeros(3), Z)})
        m = motion_at(scene, np.array([0.5]))
        np.testing.assert_allclose(m.omega[0, 1 + list(scene.links).index("crank")], [0, 0, 1], atol=1e-13)
