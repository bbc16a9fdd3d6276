"""Springs and dampers whose force is a curve: over length, travel, angle, speed or time; every direction and frame."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.interpolate import PchipInterpolator

from kedfem.scene import scene_from
from tests.laws.test_limits import AXES
from tests.laws.test_varying_springs import hinged_rod, moment_of_inertia
from tests.moving import channels, inverted, ran
from tests.rooms.test_force_elements_on_links import four_bar
from tests.systems import against_oracle, begun

Raw = dict[str, Any]
HARDENING = {"at": [0.02, 0.06, 0.1, 0.15, 0.3], "value": [-400.0, -60.0, 0.0, 150.0, 1200.0]}
FADING = {"at": [-4.0, -1.0, 0.0, 0.5, 4.0], "value": [-90.0, -40.0, 0.0, 35.0, 60.0]}
"""Of a damper that gives way to fast motion."""


def pulled_rod(n: np.ndarray, count: int, **pull: Any) -> Raw:
    """A rigid rod on a hinge through the origin, pulled at its middle from a point of the ground beside it."""
    raw = hinged_rod(n)
    tip = np.array(raw["links"]["rod"]["shape"]["between"][1])
    away = 0.5 * np.cross(n, tip) - 0.2 * tip + 0.03 * n
    between = [{"link": "rod", "at": (tip / 2).tolist()}, {"link": "ground", "at": away.tolist()}]
    spring = {"kind": "spring", "between": between, **pull}
    analysis = {"end_time": 0.1, "step": 0.1 / count, "accuracy": "quick"}
    return {**raw, "springs": {"s": spring}, "analysis": analysis}


@pytest.mark.parametrize("axis", list(AXES))
@pytest.mark.parametrize("over", ["length", "speed"])
def test_a_rod_that_is_pulled_by_a_curve_swings_as_its_equation_says(axis: str, over: str) -> None:
    """J φ'' = −F(l, l') ∂l/∂φ by a solver of order eight: a smooth curve over the length, or over the speed beside k."""
    n, k = AXES[axis], 3000.0
    if over == "length":
        pull: Raw = {"force": {"over": "length", **HARDENING, "interpolation": "smooth"}}
        curve = PchipInterpolator(HARDENING["at"], HARDENING["value"])
    else:
        force = {"over": "speed", **FADING, "interpolation": "smooth"}
        pull = {"force": force, "stiffness": k, "free_length": 0.05}
        curve = PchipInterpolator(FADING["at"], FADING["value"])
    errors = []
    for count in (500, 1000):
        raw = pulled_rod(n, count, **pull)
        ready, blocks = ran(raw)
        t = np.concatenate([block.motion.t for block in blocks])
        J = moment_of_inertia(ready.model.links[0], n)
        on_rod, on_ground = (np.array(end["at"]) for end in raw["springs"]["s"]["between"])

        def length(phi: float, x: np.ndarray = on_rod, y: np.ndarray = on_ground) -> tuple[float, float]:
            """Distance of both ends, and its derivative."""
            turned = x * np.cos(phi) + np.cross(n, x) * np.sin(phi)  # x is across n
            apart = turned - y
            distance = float(np.linalg.norm(apart))
            return distance, float(apart @ np.cross(n, turned) / distance)

        def pulled(distance: float, rate: float) -> float:
            if over == "length":
                return float(curve(np.clip(distance, *np.array(HARDENING["at"])[[0, -1]])))
            return float(k * (distance - 0.05) + curve(np.clip(rate, -4.0, 4.0)))

        def rates(time: float, y: np.ndarray, J: float = J) -> list[float]:
            distance, slope = length(y[0])
            return [y[1], -pulled(distance, slope * y[1]) * slope / J]

        exact = solve_ivp(rates, (0, t[-1]), (0.0, 0.0), t_eval=t, rtol=1e-10, atol=1e-12, method="DOP853",
                          max_step=1e-3)  # fmt: skip
        found = channels(ready, blocks)
        lengths = np.array([length(phi)[0] for phi in exact.y[0]])
        errors.append(np.abs(found["springs/s/length"][:, 0] - lengths).max() / np.ptp(lengths))
        assert np.ptp(lengths) > 0.02
        force = np.array([pulled(*x) for x in zip(lengths, np.gradient(lengths, t), strict=True)])
        apart = np.abs(found["springs/s/force"][:, 0] - force)[2:-2].max()
        assert apart < 0.05 * np.abs(force).max()
    assert errors[1] < 2e-3
    assert 3.3 < errors[0] / errors[1] < 4.7


STRAIGHT = [
    ({"kind": "spring", "between": "ends", "stiffness": 2000.0, "damping": 15.0, "free_length": 0.1},
     {"damping": 15.0, "force": {"over": "length", "at": [0.0, 2.0], "value": [-200.0, 3800.0]}}),
    ({"kind": "spring", "between": "ends", "stiffness": 2000.0, "damping": 15.0},
     {"stiffness": 2000.0, "force": {"over": "speed", "at": [-100, 100], "value": [-1500, 1500]}}),
    ({"kind": "torsion", "joint": "C", "stiffness": 20.0, "damping": 0.2, "free_angle": 0.1},
     {"damping": 0.2, "torque": {"over": "angle", "at": [-9.0, 9.0], "value": [-182.0, 178.0]}}),
    ({"kind": "torsion", "joint": "C", "stiffness": 20.0, "damping": 0.2},
     {"stiffness": 20.0, "torque": {"over": "speed", "at": [-500, 500], "value": [-100.0, 100.0]}}),
]  # fmt: skip


@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
@pytest.mark.parametrize(("constants", "curve"), STRAIGHT, ids=["length", "speed of ends", "angle", "speed of turn"])
def test_a_straight_curve_is_a_spring_or_a_damper(constants: Raw, curve: Raw, frames: str) -> None:
    """In a driven four-bar whose links bend: joint forces, the drive's torque and probes are the same."""
    ends = [{"link": "coupler", "at": {"between": ["B", "C"], "fraction": 0.5}}, {"link": "ground", "at": "D"}]

    def found(**law: Any) -> dict[str, np.ndarray]:
        place = {key: ends if key == "between" else constants[key] for key in ("kind", "between", "joint")
                 if key in constants}  # fmt: skip
        return channels(*ran(four_bar(frames, springs={"s": {**place, **law}})))

    ours = found(**{key: x for key, x in constants.items() if key not in {"kind", "between", "joint"}})
    assert np.abs(ours["drive/torque"]).max() > 0.5
    for name, values in found(**curve).items():
        assert_allclose(values, ours[name], atol=1e-9 * (1.0 + np.abs(ours[name]).max()), err_msg=name)


def test_along_a_slide_a_straight_curve_over_its_travel_is_a_spring() -> None:
    def found(**law: Any) -> dict[str, np.ndarray]:
        raw = inverted(kind="prismatic")
        return channels(*ran({**raw, "springs": {"s": {"kind": "spring", "joint": "S", **law}}}))

    ours = found(stiffness=400.0, free_travel=0.01)
    curve = {"over": "travel", "at": [-1.0, 1.0], "value": [-404.0, 396.0]}
    assert np.ptp(ours["springs/s/force"]) > 1.0
    for name, values in found(force=curve).items():
        assert_allclose(values, ours[name], atol=1e-9 * (1.0 + np.abs(ours[name]).max()), err_msg=name)


@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
@pytest.mark.parametrize(
    "law",
    [{"force": {"over": "length", "at": [0.1, 0.2, 0.35], "value": [-300.0, 0.0, 900.0], "interpolation": "smooth"}},
     {"stiffness": 500.0, "force": {"over": "speed", **FADING}},
     {"force": {"at": [0.0, 0.02, 0.07], "value": [10.0, 50.0, 20.0], "interpolation": "smooth", "period": 0.1}}],
    ids=["length", "speed", "time"],
)  # fmt: skip
def test_both_solvers_find_the_same(law: Raw, frames: str) -> None:
    ends = [{"link": "coupler", "at": {"between": ["B", "C"], "fraction": 0.5}}, {"link": "ground", "at": "D"}]
    springs = {"s": {"kind": "spring", "between": ends, **law}}
    raw = four_bar(frames, steps=720, springs=springs, analysis={"rho_inf": 0.8, "initial": "rest"})
    assert against_oracle(begun(raw, frames=frames), 8) < 1e-7


def test_a_pull_over_time_does_the_work_that_the_account_of_energy_has() -> None:
    """A cylinder between two links that is told its force: the residual falls with the square of the step."""
    ends = [{"link": "coupler", "at": "C"}, {"link": "ground", "at": "A"}]
    pull = {"time": [0.0, 0.25], "value": [0.0, 40.0]}
    residuals = []
    for steps in (180, 360):
        springs = {"s": {"kind": "spring", "between": ends, "force": pull}}
        found = channels(*ran(four_bar("co-rotational", steps=steps, springs=springs)))
        work = found["energy/work"]
        residuals.append(np.abs(found["energy/residual"]).max() / np.abs(work).max())
    assert residuals[1] < 1e-3
    assert residuals[0] / residuals[1] > 3.0


def test_a_curve_of_a_spring_comes_from_a_file(tmp_path: Path) -> None:
    (tmp_path / "damper.csv").write_text("speed [mm/s], force [kN]\n-500, -2\n0, 0\n500, 1.2\n", encoding="utf-8")
    n = AXES["z"]
    read = scene_from(pulled_rod(n, 10, force={"over": "speed", "file": "damper.csv"}), tmp_path)
    listed = {"over": "speed", "at": [-0.5, 0.0, 0.5], "value": ["-2 kN", 0.0, "1.2 kN"]}
    assert read.springs == scene_from(pulled_rod(n, 10, force=listed), tmp_path).springs


@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
def test_a_damper_on_a_joint_that_goes_on_turning_has_a_steady_motion(frames: str) -> None:
    """Its force does not grow from turn to turn: the same as after some turns from rest."""
    fades = {"over": "speed", "at": [-10, 0, 3, 10], "value": [-8, 0, 4, 6], "interpolation": "smooth"}
    more = {
        "springs": {"s": {"kind": "torsion", "joint": "B", "torque": fades}},
        "damping": {"ratio": 0.05, "frequencies": [20, 2000]},
    }
    analysis = {"steps_per_revolution": 180, "rho_inf": 0.8}
    steady = {**analysis, "kind": "steady", "revolutions": 1, "initial": "rest"}
    found = channels(*ran(four_bar(frames, **more, analysis=steady)))
    later = channels(*ran(four_bar(frames, **more, analysis={**analysis, "revolutions": 4})))
    for name in ("drive/torque", "springs/s/torque", "joints/C/force"):
        size = np.abs(later[name]).max()
        assert size > 1.0
        assert_allclose(found[name][-180:], later[name][-180:], atol=1e-8 * size, err_msg=name)
