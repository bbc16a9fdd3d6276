"""Springs, motors, limits and drives along slots: the pin's place on the bent line is a coordinate like any other."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.dynamics.system.ends import left_line
from kedfem.dynamics.system.record import ON_LINES
from kedfem.output.joint_springs import line_springs
from kedfem.scene import scene_from
from tests.driven_mechanisms import off_rigid, stiffer
from tests.laws.test_joint_partners import along
from tests.moving import bar, channels, inverted, ran, turned
from tests.partners import chain
from tests.rooms.test_cross_checks import compared
from tests.systems import against_oracle, begun

Raw = dict[str, Any]
OMEGA, HERE, K = 20.0, 0.2, 400.0  # rad/s; m, where the bead is drawn; N/m
RHO, E, SECTION, G = 7850.0, 210e9, 0.03 * 0.02, 9.81  # of steel, of `bar` [m²], m/s²
BEAD = RHO * SECTION * 0.04  # kg
FRAMES = ("rigid-body", "co-rotational")


def bead(at: float = HERE) -> Raw:
    """A rod across the line whose middle is the pin."""
    return bar("beam", (at, -0.02), (at, 0.02), 2)


def slot(pin: str = "bead", at: float = HERE) -> Raw:
    return {"kind": "slot", "links": [pin, "arm"], "at": [at, 0], "axis": [1, 0, 0]}


def spring(joint: str = "S", **more: Any) -> Raw:
    return {"kind": "spring", "joint": joint, **more}


def motor(force: float) -> Raw:
    return {"joint": "S", "force": {"over": "time", "at": [0.0], "value": [force]}}


def on_a_turning_arm(arm: Raw, **more: Any) -> Raw:
    """A drive turns an arm at a steady rate; a bead is let go where it is drawn, as it turns with the arm."""
    return {
        "links": {"bead": bead(), "arm": arm},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0]}, "S": slot()},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": OMEGA}},
        "analysis": {"end_time": 0.1, "step": 2.5e-4, "rho_inf": 0.9, "initial": "rest", "accuracy": "quick"},
        **more,
    }


ARMS = {
    "rigid": bar("rigid", (0, 0), (0.6, 0), 8),
    "beam": bar("beam", (0, 0), (0.6, 0), 8),
    "plane": bar("plane", (0, 0), (0.6, 0), 12),
    "segments": bar("plane", (0, 0), (0.6, 0), 12, segments=3),
}
SOME = ["rigid", "beam", "segments", pytest.param("plane", marks=pytest.mark.long)]


def swings(t: np.ndarray, c: float = 0.0, at: float = HERE) -> np.ndarray:
    """m x'' + c x' + (k − m ω²) x = m ω² r, from rest on the arm."""
    still = BEAD * OMEGA**2 * at / (K - BEAD * OMEGA**2)
    slow = c / (2 * BEAD)
    fast = np.sqrt(K / BEAD - OMEGA**2 - slow**2)
    return np.asarray(still * (1 - np.exp(-slow * t) * (np.cos(fast * t) + slow / fast * np.sin(fast * t))))


@pytest.mark.parametrize("c", [0.0, pytest.param(3.0, marks=pytest.mark.long)])
@pytest.mark.parametrize("arm", SOME)
def test_a_bead_on_a_spring_swings_slower_on_a_turning_arm(arm: str, c: float) -> None:
    """At √(k/m − ω²): steps of 0.01 of its radian leave 2e-5 of the amplitude per radian, arms that bend 1e-4."""
    raw = on_a_turning_arm(ARMS[arm], springs={"s": spring(stiffness=K, damping=c)})
    raw["analysis"]["frames"] = "co-rotational"
    got = channels(*ran(raw))
    x = swings(2.5e-4 * np.arange(401), c)
    found = got["springs/s/travel"][:, 0]
    rate = np.gradient(found, 2.5e-4)
    assert_allclose(found, x, atol=5e-4 * x.max())
    assert_allclose(got["springs/s/force"][2:-2, 0], -(K * found + c * rate)[2:-2], atol=2e-3 * K * x.max())
    assert np.abs(got["energy/residual"]).max() < 1e-4 * np.abs(got["energy/kinetic"]).max()


def test_each_pin_on_a_line_has_a_place_of_its_own() -> None:
    """Two beads on one arm, whose travels are from where each is drawn; it bends, by 7e-4 of these."""
    raw = on_a_turning_arm(ARMS["beam"], springs={"s": spring(stiffness=K), "t": spring("T", stiffness=K)})
    raw["links"]["other"], raw["joints"]["T"] = bead(0.3), slot("other", 0.3)
    raw["analysis"]["frames"] = "co-rotational"
    got, t = channels(*ran(raw)), 2.5e-4 * np.arange(401)
    for name, at in (("s", HERE), ("t", 0.3)):
        x = swings(t, at=at)
        assert_allclose(got[f"springs/{name}/travel"][:, 0], x, atol=2e-3 * x.max())


def hung(arm: Raw, slope: float = 0.0, **more: Any) -> Raw:
    """A rod hangs on its pin in the slot of an arm that is clamped, at a slope."""
    c, s = np.cos(slope), np.sin(slope)
    raw: Raw = {
        "links": {"bead": bar("beam", (HERE, 0), (HERE, -0.1), 2), "arm": arm},
        "joints": {"A": {"kind": "weld", "links": ["ground", "arm"], "at": [0, 0]}, "S": slot()},
        "analysis": {"kind": "static"},
    }
    raw = turned(raw, np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]))
    x, y = HERE * c, HERE * s
    raw["links"]["bead"]["shape"]["between"] = [[x, y], [x, y - 0.1]]
    return {**raw, "gravity": [0, -G], **more}


@pytest.mark.parametrize("arm", SOME)
def test_a_motors_force_and_weight_press_a_spring_together(arm: str) -> None:
    """k s = F − m g sin β: the arm's slope at the pin is 3e-5 at most."""
    F, slope, weight = 5.0, 0.5, RHO * SECTION * 0.1 * G
    acting: Raw = {"springs": {"s": spring(stiffness=K)}, "motors": {"m": motor(F)}}
    got = channels(*ran(hung(ARMS[arm], slope, **acting)))
    s = (F - weight * np.sin(slope)) / K
    assert_allclose(got["springs/s/travel"], s, rtol=2e-4)
    assert_allclose(got["motors/m/travel"], got["springs/s/travel"], rtol=1e-12)
    across = weight * np.cos(slope) * np.array([-np.sin(slope), np.cos(slope), 0])
    assert_allclose(got["joints/S/force"][0, :2], across[:2], atol=1e-3 * weight)


def test_a_stop_gives_by_the_force_on_it() -> None:
    """s = upper + F/k."""
    stop = {"kind": "travel", "joint": "S", "lower": -0.02, "upper": 0.01, "stiffness": 1e5}
    got = channels(*ran(hung(ARMS["beam"], motors={"m": motor(50.0)}, limits={"l": stop})))
    assert_allclose(got["limits/l/travel"], 0.01 + 50.0 / 1e5, rtol=1e-4)
    assert_allclose(got["limits/l/force"], -50.0, rtol=1e-4)


def test_a_pin_that_is_held_is_at_another_place_of_a_line_that_is_stretched() -> None:
    """s = r/(1 + ε) − r, by lengths of the unstrained line."""
    strain = 0.01
    raw = hung(ARMS["beam"], springs={"s": spring(stiffness=1.0)})
    raw["joints"]["H"] = {"kind": "weld", "links": ["ground", "bead"], "at": [HERE, 0]}
    raw["loads"] = {"P": {"kind": "force", "link": "arm", "at": [0.6, 0], "vector": [strain * E * SECTION, 0]}}
    raw["gravity"] = [0, 0]
    got = channels(*ran(raw))
    assert_allclose(got["springs/s/travel"], HERE / (1 + strain) - HERE, rtol=1e-4)


def stiff_block(kind: str, frames: str) -> dict[str, np.ndarray]:
    """A crank's pin in a slot of an arm, or on a block that slides on the arm and has next to no mass; stiff links."""
    raw = inverted("beam", kind, revolutions=0.25, steps_per_revolution=180, rho_inf=0.8, frames=frames)
    raw["materials"] = {
        "stiff": {"youngs_modulus": 2e14, "poisson_ratio": 0.3, "density": RHO},
        "light": {"youngs_modulus": 2e14, "poisson_ratio": 0.3, "density": 1e-3},
    }
    for name, link in raw["links"].items():
        link["material"] = "light" if name == "block" else "stiff"
    raw["joints"]["S"]["at"] = [0.1, 0]
    raw["springs"] = {"s": spring(stiffness=3e3, damping=20.0, preload=10.0)}
    raw["motors"] = {"m": {"joint": "S", "force": {"over": "speed", "at": [-1.0, 1.0], "value": [30.0, -30.0]}}}
    return channels(*ran(raw))


@pytest.mark.parametrize("frames", FRAMES)
def test_a_pin_is_moved_as_a_block_without_mass(frames: str) -> None:
    """Travel, forces along it and the drive's torque: of stiff links, that bend by 1e-6 of their length."""
    one, other = stiff_block("slot", frames), stiff_block("prismatic", frames)
    assert np.abs(one["springs/s/travel"]).max() > 0.05
    for name in ("springs/s/travel", "springs/s/force", "motors/m/speed", "motors/m/force", "drive/torque"):
        assert_allclose(one[name], other[name], atol=1e-4 * np.abs(other[name]).max())


def acting(damping: float = 3.0) -> Raw:
    """A spring, a motor and stops along joint J, which it passes within three steps from rest."""
    force = {"over": "time", "at": [0.0, 0.01], "value": [20.0, 40.0]}
    stop = {"kind": "travel", "joint": "J", "lower": -2e-5, "upper": 2e-5, "stiffness": 1e5, "damping": 5.0}
    return {
        "springs": {"s": spring("J", stiffness=3e3, damping=damping, preload=5.0)},
        "motors": {"m": {"joint": "J", "force": force}},
        "limits": {"l": stop},
    }


def acted_on(partners: tuple[str, str], plane: bool, frames: str, driven: bool = False) -> Raw:
    """A chain whose slot J has all of these, or the drive."""
    raw = chain("slot", partners, "travel" if driven else False, plane)
    raw["analysis"] |= {"frames": frames}
    return raw if driven else raw | acting()


CELLS = [
    (("planar beam", "plane"), True), (("plane", "planar beam"), True), (("planar beam", "ground"), True),
    (("rigid", "planar beam"), True), (("planar beam", "rigid"), True),
    (("beam", "beam"), False), (("beam", "ground"), False), (("rigid", "beam"), False),
    (("beam", "solid"), False), (("reduced", "rigid"), False), (("solid", "reduced"), False),
]  # fmt: skip


@pytest.mark.parametrize("driven", [False, True], ids=["elements", "drive"])
@pytest.mark.parametrize("frames", FRAMES)
@pytest.mark.parametrize(
    ("partners", "plane"),
    [x if k in {0, 5, 7} else pytest.param(*x, marks=pytest.mark.long) for k, x in enumerate(CELLS)],
)
def test_the_oracle_has_the_same(partners: tuple[str, str], plane: bool, frames: str, driven: bool) -> None:
    """Which finds places by bisection, and rates by differences: 4e-10 found."""
    assert against_oracle(begun(acted_on(partners, plane, frames, driven)), keeps=True) < 1e-8


@pytest.mark.parametrize("frames", FRAMES)
def test_a_pin_beyond_its_line_is_told_by_the_joint(frames: str) -> None:
    """Whichever of what is on it finds it there."""
    system = begun(acted_on(("planar beam", "planar beam"), True, frames)).ready.system
    lines = {term.j for each in system.constraints for term in each.terms if term.kind in ON_LINES}
    assert lines
    for end in lines:
        assert left_line(system, end, 0.0).startswith("joints.J: the pin must stay on link 'link 1'")


@pytest.mark.parametrize("frames", FRAMES)
@pytest.mark.parametrize("plane", [True, pytest.param(False, marks=pytest.mark.long)])
def test_off_its_line_too_the_oracle_has_the_same(plane: bool, frames: str) -> None:
    """By 0.1 mm on soft bushings, where the line's slopes bear a part of what acts along it."""
    raw = acted_on(("planar beam", "planar beam") if plane else ("beam", "beam"), plane, frames)
    raw["joints"]["J"]["bushing"] = {"stiffness": 1e3, "damping": 1.0}
    raw["motors"]["m"]["force"]["value"] = [2000.0, 4000.0]
    steps = 10 if plane else 30  # in space iterations of longer steps do not converge with so soft a bushing
    raw["analysis"]["step"] = 5e-4 if plane else 1e-4
    assert against_oracle(begun(raw), steps, keeps=True) < 1e-8


def long(partners: tuple[str, str], plane: bool, frames: str, driven: bool, step: float = 2.5e-4) -> Raw:
    """40 steps from a quasi-static start."""
    raw = acted_on(partners, plane, frames, driven)
    raw["analysis"] |= {"end_time": 0.01, "step": step}
    return raw


@pytest.mark.parametrize("driven", [False, True], ids=["elements", "drive"])
@pytest.mark.parametrize("frames", FRAMES)
@pytest.mark.parametrize("to", [*(pytest.param(x, marks=pytest.mark.long) for x in "xy"), "z"])
def test_the_same_along_x_y_and_z_as_askew(to: str, frames: str, driven: bool) -> None:
    raw = long(("beam", "beam"), False, frames, driven)
    raw["analysis"]["end_time"] = 0.005
    straight = turned(raw, along(np.asarray(raw["joints"]["J"]["axis"]), "xyz".index(to)))
    one, other = channels(*ran(raw)), channels(*ran(straight))
    names = [name for name in one if name.partition("/")[0] in {"springs", "motors", "limits", "drive"}]
    assert len(names) >= (1 if driven else 7)
    for name in names:
        if name != "drive/torque":
            assert_allclose(other[name], one[name], atol=(5e-9 if driven else 1e-9) * np.abs(one[name]).max())


@pytest.mark.parametrize("frames", FRAMES)
@pytest.mark.parametrize(("partners", "plane"), [CELLS[0], pytest.param(*CELLS[5], marks=pytest.mark.long)])
def test_what_a_slots_elements_do_is_accounted_for(partners: tuple[str, str], plane: bool, frames: str) -> None:
    """The drive's work on the rigid-body motion, and the energy, to the square of the step."""
    raw = long(partners, plane, frames, False)
    checks, _ = compared(*ran(raw))
    assert checks.worked
    assert checks.unworked < (1e-6 if frames == "rigid-body" else 2e-4)
    raw["limits"] = {}
    left = []
    for step in (2.5e-4, 1.25e-4):
        raw["analysis"]["step"] = step
        got = channels(*ran(raw))
        left.append(np.abs(got["energy/residual"]).max() / np.abs(got["energy/kinetic"]).max())
    assert left[0] < 2e-3
    assert left[1] < left[0] / 3


@pytest.mark.parametrize("partners", [("beam", "beam"), pytest.param(("beam", "ground"), marks=pytest.mark.long)])
def test_stiff_links_bear_what_rigid_ones_do_with_elements_on_their_slot(partners: tuple[str, str]) -> None:
    """Two independent ways: multipliers of the rigid linkage's equations, and the elastic system's."""
    raw = acted_on(partners, False, "rigid-body")
    raw["analysis"] |= {"kind": "quasi-static", "end_time": 0.03, "step": 0.01}
    raw["analysis"].pop("initial")
    soft, stiff = (off_rigid(stiffer(raw, x)) for x in (10.0, 100.0))
    assert {"drive/torque", "joints/J/force"} <= set(stiff)
    for name, x in stiff.items():
        assert x < 2e-3, name
        assert x < max(0.2 * soft[name], 1e-7), name


def test_small_deflections_are_those_of_rigid_body_frames() -> None:
    """In quasi-static positions, of the spring's travel: what is apart falls with the square of the deflection."""
    apart = []
    for softness in (0.1, 1.0):
        raw = stiffer(acted_on(("planar beam", "planar beam"), True, "rigid-body"), softness)
        raw["analysis"] |= {"kind": "quasi-static", "end_time": 0.03, "step": 0.01}
        raw["analysis"].pop("initial")
        found = [
            channels(*ran({**raw, "analysis": raw["analysis"] | {"frames": each}}))["springs/s/travel"] for each in FRAMES
        ]
        apart.append(np.abs(found[0] - found[1]).max() / np.abs(found[0]).max())
    assert apart[1] < 0.2 * apart[0]
    assert apart[0] < 1e-2


def test_a_spring_along_a_slot_is_drawn_from_its_pin_to_the_line() -> None:
    """Whichever is the ground: where the pin is, and along the line with the link that has it."""
    raw = hung(ARMS["beam"], springs={"s": spring(stiffness=K)})
    for links in (["bead", "arm"], ["ground", "arm"]):
        raw["joints"]["S"]["links"] = links
        scene = scene_from({**raw, "joints": {"S": raw["joints"]["S"]}} if links[0] == "ground" else raw)
        (drawn,) = line_springs(scene, {}, 1.0).values()
        assert [each.link for each in drawn.ends] == links
        assert_allclose(drawn.ends[0].at, [HERE, 0, 0])
        assert_allclose(np.cross(drawn.line, [1, 0, 0]), 0, atol=1e-12)
