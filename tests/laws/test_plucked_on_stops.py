"""What forces press against stops, and let go: static balance with one-sided laws, against closed forms."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq

from kedfem.errors import KedfemError
from tests.laws.test_limits import AXES, KINDS, OTHER_SIDES, SIDES
from tests.moving import bar, beam_in_space
from tests.runs import Ran, ran

Raw = dict[str, Any]
E, D, L = 2.1e11, 0.02, 0.4
EI = E * np.pi * D**4 / 64
STEPS: Raw = {"end_time": 3e-4, "step": 1e-4, "rho_inf": 0.8, "accuracy": "quick"}


def across(n: np.ndarray) -> np.ndarray:
    d = np.cross(n, [0.3, 0.5, 0.9])
    return np.asarray(d / np.linalg.norm(d))


def hinged(axis: str, force: float, limit: Raw, spring: float = 0.0, **more: Any) -> Raw:
    """A rod on a hinge, with a torsion spring and stops, that a force at its end across it turns."""
    n = AXES[axis]
    d = across(n)
    raw: Raw = {
        "links": {"rod": beam_in_space((0, 0, 0), L * d, 4, n)},
        "joints": {"J": {"kind": "revolute", "links": ["rod", "ground"], "at": [0, 0, 0], "axis": n.tolist()}},
        "limits": {"stop": {"kind": "angle", "joint": "J", **limit}},
        "springs": {"k": {"kind": "torsion", "joint": "J", "stiffness": spring}} if spring else {},
        "analysis": {**STEPS, "initial_deflection": {"f": at_end(n, d, force)}},
    }
    return raw | more


def at_end(n: np.ndarray, d: np.ndarray, force: float) -> Raw:
    return {"link": "rod", "at": (L * d).tolist(), "force": (force * np.cross(n, d)).tolist()}


def turned_by(force: float, gap: float, stiffness: float, spring: float) -> float:
    """k θ + k_stop (θ − gap)₊ = F L (cos θ − β sin θ): the end is bent by β L = F cos θ L³/3EI besides."""

    def left(theta: float) -> float:
        bent = abs(force) * np.cos(theta) * L**2 / (3 * EI)
        borne = spring * theta + stiffness * max(theta - gap, 0.0)
        return float(borne - abs(force) * L * (np.cos(theta) - bent * np.sin(theta)))

    return float(np.sign(force) * brentq(left, 0.0, 1.5, xtol=1e-14))


def effort(run: Ran, name: str) -> float:
    return float(run.channel(f"limits/stop/{name}")[0, 0])


#: spring, gap, stiffness of the stop; the last three are held by nothing but it, which they do not touch as drawn
PRESSED = [
    (500.0, 0.01, 1e4), (20.0, 0.02, 1e6), (500.0, 0.0, 100.0), (0.0, 0.02, 1e9), (0.0, 0.3, 1e4),
    pytest.param(0.0, 1e-4, 1.0, marks=pytest.mark.long),
]  # fmt: skip


@pytest.mark.parametrize(("axis", "side"), SIDES + OTHER_SIDES)
@pytest.mark.parametrize(("spring", "gap", "stiffness"), PRESSED)
def test_a_rod_is_pressed_into_a_stop_until_moments_balance(
    axis: str, side: int, spring: float, gap: float, stiffness: float
) -> None:
    """5e-7: shear, and the axial force of the bent rod, which the closed form leaves out."""
    limit = {"upper" if side > 0 else "lower": side * gap, "stiffness": stiffness, "damping": 2.0}
    run = ran(hinged(axis, side * 30.0, limit, spring))
    theta = turned_by(side * 30.0, gap, stiffness, spring)
    assert effort(run, "angle") == pytest.approx(theta, rel=2e-6)
    beyond = side * effort(run, "angle") - gap
    assert beyond > 0
    assert effort(run, "torque") == pytest.approx(-side * stiffness * beyond, rel=1e-9)
    assert np.abs(run.state(0, "v")[0]).max() == 0.0


@pytest.mark.parametrize("axis", AXES)
def test_a_cantilever_on_a_slide_bends_beside_its_stop(axis: str) -> None:
    """F/k beyond the gap, and F L³/3EI at its end beside that; shear adds 0.7 % to the latter."""
    n, force, gap, stiffness = AXES[axis], 40.0, 2e-3, 1e5
    d = across(n)
    run = ran({
        "links": {"rod": beam_in_space((0, 0, 0), L * d, 4, n)},
        "joints": {"J": {"kind": "prismatic", "links": ["rod", "ground"], "at": [0, 0, 0], "axis": n.tolist()}},
        "limits": {"stop": {"kind": "travel", "joint": "J", "lower": -gap, "stiffness": stiffness, "damping": 5.0}},
        "analysis": {**STEPS, "initial_deflection": {
            "f": {"link": "rod", "at": (L * d).tolist(), "force": (-force * n).tolist()}}},
    })  # fmt: skip
    assert effort(run, "travel") == pytest.approx(-gap - force / stiffness, rel=1e-9)
    assert effort(run, "force") == pytest.approx(force, rel=1e-6)
    bent = -(run.displaced("rod", L * d)[0] @ n) + effort(run, "travel")
    assert bent == pytest.approx(force * L**3 / (3 * EI), rel=0.01)


@pytest.mark.parametrize("kind", [x if x == "beam" else pytest.param(x, marks=pytest.mark.long) for x in KINDS])
def test_links_of_all_kinds_are_pressed_into_a_stop(kind: str) -> None:
    """F = k s of a block that nothing else holds; what they are pushed at gives way beside that."""
    side = 0.0 if kind == "beam" else 0.015
    at = [0.0, 0.0] if kind in ("beam", "plane") else [0.0, side, 0.0]
    run = ran({
        "links": {"block": KINDS[kind]},
        "joints": {"J": {"kind": "prismatic", "links": ["block", "ground"], "at": [0.02, side], "axis": "x"}},
        "limits": {"stop": {"kind": "travel", "joint": "J", "upper": 1e-3, "stiffness": 1e5}},
        "analysis": {**STEPS, "initial_deflection": {
            "f": {"link": "block", "at": at, "force": [50.0, 0.0, 0.0][: len(at)]}}},
    })  # fmt: skip
    assert effort(run, "travel") == pytest.approx(1e-3 + 50.0 / 1e5, rel=1e-6)
    assert effort(run, "force") == pytest.approx(-50.0, rel=1e-6)


@pytest.mark.parametrize("axis", ["z", "oblique"])
def test_a_stop_that_stays_open_changes_nothing(axis: str) -> None:
    open_ = ran(hinged(axis, 30.0, {"upper": 0.2, "lower": -0.2, "stiffness": 1e6, "damping": 3.0}, 500.0))
    without = ran(hinged(axis, 30.0, {}, 500.0, limits={}))
    for k in range(len(without.ready.model.links)):
        wanted = without.state(k, "u")
        assert_allclose(open_.state(k, "u"), wanted, rtol=0, atol=1e-9 * np.abs(wanted).max())
    assert not open_.channel("limits/stop/torque").any()


@pytest.mark.parametrize(("spring", "gap"), [(500.0, 0.01), (0.0, 0.02)])
def test_what_is_let_go_by_nothing_stays_in_balance(spring: float, gap: float) -> None:
    """The force is a load that stays; what is let go is 1e-12 of it."""
    n, limit = AXES["oblique"], {"upper": gap, "stiffness": 1e4, "damping": 2.0}
    d = across(n)
    load = {"kind": "force", "link": "rod", "at": (L * d).tolist(), "vector": (30.0 * np.cross(n, d)).tolist()}
    raw = hinged("oblique", 3e-11, limit, spring, loads={"F": load})
    run = ran({**raw, "analysis": {**raw["analysis"], "end_time": 0.01}})
    u = run.state(0, "u")
    assert_allclose(u, np.broadcast_to(u[0], u.shape), rtol=0, atol=1e-9 * np.abs(u).max())
    theta = turned_by(30.0, gap, 1e4, spring)
    assert_allclose(run.channel("limits/stop/angle")[:, 0], theta, rtol=2e-6)


@pytest.mark.parametrize("axis", ["x", "oblique"])
@pytest.mark.parametrize("spring", [500.0, 0.0])
def test_what_a_static_analysis_finds_under_loads_is_let_go(axis: str, spring: float) -> None:
    n, limit = AXES[axis], {"upper": 0.02, "stiffness": 1e4}
    d = across(n)
    plucked = ran(hinged(axis, 30.0, limit, spring))
    load = {"kind": "force", "link": "rod", "at": (L * d).tolist(), "vector": (30.0 * np.cross(n, d)).tolist()}
    static = ran(hinged(axis, 0.0, limit, spring, loads={"F": load}, analysis={"kind": "static"}))
    wanted = static.state(0, "u")[0]
    assert_allclose(plucked.state(0, "u")[0], wanted, rtol=0, atol=1e-9 * np.abs(wanted).max())


def test_energy_is_kept_at_second_order_after_a_stop_lets_go() -> None:
    """It begins with ½ k θ² of the spring, ½ k s² of the stop and that of the bent rod, and leaves the stop: signs of
    the error change from step to step, so that its order is that over all, of steps of which rounding chooses none."""
    spring, gap, stiffness, counts, apart = 500.0, 5e-3, 2e3, (120, 250, 500, 1000, 2000, 4000), []
    for count in counts:
        raw = hinged("oblique", 100.0, {"upper": gap, "stiffness": stiffness}, spring)
        raw["analysis"] |= {"end_time": 0.03, "step": 0.03 / count, "rho_inf": 0.95}
        run = ran(raw)
        angle = run.channel("limits/stop/angle")[:, 0]
        held = 0.5 * spring * angle**2 + 0.5 * stiffness * np.maximum(angle - gap, 0.0) ** 2
        energy = held + run.kinetic_energy + run.strain_energy
        assert run.kinetic_energy[0] == 0.0
        assert angle[0] > 3 * gap
        assert angle.min() < -3 * gap
        apart.append(float(np.abs(energy / energy[0] - 1).max()))
    assert apart[-1] < 1e-5, apart
    assert -2.5 < np.polyfit(np.log(counts), np.log(apart), 1)[0] < -1.7, apart


def on_a_crank() -> Raw:
    """A rod on a crank that a drive hardly turns, pressed into a stop of the hinge between them."""
    return {
        "links": {"crank": bar("beam", (0, 0), (0.1, 0), 2), "rod": bar("beam", (0.1, 0), (0.5, 0), 4)},
        "joints": {
            "A": {"kind": "revolute", "links": ["ground", "crank"], "at": [0, 0]},
            "J": {"kind": "revolute", "links": ["crank", "rod"], "at": [0.1, 0]},
        },
        "drive": {"joint": "A", "motion": {"kind": "cycloidal", "angle": 1e-9, "rise": 1.0}},
        "analysis": {**STEPS, "initial": "quasi-static", "frames": "co-rotational", "initial_deflection": {
            "f": {"link": "rod", "at": [0.5, 0.0], "force": [0.0, -30.0]}}},
    }  # fmt: skip


def test_driven_mechanisms_are_pressed_into_stops() -> None:
    """k θ + k_stop (θ − gap) = F L about the hinge, with two stops of half that stiffness as with one; the rod turns by
    2 mrad, which shortens the lever by 2e-6. Without the pluck the stop is open."""
    spring, gap, stiffness, moment = 300.0, 2e-3, 1e5, 30.0 * L
    theta = (moment + stiffness * gap) / (stiffness + spring)
    for parts in (1, 2):
        limit = {"kind": "angle", "joint": "J", "upper": gap, "stiffness": stiffness / parts, "damping": 1.0}
        springs = {"k": {"kind": "torsion", "joint": "J", "stiffness": spring}}
        limits = dict(zip(("stop", "other"), [limit] * parts, strict=False))
        run = ran({**on_a_crank(), "limits": limits, "springs": springs})
        assert effort(run, "angle") == pytest.approx(theta, rel=1e-6)
        assert parts * effort(run, "torque") == pytest.approx(-stiffness * (theta - gap), rel=2e-5)


CRANKS = [("rigid-body", False), ("co-rotational", False), ("rigid-body", True)]


@pytest.mark.parametrize("open_", [False, True])
@pytest.mark.parametrize(("frames", "stiffening"), CRANKS)
def test_a_slider_is_pulled_against_its_stop_with_all_frames(frames: str, stiffening: bool, open_: bool) -> None:
    """F = E A x/L + k (x − gap)₊, the crank in line with its rod, from a drive that hardly turns."""

    def beam(a: float, b: float) -> Raw:
        return bar("beam", (a, 0), (b, 0), 2)

    force, stiffness, along = 1e4, 1e8, E * 6e-4 / 0.4
    gap = (2.0 if open_ else 0.3) * force / along
    x = force / along if open_ else (force + stiffness * gap) / (along + stiffness)
    hinges = {"A": ("ground", "crank", 0.0), "B": ("crank", "rod", 0.1), "C": ("rod", "shoe", 0.4)}
    joints: Raw = {name: {"kind": "revolute", "links": [i, j], "at": [s, 0]} for name, (i, j, s) in hinges.items()}
    joints["S"] = {"kind": "prismatic", "links": ["shoe", "ground"], "at": [0.4, 0], "axis": "x"}
    run = ran({
        "links": {"crank": beam(0, 0.1), "rod": beam(0.1, 0.4), "shoe": {"model": "rigid", "mass": 0.5}},
        "joints": joints, "drive": on_a_crank()["drive"],
        "limits": {"stop": {"kind": "travel", "joint": "S", "upper": gap, "stiffness": stiffness, "damping": 20.0}},
        "analysis": {**STEPS, "initial": "quasi-static", "frames": frames, "stiffening": stiffening,
                     "initial_deflection": {"f": {"link": "rod", "at": [0.4, 0.0], "force": [force, 0.0]}}},
    })  # fmt: skip
    assert effort(run, "travel") == pytest.approx(x, rel=1e-6)
    assert effort(run, "force") == pytest.approx(-stiffness * max(x - gap, 0.0), rel=1e-5)


def test_what_no_stop_holds_is_refused() -> None:
    """Pulled away from its stop, along the rod's other way, on a slide: nothing else holds it."""
    n = AXES["x"]
    d = across(n)
    with pytest.raises(KedfemError, match="must be a deflection that can be found"):
        ran({
            "links": {"rod": beam_in_space((0, 0, 0), L * d, 2, n)},
            "joints": {"J": {"kind": "prismatic", "links": ["rod", "ground"], "at": [0, 0, 0], "axis": n.tolist()}},
            "limits": {"stop": {"kind": "travel", "joint": "J", "upper": 1e-3, "stiffness": 1e5}},
            "analysis": {**STEPS, "initial_deflection": {
                "f": {"link": "rod", "at": [0, 0, 0], "force": (-40.0 * n).tolist()}}},
        })  # fmt: skip
