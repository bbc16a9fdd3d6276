"""Curves of loads, motors and springs: straight or smooth, held or repeated, from lists or files, all directions."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.interpolate import PchipInterpolator

from kedfem.scene import Factor, load_factor, path_parameter, pieces, scene_from
from tests.laws.test_limits import AXES
from tests.laws.test_varying_springs import hinged_rod, moment_of_inertia
from tests.moving import channels, driven_slide, ran
from tests.rooms.test_force_elements_on_links import four_bar
from tests.systems import against_oracle, begun

Raw = dict[str, Any]
TURN = 2 * np.pi
COGGING = {"over": "angle", "at": ["0 deg", "50 deg", "140 deg", "200 deg", "300 deg"],
           "value": [0.0, 3.0, -1.0, 0.5, -2.5], "interpolation": "smooth", "period": "360 deg"}  # fmt: skip


@st.composite
def curves(draw: st.DrawFn) -> Factor:
    count = draw(st.integers(2, 8))
    at = np.cumsum(draw(st.lists(st.floats(0.1, 2.0), min_size=count, max_size=count)))
    value = draw(st.lists(st.floats(-5.0, 5.0), min_size=count, max_size=count))
    period = None
    if draw(st.booleans()):
        period = float(at[-1] - at[0]) + draw(st.sampled_from([0.0, 0.7]))
        value[-1] = value[0] if period == at[-1] - at[0] else value[-1]
    way = draw(st.sampled_from(["linear", "smooth"]))
    return Factor(at=tuple(at), value=tuple(value), period=period, interpolation=way)


@example(Factor(at=(1.0, 2.0, 3.0), value=(0.0, 0.0, 5e-324), interpolation="smooth"))
@given(curves())
def test_a_curve_has_its_values_stays_between_them_and_repeats_itself(curve: Factor) -> None:
    at, value = np.array(curve.at), np.array(curve.value)
    assert_allclose(load_factor(curve, at), value, atol=1e-12)
    x = np.linspace(at[0] - 3.0, at[-1] + 3.0, 997)
    y = load_factor(curve, x)
    assert y.min() >= value.min() - 1e-12
    assert y.max() <= value.max() + 1e-12
    if curve.period:
        assert_allclose(load_factor(curve, x + 2 * curve.period), y, atol=1e-9)
    else:
        assert_allclose(y[x > at[-1]], value[-1], atol=0)
        assert_allclose(y[x < at[0]], value[0], atol=0)
    if curve.interpolation == "linear" and not curve.period:
        assert_allclose(y, np.interp(x, at, value), atol=1e-12)


@given(curves())
def test_a_curve_has_one_slope_from_both_sides_and_values_and_slopes_agree(curve: Factor) -> None:
    """A smooth one has no corner, where it repeats itself neither; a straight one has its corners at its points only."""
    of, step = pieces(curve), 1e-6
    x = np.linspace(curve.at[0], curve.at[-1] + (curve.period or 0.0), 61)
    x = x[np.abs(np.subtract.outer(x, np.add.outer([0, curve.period or 0], curve.at))).min(axis=(1, 2)) > 0.01]
    for place in x:
        value, slope = of(np.array([place]))
        assert_allclose(value, load_factor(curve, np.array([place]))[0], atol=1e-12)
        assert_allclose(
            slope, (of(np.array([place + step]))[0] - of(np.array([place - step]))[0]) / (2 * step), atol=1e-3
        )
    if curve.interpolation == "smooth":
        inner = curve.at if curve.period else curve.at[1:-1]
        for place in inner:
            assert_allclose(of(np.array([place - 1e-9]))[1], of(np.array([place + 1e-9]))[1], atol=1e-5)


def test_a_smooth_curve_of_a_law_converges_by_the_third_power_of_its_spacing() -> None:
    x = np.linspace(0.0, TURN, 4001)
    errors = []
    for count in (16, 32, 64):
        at = np.linspace(0.0, TURN, count, endpoint=False)
        curve = Factor(over="angle", at=tuple(at), value=tuple(np.sin(at)), interpolation="smooth", period=TURN)
        errors.append(np.abs(load_factor(curve, x, x) - np.sin(x)).max())
    assert errors[2] < 2e-3
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    assert ((slopes > 1.7) & (slopes < 3.3)).all()  # extrema, where its slope is zero, are of order two


def rod(n: np.ndarray, motor: Raw, speed: float, end: float, count: int, **analysis: Any) -> Raw:
    """A rigid rod that a motor turns about an axis through the origin."""
    return {
        **hinged_rod(n),
        "motors": {"m": {"joint": "J", "torque": motor}},
        "analysis": {
            "end_time": end, "step": end / count, "accuracy": "quick", "initial_speeds": {"J": speed}, **analysis
        },
    }  # fmt: skip


@pytest.mark.parametrize("axis", list(AXES))
def test_a_rod_turns_past_a_torque_that_repeats_itself_as_its_equation_says(axis: str) -> None:
    """J φ'' = T(φ), five revolutions and more, by a solver of order eight and a spline of its own."""
    n = AXES[axis]
    at = np.radians([0.0, 50.0, 140.0, 200.0, 300.0])
    at = np.concatenate([at - TURN, at, at + TURN])
    torque = PchipInterpolator(at, np.tile(COGGING["value"], 3))
    errors = []
    for count in (1000, 2000):
        ready, blocks = ran(rod(n, COGGING, 60.0, 0.5, count))
        t = np.concatenate([block.motion.t for block in blocks])
        J = moment_of_inertia(ready.model.links[0], n)

        def rates(time: float, x: np.ndarray, J: float = J) -> list[float]:
            return [x[1], float(torque(x[0] % TURN)) / J]

        exact = solve_ivp(rates, (0, t[-1]), (0, 60.0), t_eval=t, rtol=1e-10, atol=1e-12, method="DOP853",
                          max_step=1e-3).y[0]  # fmt: skip
        found = channels(ready, blocks)
        phi = found["motors/m/angle"][:, 0]
        assert phi[-1] > 4 * TURN
        errors.append(np.abs(phi - exact).max() / np.ptp(exact))
        assert_allclose(found["motors/m/torque"][:, 0], torque(phi % TURN), atol=1e-9 * 3)
    assert errors[1] < 2e-4
    assert 3.3 < errors[0] / errors[1] < 4.7


@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
@pytest.mark.parametrize(
    "curve",
    [COGGING, {"over": "speed", "at": [-5.0, 0.0, 5.0], "value": [3.0, 1.0, -2.0], "interpolation": "smooth"},
     {"at": [0.0, 0.02, 0.07], "value": [1.0, 5.0, 2.0], "interpolation": "smooth", "period": 0.1}],
    ids=["angle", "speed", "time"],
)  # fmt: skip
def test_both_solvers_find_the_same_with_a_smooth_motor(curve: Raw, frames: str) -> None:
    analysis = {"rho_inf": 0.8, "initial": "rest"}
    raw = four_bar(frames, steps=1440, motors={"m": {"joint": "C", "torque": curve}}, analysis=analysis)
    of = begun(raw, frames=frames)
    assert against_oracle(of, 8) < 1e-7


def test_a_factor_over_the_travel_of_a_drive_is_one_over_time_there() -> None:
    """y = 0.1 s(t): the same numbers at every step; the start looks at quarters of the first."""
    raw, h = driven_slide(), 2e-3
    raw["analysis"] |= {"end_time": 0.1, "step": h, "accuracy": "quick"}
    load = {"kind": "force", "link": "one", "at": [0.3, 0], "vector": [0, 100.0]}
    along = {"over": "travel", "at": [0.0, "40 mm", 0.1], "value": [0.0, 1.0, -1.0], "interpolation": "smooth"}
    ready, blocks = ran({**raw, "loads": {"p": {**load, "factor": along}}})
    t = h / 4 * np.arange(201)
    value = load_factor(Factor(**along), t, path_parameter(ready.scene, t)[0])
    assert np.ptp(value) > 1.5
    timed = {"time": t.tolist(), "value": value.tolist()}
    again = channels(*ran({**raw, "loads": {"p": {**load, "factor": timed}}}))
    for name, found in channels(ready, blocks).items():
        assert_allclose(found, again[name], atol=1e-9 * (1.0 + np.abs(found).max()), err_msg=name)


def test_motors_take_their_curve_from_a_file(tmp_path: Path) -> None:
    n = AXES["z"]
    (tmp_path / "motor.csv").write_text("speed [rpm], torque [N*m]\n0, 12\n1500, 9\n3000, 0\n", encoding="utf-8")
    from_file = rod(n, {"over": "speed", "file": "motor.csv", "interpolation": "smooth"}, 0.0, 0.1, 10)
    listed = {"over": "speed", "at": ["0 rpm", "1500 rpm", "3000 rpm"], "value": [12.0, 9.0, 0.0],
              "interpolation": "smooth"}  # fmt: skip
    assert scene_from(from_file, tmp_path).motors == scene_from(rod(n, listed, 0.0, 0.1, 10)).motors
