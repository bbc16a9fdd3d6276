"""Frequencies of links that turn: published bars, eigenvalues of the monolithic system, buckling, critical speeds.

A cantilever that turns about its root has f(μ) of Hamza-Cherif and Houmat (ICAS 2004, table 2; Bernoulli's beam), μ =
Ω √(ρA L⁴/EI). Gyroscopic forces, which are left out, take 1e-4 μ² from the chordwise one; shear takes 0.15 % from both.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from kedfem.accuracy.prepared import meshed
from kedfem.dynamics.modes.frozen import Frozen, UnstableError
from kedfem.dynamics.modes.stiffened import Stiffened, frozen_linkage
from kedfem.dynamics.system.build import system_of
from kedfem.dynamics.system.record import System
from kedfem.errors import SceneError
from kedfem.frequencies import Wanted, frequencies
from kedfem.motion.rigid import RigidMotion, rigid_motion
from kedfem.scene import path_parameter, scene_from, time_grid
from tests.laws.test_frozen import difference
from tests.scenes import constant_speed, four_bar
from tests.verification.stiffening import HEIGHT, LENGTH, RUBBER, TABLE

Raw = dict[str, Any]
E, DENSITY = RUBBER.youngs_modulus, RUBBER.density
UNIT = float(np.sqrt(E * HEIGHT**2 / 12 / DENSITY) / LENGTH**2)
SPEEDS = (2, 4, 6)  # μ, of the table
AXES = {
    "x": np.array([0, np.pi / 2, 0]), "y": np.array([-np.pi / 2, 0, 0]), "z": np.zeros(3),
    "oblique": np.array([0.7, -0.4, 1.1]),
}  # fmt: skip


def arm(kind: str, mu: float, turn: Any = "z", **more: Any) -> Raw:
    """A square bar that turns about an axis across its root."""
    R = Rotation.from_rotvec(AXES[turn]).as_matrix()
    planar = kind in ("planar beam", "plane")
    tip, axis = (LENGTH * R[:, 0]).tolist(), R[:, 2].tolist()
    shape = {"kind": "bar", "between": [[0, 0], [LENGTH, 0]], "width": HEIGHT, "thickness": HEIGHT}
    if not planar:
        shape |= {"between": [[0, 0, 0], tip], "up": axis}
    link: Raw = {"material": "rubber", "shape": shape, "mesh": {"elements": [16, 1, 1]}, "model": kind}
    if kind.endswith("beam"):
        link |= {"model": "beam", "mesh": {"elements": 16}, "beam": kind.split(maxsplit=1)[0]}
    if kind == "plane":
        link["mesh"] = {"elements": [24, 1]}
    joint = {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0] if planar else [0, 0, 0]}
    return {
        "materials": {"rubber": {"density": DENSITY, "youngs_modulus": E, "poisson_ratio": 0.0}},
        "links": {"arm": link}, "joints": {"A": joint if planar else {**joint, "axis": axis}},
        "drive": {"joint": "A", "motion": constant_speed(mu * UNIT)},
        "analysis": {"accuracy": "quick", "revolutions": 1, "steps_per_revolution": 360, "stiffening": True}, **more,
    }  # fmt: skip


def stiffened(raw: Raw, count: int = 2, driven: bool = True, share: float = 0.3) -> tuple[System, RigidMotion, Stiffened]:
    """A scene, its motion after a share of a revolution, and its solver."""
    scene = scene_from(raw)
    ready = meshed(scene)
    loose = scene if driven else scene.model_copy(update={"drive": None, "drives": {}})
    system = system_of(loose, ready.linkage, ready.path)
    t = np.array([share * time_grid(scene).end])
    motion = rigid_motion(ready.linkage, ready.path, t, path_parameter(scene, t))
    solver = frozen_linkage(scene, system, ready.linkage, ready.path, count, free=not driven)
    assert isinstance(solver, Stiffened)
    return system, motion, solver


BARS = [
    (kind, turn, mu)
    for kind in ("planar beam", "plane", "spatial beam", "solid")
    for turn in (AXES if kind in ("spatial beam", "solid") else ("z",))
    for mu in SPEEDS
]


@pytest.mark.parametrize(
    ("kind", "turn", "mu"),
    [x if x[1:] in (("z", 4), ("oblique", 2)) else pytest.param(*x, marks=pytest.mark.long) for x in BARS],
)
def test_a_bar_that_turns_has_published_frequencies(kind: str, turn: str, mu: int) -> None:
    _, motion, solver = stiffened(arm(kind, mu, turn))
    found = solver.at(motion).omega / UNIT
    chord, flap = TABLE[mu]
    assert_allclose(found[0], chord, rtol=1.5e-3 + 1e-4 * mu**2)
    if kind not in ("planar beam", "plane"):
        assert_allclose(found[1], flap, rtol=2e-3)


@pytest.mark.parametrize("kind", ["planar beam", "plane", "spatial beam", "solid"])
def test_at_no_speed_they_are_those_of_the_linkage_at_rest(kind: str) -> None:
    system, motion, solver = stiffened(arm(kind, 1e-4))
    assert_allclose(solver.at(motion).omega, Frozen(system, 2).at(motion).omega, rtol=1e-6)


def swung(kind: str, turn: str) -> Raw:
    """The bar in a swing that speeds it up as much as it turns, under its weight across and along it."""
    rise = np.pi / UNIT
    motion = {"kind": "cycloidal", "angle": 1.5, "rise": rise}
    analysis = {"accuracy": "quick", "end_time": rise, "step": rise / 360, "stiffening": True}
    weight = [-3.0, -9.81, 0.0] if "pla" in kind else [-3.0, -9.81, -5.0]
    return {**arm(kind, 2.0, turn, gravity=weight), "drive": {"joint": "A", "motion": motion}, "analysis": analysis}


TURNING = [(kind, turn) for kind, turn, mu in BARS if mu == 2]


@pytest.mark.parametrize(("kind", "turn"), TURNING)
def test_a_turning_bar_that_a_drive_lets_go_turns_at_no_frequency(kind: str, turn: str) -> None:
    """Its vibrations are those of the bar on its hinge, as without the exclusion: its stress turns with it."""
    _, motion, solver = stiffened(arm(kind, 2.0, turn), driven=False)
    found, solver.loose = solver.at(motion), None
    assert found.still == 1
    assert_allclose(found.omega, solver.at(motion).omega, rtol=1e-6, atol=1e-4 * UNIT)


@pytest.mark.parametrize(("kind", "turn"), TURNING)
def test_neither_weight_nor_acceleration_turns_what_a_drive_lets_go(kind: str, turn: str) -> None:
    """They did: turned about z it was refused, as if it tipped over, and about x it had half of Ω."""
    _, motion, solver = stiffened(swung(kind, turn), driven=False, share=0.2)
    _, _, still = stiffened(arm(kind, 1e-6, turn), driven=False)
    found = solver.at(motion)
    assert found.still == 1
    assert_allclose(found.omega[1:], still.at(motion).omega[1:], rtol=0.005)  # 0.34 % by stiffening


LINKS: dict[str, Raw] = {
    "planar beam": {"model": "beam", "mesh": {"elements": 4}},
    "plane": {"model": "plane", "mesh": {"elements": [8, 1]}},
    "spatial beam": {"model": "beam", "beam": "spatial", "mesh": {"elements": 4}},
    "solid": {"model": "solid", "mesh": {"elements": [6, 1, 1]}},
}


def linkage(kind: str, rpm: float = 1500.0) -> Raw:
    """A four-bar that stiffens by some per cent."""
    shape = {"kind": "bar", "width": 0.006, "thickness": 0.012}
    link = {"material": "steel", "shape": shape, **LINKS[kind]}
    analysis = {"accuracy": "quick", "revolutions": 1, "steps_per_revolution": 360, "stiffening": True}
    return {**four_bar((0.1, 0.3, 0.25, 0.3), link, constant_speed(f"{rpm} rpm")), "analysis": analysis}


@pytest.mark.parametrize("kind", LINKS)
def test_a_linkage_has_the_eigenvalues_of_the_monolithic_system(kind: str) -> None:
    system, motion, solver = stiffened(linkage(kind), count=3)
    found = solver.at(motion)
    assert difference(solver.system_at(motion)[0], motion, found) < (1e-8 if "pla" in kind else 2e-6)
    assert np.abs(found.omega / Frozen(system, 3).at(motion).omega - 1).max() > 0.005


@pytest.mark.parametrize("kind", LINKS)
def test_a_linkage_that_a_drive_lets_go_has_its_vibrations_alone(kind: str) -> None:
    """Its motion had 20.5 Hz where the drive turns at 25 Hz, and critical speeds."""
    system, motion, solver = stiffened(linkage(kind), count=3, driven=False)
    found = solver.at(motion)
    assert found.still == 1
    assert found.frequencies[0] > 100.0
    assert difference(solver.system_at(motion)[0], motion, found, system) < (1e-8 if "pla" in kind else 2e-6)


def test_a_bar_under_too_much_pressure_buckles() -> None:
    """Euler's load of a cantilever, π² EI/4L², and 2 % less and more than it, while it hardly turns."""
    euler = np.pi**2 * E * HEIGHT**4 / 12 / 4 / LENGTH**2

    def pressed(share: float) -> Raw:
        load = {"kind": "force", "link": "arm", "at": [LENGTH, 0, 0], "vector": [-share * euler, 0, 0], "frame": "link"}
        return arm("spatial beam", 1e-3, loads={"P": load})

    _, motion, solver = stiffened(pressed(0.98))
    _, _, free = stiffened(pressed(0.0))
    assert solver.at(motion).omega[0] < 0.2 * free.at(motion).omega[0]
    _, motion, solver = stiffened(pressed(1.02))
    with pytest.raises(UnstableError, match="buckles under the stresses of its motion"):
        solver.at(motion)


def test_a_harmonic_meets_what_stiffens_with_the_speed(tmp_path: Path) -> None:
    """3 Ω = ω(Ω), within what straight lines over Ω² leave; Ω = ω(Ω) is beyond twice the drive's speed."""
    found = frequencies(scene_from(arm("planar beam", 1.5)), Wanted(1, 2, harmonics=3), tmp_path / "out")
    (third, *_) = (x for x in found.crossings if x.harmonic == 3)
    _, motion, solver = stiffened(arm("planar beam", third.slowest / UNIT))
    assert_allclose(solver.at(motion).omega[0], 3 * third.slowest, rtol=1e-3)
    assert_allclose(third.fastest, third.slowest, rtol=1e-6)
    assert not [x for x in found.crossings if x.harmonic == 1]
    assert (tmp_path / "out" / "campbell.png").is_file()


@pytest.mark.parametrize("speed", [2 * UNIT, -2 * UNIT])
def test_positions_of_a_ramp_have_the_speed_that_it_leads_to(speed: float, tmp_path: Path) -> None:
    """Half a revolution while it speeds up: frequencies and crossings were those of the speeds until then."""
    motions = {"kind": "ramp", "speed": speed, "time": np.pi / UNIT}, constant_speed(speed)
    analysis = {"accuracy": "quick", "end_time": np.pi / UNIT, "step": np.pi / UNIT / 180, "stiffening": True}
    ramp, constant = (
        frequencies(scene_from({**arm("planar beam", 2.0), "drive": {"joint": "A", "motion": x}, "analysis": analysis}),
                    Wanted(1, 4), tmp_path / x["kind"])
        for x in motions
    )  # fmt: skip
    assert_allclose(ramp.values, constant.values, rtol=1e-8)
    assert [x.slowest for x in ramp.crossings] == pytest.approx([x.slowest for x in constant.crossings], rel=1e-8)


def test_speeds_at_which_links_buckle_are_left_out_and_told(tmp_path: Path) -> None:
    found = frequencies(scene_from(linkage("planar beam", 3000.0), tmp_path), Wanted(2, 8), tmp_path / "out")
    assert [text for text in found.warnings if "buckle by the stresses of motion between" in text]
    assert np.isfinite(found.values).all()


def with_rigid(name: str) -> Raw:
    """A four-bar of beams with one rigid link."""
    raw = linkage("planar beam")
    link = {key: value for key, value in raw["links"][name].items() if key != "mesh"}
    return {**raw, "links": {**raw["links"], name: {**link, "model": "rigid"}}}


@pytest.mark.parametrize("name", ["crank", "coupler", "rocker"])
def test_rigid_links_have_the_eigenvalues_of_the_monolithic_system_too(name: str) -> None:
    _, motion, solver = stiffened(with_rigid(name), count=3)
    assert difference(solver.system_at(motion)[0], motion, solver.at(motion)) < 1e-8


def test_a_free_drive_that_carries_a_rigid_link_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"--free: must be left out with analysis\.stiffening .* got crank"):
        frequencies(scene_from(with_rigid("crank"), tmp_path), Wanted(2, 1, free=True), tmp_path / "out")
