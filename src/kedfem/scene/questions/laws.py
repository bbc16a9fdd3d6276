"""Angles or travels of drives, and factors of loads and springs, over time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import MotionError
from kedfem.scene.questions.curves import Pieces, pieces
from kedfem.scene.records.curves import Curve, Factor
from kedfem.scene.records.drives import ConstantSpeed, Cycloidal, Harmonic, MotionCurve, MotionLaw, Polynomial, Ramp
from kedfem.scene.records.scene import Scene

Times = Float[np.ndarray, " t"]
Law = tuple[Times, Times, Times]


def drive_angle(motion: MotionLaw | None, t: Times) -> Law:
    """Angle, or travel, of a driven joint and its derivatives.

    Parameters
    ----------
    motion : law of motion of the drive; None without a drive, for which the angle is zero
    t : (t,) times from 0 [s]

    Returns
    -------
    phi, dphi, ddphi : (t,) each [rad, rad/s, rad/s²; for a travel m, m/s, m/s²]
        Relative to the reference position; right-hand derivatives at jumps of a law.

    Raises
    ------
    MotionError
        A time outside a curve without a period.
    """
    t = np.asarray(t, dtype=float)
    match motion:
        case ConstantSpeed(speed=w):
            return w * t, np.full_like(t, w), np.zeros_like(t)
        case Ramp():
            return ramp(motion, t)
        case MotionCurve():
            return spline(motion, t)
        case Cycloidal() | Polynomial():
            return rise_dwell(motion, t)
        case Harmonic(frequency=f):
            w, a = 2 * np.pi * f, motion.height
            sine, cosine = np.sin(w * t + motion.phase), np.cos(w * t + motion.phase)
            return a * (sine - np.sin(motion.phase)), a * w * cosine, -a * w**2 * sine
        case None:
            return np.zeros_like(t), np.zeros_like(t), np.zeros_like(t)


def path_parameter(scene: Scene, t: Times) -> Law:
    """Parameter of the linkage's path and its derivatives (t,) each: the only drive's angle or travel, else the time.

    In a static analysis the mechanism rests at each place, and the derivatives are zero.

    Raises
    ------
    MotionError
        A time outside a curve without a period.
    """
    t = np.asarray(t, dtype=float)
    several = len(scene.all_drives) > 1
    found = (t, np.ones_like(t), np.zeros_like(t)) if several else drive_angle(scene.motion, t)
    if scene.analysis.kind != "static":
        return found
    return found[0], np.zeros_like(found[0]), np.zeros_like(found[0])


def ramp(motion: Ramp, t: Times) -> Law:
    """A motion whose speed rises from 0 to ω in T: linearly, or as ω/2 (1 − cos πt/T)."""
    w, T = motion.speed, motion.time
    up = np.minimum(t, T)
    k = np.pi / T
    if motion.shape == "smooth":
        phi = 0.5 * w * (up - np.sin(k * up) / k)
        dphi, ddphi = 0.5 * w * (1.0 - np.cos(k * up)), 0.5 * w * k * np.sin(k * up)
    else:
        phi, dphi, ddphi = 0.5 * w * up**2 / T, w * up / T, np.full_like(t, w / T)
    return phi + w * (t - up), dphi, np.where(t < T, ddphi, 0.0)


def spline(motion: MotionCurve, t: Times) -> Law:
    """The cubic spline through a curve of motion; with smoothing the smoothest quintic spline within that distance."""
    from scipy.interpolate import BSpline, CubicSpline, splrep

    at, value, period = motion.at, motion.value, motion.period
    if period is None:
        _refuse_beyond(at, t)
    else:
        last = None if at[-1] < at[0] + period * (1.0 - 1e-12) else -1  # it may include the end of its period
        at, value = (*at[:last], at[0] + period), (*value[:last], value[0])
        t = at[0] + np.mod(t - at[0], period)
    if motion.smoothing is None:
        curve = CubicSpline(at, value, bc_type="periodic" if period else "not-a-knot")
        return curve(t), curve(t, 1), curve(t, 2)
    repeats = period is not None  # the last value equals the first and counts once
    bound, k = (len(at) - repeats) * motion.smoothing**2, min(5, len(at) - 1)
    knots, *_ = splrep(
        at, value, k=k, s=bound, per=repeats, full_output=True, quiet=True
    )  # warnings that the bound is not reached exactly are suppressed
    smooth = BSpline(*knots)
    return smooth(t), smooth(t, 1), smooth(t, 2)


def _refuse_beyond(at: tuple[float, ...], t: Times) -> None:
    """Raise a MotionError if a curve of motion does not reach a time."""
    first, last = at[0], at[-1]
    slack = 1e-9 * (last - first)
    if t.size and (t.min() < first - slack or t.max() > last + slack):
        wrong = t.min() if t.min() < first - slack else t.max()
        got = f"got a curve from {first:.6g} to {last:.6g} s"
        raise MotionError(f"motion of a drive: must reach t = {wrong:.6g} s, {got}")


def curve_noise(motion: MotionCurve) -> tuple[float, float]:
    """Standard deviation of the noise in a curve of motion, and its share in the acceleration.

    Divided differences of growing order remove the smooth part; a difference whose weights have unit norm keeps the
    standard deviation σ of independent errors. The least of orders 4 to 8 is the estimate (R. W. Hamming, Numerical
    Methods for Scientists and Engineers, 1962, on the noise in a table). A second difference has the error √6 σ/h²,
    which is compared with the mean square of all second differences. A harmonic motion sampled six times in a period
    still counts as smooth; one of 30 deg amplitude at every degree of its phase, rounded to 0.01 deg, does not.

    Returns
    -------
    σ [rad or m], and the share of noise in the acceleration [-]; zeros for a curve of fewer than 12 times
    """
    t, y = np.array(motion.at), np.array(motion.value)
    if len(t) < 12:
        return 0.0, 0.0
    noise = min(_left_by_differences(t, y, order) for order in range(4, 9))
    h = np.diff(t)
    second = 2 * np.diff(np.diff(y) / h) / (h[1:] + h[:-1])
    scale = float(np.sqrt(np.mean(second**2)))
    rough = float(np.sqrt(6) * noise / np.median(h) ** 2)
    return noise, rough / scale if scale > 0 else 0.0


def _left_by_differences(t: Times, y: Times, order: int) -> float:
    """Mean square of divided differences whose weights have unit norm."""
    window = np.lib.stride_tricks.sliding_window_view
    times, values = window(t, order + 1), window(y, order + 1)
    apart = times[:, :, None] - times[:, None, :] + np.eye(order + 1)
    span = (times[:, -1] - times[:, 0])[:, None, None] + 0 * apart
    weights = 1 / np.prod(np.where(np.eye(order + 1) > 0, 1.0, apart / span), axis=2)
    weights /= np.linalg.norm(weights, axis=1, keepdims=True)
    left = ((values - values[:, :1]) * weights).sum(axis=1)
    return float(np.sqrt(np.mean(left**2)))


def rise_dwell(motion: Cycloidal | Polynomial, t: Times) -> Law:
    """Rise, dwell, return and dwell, periodically; without a return time only the rise."""
    rise, back = motion.rise, motion.return_time
    if back is None:
        s, ds, dds = unit_rise(motion, np.clip(t / rise, 0.0, 1.0))
        return motion.height * s, motion.height / rise * ds, motion.height / rise**2 * dds
    top = rise + motion.dwell
    tau = np.mod(t, top + back + motion.dwell_after)
    falling = tau >= top
    span = np.where(falling, back, rise)
    s, ds, dds = unit_rise(motion, np.clip(np.where(falling, tau - top, tau) / span, 0.0, 1.0))
    sign = np.where(falling, -1.0, 1.0) * motion.height
    return np.where(falling, motion.height, 0.0) + sign * s, sign / span * ds, sign / span**2 * dds


def unit_rise(motion: Cycloidal | Polynomial, x: Times) -> Law:
    """A law's rise from 0 to 1 over 0 ≤ x ≤ 1, and its two derivatives."""
    if isinstance(motion, Cycloidal):
        w = 2.0 * np.pi
        return x - np.sin(w * x) / w, 1.0 - np.cos(w * x), w * np.sin(w * x)
    if motion.order == 5:
        s, ds = x**3 * (10.0 - 15.0 * x + 6.0 * x**2), 30.0 * x**2 * (1.0 - x) ** 2
        return s, ds, 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x)
    s, ds = x**4 * (35.0 - 84.0 * x + 70.0 * x**2 - 20.0 * x**3), 140.0 * x**3 * (1.0 - x) ** 3
    return s, ds, 420.0 * x**2 * (1.0 - x) ** 2 * (1.0 - 2.0 * x)


FactorLaw = Callable[[Times, Times], Times]
"""A function from times [s] and positions of the drive [rad or m], each (t,), to factors (t,)."""


def factor_law(factor: Factor) -> FactorLaw:
    """A factor as a function; its polynomials are computed once."""
    return partial(_factor_there, pieces(factor), factor.over == "time")


def _factor_there(curve: Pieces, timed: bool, t: Times, phi: Times) -> Times:
    return curve(np.asarray(t if timed else phi, dtype=float))[0]


def load_factor(factor: Factor, t: Times, phi: Times | None = None) -> Times:
    """Values (t,) of a factor at times t (t,) [s] and angles or travels phi (t,) of the drive [rad or m]."""
    return factor_law(factor)(t, t if phi is None else phi)


def factors(scene: Scene) -> Iterator[tuple[str, Factor]]:
    """All factors of a scene, of loads and springs, each with its place."""
    yield from ((f"loads.{name}.factor", load.factor) for name, load in scene.loads.items())
    for name, spring in scene.springs.items():
        yield f"springs.{name}.stiffness_factor", spring.stiffness_factor


def curves(scene: Scene) -> Iterator[tuple[str, Curve]]:
    """All curves of a scene, each with its place: factors, and torques and forces of motors and springs."""
    yield from factors(scene)
    for name, spring in scene.springs.items():
        if spring.curve is not None:
            yield f"springs.{name}.{spring.effort}", spring.curve
    for name, motor in scene.motors.items():
        yield f"motors.{name}.{next(iter(motor.curve.what))}", motor.curve


def is_constant(curve: Curve) -> bool:
    """Whether a curve has a single value."""
    return len(set(curve.value)) < 2


def factor_table(factor: Factor, end: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Times up to an end and the values there of a factor over time, with its periods written out."""
    at, value = np.array(factor.at), np.array(factor.value)
    if factor.period is None:
        return factor.at, factor.value
    whole = np.arange(np.floor(-at[0] / factor.period) - 1, np.ceil((end - at[0]) / factor.period) + 1)
    times = (at + factor.period * whole[:, None]).ravel()
    new = np.concatenate([[True], np.diff(times) > 1e-12 * factor.period])
    return tuple(times[new].tolist()), tuple(np.tile(value, len(whole))[new].tolist())
