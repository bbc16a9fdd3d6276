"""The time steps of an analysis."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from kedfem.scene.questions.laws import drive_angle
from kedfem.scene.questions.modelling import driven_travel
from kedfem.scene.records.analysis import WITHOUT_VIBRATION
from kedfem.scene.records.drives import ConstantSpeed, Cycloidal, Harmonic, MotionCurve, MotionLaw, Polynomial, Ramp
from kedfem.scene.records.scene import Scene

STEPS_PER_REVOLUTION = 720
POSITIONS = 72  # in a revolution of an analysis without vibration


@dataclass(frozen=True, slots=True)
class TimeGrid:
    """Equal time steps [s] from t = 0, and their number; there is one more time point."""

    step: float
    steps: int

    @property
    def end(self) -> float:
        """Time at the end [s]."""
        return self.step * self.steps


def continuous_speed(motion: MotionLaw | None) -> float:
    """The absolute speed [rad/s] at which a drive rotates continuously; 0 for others and without one."""
    return abs(motion.speed) if isinstance(motion, (ConstantSpeed, Ramp)) else 0.0


def scene_speed(scene: Scene) -> float:
    """The speed [rad/s] at which the only drive of a scene rotates continuously; 0 for a slide, several and none."""
    slides = any(driven_travel(scene, name) for name in scene.all_drives)
    return 0.0 if slides else continuous_speed(scene.motion)


def cycle(motion: MotionLaw | None) -> float | None:
    """Period of a drive's law [s], up to whole revolutions; None without one.

    A ramp has the period of its final speed.
    """
    if isinstance(motion, (ConstantSpeed, Ramp)):
        return 2.0 * math.pi / abs(motion.speed) if motion.speed else None
    if isinstance(motion, (Cycloidal, Polynomial)) and motion.return_time is not None:
        return motion.rise + motion.dwell + motion.return_time + motion.dwell_after
    if isinstance(motion, MotionCurve):
        period: float | None = motion.period
        return period
    return 1.0 / motion.frequency if isinstance(motion, Harmonic) else None


def without_vibration(scene: Scene) -> bool:
    """Whether each position is computed by itself, static or quasi-static, without time steps."""
    return scene.analysis.kind in WITHOUT_VIBRATION


def time_of_revolutions(motion: MotionLaw, revolutions: float) -> float:
    """Time at which a continuously rotating drive has made a number of revolutions [s].

    Raises
    ------
    ValueError
        The drive does not rotate continuously.
    """
    angle, speed = 2.0 * math.pi * revolutions, continuous_speed(motion)
    if isinstance(motion, ConstantSpeed):
        return angle / speed
    if not isinstance(motion, Ramp):
        raise ValueError(f"a {motion.kind} drive has no revolutions")
    if angle >= 0.5 * speed * motion.time:  # the ramp, of either shape, takes half the angle of full speed
        return angle / speed + 0.5 * motion.time
    from scipy.optimize import brentq

    def short_of(t: float) -> float:
        return abs(float(drive_angle(motion, np.array([t]))[0][0])) - angle

    return float(brentq(short_of, 0.0, motion.time, xtol=1e-15, rtol=1e-14))


def time_grid(scene: Scene) -> TimeGrid:
    """Step and number of steps of a scene's analysis.

    With ``steps_per_revolution`` the step is that part of a revolution at the drive's final speed, and the last step may
    pass the end; ``step`` is shortened so that a whole number reaches the end. A steady motion has an even number of
    steps. Analyses without vibration end after one revolution by default, and a structure needs no end.

    Raises
    ------
    ValueError
        The analysis has no end.
    """
    analysis, motion = scene.analysis, scene.motion
    steady = analysis.kind == "steady"
    end = analysis.end_time
    if motion is not None and analysis.revolutions is not None:
        end = time_of_revolutions(motion, analysis.revolutions)
    if end is None and analysis.kind != "transient":
        end = cycle(motion)
    if end is None and analysis.kind == "static" and not scene.driven_joints:
        return TimeGrid(1.0, 1) if analysis.step is None else _grid(scene, 1.0)
    if end is None:
        raise ValueError("an analysis needs revolutions or an end time")
    grid = _grid(scene, end)
    return TimeGrid(end / (steps := grid.steps + grid.steps % 2), steps) if steady else grid


def _grid(scene: Scene, end: float) -> TimeGrid:
    """Equal steps up to an end, or a little beyond."""
    analysis = scene.analysis
    if analysis.step is not None:
        steps = max(1, math.ceil(end / analysis.step - 1e-9))
        return TimeGrid(end / steps, steps)
    speed = scene_speed(scene)
    usual = POSITIONS if without_vibration(scene) else STEPS_PER_REVOLUTION
    if not speed:
        return TimeGrid(end / usual, usual)
    step = 2.0 * math.pi / (speed * (analysis.steps_per_revolution or usual))
    return TimeGrid(step, max(1, math.ceil(end / step - 1e-6)))


def states_step(scene: Scene) -> bool:
    """Whether a scene states the length of its steps."""
    return scene.analysis.step is not None or scene.analysis.steps_per_revolution is not None


def revolution_steps(scene: Scene) -> float | None:
    """Time steps in one revolution of the drive at its final speed; None if it does not rotate continuously."""
    speed = scene_speed(scene)
    return 2.0 * math.pi / (speed * time_grid(scene).step) if speed else None
