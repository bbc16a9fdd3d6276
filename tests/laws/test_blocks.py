"""Linkages solved entry by entry move, and are refused, as those that are solved as one matrix."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.accuracy.prepared import moving
from kedfem.dynamics.inertias import inertias_of_links
from kedfem.errors import MotionError
from kedfem.kinematics import rigid_links
from kedfem.motion import linkage as linkages
from kedfem.motion.linkage import linkage
from kedfem.motion.newton import BlockFactor, Factor
from kedfem.motion.path import path
from kedfem.motion.rigid import rigid_motion
from kedfem.motion.values import features
from kedfem.results.forces.rigid import rigid_forces
from kedfem.scene import Scene, path_parameter
from tests.linkages import four_bar, linkage_scene, motion_at, slider_crank
from tests.spatial_linkages import rssr

Z = (0.0, 0.0, 1.0)


def geared() -> Scene:
    """A four-bar, a wheel on its rocker geared to the turn of the coupler on the crank: a row of four bodies."""
    joints = four_bar(0.3, 0.95, 0.35, 1.0, 1.2)
    joints["V"] = ("revolute", "rocker", "wheel", joints["C"][3], Z)
    return linkage_scene(joints, sections={"gears": {"pair": {"joints": ["B", "V"], "ratio": 2.0}}})


def row_of_loops(n: int) -> Scene:
    """Four-bars one behind the other, the rocker of each the crank of the next."""
    joints = dict(four_bar(0.3, 0.95, 0.35, 1.0, 1.2))
    C, D = (np.asarray(joints[x][3]) for x in "CD")
    for k in range(n):
        ahead = np.array([0.9, 0.02, 0.0])
        joints |= {
            f"C{k}": ("revolute", f"rocker{k - 1}" if k else "rocker", f"coupler{k}", C, Z),
            f"E{k}": ("revolute", f"coupler{k}", f"rocker{k}", C + ahead, Z),
            f"D{k}": ("revolute", f"rocker{k}", "ground", D + ahead, Z),
        }
        C, D = C + ahead, D + ahead
    return linkage_scene(joints)


SCENES: dict[str, Callable[[], Scene]] = {
    "four-bar": lambda: linkage_scene(four_bar(0.3, 0.95, 0.35, 1.0, 1.2)),
    "slider-crank": lambda: linkage_scene(slider_crank(0.1, 0.3, 0.4), sliders=("slider",)),
    "in space": lambda: linkage_scene(rssr(0.3)),
    "gears": geared,
    "seven loops": lambda: row_of_loops(6),
}
T = np.linspace(0.0, 0.3, 7)


Work = Callable[[], Any]


@pytest.fixture
def whole_up_to(monkeypatch: pytest.MonkeyPatch) -> Callable[[int, Work], Any]:
    """What a function gives where linkages of so many bodies are solved as one matrix, larger ones by entries."""

    def given(bodies: int, work: Work) -> Any:
        monkeypatch.setattr(linkages, "MANY", bodies)
        return work()

    return given


@pytest.mark.parametrize("name", SCENES)
def test_solved_by_entries_a_linkage_moves_the_same(name: str, whole_up_to: Any) -> None:
    scene = SCENES[name]()
    one, other = (whole_up_to(many, lambda: motion_at(scene, T)) for many in (0, 1000))
    for key in ("R", "p", "v", "omega", "alpha", "p2"):
        wanted = getattr(other, key)
        assert_allclose(getattr(one, key), wanted, atol=1e-10 * np.abs(wanted).max())  # condition² · rounding


@pytest.mark.parametrize("name", SCENES)
def test_singular_values_and_least_squares_are_those_of_the_whole_matrix(name: str, whole_up_to: Any) -> None:
    scene = SCENES[name]()
    link = whole_up_to(0, lambda: linkage(scene))
    along = whole_up_to(1000, lambda: path(linkage(scene), 0.0, 0.3))
    f = features(link.rows, (along.R, along.p), along.near)
    whole, by_entry = Factor(link, f), BlockFactor(link, f, link.blocks)
    assert_allclose(by_entry.extremes(), whole.extremes(), rtol=0.03)  # power iteration: close ones mix
    rhs = np.random.default_rng(2).standard_normal((len(along.phi), link.rows.count, 2))  # not to be fulfilled
    wanted = whole.solve(rhs)
    assert_allclose(by_entry.solve(rhs), wanted, atol=1e-9 * np.abs(wanted).max())
    assert_allclose(by_entry.left(rhs), whole.left(rhs), atol=1e-9)
    forces = np.random.default_rng(3).standard_normal((len(along.phi), len(link.bodies) - 1, 6))
    wanted = whole.least_norm(forces)
    assert_allclose(by_entry.least_norm(forces), wanted, atol=1e-9 * np.abs(wanted).max())
    for k in range(len(along.phi)):
        there = by_entry.J[k]
        assert link.blocks.agree(there, by_entry.J[0]) == (np.linalg.slogdet(whole.J[k].T @ whole.J[0])[0] > 0)


PARALLEL = four_bar(0.3, 0.9, 0.3, 0.9, np.radians(60))
LOCKING = {
    "a change point": (PARALLEL, 121.0),
    "a limit of the crank": (four_bar(0.5, 0.6, 0.5, 1.0, 0.7), 60.0),
    "no triangle": (slider_crank(0.3, 0.2, 0.4), 80.0),
}


@pytest.mark.parametrize("name", LOCKING)
def test_dead_points_are_found_and_told_the_same(name: str, whole_up_to: Any) -> None:
    joints, end = LOCKING[name]
    scene = linkage_scene(joints, sliders=("slider",) if "triangle" in name else ())

    def refusal() -> str:
        with pytest.raises(MotionError) as caught:
            motion_at(scene, np.linspace(0, np.radians(end), 9))
        return str(caught.value)

    one, other = (whole_up_to(many, refusal) for many in (0, 1000))
    assert one == other


@pytest.mark.parametrize("name", SCENES)
def test_joints_of_rigid_links_bear_the_same(name: str, whole_up_to: Any) -> None:
    """Forces, moments and efforts with the least multipliers; and which of them statics determine."""
    scene = SCENES[name]()

    def borne() -> dict[str, np.ndarray]:
        linked, along = moving(scene)
        forces = rigid_forces(scene, linked, inertias_of_links(scene, linked, rigid_links(scene)), along)
        return forces.rows(rigid_motion(linked, along, T, path_parameter(scene, T)))

    one, other = (whole_up_to(many, borne) for many in (0, 1000))
    assert one.keys() == other.keys()
    sizes: dict[str, float] = {}
    for key, wanted in other.items():
        unit = key.rsplit("_", 1)[-1]
        sizes[unit] = max(sizes.get(unit, 0.0), float(np.abs(wanted).max()))
    for key, wanted in other.items():
        assert_allclose(one[key], wanted, atol=1e-9 * sizes[key.rsplit("_", 1)[-1]])


REFUSED: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "a drive too many": (
        dict(four_bar(0.3, 0.95, 0.35, 1.0, 1.2)),
        {"drives": {x: {"joint": x, "motion": {"kind": "cycloidal", "angle": 0.1, "rise": 1.0}} for x in "AD"}},
    ),
    "a dead point in the reference position": (
        {
            "A": ("revolute", "ground", "crank", (0.3, -0.4, 0.0), Z),
            "B": ("revolute", "crank", "coupler", (0.3, 0.0, 0.0), Z),
            "C": ("revolute", "coupler", "rocker", (0.7, 0.0, 0.0), Z),
            "D": ("revolute", "rocker", "ground", (0.9, 0.0, 0.0), Z),
        },
        {},
    ),
    "a link that is free": (
        {**four_bar(0.3, 0.95, 0.35, 1.0, 1.2), "E": ("revolute", "rocker", "flap", np.zeros(3), Z)},
        {},
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_driven_is_refused_the_same(name: str, whole_up_to: Any) -> None:
    """The quick look at many bodies, least squares of each drive's rate, lets nothing pass that ranks refuse."""
    joints, sections = REFUSED[name]
    scene = linkage_scene(joints, None if sections else "A", sections=sections)

    def refusal() -> str:
        with pytest.raises(MotionError) as caught:
            linkage(scene)
        return str(caught.value)

    one, other = (whole_up_to(many, refusal) for many in (0, 1000))
    assert one == other
