"""Rigid links bear what they pass on without giving way, however light they are and however long the step is."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from kedfem.accuracy.estimates import step_errors
from kedfem.accuracy.histories import histories, relative_errors
from kedfem.accuracy.plan import planned
from kedfem.accuracy.prepared import meshed
from kedfem.analysis import analyse
from kedfem.scene import scene_from, time_grid
from tests.moving import bar, beam_in_space, channels, ran, turned

TURNS = {"x": (0, 0, 0), "y": (0, 0, 90), "oblique": (0, 0, 35), "z": (0, 90, 0), "askew": (20, 50, 70)}


def lifted(step: float, shapeless: bool) -> dict[str, Any]:
    """A lever with a ton at its end on a cylinder of two light rigid links, which a drive moves; 20 kN on 2.5 kg."""
    foot, rod = bar("rigid", (0.5, -0.4), (0.5, -0.2)), bar("rigid", (0.5, -0.2), (0.5, 0))
    if shapeless:
        given = {"model": "rigid", "mass": 2.5, "inertia": [8e-3, 4e-4, 8e-3, 0, 0, 0]}
        foot, rod = {**given, "centre": [0.5, -0.3, 0]}, {**given, "centre": [0.5, -0.1, 0]}
    lever = beam_in_space((0, 0, 0), (1, 0, 0), 2)
    lever["shape"] |= {"points": [[0, 0, 0], [0.5, 0, 0], [1, 0, 0]], "section": {"kind": "round", "diameter": 0.1}}
    if not shapeless:
        lever = bar("beam", (0, 0), (1, 0), 4)
        lever["shape"] |= {"width": 0.1, "thickness": 0.06}
    hinge = {"kind": "revolute", "axis": [0, 0, 1]}
    return {
        "gravity": [0, -9.81, 0],
        "links": {"lever": lever, "foot": foot, "rod": rod},
        "joints": {
            "A": {**hinge, "links": ["ground", "lever"], "at": [0, 0, 0]},
            "P": {**hinge, "links": ["ground", "foot"], "at": [0.5, -0.4, 0]},
            "Q": {**hinge, "links": ["lever", "rod"], "at": [0.5, 0, 0]},
            "C": {"kind": "prismatic", "links": ["rod", "foot"], "at": [0.5, -0.2, 0], "axis": [0, 1, 0]},
        },
        "bodies": {"m": {"kind": "point_mass", "link": "lever", "at": [1, 0, 0], "mass": 1000.0}},
        "drive": {"joint": "C", "motion": {"kind": "polynomial", "travel": 0.05, "rise": 1.0}},
        "damping": {"ratio": 0.02, "frequencies": [5, 200]},
        "analysis": {"end_time": 10 * step, "step": step, "initial": "quasi-static", "frames": "co-rotational"},
        "output": {"probes": {"q": {"link": "rod", "at": [0.5, 0, 0], "quantity": "travel"}}},
    }  # fmt: skip


@pytest.mark.parametrize("step", [1e-3, 5e-3])
@pytest.mark.parametrize("way", TURNS)
def test_a_cylinder_of_rigid_links_is_as_long_as_its_drive_says(way: str, step: float) -> None:
    """Within 2 µm; 14 mm and more once: links gave by the force times h² over mass."""
    R = Rotation.from_euler("xyz", TURNS[way], degrees=True).as_matrix()
    ready, blocks = ran(turned(lifted(step, way in ("z", "askew")), R))
    found = channels(ready, blocks)["probes/q/travel"]
    x, y = (found @ R[: found.shape[1], :2]).T
    s = np.concatenate([block.motion.t for block in blocks])  # of a second
    asked = 0.4 + 0.05 * (10 * s**3 - 15 * s**4 + 6 * s**5)
    missing = np.abs(np.hypot(x, 0.4 + y) - asked)
    assert missing.max() < 2e-6


def light(a: Sequence[float], b: Sequence[float], mass: float) -> dict[str, Any]:
    """A rigid link without a shape between two points, with the inertia of a rod 35 mm thick."""
    d = np.subtract(b, a)
    of = mass * ((d @ d * np.eye(3) - np.outer(d, d)) / 12 + 1e-4 * np.eye(3))
    inertia = [of[k] for k in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))]
    return {"model": "rigid", "mass": mass, "centre": np.mean([a, b], axis=0).tolist(), "inertia": inertia}


PIN = {"kind": "revolute", "axis": [0, 0, 1]}


def propped(steps: int, space: bool = False) -> dict[str, Any]:
    """A lever with a ton at its end on a light rigid prop, which nothing drives: 20 kN on 2 kg."""
    lever = beam_in_space((0, 0, 0), (1, 0, 0), 2) if space else bar("beam", (0, 0), (1, 0), 4)
    if space:
        section = {"kind": "round", "diameter": 0.1}
        lever["shape"] |= {"points": [[0, 0, 0], [0.5, 0, 0], [1, 0, 0]], "section": section}
    else:
        lever["shape"] |= {"width": 0.1, "thickness": 0.06}
    return {
        "gravity": [0, -9.81, 0],
        "links": {"lever": lever, "prop": light((0.4, -0.4, 0), (0.5, 0, 0), 2.0)},
        "joints": {
            "A": {**PIN, "links": ["ground", "lever"], "at": [0, 0, 0]},
            "P": {**PIN, "links": ["ground", "prop"], "at": [0.4, -0.4, 0]},
            "Q": {**PIN, "links": ["lever", "prop"], "at": [0.5, 0, 0]},
        },
        "bodies": {"m": {"kind": "point_mass", "link": "lever", "at": [1, 0, 0], "mass": 1000.0}},
        "damping": {"beta": 3e-5},
        "analysis": {
            "end_time": 0.02, "step": 0.02 / steps, "initial": "quasi-static", "frames": "co-rotational"
        },
        "output": {"probes": {"p": {"link": "lever", "at": [1, 0, 0], "quantity": "travel"}}},
    }  # fmt: skip


def swinging(steps: int) -> dict[str, Any]:
    """A pendulum of 50 kg on a light rigid rod."""
    bob = beam_in_space((0.2, 0, 0), (0.3, 0, 0), 1)
    bob["shape"]["section"]["diameter"] = 0.04
    return {
        "gravity": [0, -9.81, 0],
        "links": {"rod": light((0, 0, 0), (0.2, 0, 0), 0.2), "bob": bob},
        "joints": {
            "A": {**PIN, "links": ["ground", "rod"], "at": [0, 0, 0]},
            "W": {**PIN, "links": ["rod", "bob"], "at": [0.2, 0, 0]},
        },
        "bodies": {"m": {"kind": "point_mass", "link": "bob", "at": [0.3, 0, 0], "mass": 50.0}},
        "damping": {"beta": 1e-4},
        "analysis": {"end_time": 0.25, "step": 0.25 / steps, "frames": "co-rotational"},
        "output": {"probes": {"p": {"link": "bob", "at": [0.3, 0, 0], "quantity": "travel"}}},
    }  # fmt: skip


def connected(steps: int, **analysis: Any) -> dict[str, Any]:
    """A four-bar in space whose rigid connecting link, between elastic ones, turns far in a step."""
    crank, arm = beam_in_space((0, 0, 0), (0.1, 0, 0), 2), beam_in_space((0.13, 0.05, 0), (0.2, -0.06, 0), 3)
    given = {"end_time": 0.02, "step": 0.02 / steps, "initial": "quasi-static", "frames": "co-rotational"}
    return {
        "links": {"crank": crank, "rod": light((0.1, 0, 0), (0.13, 0.05, 0), 0.05), "arm": arm},
        "joints": {
            "A": {**PIN, "links": ["ground", "crank"], "at": [0, 0, 0]},
            "B": {**PIN, "links": ["crank", "rod"], "at": [0.1, 0, 0]},
            "C": {**PIN, "links": ["rod", "arm"], "at": [0.13, 0.05, 0]},
            "D": {**PIN, "links": ["arm", "ground"], "at": [0.2, -0.06, 0]},
        },
        "bodies": {"m": {"kind": "flywheel", "link": "arm", "at": [0.2, -0.06, 0], "mass": 9.0, "inertia": 0.02}},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": "-600 rpm"}},
        "damping": {"ratio": 0.02, "frequencies": [5, 500]},
        "analysis": {**given, **analysis},
        "output": {"probes": {"p": {"link": "arm", "at": [0.13, 0.05, 0], "quantity": "displacement"}}},
    }  # fmt: skip


def placed(raw: dict[str, Any], way: str) -> dict[str, Any]:
    return turned(raw, Rotation.from_euler("xyz", TURNS[way], degrees=True).as_matrix())


CASES: dict[str, tuple[Callable[[int], dict[str, Any]], int]] = {
    "prop": (propped, 80),
    "prop, y": (lambda steps: placed(propped(steps, space=True), "y"), 80),
    "prop, z": (lambda steps: placed(propped(steps, space=True), "z"), 80),
    "prop, askew": (lambda steps: placed(propped(steps, space=True), "askew"), 80),
    "pendulum": (swinging, 100),
    "pendulum, oblique": (lambda steps: placed(swinging(steps), "oblique"), 100),
    "connecting link": (connected, 60),
    "connecting link, z": (lambda steps: placed(connected(steps), "z"), 60),
    "connecting link, askew": (lambda steps: placed(connected(steps), "askew"), 60),
}


@pytest.mark.parametrize("case", CASES)
def test_what_rigid_links_give_is_part_of_the_error_of_the_step(case: str) -> None:
    """Against steps an eighth as long; 1e-11 to 0.14 of it when marches in steps twice as long had links as stiff."""
    made, steps = CASES[case]
    ready = meshed(scene_from(made(steps)))
    assert [x.rotates_little for x in ready.model.step_limits if x] == [False]
    found = histories(ready)
    true = relative_errors(found, histories(meshed(scene_from(made(8 * steps)))))
    estimate = step_errors(ready, found)[0]
    (name,) = (name for name in true if name.startswith("probes/"))
    assert 0.002 < true[name] < 0.2
    assert true[name] / 2 < estimate[name] < 2 * true[name]


def test_a_link_that_would_turn_too_far_in_longer_steps_is_judged_by_shorter_ones() -> None:
    """It is a ten-thousandth as stiff in steps twice as long: these would tell 20 times the true error, 1.6 %."""
    ready = meshed(scene_from(connected(60, rho_inf=0.9)))
    (limit,) = (x for x in ready.model.step_limits if x)
    assert limit.rotates_little
    assert not limit.in_steps(2 * limit.step).rotates_little
    found = histories(ready)
    true = relative_errors(found, histories(meshed(scene_from(connected(480, rho_inf=0.9)))))
    estimate = step_errors(ready, found)[0]
    assert all(true[name] / 2 < estimate[name] < 2 * true[name] for name in true)


def test_levels_in_time_do_without_what_rigid_links_give() -> None:
    """Each has links as stiff as its own steps allow: a hundredth is left of what the coarsest gives, 35 % of it all."""
    raw = propped(20)
    reference = histories(meshed(scene_from(propped(640))))  # 1/1024 of that
    one = relative_errors(histories(meshed(scene_from(raw))), reference)["probes/p/travel"]
    raw["analysis"]["extrapolation_levels"] = 2
    two = relative_errors(histories(meshed(scene_from(raw))), reference)["probes/p/travel"]
    assert 0.3 < one < 0.4
    assert two < one / 100


@pytest.mark.parametrize("steps", [20, 160])
def test_a_run_says_what_rigid_links_give(steps: int, tmp_path: Path) -> None:
    """12 F/(ω² m), ω h = 30, of a rod of mass m that F compresses, and what to do; nothing below 1 % of the peak."""
    run = analyse(scene_from(propped(steps), tmp_path))
    said = [text for text in run.warnings if "rigid link prop deforms" in text]
    moment = 9.81 * (1000 + 7850 * 0.1 * 0.06 / 2)  # of the ton and the lever about its foot
    pressed = moment / (0.5 * 0.4 / np.hypot(0.1, 0.4))
    give = 12 * pressed * 0.001**2 / (900 * 2.0)
    if steps == 160:
        assert not said
        return
    (text,) = said
    assert f"by up to {1e3 * give:.2g} mm, 25 % of the largest displacement" in text
    assert "no drive moves it, and steps of 0.001 s" in text
    assert "take 0.0002 s or less" in text


def test_a_plan_takes_steps_in_which_rigid_links_give_little_enough() -> None:
    """Of the connecting link, within 1 %; with links as stiff in all trials, two levels of 56 steps left 17 %."""
    raw = connected(60)
    del raw["analysis"]["step"]
    raw["analysis"]["accuracy"] = 0.01
    plan = planned(scene_from(raw))
    assert plan.reached
    grid = time_grid(plan.scene)
    finest = {"step": grid.step / 16, "end_time": grid.end, "extrapolation_levels": 1}
    reference = plan.scene.model_copy(update={"analysis": plan.scene.analysis.model_copy(update=finest)})
    errors = relative_errors(histories(meshed(plan.scene)), histories(meshed(reference)))
    assert max(errors.values()) < 0.01


@pytest.mark.parametrize("axis", [(1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0), (0.48, 0.6, 0.64)])
def test_a_rigid_bar_hinged_across_its_end_face_is_a_pendulum(axis: tuple[float, float, float]) -> None:
    """A bar along the axis with a mass m at r beside it, let go with the mass level: I φ'' = m g r cos φ."""
    d = np.array(axis)
    e = np.roll(d, 1) - d * (d @ np.roll(d, 1))
    e /= np.linalg.norm(e)
    down = np.cross(d, e)
    m, r, side, long, end = 5.0, 0.01, 0.02, 0.1, 0.01
    shape = {
        "kind": "bar",
        "between": [[0, 0, 0], (long * d).tolist()],
        "width": side,
        "thickness": side,
        "up": e.tolist(),
    }
    raw = {
        "gravity": (9.81 * down).tolist(),
        "links": {"bar": {"model": "rigid", "material": "steel", "shape": shape}},
        "materials": {"steel": {"density": 7850.0, "youngs_modulus": 2.1e11, "poisson_ratio": 0.3}},
        "bodies": {"m": {"kind": "point_mass", "link": "bar", "at": (long / 2 * d + r * e).tolist(), "mass": m}},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "bar"], "at": [0, 0, 0], "axis": list(axis)}},
        "analysis": {"end_time": end, "step": end / 100, "initial": "rest", "rho_inf": 0.9},
        "output": {"probes": {"p": {"link": "bar", "at": (long * d + r * e).tolist(), "quantity": "position"}}},
    }  # fmt: skip
    x = channels(*ran(raw))["probes/p/position"][-1][:3]
    inertia = 7850.0 * side**2 * long * side**2 / 6 + m * r**2
    exact = solve_ivp(lambda t, y: [y[1], m * 9.81 * r * np.cos(y[0]) / inertia], (0, end), [0, 0], rtol=1e-9, atol=1e-12)
    assert_allclose(np.arctan2(x @ down, x @ e), exact.y[0, -1], rtol=1e-5)  # of order 2 in the step
    assert_allclose(x @ d, long, atol=1e-12)
