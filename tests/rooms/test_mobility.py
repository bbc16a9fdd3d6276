"""What is told of a linkage's freedom: mobility, redundant equations, free motions, dead points; and the remedies."""

from io import StringIO

import numpy as np
import pytest
from rich.console import Console

from kedfem.dynamics.stepping.transient import instant_in_words
from kedfem.errors import MotionError
from kedfem.motion.dead_point import DeadPoint
from kedfem.motion.linkage import alternative_rows, linearised_linkage, linkage
from kedfem.motion.messages import position_in_words
from kedfem.motion.mobility import Mobility, mobility
from kedfem.motion.path import path
from kedfem.motion.redundancy import redundancy, without_redundancy, wrenches
from kedfem.motion.released_motions import free_motions, remedy
from kedfem.motion.rigid import rigid_motion
from kedfem.scene import Scene, path_parameter, scene_from
from kedfem.tables.model import mobility_table
from tests.laws.test_moving_ground import sprung
from tests.linkages import (
    RISE,
    UNIT_SPEED,
    JointTable,
    Z,
    bar,
    bennett,
    cardan,
    four_bar,
    joint,
    linkage_scene,
    motion_at,
    rssr,
    slider_crank,
)
from tests.spatial_linkages import double_cardan, oldham, quick_return, universal_rssr

TURN, LITTLE = 2.2 * np.pi, 0.1
SKEW, *_ = bennett(np.radians(40), np.radians(75), 1.0)
BAR = four_bar(0.3, 0.9, 0.7, 0.9, 1.0)


def found(joints: JointTable, high: float = LITTLE, sliders: tuple[str, ...] = ()) -> Mobility:
    """Of a linkage driven from 0 to an angle [rad]."""
    scene = linkage_scene(joints, sliders=sliders)
    link = linkage(scene)
    return mobility(scene, link, path(link, 0.0, high))


# -- redundancy: Kutzbach's count 6 (links) − equations against the mobility that the linkage has -------------


@pytest.mark.parametrize(
    ("joints", "equations", "sliders"),
    [
        (BAR, 20, ()),
        (slider_crank(0.1, 0.3, 0.7), 20, ("slider",)),
        (SKEW, 20, ()),
        (cardan(0.6), 20, ()),
        (oldham(0.04, 0.5), 20, ()),
        (oldham(0.04, 0.5, "planar"), 18, ()),
        (double_cardan(0.6), 18, ()),
        (universal_rssr(1.0), 17, ()),
        (rssr(1.0), 23, ()),
        (quick_return(0.1, 0.25, 0.4), 12, ()),
    ],
    ids=["four-bar", "slider-crank", "bennett", "cardan", "oldham", "tongue", "double cardan", "rssr", "cross", "slot"],
)  # fmt: skip
def test_mobility_is_one_and_redundancy_makes_up_for_kutzbach(
    joints: JointTable, equations: int, sliders: tuple[str, ...]
) -> None:
    scene = linkage_scene(joints, sliders=sliders)
    told = found(joints, sliders=sliders)
    assert (told.freedom, told.drives, told.equations) == (1, 1, equations)
    assert told.redundancy == 1 - (6 * len(scene.links) - equations)


@pytest.mark.parametrize("joints", [BAR, oldham(0.04, 0.5), quick_return(0.1, 0.25, 0.4, block=True)])
def test_a_planar_linkage_holds_what_lies_outside_its_plane_twice(joints: JointTable) -> None:
    told = found(joints)
    assert [(each.joints, each.words) for each in told.redundant] == [
        (tuple(joints), "force along z, moments about x and y")
    ]


PENDULUM: JointTable = {"A": ("revolute", "ground", "arm", (0.0, 0.0, 0.0), Z)}
ALONG: JointTable = {
    "A": ("prismatic", "ground", "one", (0.0, 0.0, 0.0), (1.0, 2.0, 0.0)),
    "B": ("prismatic", "one", "two", (0.1, 0.0, 0.0), (1.0, 2.0, 0.0)),
    "C": ("prismatic", "two", "ground", (0.2, 0.0, 0.0), (1.0, 2.0, 0.0)),
}


@pytest.mark.parametrize("model", ["beam", "plane"])
@pytest.mark.parametrize(
    ("joints", "free"),
    [(BAR, 1), (PENDULUM, 1), (quick_return(0.1, 0.25, 0.4), 1), (ALONG, 2)],
    ids=["four-bar", "pendulum", "slot", "slides"],
)
def test_planar_links_are_counted_in_their_plane(joints: JointTable, free: int, model: str) -> None:
    """Grübler's count 3 (links) − 2 (hinges and slides) − 1 (slots), not Kutzbach's in space."""
    drive = {"joint": "A", "motion": UNIT_SPEED} if joints is not ALONG else None
    tables = {"drive": drive} if drive else {"analysis": {"end_time": 1.0, "step": 0.01}}
    scene = scene_with(joints, model=model, **tables)
    link = linkage(scene)
    told = mobility(scene, link, path(link, 0.0, LITTLE))
    equations = sum(1 if each.kind == "slot" else 2 for each in scene.joints.values())
    assert (told.plane, told.freedom, told.equations) == (True, free, equations)
    assert told.redundancy == free - (3 * len(scene.links) - equations)
    assert [each.words for each in told.redundant] == ["force along (0.894, -0.447, 0), moment about z"] * (
        joints is ALONG
    )


def test_a_planar_link_that_no_joint_holds_has_three_motions() -> None:
    arm = bar(np.zeros(3)) | {"model": "beam"}
    scene = scene_from({"links": {"arm": arm}, "analysis": {"end_time": 1.0, "step": 0.01}})
    link = linkage(scene)
    told = mobility(scene, link, path(link, 0.0, LITTLE))
    assert (told.freedom, told.equations) == (3, 0)
    assert [each.words for each in told.free] == [
        "link 'arm' can turn about z and slide along x and y, constrained by no joint"
    ]


def test_parallel_cranks_share_a_force_in_their_own_plane_as_well() -> None:
    """Three cranks: one of them could be left out. What they share is a force along the cranks, here at 1 rad."""
    joints = four_bar(0.3, 0.9, 0.3, 0.9, 1.0)
    middle = (np.asarray(joints["B"][3]) + joints["C"][3]) / 2
    joints["E"] = ("revolute", "crank2", "coupler", middle, Z)
    joints["F"] = ("revolute", "crank2", "ground", (0.45, 0.0, 0.0), Z)
    (each,) = found(joints).redundant
    assert each.words == "forces along z and (0.54, 0.841, 0), moments about x and y"


def test_a_double_cardan_joint_holds_its_middle_shaft_along_twice() -> None:
    told = found(double_cardan(0.6))
    at = {name: each.words for each in told.redundant for name in each.joints}
    assert at["U"] == at["V"] == "force along (0.825, 0.565, 0)"  # cos 0.6, sin 0.6
    assert told.remedy == "make joint D cylindrical"


def test_bennett_hinges_hold_all_but_their_turn_twice() -> None:
    told = found(SKEW)
    words = {name: each.words for each in told.redundant for name in each.joints}
    assert words["A"] == "forces in all directions, moments about x and y"  # its axis is z
    assert words["B"] == words["C"] == words["D"] == "forces in all directions, moments across its axis"


def test_self_stress_balances_on_every_link_and_does_no_work_in_its_joint() -> None:
    """Equilibrium by hand: forces, and moments about the centre, of the joints of each link sum to zero."""
    drawn = linearised_linkage(linkage_scene(SKEW))
    stress = np.linalg.svd(drawn.J.T)[2][-3:].T
    for link in drawn.links:
        total = np.zeros((6, 3))
        for name, each in drawn.joints.items():
            first = next(x for x in each.links if x in drawn.links)
            if link in each.links:
                w = wrenches(drawn, name, stress) * (1 if link == first else -1)
                total[:3] += w[:3]
                total[3:] += w[3:] + np.cross(drawn.place(name), w[:3].T).T
        np.testing.assert_allclose(total, 0.0, atol=1e-12)
    for name, each in drawn.joints.items():
        np.testing.assert_allclose(np.asarray(each.axis) @ wrenches(drawn, name, stress)[3:], 0.0, atol=1e-12)


@pytest.mark.parametrize(("joints", "sliders"), [(BAR, ()), (SKEW, ()), (slider_crank(0.1, 0.3, 0.7), ("slider",))])
def test_the_remedy_leaves_the_motion_as_it_was_and_nothing_redundant(
    joints: JointTable, sliders: tuple[str, ...]
) -> None:
    """Done as told, in a new scene: the same poses, by a linkage without redundancy.

    As drawn, and about there: half a revolution on, Bennett's linkage with a ball and a sleeve could leave its motion.
    """
    scene = linkage_scene(joints, sliders=sliders)
    drawn = linearised_linkage(scene)
    changes, left = without_redundancy(drawn, alternative_rows(scene, drawn))
    assert left == 0
    other = {name: (dict(changes).get(name, joint[0]), *joint[1:]) for name, joint in joints.items()}
    cured = linkage_scene(other, sliders=sliders)
    assert redundancy(linearised_linkage(cured)) == 0
    assert found(other, sliders=sliders).remedy == ""
    t = np.linspace(0, 1.0, 7)
    before, after = motion_at(scene, t), motion_at(cured, t)
    np.testing.assert_allclose(after.R, before.R, atol=1e-11)
    np.testing.assert_allclose(after.p, before.p, atol=1e-11)


# -- free motions -------------------------------------------------------------------------------------------


def test_free_motions_are_told_by_the_fewest_links_that_make_them() -> None:
    """A free arm on a ball, a block on a slide, and a coupler and rocker without their pivot: 3 + 1 + 2 motions."""
    joints = {name: joint for name, joint in BAR.items() if name != "D"}
    joints["E"] = ("spherical", "ground", "arm", (0.0, 1.0, 0.0))
    joints["F"] = ("prismatic", "ground", "block", (3.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    drawn = linearised_linkage(linkage_scene(joints, sliders=("block",)))
    motions = free_motions(drawn)
    assert sorted((each.links, each.basis.shape[1], each.joints) for each in motions) == [
        (("arm",), 3, ("E",)),
        (("block",), 1, ("F",)),
        (("coupler", "rocker"), 1, ("B", "C")),
        (("rocker",), 1, ("C",)),
    ]
    for each in motions:
        np.testing.assert_allclose(drawn.J @ each.basis, 0.0, atol=1e-9)
    words = {each.links: each.words for each in motions}
    assert words["arm",] == "link 'arm' can turn about all axes at joint E (spherical)"
    assert words["block",] == "link 'block' can slide along y at joint F (prismatic)"
    cures = {each.links: remedy(each) for each in motions}
    assert cures["arm",] == "constrain arm by a further joint"  # a ball is not driven
    assert cures["rocker",] == "drive joint C, or constrain rocker by a further joint"


def test_making_one_ball_a_universal_joint_stops_the_idle_spin() -> None:
    (spin,) = free_motions(linearised_linkage(linkage_scene(rssr(1.0, ball=True))))
    assert remedy(spin) == "make joint B or C universal"
    assert not free_motions(linearised_linkage(linkage_scene(universal_rssr(1.0))))


# -- dead points --------------------------------------------------------------------------------------------

CRANK = (0.5, 0.6, 0.5, 1.0)  # cannot turn fully
LIMIT = np.arccos((0.5**2 + 1.0 - 1.1**2) / (2 * 0.5))  # coupler and rocker in line: cosine rule, diagonal b + c


def nearest(joints: JointTable, high: float) -> DeadPoint:
    told = found(joints, high).dead_point
    assert told is not None
    return told


@pytest.mark.parametrize(("short", "error"), [(1.0, 0.06), (5.0, 0.06), (10.0, 0.12), (20.0, 0.25)])
def test_how_far_a_limit_of_the_drive_lies_beyond_its_range_is_estimated(short: float, error: float) -> None:
    """Driven to some degrees before the limit; the estimate is of first order in that distance."""
    told = nearest(four_bar(*CRANK, 0.5), LIMIT - 0.5 - np.radians(short))
    assert told.outside is not None
    assert np.degrees(told.outside - told.tau) == pytest.approx(short, rel=error)


@pytest.mark.parametrize(("short", "error"), [(1.0, 0.01), (5.0, 0.01), (20.0, 0.06)])
def test_a_change_point_beyond_the_range_is_estimated(short: float, error: float) -> None:
    """A parallelogram's, at a crank angle of 180°: its coupler there makes the same angle with its cranks."""
    told = nearest(four_bar(0.3, 0.9, 0.3, 0.9, 1.0), np.pi - 1.0 - np.radians(short))
    assert told.outside is not None
    assert np.degrees(told.outside - told.tau) == pytest.approx(short, rel=error)


def test_a_limit_behind_the_drawn_position_is_told_as_such() -> None:
    """Drawn 5° after the limit on the other side, at minus the angle, and driven away from it."""
    told = nearest(four_bar(*CRANK, np.radians(5) - LIMIT), 0.3)
    assert told.tau == 0.0
    assert told.outside is not None
    assert np.degrees(told.outside) == pytest.approx(-5.0, rel=0.06)


@pytest.mark.parametrize("bend", [2.0, 10.0, 25.0])
def test_how_far_the_joint_is_from_its_dead_position_is_the_transmission_angle(bend: float) -> None:
    """A crank-rocker whose coupler and rocker are at that angle to a line at a crank angle of 180°: cosine rule."""
    b, c, d = 0.6, 0.5, 0.8
    a = np.sqrt(b**2 + c**2 + 2 * b * c * np.cos(np.radians(bend))) - d
    told = nearest(four_bar(a, b, c, d, 0.6), TURN)
    assert told.joint == "C"
    assert np.degrees(told.off) == pytest.approx(bend, rel=0.12)
    assert np.degrees(told.tau) + np.degrees(0.6) == pytest.approx(180, abs=3)
    assert told.outside is None  # it turns fully


# -- the table ----------------------------------------------------------------------------------------------


def said(joints: JointTable, high: float = LITTLE, sliders: tuple[str, ...] = ()) -> str:
    console = Console(width=160, file=StringIO())
    scene = linkage_scene(joints, sliders=sliders)
    console.print(mobility_table(scene, linkage(scene), found(joints, high, sliders)))
    rows: list[list[str]] = []
    for line in console.file.getvalue().splitlines():  # type: ignore[attr-defined]
        cells = [cell.strip() for cell in line.strip("│").split("│")]
        if len(cells) == 2 and not cells[0]:  # a text that goes on
            rows[-1][1] += f" {cells[1]}"
        else:
            rows.append(cells)
    return "\n".join("│".join(cells) for cells in rows)


def test_the_table_reads_as_sentences() -> None:
    text = said(four_bar(*CRANK, 0.5), LIMIT - 0.5 - np.radians(5))
    for row in (
        "degrees of freedom                      │ 1, driven at joint A",
        "joint equations                         │ 20, 3 of them redundant",
        "constrained redundantly at joints A, B, C and D │ force along z, moments about x and y",
        "without these                           │ make joint B spherical and joint C cylindrical",
        "closest to a dead point                 │ at drive angle 54.06 deg, joint C about",
        "to keep away from it                    │ drive another joint, limit the drive, or let a flywheel",
    ):
        wanted = [part.strip() for part in row.split("│")]
        assert any(all(part in line for part in wanted) for line in text.splitlines()), row
    assert "none redundant" in said(universal_rssr(1.0))


def test_an_arm_without_a_loop_has_no_dead_point() -> None:
    arm = {"A": ("revolute", "ground", "arm", (0.0, 0.0, 0.0), Z)}
    told = found(arm)
    assert (told.freedom, told.equations, told.redundancy) == (1, 5, 0)
    assert told.dead_point is None
    assert "dead point" not in said(arm)


def test_far_from_a_dead_point_no_number_is_told_that_would_be_wrong() -> None:
    """A slider-crank of ratio 3: the rod is 71° from the direction in which it would lock, acos(1/3)."""
    text = said(slider_crank(0.1, 0.3, 0.7), TURN, ("slider",))
    assert "30° or more from it (estimated" in text
    assert "to keep away" not in text


# -- couplings and several drives -----------------------------------------------------------------------------

WHEELS: JointTable = {name: ("revolute", "ground", f"wheel{name}", (x, 0.0, 0.0), Z) for x, name in enumerate("ABC")}


def scene_with(joints: JointTable, model: str = "solid", **tables: object) -> Scene:
    """A linkage with gears or drives of its own."""
    at = {link: np.asarray(joint[3], float) for joint in joints.values() for link in joint[1:3]}
    links = {link: bar(point) | {"model": model} for link, point in at.items() if link != "ground"}
    raw = {"links": links, "joints": {name: joint(*fields) for name, fields in joints.items()}}
    return scene_from({**raw, "analysis": {"end_time": 1.0, "step": 0.01}, **tables})


def geared(ratio: float) -> Scene:
    """Three wheels in a ring of gears: consistent at a ratio of 4 = (−2)²."""
    pairs = {"g": (("A", "B"), -2.0), "h": (("B", "C"), -2.0), "k": (("A", "C"), ratio)}
    gears = {name: {"joints": list(on), "ratio": x} for name, (on, x) in pairs.items()}
    return scene_with(WHEELS, drive={"joint": "A", "motion": UNIT_SPEED}, gears=gears)


def test_one_gear_of_a_ring_can_be_left_out() -> None:
    scene = geared(4.0)
    link = linkage(scene)
    told = mobility(scene, link, path(link, 0.0, LITTLE))
    assert (told.freedom, told.equations, told.redundancy) == (1, 18, 1)
    assert [(each.joints, each.words) for each in told.redundant] == [
        (("gears.g", "gears.h", "gears.k"), "the coupling itself")
    ]
    assert told.remedy == "leave out gears.g, gears.h or gears.k"


def test_gears_that_contradict_one_another_are_a_structure() -> None:
    with pytest.raises(MotionError, match=r"it would move without gears\.g, gears\.h or gears\.k;"):
        linkage(geared(3.0))


def test_a_five_bar_is_driven_twice_and_its_dead_point_is_told_by_time() -> None:
    P = ((0, 0, 0), (0, 0.2, 0), (0.4, 0.6, 0), (0.9, 0.6, 0), (1.0, 0, 0))
    names = ("ground", "crank", "one", "two", "rocker", "ground")
    joints = {x: ("revolute", names[k], names[k + 1], P[k], Z) for k, x in enumerate("ABCDE")}
    drives = {x: {"joint": x, "motion": {**RISE, "angle": angle}} for x, angle in (("A", 0.1), ("E", -0.1))}
    scene = scene_with(joints, drives=drives)
    link = linkage(scene)
    told = mobility(scene, link, path(link, 0.0, 1.0))
    assert (told.freedom, told.drives, told.redundancy) == (2, 2, 3)  # 6·4 − 5·5 = −1
    console = Console(width=160, file=StringIO())
    console.print(mobility_table(scene, link, told))
    text = console.file.getvalue()  # type: ignore[attr-defined]
    assert "2, driven at joints A and E" in text
    assert "at t = " in text


# -- a drive that slides ------------------------------------------------------------------------------------


def carried(frames: str) -> Scene:
    """A block on a spring of a ground that a drive lifts; its guide leaves it free."""
    lift = {"kind": "curve", "time": [0, 1], "value": [-0.05, 0.05]}
    return scene_from(
        sprung(np.array(Z), lift, end_time=1.0, step=0.01) | {"analysis": {"frames": frames, "end_time": 1.0}}
    )


def test_messages_of_a_slide_speak_of_its_travel() -> None:
    link = linkage(carried("co-rotational"))
    assert position_in_words(link, -0.05) == "drive travel -50 mm"
    scene = carried("co-rotational")
    motion = rigid_motion(link, path(link, -0.05, 0.05), np.array([0.25]), path_parameter(scene, np.array([0.25])))
    assert instant_in_words(link, motion, 0) == "t = 0.25 s, drive travel -25 mm"
    with pytest.raises(MotionError, match="free motion left at drive travel 0 mm, the reference position"):
        linkage(carried("rigid-body"))


def test_remedies_against_free_motions_are_told_where_the_first_steps_fail() -> None:
    scene = carried("co-rotational")
    link = linkage(scene)
    told = mobility(scene, link, path(link, -0.05, 0.05))
    for works in (True, False):
        console = Console(width=160, file=StringIO())
        console.print(mobility_table(scene, link, told, works))
        text = console.file.getvalue()  # type: ignore[attr-defined]
        assert "link 'block' can slide along z" in text
        assert ("drive joint guide" in text) != works
