"""Springs whose stiffness varies with time or with the drive's angle: closed forms, all directions, both solvers."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from kedfem.errors import SceneError
from kedfem.scene import read_scene, scene_from
from tests.laws.test_limits import AXES
from tests.laws.test_steady import steady
from tests.moving import bar, channels, ran
from tests.rooms.test_force_elements_on_links import LINE, apart, four_bar, largest, places

Raw = dict[str, Any]
OMEGA, DELTA, EPSILON = 40.0, 1.0, 0.4
STEEL = {"youngs_modulus": 2e11, "poisson_ratio": 0.3, "density": 2000.0}
SIDE = 0.1
MASS = STEEL["density"] * SIDE**3


def as_dense(m: Any) -> np.ndarray:
    return np.asarray(m.todense() if hasattr(m, "todense") else m)


def hill(form: str, axis: str, zeta: float, **analysis: Any) -> Raw:
    """A block on a slide, x'' + 2 ζ ω x' + ω² (δ + ε f(ω t)) x = 0, half of δ by a bushing, f of period π.

    Mathieu's f is cos 2 ω t; Meissner's is 1 and −1 by turns, at the time points of steps the mean of both.
    """
    share = 0.5 * DELTA * OMEGA**2 * MASS
    swing = 2 * EPSILON / DELTA
    phi = np.linspace(0, 2 * np.pi, 2881)
    at, f = {
        "Mathieu": (phi, np.cos(phi)),
        "Meissner": (np.pi * np.array([1e-8, 1 - 1e-8, 1 + 1e-8, 2 - 1e-8]), np.array([1, 1, -1, -1])),
    }[form]
    factor = {"over": "angle", "at": at.tolist(), "value": (1 + swing * f).tolist(), "period": "360 deg"}
    spring = {"kind": "spring", "joint": "S", "stiffness": share, "damping": 2 * zeta * OMEGA * MASS}
    between = {"links": ["block", "ground"], "at": [0.3, 0, 0]}

    def rigid(a: float, b: float, side: float) -> Raw:
        shape = {"kind": "bar", "between": [[a, 0, 0], [b, 0, 0]], "width": side, "thickness": side}
        return {"model": "rigid", "material": "m", "shape": shape}

    return {
        "materials": {"m": STEEL},
        "links": {"crank": rigid(0, 0.1, 0.02), "block": rigid(0.3, 0.3 + SIDE, SIDE)},
        "joints": {
            "A": {"kind": "revolute", "links": ["crank", "ground"], "at": [0, 0, 0], "axis": "z"},
            "mount": {
                "kind": "weld",
                "bushing": {"stiffness": share, "rotational_stiffness": share * SIDE**2},
                **between,
            },
            "S": {"kind": "prismatic", "axis": list(AXES[axis]), **between},
        },
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 2 * OMEGA}},
        "springs": {"k": {**spring, "stiffness_factor": factor}},
        "analysis": {"steps_per_revolution": 360, "extrapolation_levels": 2, "rho_inf": 0.95, **analysis},
    }


def multiplier(form: str, zeta: float, speed: float = 2 * OMEGA) -> float:
    """The largest of the equation itself, from its two solutions over a period of a speed [rad/s]."""
    slow = 2 * OMEGA / speed
    delta, epsilon, zeta = slow**2 * DELTA, slow**2 * EPSILON, slow * zeta
    if form == "Meissner":
        P = np.eye(2)
        for f in (1, -1):
            P = expm(np.array([[0, 1], [-(delta + f * epsilon), -2 * zeta]]) * np.pi / 2) @ P
    else:

        def rates(t: float, x: np.ndarray) -> list[float]:
            return [x[1], -(delta + epsilon * np.cos(2 * t)) * x[0] - 2 * zeta * x[1]]

        both = [solve_ivp(rates, (0, np.pi), x0, rtol=1e-12, atol=1e-13, method="DOP853") for x0 in np.eye(2)]
        P = np.array([each.y[:, -1] for each in both]).T
    return float(np.abs(np.linalg.eigvals(P)).max())


@pytest.mark.parametrize(
    ("form", "axis", "zeta"),
    [
        ("Mathieu", "oblique", 0.02),
        *(pytest.param(*each, marks=pytest.mark.long)
          for each in (("Mathieu", "x", 0), ("Mathieu", "z", 0), ("Meissner", "y", 0), ("Meissner", "oblique", 0.02))),
    ],
)  # fmt: skip
def test_multipliers_of_a_spring_that_stiffens_and_softens(form: str, axis: str, zeta: float) -> None:
    of = steady(hill(form, axis, zeta))[2]
    exact = multiplier(form, zeta)
    assert of.unstable
    assert exact > 1.25
    assert_allclose(of.growth, exact, rtol=1e-6)


def test_the_largest_multiplier_is_found_though_others_are_found_before_it() -> None:
    """Another vibration of the block, undamped, is found after three marches: the motion had been told to be stable."""
    of = steady(hill("Meissner", "x", 0.0, steps_per_revolution=180, extrapolation_levels=1))[2]
    assert of.certain
    assert_allclose(of.growth, multiplier("Meissner", 0.0), rtol=2e-4)


@pytest.mark.long
@pytest.mark.parametrize("form", ["Mathieu", "Meissner"])
def test_the_multiplier_of_one_level_is_of_second_order(form: str) -> None:
    steps = np.array([90, 180, 720])
    errors = [
        abs(steady(hill(form, "x", 0.0, steps_per_revolution=int(n), extrapolation_levels=1))[2].growth
            / multiplier(form, 0.0) - 1) for n in steps
    ]  # fmt: skip
    assert errors[0] < 4e-4
    assert 1.9 < np.log(errors[0] / errors[2]) / np.log(8) < 2.1


RISES = {"over": "time", "at": [0.0, 0.05, 0.1, 0.2], "value": [1.0, 0.0, 3.0, 1.0]}


def hinged_rod(n: np.ndarray) -> Raw:
    """A rigid rod on a hinge J about an axis through the origin."""
    along = np.cross(n, [0.3, 0.5, 0.9])
    along /= np.linalg.norm(along)
    joint = {"kind": "revolute", "links": ["rod", "ground"], "at": [0, 0, 0], "axis": n.tolist()}
    return {"links": {"rod": bar("rigid", [0, 0, 0], (0.2 * along).tolist())}, "joints": {"J": joint}}


@pytest.mark.parametrize("axis", list(AXES))
def test_a_rod_on_a_torsion_spring_that_varies_swings_as_its_equation_says(axis: str) -> None:
    """J φ'' = −k f(t) (φ − φ0), by a solver of ordinary differential equations of order eight."""
    n = AXES[axis]
    k, free = 200.0, 0.3
    spring = {"kind": "torsion", "joint": "J", "stiffness": k, "free_angle": free, "stiffness_factor": RISES}
    errors = []
    for count in (1000, 2000):
        analysis = {"end_time": 0.2, "step": 0.2 / count, "accuracy": "quick"}
        ready, blocks = ran({**hinged_rod(n), "springs": {"s": spring}, "analysis": analysis})
        t = np.concatenate([block.motion.t for block in blocks])
        exact = swung(k / moment_of_inertia(ready.model.links[0], n), free, t)
        found = channels(ready, blocks)
        phi = found["springs/s/angle"][:, 0]
        errors.append(np.abs(phi - exact).max() / np.ptp(exact))
        torque = -k * np.interp(t, RISES["at"], RISES["value"]) * (phi - free)
        assert_allclose(found["springs/s/torque"][:, 0], torque, atol=1e-9 * k)
    assert errors[1] < 1e-3
    assert 3.5 < errors[0] / errors[1] < 4.5


def moment_of_inertia(link: Any, n: np.ndarray) -> float:
    """About an axis through the origin [kg m²]."""
    arms = link.X - n * (link.X @ n)[:, None]
    return float(np.einsum("ia,ij,ja->", arms, as_dense(link.mass[0]), arms))


def swung(square: float, free: float, t: np.ndarray) -> np.ndarray:
    """φ'' = −ω² f(t) (φ − φ0) from rest."""

    def rates(time: float, x: np.ndarray) -> list[float]:
        return [x[1], -square * np.interp(time, RISES["at"], RISES["value"]) * (x[0] - free)]

    found = solve_ivp(rates, (0, t[-1]), (0, 0), t_eval=t, rtol=1e-10, atol=1e-12, method="DOP853", max_step=1e-3)
    return np.asarray(found.y[0])


def test_both_solvers_find_the_same_with_a_spring_that_varies() -> None:
    factor = {"over": "angle", "at": ["0 deg", "30 deg", "60 deg"], "value": [0.5, 2.0, 0.0]}
    springs = {"s": {**LINE, "stiffness": 2e3, "preload": 200.0, "stiffness_factor": factor}}
    one = places(four_bar("rigid-body", springs=springs, steps=40))
    other = places(four_bar("rigid-body", springs=springs, steps=40, analysis={"solver": "monolithic"}))
    assert apart(one, other) < 1e-9 * largest(one)
    constant = {"s": {**LINE, "stiffness": 1e3, "preload": 200.0}}
    assert apart(one, places(four_bar("rigid-body", springs=constant, steps=40))) > 0.1 * largest(one)


@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
def test_a_constant_factor_is_another_stiffness(frames: str) -> None:
    twice = {"s": {**LINE, "stiffness": 1e3, "stiffness_factor": 2.0}}
    once = {"s": {**LINE, "stiffness": 2e3}}
    one, other = (ran(four_bar(frames, springs=each, steps=60)) for each in (twice, once))
    for name, rows in channels(*one).items():  # those of rigid links too, which are worked out apart
        assert_allclose(rows, channels(*other)[name], atol=1e-9 * max(1.0, float(np.abs(rows).max())), err_msg=name)


def refused(**spring: Any) -> str:
    with pytest.raises(SceneError) as found:
        scene_from(four_bar("rigid-body", springs={"s": {**LINE, "stiffness": 1e3, **spring}}))
    return str(found.value)


def test_factors_that_make_no_sense_are_refused() -> None:
    below = {"over": "time", "at": [0, 1], "value": [1, -0.5]}
    assert (
        "springs.s.stiffness_factor.value: must hold values of at least 0 (a spring of negative stiffness would push "
        "apart), got -0.5" in refused(stiffness_factor=below)
    )
    damper = {"stiffness": 0.0, "damping": 1.0, "stiffness_factor": 2.0}
    assert "springs.s.stiffness_factor: must be combined with a stiffness, got none" in refused(**damper)


def test_a_factor_is_read_from_a_file(tmp_path: Path) -> None:
    (tmp_path / "k.csv").write_text("angle [deg], factor\n0, 1\n90, 0.5\n")
    scene = (
        'joints.A = { kind = "revolute", links = ["ground", "a"], at = [0, 0] }\n'
        'drive = { joint = "A", motion = { kind = "constant_speed", speed = 1 } }\n'
        "analysis = { revolutions = 0.1, steps_per_revolution = 360 }\n"
        '[links.a]\nmodel = "beam"\nmaterial = "steel"\n'
        'shape = { kind = "bar", between = [[0, 0], [1, 0]], width = 0.01, thickness = 0.01 }\n'
        '[springs.s]\nkind = "spring"\nbetween = [{ link = "a", at = [1, 0] }, { link = "ground", at = [1, 1] }]\n'
        'stiffness = 1\nstiffness_factor = { over = "angle", file = "k.csv", period = "90 deg" }\n'
    )
    (tmp_path / "scene.toml").write_text(scene)
    factor = read_scene(tmp_path / "scene.toml").springs["s"].stiffness_factor
    assert_allclose(factor.at, [0, np.pi / 2])
    assert (factor.value, factor.period) == ((1.0, 0.5), pytest.approx(np.pi / 2))
    (tmp_path / "k.csv").write_text("angle [deg], factor\n0, 1\n90, oops\n")
    with pytest.raises(SceneError, match=r"springs\.s\.stiffness_factor\.file: .*oops"):
        read_scene(tmp_path / "scene.toml")
