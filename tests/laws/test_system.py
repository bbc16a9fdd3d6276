"""One system, one step: equal to the oracle and to the monolithic step of scenes, and right where that knows less."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from kedfem.dynamics.system.march import march
from kedfem.dynamics.system.ready import displacements, ready
from kedfem.dynamics.system.record import COROTATIONAL, TANGENTIAL, Driven, Held, Spring, Stop
from kedfem.dynamics.system.starts.initial_states import rest
from kedfem.scene import Gear, Motor
from tests.cells import run_of
from tests.moving import bar, beam_in_space, cardan, channels, geared, inverted, ran, rising, screwed, turned
from tests.spatial_joints import BEAMS
from tests.systems import Begun, against_oracle, begun, by_oracle, marched, rows

Raw = dict[str, Any]
KINDS = list(BEAMS)
STEPS = {"end_time": 0.005, "step": 5e-4, "rho_inf": 0.8}
HINGE = {"kind": "revolute"}


def four_bar(**more: Any) -> Raw:
    """Three planar beams, a drive that speeds up, gravity and damping."""
    links = {
        "crank": bar("beam", (0, 0), (0.1, 0), 1),
        "coupler": bar("beam", (0.1, 0), (0.35, 0.2), 2),
        "rocker": bar("beam", (0.35, 0.2), (0.4, 0), 2),
    }
    joints = {
        "A": {**HINGE, "links": ["ground", "crank"], "at": [0, 0]},
        "B": {**HINGE, "links": ["crank", "coupler"], "at": [0.1, 0]},
        "C": {**HINGE, "links": ["coupler", "rocker"], "at": [0.35, 0.2]},
        "D": {**HINGE, "links": ["rocker", "ground"], "at": [0.4, 0]},
    }
    raw = {"links": links, "joints": joints, "gravity": [0, -9.81, 0], "damping": {"beta": 1e-5}}
    return {**raw, "drive": {"joint": "A", "motion": rising(2.0)}, "analysis": dict(STEPS), **more}


def elements() -> Raw:
    """A spring between a link and the ground, one about a hinge, a motor whose torque falls with speed."""
    ends = [{"link": "coupler", "at": [0.1, 0]}, {"link": "ground", "at": [0.1, 0.5]}]
    return {
        "springs": {
            "line": {
                "kind": "spring", "between": ends, "stiffness": 2e4, "damping": 20.0, "free_length": 0.4,
            },
            "turn": {"kind": "torsion", "joint": "C", "stiffness": 50.0, "damping": 0.1},
        },
        "motors": {"m": {"joint": "D", "torque": {"over": "speed", "at": [-10, 10], "value": [5, -5]}}},
    }  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_joint_moves_as_by_the_monolithic_step(kind: str) -> None:
    """In rigid-body frames, gravity askew; that step keeps eight digits of beams in space."""
    raw = BEAMS[kind]()
    of = begun({**raw, "analysis": {**raw["analysis"], "end_time": 0.005}})
    wanted = run_of(of, monolithic=True)
    state, history = marched(of, len(wanted))
    assert np.abs(rows(of.ready, history.u) - wanted).max() < 3e-8 * np.abs(wanted).max()
    assert state.passes[2] == 1  # linear: done after one pass


#: turns of the whole scene: none, x onto y, x onto z, oblique
TURNS = {"x": [0, 0, 0], "y": [0, 0, np.pi / 2], "z": [0, -np.pi / 2, 0], "oblique": [0.7, -0.4, 1.1]}


def on_bushing(kind: str) -> Raw:
    """A beam on a driven joint whose other directions give, gravity askew."""
    motion = rising(0.02, "travel") if kind == "prismatic" else rising(1.0)
    joint = {"kind": kind, "links": ["arm", "ground"], "at": [0, 0, 0], "axis": [0.2, -0.3, 0.9]}
    joint["bushing"] = {"stiffness": 1e6, "rotational_stiffness": 2e3, "rotational_damping": 0.3}
    return {
        "links": {"arm": beam_in_space((0, 0, 0), (0.2, 0.05, 0.02), 2)},
        "joints": {"A": joint},
        "drive": {"joint": "A", "motion": motion},
        "gravity": [2.0, -9.0, 3.0],
        "analysis": dict(STEPS),
    }


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_a_drive_holds_its_joint_firmly_whatever_its_bushing(kind: str, turn: str) -> None:
    """Both steps alike; a bushing a thousand times softer changes what it gives and not what the drive prescribes."""
    R, off = Rotation.from_rotvec(TURNS[turn]).as_matrix(), []
    for softer in (1.0, 1e3):
        raw = on_bushing(kind)
        raw["joints"]["A"]["bushing"] |= {"stiffness": 1e6 / softer, "rotational_stiffness": 2e3 / softer}
        of = begun(turned(raw, R, (0.1, 0.2, -0.3)))
        wanted = run_of(of, monolithic=True)
        _, history = marched(of, len(wanted))
        assert np.abs(rows(of.ready, history.u) - wanted).max() < 1e-6 * np.abs(wanted).max()
        driven = next(n for n, x in enumerate(of.ready.system.constraints) if isinstance(x.law, Driven))
        off.append(np.abs(history.e[:, driven]).max() / np.abs(history.e).max())
    assert max(off) < 1e-9


@pytest.mark.parametrize(("frames", "within"), [("rigid-body", 1e-11), ("co-rotational", 1e-9)])
def test_planar_beams_move_as_by_other_steps(frames: str, within: float) -> None:
    """Linear by the monolithic step of scenes, to rounding; co-rotational by the oracle, to its tolerance."""
    raw = four_bar()
    of = begun({**raw, "analysis": {**raw["analysis"], "frames": frames}})
    assert (TANGENTIAL in of.ready.bodies.frame) == (frames == "co-rotational")
    count = 10
    wanted = run_of(of, monolithic=True) if frames == "rigid-body" else by_oracle(of, count)[0]
    _, history = marched(of, count)
    assert np.abs(rows(of.ready, history.u) - wanted).max() < within * np.abs(wanted).max()


def corotational(name: str) -> Raw:
    """Mechanisms whose frames follow their links, driven and not, that begin at rest or quasi-statically."""
    made: dict[str, Callable[[], Raw]] = {
        "planar beams": four_bar, "springs and motor": lambda: four_bar(**elements()),
        "loads that turn": lambda: four_bar(loads={"f": PUSH}), "slide": lambda: inverted("beam"),
        "solids": lambda: inverted("solid"), "screw": screwed, "gears": geared, "cardan": cardan,
    }  # fmt: skip
    raw = four_bar(**elements()) if name == "no drive" else made[name]()
    given = dict(raw["analysis"]) | {"frames": "co-rotational", "end_time": 0.003, "step": 5e-4}
    given["initial"] = "quasi-static" if name in {"slide", "gears"} else "rest"
    analysis = {key: x for key, x in given.items() if key not in {"revolutions", "steps_per_revolution"}}
    if name == "no drive":
        del raw["drive"]
        analysis["initial_speeds"] = {"A": 5.0}
    return {**raw, "analysis": analysis}


PUSH = {"kind": "force", "link": "coupler", "at": [0.35, 0.2], "vector": [50.0, 20.0], "frame": "link"}
CHEAP = ("planar beams", "springs and motor", "loads that turn", "slide", "no drive")
DEAR = ("solids", "screw", "gears", "cardan")


@pytest.mark.parametrize("name", [*CHEAP, *(pytest.param(x, marks=pytest.mark.long) for x in DEAR)])
def test_all_channels_of_corotational_scenes_are_those_of_the_monolithic_solver(name: str) -> None:
    """By its own tangents, from the first time point on: forces, moments, energies, elements, what probes show."""
    raw, found = corotational(name), []
    for solver in ("condensed", "monolithic"):
        found.append(channels(*ran({**raw, "analysis": {**raw["analysis"], "solver": solver}})))
    got, wanted = found
    for what in {each.split("/")[-1] for each in wanted} - {"residual"}:
        names = [each for each in wanted if each.split("/")[-1] == what]
        size = max(np.abs(wanted[each]).max() for each in names)
        for each in names:
            assert_allclose(got[each], wanted[each], atol=5e-7 * size, err_msg=each)


CELLS = [("rigid-body", True, 1e-8), ("co-rotational", True, 1e-7), ("co-rotational", False, 1e-7)]


@pytest.mark.parametrize(("frames", "driven", "within"), CELLS)
def test_springs_and_motors_move_as_by_the_oracle(frames: str, driven: bool, within: float) -> None:
    of = begun(four_bar(**elements()), frames, driven)
    assert sum(isinstance(each.law, Spring) for each in of.ready.system.constraints) == 2
    assert against_oracle(of) < within


@pytest.mark.long
@pytest.mark.parametrize(("frames", "driven", "within"), CELLS)
@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_joint_in_all_frames_moves_as_by_the_oracle(
    kind: str, frames: str, driven: bool, within: float
) -> None:
    of = begun(BEAMS[kind](), frames, driven)
    assert (COROTATIONAL in of.ready.bodies.frame) == (frames == "co-rotational")
    assert against_oracle(of, 2) < within


def test_a_state_is_all_that_a_march_needs() -> None:
    """Marched in two parts from stored states, bit for bit what one march is; what was given is not used up."""
    of = begun(four_bar(**elements()), "co-rotational")
    whole, history = marched(of, 8)
    before = [x.copy() for x in of.state]
    half, _ = march(of.ready, of.state, of.steps(4))
    rest, later = march(of.ready, half, of.steps(4, first=5))
    for x, y in zip(of.state, before, strict=True):
        assert_array_equal(x, y)
    for x, y in zip(rest, whole, strict=True):
        assert_array_equal(x, y)
    assert_array_equal(later.u, history.u[4:])


def geared_arms(frames: str | None, driven: bool) -> Begun:
    """Two arms geared 1 : −1, a motor of 1 N m on the first."""
    links = {"one": bar("beam", (0, 0), (0.3, 0), 1), "two": bar("beam", (0.5, 0), (0.8, 0), 1)}
    joints = {
        "A": {**HINGE, "links": ["ground", "one"], "at": [0, 0]},
        "B": {**HINGE, "links": ["ground", "two"], "at": [0.5, 0]},
    }
    raw: Raw = {"links": links, "joints": joints}
    gears = {"g": Gear(joints=("A", "B"), ratio=-1.0)}
    raw |= {"analysis": {"end_time": 0.1, "step": 1e-3, "rho_inf": 0.8}}
    if driven:
        return begun({**raw, "drive": {"joint": "A", "motion": rising(1.0)}}, frames, gears=gears)
    return begun({**raw, "motors": {"m": {"joint": "A", "torque": 1.0}}}, gears=gears)


def test_gears_couple_links_that_nothing_drives() -> None:
    """T t² / 2 over the inertia of both, as for rigid arms of ρ A L³ / 3; one turns as far back as the other forth."""
    of = geared_arms(None, driven=False)
    _, history = marched(of, 100)
    one, two = (displacements(of.ready, k, history.u)[:, :, 2] for k in range(2))
    inertia = 2 * 7850 * 0.03 * 0.02 * (0.3**3 / 3 + 0.3 * 0.03**2 / 12)
    assert_allclose(one[-1, -1], 0.5 * 0.1**2 / inertia, rtol=2e-3)
    assert_allclose(two[-1, -1], -one[-1, -1], rtol=2e-3)
    gear = next(k for k, x in enumerate(of.ready.system.constraints) if x.name == "gears.g")
    assert isinstance(of.ready.system.constraints[gear].law, Held)
    assert np.abs(history.e[:, gear]).max() < 1e-12
    assert_allclose(np.abs(history.multiplier[50:, gear]).mean(), 0.5, rtol=0.05)  # half the torque goes over


def test_gears_couple_driven_links_with_frames_of_their_own() -> None:
    """The second arm turns by as much as the drive, the other way."""
    of = geared_arms("co-rotational", driven=True)
    _, history = marched(of, 100)
    two = displacements(of.ready, 1, history.u)[:, :, 2] + 0.0
    prescribed = of.steps(100).drives[:, 0]
    turned = prescribed + displacements(of.ready, 0, history.u)[:, 0, 2]
    body = of.ready.system.model.bodies[1]
    R = of.steps(100).R[:, body]
    other = np.unwrap(np.arctan2(R[:, 1, 0], R[:, 0, 0])) + two[:, 0]
    assert_allclose(other, -turned, atol=1e-9)


def test_a_motor_pushes_along_a_slide_that_turns() -> None:
    """A block on an arm at constant speed Ω: r'' = Ω² r + F/m, r = −F/(m Ω²) + (r₀ + F/(m Ω²)) cosh Ω t of its centre."""
    speed, force, end = 10.0, 30.0, 0.06
    links = {"arm": bar("beam", (0, 0), (0.6, 0), 6), "block": bar("beam", (0.2, 0), (0.24, 0), 1)}
    joints = {
        "A": {**HINGE, "links": ["ground", "arm"], "at": [0, 0]},
        "S": {"kind": "prismatic", "links": ["block", "arm"], "at": [0.2, 0], "axis": "x"},
    }
    raw: Raw = {
        "links": links, "joints": joints,
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": speed}},
        "drives": {}, "analysis": {"end_time": end, "step": 2e-4, "rho_inf": 0.8},
    }  # fmt: skip
    of = begun(raw, "co-rotational", motors={"m": Motor(joint="S", force=force)})  # today refused
    count = round(end / 2e-4)
    _, history = marched(of, count)
    mass = 7850 * 0.03 * 0.02 * 0.04
    ratio = force / (mass * speed**2)
    moved = (0.22 + ratio) * (np.cosh(speed * end) - 1)
    motor = next(k for k, x in enumerate(of.ready.system.constraints) if x.name == "motors.m")
    assert_allclose(history.e[-1, motor], moved, rtol=5e-3)  # the arm bends: 6e-4 of its length


def stopped(lower: float) -> Begun:
    """An arm that falls onto a stop at an angle of its hinge."""
    links = {"arm": bar("beam", (0, 0), (0.3, 0), 2)}
    raw: Raw = {
        "links": links, "joints": {"A": {**HINGE, "links": ["ground", "arm"], "at": [0, 0]}}, "gravity": [0, -9.81, 0],
        "springs": {"s": {"kind": "torsion", "joint": "A", "stiffness": 1.0}},
        "analysis": {"end_time": 0.1, "step": 5e-4, "rho_inf": 0.8},
    }  # fmt: skip
    of = begun(raw)
    (spring,) = of.ready.system.constraints
    stop = replace(spring, law=Stop(lower, 1.0, 2e3, 5.0))
    made = ready(replace(of.ready.system, constraints=(stop,)), of.ready.scheme)
    return Begun(of.prepared, made, rest(made, of.motion), of.motion)


def test_a_stop_pushes_and_never_pulls() -> None:
    """Free before it, 3/4 g/L t² of a rod; at it √(2 k E) of a rigid one."""
    of = stopped(-0.02)
    _, history = marched(of, 200)
    angle, push = history.e[:, 0], history.multiplier[:, 0]
    t = of.ready.c.h * np.arange(1, 201)
    before = 0.75 * 9.81 / 0.3 * t**2 < 0.018
    assert_allclose(angle[before][-1], -0.75 * 9.81 / 0.3 * t[before][-1] ** 2, rtol=0.02)
    assert push.min() >= 0
    assert_array_equal(push[angle > -0.0199], 0.0)
    fall = 7850 * 0.03 * 0.02 * 0.3 * 9.81 * 0.15 * 0.02  # J
    assert_allclose(push.max(), np.sqrt(2 * 2e3 * fall), rtol=0.15)  # it bends, and the stop damps


def test_a_stop_moves_as_by_the_oracle() -> None:
    """Met in the second step."""
    of = stopped(-5e-6)
    assert marched(of, 4)[1].multiplier.max() > 0
    assert against_oracle(of, 4) < 1e-7
