"""Laws of motion, time steps and load factors: closed forms against differences and textbook values."""

import math
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.errors import MotionError
from kedfem.scene import (
    Analysis,
    ConstantSpeed,
    Cycloidal,
    Damping,
    Drive,
    Factor,
    MotionCurve,
    MotionLaw,
    Polynomial,
    Ramp,
    TimeGrid,
    cycle,
    drive_angle,
    load_factor,
    rayleigh,
    time_grid,
)
from kedfem.scene.questions.laws import curve_noise

TIMES = tuple(np.linspace(0.0, 2.0, 9))
LAWS = {
    "constant speed": ConstantSpeed(speed=7.0),
    "smooth ramp": Ramp(speed=-5.0, time=0.8),
    "linear ramp": Ramp(speed=5.0, time=0.8, shape="linear"),
    "table": MotionCurve(time=TIMES, value=tuple(math.sin(2.0 * t) for t in TIMES)),
    "cycloidal": Cycloidal(angle=1.2, rise=0.3, dwell=0.2, return_time=0.4, dwell_after=0.1),
    "cycloidal, stays": Cycloidal(angle=-1.2, rise=0.7),
    "3-4-5": Polynomial(angle=1.2, rise=0.3, dwell=0.2, return_time=0.4),
    "4-5-6-7": Polynomial(order=7, angle=1.2, rise=0.3, return_time=0.4, dwell_after=0.1),
}
SMOOTH = sorted(LAWS.keys() - {"linear ramp"})


@dataclass
class Driven:
    """As much of a scene as the time steps depend on."""

    motion: MotionLaw
    analysis: Analysis

    @property
    def all_drives(self):
        return {"A": Drive(joint="A", motion=self.motion)}

    @property
    def joints(self):
        return {"A": SimpleNamespace(kind="revolute")}


@pytest.mark.parametrize("name", LAWS)
def test_speed_and_acceleration_are_the_derivatives_of_the_angle(name):
    h = 1e-5
    t = np.linspace(0.013, 1.977, 400)  # between the joins of the pieces, but for few points
    t = t[np.all([abs(t - join) > 2 * h for join in (0.3, 0.5, 0.7, 0.8, 0.9, 1.0, 1.3, 1.5, 1.6)], axis=0)]
    phi, dphi, ddphi = drive_angle(LAWS[name], t)
    (before, dbefore, _), (after, dafter, _) = (drive_angle(LAWS[name], t + d) for d in (-h, h))
    assert_allclose(dphi, (after - before) / (2 * h), atol=1e-6)  # h² φ''' / 6 for φ''' up to 1e4
    assert_allclose(ddphi, (dafter - dbefore) / (2 * h), atol=1e-4)  # h² φ'''' / 6 up to 1e6
    assert phi.shape == dphi.shape == ddphi.shape == t.shape


@pytest.mark.parametrize("name", SMOOTH)
def test_the_acceleration_has_no_jumps(name):
    t = np.linspace(0.0, 2.0, 200_001)
    for derivative, slope in zip(drive_angle(LAWS[name], t), (10.0, 120.0, 4000.0), strict=True):
        assert np.abs(np.diff(derivative)).max() < slope * 1e-5  # laws have at most such slopes; a jump is larger


def test_a_linear_ramp_has_constant_acceleration_until_the_speed_is_reached():
    _, dphi, ddphi = drive_angle(LAWS["linear ramp"], np.array([0.0, 0.4, 0.8, 1.5]))
    assert_allclose(dphi, [0.0, 2.5, 5.0, 5.0])
    assert_allclose(ddphi, [6.25, 6.25, 0.0, 0.0])  # ω/T; right-hand values


@pytest.mark.parametrize("shape", ["smooth", "linear"])
def test_a_ramp_takes_half_the_angle_of_full_speed(shape):
    phi, dphi, _ = drive_angle(Ramp(speed=5.0, time=0.8, shape=shape), np.array([0.8, 2.0]))
    assert_allclose(phi, [2.0, 8.0], rtol=1e-14)  # ω T/2, ω (t − T/2)
    assert_allclose(dphi, 5.0, rtol=1e-14)


@pytest.mark.parametrize(
    ("law", "speed", "acceleration"),
    [
        # Norton, Design of Machinery, table of double-dwell laws: peak velocity and acceleration factors
        (Cycloidal(angle=1.0, rise=1.0), 2.0, 2.0 * math.pi),
        (Polynomial(angle=1.0, rise=1.0), 1.875, 10.0 / math.sqrt(3.0)),
        (Polynomial(order=7, angle=1.0, rise=1.0), 2.1875, 84.0 * math.sqrt(5.0) / 25.0),
    ],
    ids=["cycloidal", "3-4-5", "4-5-6-7"],
)
def test_peaks_of_the_dwell_laws_are_those_of_the_textbook(law, speed, acceleration):
    phi, dphi, ddphi = drive_angle(law, np.linspace(0.0, 1.0, 100_001))
    assert_allclose((phi[0], phi[50_000], phi[-1]), (0.0, 0.5, 1.0), atol=1e-15)
    assert_allclose(dphi.max(), speed, rtol=1e-8)  # a grid point lies within 1e-5 of the peak
    assert_allclose(ddphi.max(), acceleration, rtol=1e-8)


def test_rise_dwell_return_dwell_repeats():
    law = LAWS["cycloidal"]
    t = np.array([0.0, 0.15, 0.3, 0.45, 0.5, 0.7, 0.9, 0.95])
    expected = np.array([0.0, 0.6, 1.2, 1.2, 1.2, 0.6, 0.0, 0.0])
    assert_allclose(drive_angle(law, t)[0], expected, atol=1e-12)
    assert_allclose(drive_angle(law, t + 3.0)[0], expected, atol=1e-12)  # three periods of 1 s later


def test_a_rise_without_a_return_stays_at_the_top():
    phi, dphi, ddphi = drive_angle(LAWS["cycloidal, stays"], np.array([0.7, 5.0]))
    assert_allclose(phi, -1.2, rtol=1e-15)
    assert_allclose((dphi, ddphi), 0.0, atol=1e-14)


def test_a_table_passes_through_its_points_and_follows_a_cubic_exactly():
    t = np.linspace(0.0, 2.0, 50)
    law = MotionCurve(time=TIMES, value=tuple(s**3 - s for s in TIMES))  # not-a-knot reproduces cubics
    phi, dphi, ddphi = drive_angle(law, t)
    assert_allclose(phi, t**3 - t, atol=1e-13)
    assert_allclose(dphi, 3 * t**2 - 1, atol=1e-12)
    assert_allclose(ddphi, 6 * t, atol=1e-11)


@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("smoothing", [None, "1e-7 rad"])
def test_a_periodic_curve_of_motion_repeats_itself_without_jumps(closed, smoothing):
    """A sine over its period T; the error of a cubic spline's second derivative is h²/12 of the fourth one at the most,
    for h = T/80: de Boor, A Practical Guide to Splines, 2001, chapter V."""
    period, n = 1.6, 80
    at = np.linspace(-0.4, 1.2, n + 1)[: None if closed else n]
    law = MotionCurve(time=tuple(at), value=tuple(np.sin(2 * np.pi * at / period)), period=period, smoothing=smoothing)
    w, t = 2 * np.pi / period, np.linspace(0.0, 3.7, 301)
    phi, dphi, ddphi = drive_angle(law, t)
    cap = 2.0 * (w * period / n) ** 2 / 12.0
    assert_allclose(ddphi, -(w**2) * np.sin(w * t), atol=cap * w**2)
    assert_allclose(dphi, w * np.cos(w * t), atol=cap * w)
    assert_allclose(phi, np.sin(w * t), atol=cap)
    seam = [x[:, 0] - x[:, 1] for x in np.array(drive_angle(law, np.array([1.2 - 1e-9, 1.2 + 1e-9])))[:, None, :]]
    assert_allclose(np.ravel(seam), 0.0, atol=1e-7 * w**3)
    assert cycle(law) == period


@pytest.mark.parametrize("t", [-0.1, 2.1])
def test_a_table_is_not_used_beyond_its_ends(t):
    with pytest.raises(MotionError, match=rf"must reach t = {t} s, got a curve from 0 to 2 s"):
        drive_angle(LAWS["table"], np.array([1.0, t]))


def test_a_load_factor_is_linear_between_its_times_and_held_outside():
    factor = Factor(time=(1.0, 2.0, 4.0), value=(0.0, 3.0, -1.0))
    assert_allclose(load_factor(factor, np.array([0.0, 1.5, 3.0, 9.0])), [0.0, 1.5, 1.0, -1.0])


def test_turns_at_constant_speed_are_a_whole_number_of_steps():
    scene = Driven(ConstantSpeed(speed=-2.0 * math.pi * 10.0), Analysis(revolutions=3.0, steps_per_revolution=360))
    grid = time_grid(scene)
    assert grid.steps == 1080
    assert_allclose((grid.step, grid.end), (0.1 / 360, 0.3), rtol=1e-14)


def test_steps_per_turn_default_to_720():
    assert time_grid(Driven(ConstantSpeed(speed=1.0), Analysis(revolutions=1.0))).steps == 720


@pytest.mark.parametrize("shape", ["smooth", "linear"])
@pytest.mark.parametrize("revolutions", [0.1, 1.0, 4.0])  # within the ramp of 1 s (5 turns at full speed) and after it
def test_turns_with_a_ramp_end_when_the_angle_is_reached(shape, revolutions):
    motion = Ramp(speed=10.0 * math.pi, time=1.0, shape=shape)
    grid = time_grid(Driven(motion, Analysis(revolutions=revolutions, steps_per_revolution=1000)))
    assert_allclose(grid.step, 0.2 / 1000, rtol=1e-14)
    last, before = drive_angle(motion, np.array([grid.end, grid.end - grid.step]))[0] / (2.0 * math.pi)
    assert before < revolutions * (1 - 1e-9)
    assert last >= revolutions * (1 - 1e-9)


@pytest.mark.parametrize(("step", "expected"), [(0.1, TimeGrid(0.1, 10)), (0.3, TimeGrid(0.25, 4))])
def test_a_step_is_shortened_so_that_a_whole_number_reaches_the_end(step, expected):
    grid = time_grid(Driven(LAWS["table"], Analysis(end_time=1.0, step=step)))
    assert grid.steps == expected.steps
    assert_allclose(grid.step, expected.step, rtol=1e-15)


def test_rayleigh_damping_has_the_given_ratio_at_both_frequencies():
    damping = Damping(ratio=(0.02, 0.05), frequencies=(20.0, 300.0))
    alpha, beta = rayleigh(damping)
    for f, ratio in ((20.0, 0.02), (300.0, 0.05)):
        omega = 2.0 * math.pi * f
        assert_allclose(alpha / (2.0 * omega) + beta * omega / 2.0, ratio, rtol=1e-12)  # ζ = α/2ω + βω/2
    assert rayleigh(Damping(alpha=1.0, beta=2e-5)) == (1.0, 2e-5)


def noisy(digits):
    """A harmonic motion at every degree of its phase, 1 s a period, in degrees with so many digits."""
    t = np.arange(361) / 360
    return t, np.radians(np.round(30 * np.sin(2 * np.pi * t), digits))


def test_the_noise_of_a_rounded_table_is_that_of_rounding():
    """Standard deviation of rounding: a unit of the last digit by √12; acceleration error √6 σ/h² of 30° ω²/√2."""
    t, angle = noisy(2)
    sigma, share = curve_noise(MotionCurve(time=tuple(t), value=tuple(angle)))
    assert_allclose(sigma, np.radians(0.01) / np.sqrt(12), rtol=0.15)
    alone = np.sqrt(6) * sigma * 360**2 / (np.radians(30) * (2 * np.pi) ** 2 / np.sqrt(2))
    assert_allclose(share, alone / np.hypot(1, alone), rtol=0.15)  # of all second differences, the noise among them
    assert share > 0.05


@pytest.mark.parametrize("points", [13, 25, 400])
def test_a_smooth_table_has_no_noise_however_coarse(points):
    t = np.sort(np.linspace(0, 1, points) + 0.1 / points * np.sin(np.arange(points)))
    assert curve_noise(MotionCurve(time=tuple(t), value=tuple(np.sin(2 * np.pi * t))))[1] < 0.01


def test_smoothing_mends_the_acceleration_of_a_rounded_table():
    """Within 1 % of the true one between the ends; the spline through the rounded values is off by 10 % and more."""
    t, angle = noisy(2)
    times = np.linspace(0.1, 0.9, 777)
    true = -math.radians(30) * (2 * np.pi) ** 2 * np.sin(2 * np.pi * times)
    rough, smooth = (
        np.abs(drive_angle(MotionCurve(time=tuple(t), value=tuple(angle), smoothing=s), times)[2] - true).max()
        for s in (None, "0.003 deg")
    )
    assert smooth < 0.01 * np.abs(true).max() < 0.1 * np.abs(true).max() < rough


@pytest.mark.parametrize("period", [None, 1.0])
@pytest.mark.parametrize("smoothing", [1e-8, 1e-3, 0.05])
@pytest.mark.parametrize("points", [4, 5, 12, 30])
@pytest.mark.filterwarnings("error")
def test_a_smoothed_curve_passes_from_its_values_as_far_as_stated_in_the_mean_square(points, smoothing, period):
    """Of a periodic curve the last value is the first once more: counted twice, curves of four times were 15 % off."""
    at = np.linspace(0.0, 1.0, points)[: -1 if period else None]
    value = np.sin(2 * np.pi * at) + 1e-2 * np.cos(37.0 * np.arange(len(at)))
    law = MotionCurve(time=tuple(at), value=tuple(value), period=period, smoothing=smoothing)
    off = np.sqrt(np.mean((drive_angle(law, at)[0] - value) ** 2))
    assert off <= 1.001 * smoothing  # FITPACK meets the square of its bound to 1e-3
