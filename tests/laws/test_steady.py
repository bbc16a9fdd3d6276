"""Steady motions: what a march settles to, whatever joints, links, frames, laws and drives there are; multipliers.

A link that a drive turns at Ω about its own axis has constant coefficients in its frame, δ = R y:

    M y'' + (2 Ω M J + C0) y' + (K0 + Ω² M J²) y = 0,   J y = ω/Ω × y

so that the multipliers of a turn are exp(λ T) with the eigenvalues λ of that. In modes of the clamped link.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmarks.steady import map_of
from numpy.testing import assert_allclose

from kedfem.accuracy.prepared import Prepared, meshed
from kedfem.accuracy.reduction import prepared
from kedfem.accuracy.steady import Steady, steady_of, steady_warning
from kedfem.analysis import analyse
from kedfem.dynamics.modes.frozen import Frozen
from kedfem.dynamics.stepping.levels import level_steps, leveled
from kedfem.dynamics.stepping.start import coarse_map, started
from kedfem.dynamics.system.build import system_of
from kedfem.dynamics.system.period.multipliers import multipliers
from kedfem.dynamics.system.period.search import periodic
from kedfem.errors import KedfemError, SolveError
from kedfem.links.record import mass_times
from kedfem.motion.newton import cross_matrix
from kedfem.motion.period import over_one_period
from kedfem.motion.rigid import rigid_motion
from kedfem.output.fields import DISPLACEMENT, VON_MISES
from kedfem.results import read_results
from kedfem.scene import path_parameter, scene_from
from tests.frames import frames
from tests.moving import inverted
from tests.partners import chain
from tests.scenes import bar, constant_speed, example, four_bar

Raw = dict[str, Any]
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0), "oblique": (0.48, -0.6, 0.64)}
DAMPED = {"ratio": 0.1, "frequencies": [20, 400]}


def states(ready: Prepared) -> tuple[np.ndarray, Steady | None]:
    """Displacements and port forces of all links over time, and what is known of the steady motion."""
    solvers = level_steps(ready.scene, ready.model)
    blocks = [
        np.concatenate(
            [np.concatenate([x.u.reshape(len(x.u), -1), 1e-9 * x.port_forces.reshape(len(x.u), -1)], axis=1)
             for x in block.links], axis=1
        )
        for block in leveled(ready.scene, ready.linkage, ready.path, ready.model, solvers)
    ]  # fmt: skip
    return np.concatenate(blocks), steady_of(ready.scene, solvers)


def as_steady(raw: Raw, **analysis: Any) -> Raw:
    """A scene that asks for its steady motion."""
    given = {k: v for k, v in raw["analysis"].items() if k not in ("revolutions", "end_time", "initial")}
    return {**raw, "analysis": {**given, "accuracy": "quick", "kind": "steady", **analysis}}


def steady(raw: Raw, **analysis: Any) -> tuple[Prepared, np.ndarray, Steady]:
    """A scene as a steady motion."""
    ready = prepared(over_one_period(scene_from(as_steady(raw, **analysis))))[0]
    found, of = states(ready)
    assert of is not None
    return ready, found, of


def off(raw: Raw, turns: int, of: np.ndarray, ready: Prepared) -> float:
    """What the last of some periods differs by from a steady one, of its peak, when a march begins at rest."""
    analysis = {**ready.scene.analysis.model_dump(exclude_unset=True), "kind": "transient"}
    span = {key: turns * analysis[key] for key in ("revolutions", "end_time") if analysis.get(key)}
    keys = {k: v for k, v in {**analysis, **span}.items() if v is not None and v != {}}
    keys.setdefault("accuracy", "quick")
    marched, _ = states(replace(meshed(scene_from({**raw, "analysis": keys})), model=ready.model))
    last = marched[-len(of) :]
    return float(np.abs(last - of).max() / np.abs(of).max())


def beams(**more: Any) -> Raw:
    raw = example("four_bar_beams")
    raw["analysis"] = {"accuracy": "quick", "steps_per_revolution": 180, "kind": "steady"}
    return {**raw, "damping": DAMPED, **more}


def planar(model: str, **more: Any) -> Raw:
    """A four-bar of steel."""
    link = {**bar(model=model), **more.pop("link", {})}
    return {
        **four_bar((0.1, 0.3, 0.25, 0.3), link, constant_speed("300 rpm")), "damping": {"beta": 1e-6},
        "analysis": {"steps_per_revolution": 120, "rho_inf": 0.95}, **more,
    }  # fmt: skip


FOUR_STROKE = {
    "kind": "force", "link": "coupler", "at": "B", "vector": [0, -500],
    "factor": {"over": "angle", "at": [0, 1.0, 2.0], "value": [0, 1, 0], "period": "720 deg"},
}  # fmt: skip
SPRING = {
    "kind": "spring", "between": [{"link": "rocker", "at": "C"}, {"link": "ground", "at": [0.5, 0.5]}],
    "stiffness": 2e4, "damping": 20.0,
}  # fmt: skip
MOTOR = {"joint": "D", "torque": {"over": "speed", "at": [-10, 10], "value": [50, -50]}}
STOP = {"kind": "angle", "joint": "D", "upper": "5 deg", "stiffness": 2e3, "damping": 0.5}
SOFT = {"alloy": {"density": 2796, "youngs_modulus": 2.5e10, "shear_modulus": 9.5e9}}
FAST = {"joint": "A", "motion": constant_speed("450 rpm")}
SWING = {"kind": "cycloidal", "angle": 0.3, "rise": 0.03, "return_time": 0.03, "dwell_after": 0.02}


def geared() -> Raw:
    """Two arms under gravity that a pair of wheels couples 20 : 30: back after three revolutions of the first."""
    arm = {"model": "beam", "material": "steel"}
    shape = {"kind": "bar", "width": 0.01, "thickness": 0.01}
    at = {"one": 0.0, "two": 1.0}
    return {
        "links": {name: {**arm, "shape": {**shape, "between": [[x, 0], [x + 0.3, 0]]}} for name, x in at.items()},
        "joints": {
            joint: {"kind": "revolute", "links": ["ground", link], "at": [at[link], 0]}
            for joint, link in (("A", "one"), ("B", "two"))
        },
        "gears": {"pair": {"joints": ["A", "B"], "teeth": [20, 30]}}, "gravity": [0, -9.81],
        "drive": {"joint": "A", "motion": constant_speed("120 rpm")}, "damping": DAMPED,
        "analysis": {"steps_per_revolution": 60, "rho_inf": 0.8},
    }  # fmt: skip


def swinging(joint: str, kinds: tuple[str, str] = ("beam", "beam")) -> Raw:
    """A chain with a joint, whose crank swings to and fro."""
    raw = chain(joint, kinds)
    raw["drive"]["motion"] = SWING
    return {**raw, "damping": DAMPED, "analysis": {"step": 5e-4, "rho_inf": 0.8}}


CASES: dict[str, tuple[Raw, dict[str, Any], int]] = {
    "planar beams": (beams(), {}, 12),
    "levels in time": (beams(), {"extrapolation_levels": 2}, 12),
    "co-rotational": (planar("beam"), {"frames": "co-rotational"}, 45),
    "co-rotational, bent far": (
        beams(materials=SOFT, damping={"ratio": 0.02, "frequencies": [20, 200]}, drive=FAST),
        {"frames": "co-rotational"}, 40,
    ),
    "stiffening": (planar("beam"), {"stiffening": True}, 45),
    "four strokes": (beams(loads={"gas": FOUR_STROKE}), {}, 8),
    "a spring": (planar("beam", springs={"s": SPRING}), {}, 40),
    "a motor": (planar("beam", motors={"m": MOTOR}), {}, 16),
    "a motor, co-rotational": (planar("beam", motors={"m": MOTOR}), {"frames": "co-rotational"}, 16),
    "a limit": (planar("beam", limits={"s": STOP}), {}, 24),
    "a limit, co-rotational": (planar("beam", limits={"s": STOP}), {"frames": "co-rotational"}, 24),
    "a spring, co-rotational": (planar("beam", springs={"s": SPRING}), {"frames": "co-rotational"}, 40),
    "a block on an arm": ({**inverted(revolutions=None), "damping": DAMPED}, {"steps_per_revolution": 120}, 9),
    "plane links, reduced": (
        planar("plane", link={"reduction": "modal", "mesh": {"elements": [8, 1]}}), {"reduction_tolerance": 1e-2}, 50,
    ),
    "plane links": (planar("plane", link={"mesh": {"elements": [8, 1]}}), {}, 50),
    "gears": (geared(), {}, 4),
    "a screw": (swinging("screw"), {}, 8),
    "a universal joint": (swinging("universal"), {}, 8),
    "solids": (swinging("spherical", ("solid", "solid")), {}, 14),
}  # fmt: skip


QUICK = ("planar beams", "co-rotational, bent far", "a screw")


@pytest.mark.parametrize("name", [x if x in QUICK else pytest.param(x, marks=pytest.mark.long) for x in CASES])
def test_a_steady_motion_is_what_a_march_settles_to(name: str) -> None:
    raw, analysis, turns = CASES[name]
    ready, found, of = steady(raw, **analysis)
    assert of.residual < 1e-6
    assert_allclose(found[-1], found[0], atol=1e-6 * np.abs(found).max())
    assert off(raw, turns, found, ready) < 1e-6


@pytest.mark.parametrize("name", ["plane links", "solids"])
def test_reduced_links_save_marches_and_lead_to_the_same_state(name: str) -> None:
    raw = planar("plane") if name == "plane links" else swinging("spherical", ("solid", "solid"))
    raw["damping"] = {"beta": 2e-6}
    for link in raw["links"].values():  # large enough to gain from it
        if link["model"] != "beam":
            link["mesh"] = {"elements": [24, 2] if link["model"] == "plane" else [12, 1, 1]}
    ready = meshed(over_one_period(scene_from(as_steady(raw))))
    small = coarse_map(ready.scene, ready.linkage, ready.path, ready.model)
    assert small is not None
    over = map_of(ready)
    alone = periodic(over, stability=False)
    helped = periodic(map_of(ready), stability=False, small=small)
    assert helped.marches <= 0.75 * alone.marches
    x, y = over.vector(alone.state), over.vector(helped.state)
    assert over.size(over.change(y, x)) < 1e-8 * over.size(x)


def test_small_links_are_not_reduced_for_it() -> None:
    ready = meshed(over_one_period(scene_from(as_steady(beams()))))
    assert coarse_map(ready.scene, ready.linkage, ready.path, ready.model) is None


ROUND = (0.0015, 0.0015)  # so thin that its rotary inertia does not count


def spun(axis: Any, ratio: float, section: tuple[float, float], **more: Any) -> Raw:
    """A bar that is turned about its own axis at so many times its first frequency of bending."""
    way = np.asarray(AXES[axis])
    shape = {"kind": "bar", "between": [[0, 0, 0], (0.5 * way).tolist()], "width": section[0], "thickness": section[1]}
    joint = {"kind": "revolute", "links": ["ground", "shaft"], "at": [0, 0, 0], "axis": way.tolist()}
    return {
        "links": {"shaft": {"model": "beam", "material": "steel", "shape": shape, "mesh": {"elements": 2}}},
        "joints": {"A": joint}, "drive": {"joint": "A", "motion": constant_speed(ratio)},
        "analysis": {"steps_per_revolution": 360, "extrapolation_levels": 2}, **more,
    }  # fmt: skip


def clamped(raw: Raw, axis: Any, modes: int = 14) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Frequencies [rad/s] of a clamped link, and M J and M J² in its modes."""
    ready = meshed(
        over_one_period(scene_from({**raw, "analysis": {**raw["analysis"], "kind": "steady", "accuracy": "quick"}}))
    )
    at = rigid_motion(ready.linkage, ready.path, np.zeros(1), path_parameter(ready.scene, np.zeros(1)))
    found = Frozen(system_of(ready.scene, ready.linkage, ready.path), modes, 0).at(at)
    shapes, J = found.shapes[0], cross_matrix(np.asarray(AXES[axis]))
    heavy = np.array([mass_times(ready.model.links[0].mass, x) for x in shapes]).reshape(len(shapes), -1)
    once, twice = ((shapes @ turn.T).reshape(len(shapes), -1) for turn in (J, J @ J))
    return found.omega, heavy @ once.T, heavy @ twice.T


def largest_multiplier(omega: np.ndarray, speed: float, MJ: np.ndarray, MJJ: np.ndarray, beta: float) -> float:
    """In a turn at a speed [rad/s]."""
    n, K = len(omega), np.diag(omega**2)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-K - speed**2 * MJJ, -beta * K - 2 * speed * MJ]])
    return float(np.exp(np.linalg.eigvals(A).real.max() * 2 * np.pi / speed))


@pytest.mark.parametrize(
    ("axis", "ratio", "section", "zeta"),
    [
        ("oblique", 1.5, ROUND, 0.02),
        *(pytest.param(*each, marks=pytest.mark.long) for each in (
            ("x", 1.1, (0.012, 0.01), 0.0), ("y", 1.15, (0.012, 0.01), 0.0), ("oblique", 1.05, (0.012, 0.01), 0.0),
            ("z", 0.9, ROUND, 0.02), ("x", 2.0, ROUND, 0.02), ("y", 0.5, ROUND, 0.02), ("z", 1.1, ROUND, 0.02),
        )),
    ],
)  # fmt: skip
def test_multipliers_of_a_shaft_that_spins(axis: str, ratio: float, section: Any, zeta: float) -> None:
    """Unstable between its two frequencies where it is not round; above them where its own damping turns with it."""
    omega, MJ, MJJ = clamped(spun(axis, 100.0, section), axis)
    beta = 2 * zeta / omega[0]
    speed = float(ratio * omega[0])
    raw = spun(axis, speed, section, **({"damping": {"beta": beta}} if zeta else {}))
    of = steady(raw)[2]
    exact = largest_multiplier(omega, speed, MJ, MJJ, beta)
    assert_allclose(of.growth, exact, rtol=1e-6)
    assert of.unstable == (exact > 1 + 1e-6)
    if section[0] == section[1]:  # both frequencies are one, so that growth is known from them alone
        published = {0.5: 0.88192800, 0.9: 0.98613910, 1.1: 1.01148414, 1.5: 1.04274486, 2.0: 1.06476769}
        assert_allclose(of.growth, published[ratio], rtol=1e-6)


@pytest.mark.long
@pytest.mark.parametrize(
    ("axis", "ratio", "half_a_turn"),
    [
        ("oblique", 0.9, 1.0), ("x", 1.05, 1.2943384363), ("y", 1.1, 1.3289995152), ("oblique", 1.1, 1.3289995152),
        ("z", 1.15, 1.2657349152), ("x", 1.3, 1.0),
    ],
)  # fmt: skip
def test_growth_of_a_shaft_of_two_frequencies(axis: str, ratio: float, half_a_turn: float) -> None:
    """K = R(Ωt) diag(ω², 1.44 ω²) Rᵀ and a mass: that of the shaft and its rotary inertia are small beside it."""
    way = np.asarray(AXES[axis])
    more = {
        "bodies": {"mass": {"kind": "point_mass", "link": "shaft", "at": (0.5 * way).tolist(), "mass": 1.0}},
        "gravity": [3.0, -9.81, 7.0],
    }
    width = 0.0036
    for _ in range(2):  # shear makes the ratio of frequencies a little less than that of the sides
        omega = clamped(spun(axis, 100.0, (width, 0.003), **more), axis)[0]
        width *= 1.2 * omega[0] / omega[1]
    of = steady(spun(axis, float(ratio * omega[0]), (width, 0.003), **more))[2]
    assert_allclose(of.growth, half_a_turn**2, rtol=1e-6)
    assert of.unstable == (half_a_turn > 1)


def test_a_shaft_at_its_own_frequency_neither_grows_nor_decays() -> None:
    """Its damping turns with it: a deflection constant in space stays, so that its multiplier is one."""
    omega = clamped(spun("oblique", 100.0, ROUND), "oblique")[0]
    found = []
    for steps in (180, 360):
        raw = spun("oblique", float(omega[0]), ROUND, damping={"beta": 0.04 / omega[0]})
        raw["analysis"] = {"steps_per_revolution": steps}
        over = map_of(meshed(over_one_period(scene_from(as_steady(raw)))))
        x = over.vector(over.start)
        y = over(x)
        over.weighed(y)
        values, certain, _ = multipliers(over, x, y)
        assert certain
        found.append(float(np.abs(values).max()))
    assert_allclose((4 * found[1] - found[0]) / 3, 1.0, rtol=1e-6)


def test_growth_that_levels_in_time_do_not_agree_on_is_not_told() -> None:
    """Stiff modes of a bar that turns by 4° in a step: 44 and 1 in a turn, of a stable shaft."""
    raw = spun("oblique", float(0.85 * clamped(spun("oblique", 100.0, (0.012, 0.01)), "oblique")[0][0]), (0.012, 0.01))
    raw["analysis"] = {"steps_per_revolution": 90, "extrapolation_levels": 2}
    of = steady(raw)[2]
    assert max(of.levels) > 10 * min(of.levels)
    assert of.growth is None
    assert not of.unstable
    (said,) = steady_warning(of)
    assert "whether it is stable cannot be determined with steps as long as these" in said


@pytest.mark.long
def test_a_multiplier_of_one_level_has_its_order() -> None:
    omega, MJ, MJJ = clamped(spun("x", 100.0, (0.012, 0.01)), "x")
    speed = float(1.1 * omega[0])
    exact = largest_multiplier(omega, speed, MJ, MJJ, 0.0)
    errors = []
    for steps in (360, 720, 1440):
        raw = spun("x", speed, (0.012, 0.01))
        raw["analysis"] = {"steps_per_revolution": steps}
        errors.append(abs(np.log(steady(raw)[2].growth / exact)))
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    assert errors[0] < 1e-3
    assert np.all((slopes > 1.9) & (slopes < 2.1))


@pytest.mark.long
def test_the_period_is_that_of_the_loads_and_of_the_gears() -> None:
    assert steady(beams(loads={"gas": FOUR_STROKE}))[2].revolutions == pytest.approx(2)
    assert steady(geared())[2].revolutions == pytest.approx(3)
    over = {**FOUR_STROKE, "factor": {"over": "time", "at": [0, 0.02], "value": [0, 1], "period": 0.15}}
    assert steady(beams(loads={"gas": over}))[2].revolutions == pytest.approx(3)


def test_a_ramp_counts_as_the_speed_that_it_leads_to() -> None:
    ramp = {"kind": "ramp", "speed": "600 rpm", "time": 0.3}
    raw = beams()
    with_ramp = {**raw, "drive": {**raw["drive"], "motion": ramp}}
    assert_allclose(steady(with_ramp)[1], steady(raw)[1], atol=1e-15)


def test_an_unstable_motion_is_unreliable_and_says_by_how_much_it_grows(tmp_path: Path) -> None:
    raw = spun("y", 230.0, (0.012, 0.01))
    nothing = {"plots": False, "picture": False, "animation": False, "folder": str(tmp_path / "out")}
    raw["analysis"] = {"kind": "steady", "accuracy": "quick", "steps_per_revolution": 180}
    run = analyse(scene_from({**raw, "output": nothing}))
    results = read_results(tmp_path / "out" / "results.h5")
    assert run.steady is not None
    assert results.status == "unreliable"
    assert f"grows by {100 * (run.steady.growth - 1):.3g} %" in results.reason
    assert results.notes["steady growth in a period"] == run.steady.growth > 1.5
    assert len(results.time) == 181


@pytest.mark.long
def test_the_vibration_that_grows_whirls_with_the_shaft(tmp_path: Path) -> None:
    """Between its two frequencies a shaft bows out in its own frame: seen in the world its bow goes round at Ω.

    δ = R y e^{σ t}, σ = ln μ / T. Its stress at the clamped end is that of a cantilever's first mode,
    3.516 E δ / L² times the distance from the axis of bending: that of the farther side at least, of a corner at most.
    """

    speed, growth, axis = 230.0, 1.769, "oblique"
    raw = spun(axis, speed, (0.012, 0.01))
    way, drawn = np.asarray(AXES[axis]), {"frames_per_revolution": 4}
    output = {"plots": False, "picture": True, "animation": drawn, "folder": str(tmp_path / "out")}
    raw["analysis"] = {"kind": "steady", "accuracy": "quick", "steps_per_revolution": 360}
    run = analyse(scene_from({**raw, "output": output}))
    assert run.steady is not None
    assert f"at about {speed / (2 * np.pi):.3g}" in run.steady.vibration
    assert "of link 'shaft'" in run.steady.vibration
    assert run.steady.vibration in run.results.reason
    assert (tmp_path / "out" / "growing.png").stat().st_size > 1000
    first, *_, last = frames(tmp_path / "out", "growing")
    sizes = [np.linalg.norm(x[DISPLACEMENT], axis=1).max() for x in (first, last)]
    assert_allclose(sizes[1], 1e-3, rtol=1e-6)
    span = 1 - 1 / 360  # of the period, from the first step to the last
    assert_allclose(sizes[1] / sizes[0], run.steady.growth**span, rtol=1e-2)
    assert_allclose(run.steady.growth, growth, rtol=1e-2)
    tip = last[DISPLACEMENT][np.linalg.norm(last[DISPLACEMENT], axis=1).argmax()]
    assert abs(tip @ way) < 0.03 * np.linalg.norm(tip)  # at a corner that turns with the section
    bending = 3.516 * 2.1e11 * 1e-3 / 0.5**2
    assert 0.98 * 0.005 * bending < last[VON_MISES].max() < 1.02 * np.hypot(0.005, 0.006) * bending


def refused(raw: Raw, **analysis: Any) -> str:
    with pytest.raises(KedfemError) as error:
        steady(raw, **analysis)
    return str(error.value)


def test_what_has_no_period_is_refused() -> None:
    raw = beams()
    free = {**{key: value for key, value in raw.items() if key != "drive"}, "analysis": {"step": 1e-3}}
    assert "moves freely has no period" in refused({**free, "damping": {"beta": 1e-4}}, end_time=0.1)
    once = {"over": "time", "at": [0, 1], "value": [0, 1]}
    assert "over time without one" in refused({**raw, "loads": {"gas": {**FOUR_STROKE, "factor": once}}})
    odd = {**FOUR_STROKE["factor"], "period": 1.0, "at": [0, 0.5, 0.9]}
    assert "a part of the motion's period" in refused({**raw, "loads": {"gas": {**FOUR_STROKE, "factor": odd}}})
    assert "the 1 of the period" in refused(raw, revolutions=3)
    rise = {**raw, "drive": {**raw["drive"], "motion": {"kind": "cycloidal", "angle": 1.0, "rise": 0.1}}}
    assert "must have a period" in refused({**rise, "analysis": {"step": 1e-3}}, end_time=0.2)


def test_a_motor_whose_torque_repeats_itself_on_a_joint_that_goes_on_turning() -> None:
    """Its steady state is what a march comes to; without a period its torque would grow for ever."""
    cogging = {"over": "angle", "at": ["0 deg", "90 deg", "200 deg"], "value": [0.0, 2.0, -1.0]}
    periodic = {**cogging, "interpolation": "smooth", "period": "360 deg"}
    raw = planar("beam", motors={"m": {"joint": "B", "torque": periodic}})
    ready, found, _ = steady(raw)
    still = steady(planar("beam"))[1]
    assert np.abs(found - still).max() > 0.01 * np.abs(found).max()
    assert off(raw, 48, found, ready) < 1e-6
    assert "rotates continuously" in refused(planar("beam", motors={"m": {"joint": "B", "torque": cogging}}))


@pytest.mark.parametrize("far", [0.0, 50.0])
def test_what_nothing_moves_is_a_steady_motion_too(far: float) -> None:
    """A table that rises and falls, a damped oscillator across on it: its mass m stands still, what would move it is
    rounding, also of places far from the origin, and it grows by exp(−c T/2m) in a period T."""
    m, c, period = 10.0, 30.0, 0.5
    raw = {
        "links": {"table": {"model": "rigid"}, "mass": {"model": "rigid", "mass": m}},
        "joints": {
            "lift": {"kind": "prismatic", "links": ["table", "ground"], "at": [far, 0], "axis": "y"},
            "guide": {"kind": "prismatic", "links": ["mass", "table"], "at": [far, 0.3], "axis": "x"},
        },
        "springs": {"across": {"kind": "spring", "joint": "guide", "stiffness": 4000, "damping": c}},
        "drive": {"joint": "lift", "motion": {"kind": "harmonic", "frequency": 1 / period, "travel": 0.01}},
        "analysis": {"kind": "steady", "frames": "co-rotational", "step": 0.0025, "accuracy": "quick"},
    }
    displacements, known = states(meshed(scene_from(raw)))
    assert known is not None
    assert np.abs(displacements).max() < 1e-6
    assert_allclose(known.growth, np.exp(-c * period / (2 * m)), rtol=1e-3)


def test_a_spring_that_is_wound_up_is_refused() -> None:
    wound = {"kind": "torsion", "joint": "B", "stiffness": 1.0}
    assert "rotates continuously" in refused(planar("beam", springs={"s": wound}))


def shaken(speed: float) -> Raw:
    """A bar that turns under gravity, without damping."""
    return {
        "links": {"arm": bar(model="beam", mesh={"elements": 1})}, "gravity": [0, -9.81],
        "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0]}},
        "drive": {"joint": "A", "motion": constant_speed(speed)},
        "analysis": {"steps_per_revolution": 48, "rho_inf": 0.999},
    }  # fmt: skip


def test_an_undamped_resonance_is_refused_and_its_frequency_named() -> None:
    """In its frame the bar's first frequency is √(ω² − Ω²), and gravity turns with Ω: at Ω = ω/√2 they meet.

    ρ∞ is so near to one that what steps make of accelerations and forces themselves does not die away in a period.
    """
    omega = clamped(shaken(300.0), "z", 2)[0][0]

    def apart(share: float) -> float:
        """How far the nearest multiplier is from one."""
        raw = shaken(share * omega)
        ready = meshed(over_one_period(scene_from(as_steady(raw))))
        solver = level_steps(ready.scene, ready.model)[0]
        started(ready.scene, ready.linkage, ready.path, ready.model, solver)
        return float(np.abs(solver.steady.multipliers - 1).min())

    below, above = 0.701, 0.704  # the steps' own frequency is a little less
    share = below + (above - below) * apart(below) / (apart(below) + apart(above))
    for near in (-2e-5, 6e-5):
        largest = np.abs(steady(shaken((share + near) * omega))[1]).max()
        assert_allclose(largest * apart(share + near), 1.5e-3, rtol=0.05)  # grows as it comes nearer
    assert_allclose(share, 1 / np.sqrt(2), rtol=0.01)
    said = refused(shaken(share * omega))
    assert "a resonance without damping" in said
    named = float(said.split("about ")[1].split(" Hz")[0])
    assert_allclose(named, omega / 2 / np.pi, rtol=0.01)
    speed = float(said.split(", at ")[1].split(" rpm")[0])
    assert_allclose(speed, share * omega * 60 / (2 * np.pi), rtol=1e-5)


def test_a_search_that_does_not_end_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kedfem.dynamics.system.period.search.NEWTON", 1)
    monkeypatch.setattr("kedfem.dynamics.system.period.search.MIXINGS", 2)
    with pytest.raises(SolveError, match="does not converge: a period still leaves"):
        steady(planar("beam", damping={"beta": 1e-6}), frames="co-rotational")
