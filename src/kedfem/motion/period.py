"""The period of a motion: the time after which linkage, drives and loads return."""

import math
from collections.abc import Iterator

import numpy as np

from kedfem.errors import SceneError
from kedfem.motion.linkage import Linkage, linkage
from kedfem.motion.path import MOST_TURNS, Path, path
from kedfem.scene import (
    ConstantSpeed,
    Drive,
    MotionCurve,
    MotionLaw,
    Ramp,
    Scene,
    curves,
    cycle,
    drive_angle,
    factors,
    is_constant,
    path_parameter,
    revolution_steps,
)

WHOLE = 1e-9  # of a period: tolerance of whole multiples
STEADY, FATIGUE = "analysis.kind = 'steady'", "[fatigue]"  # keys that need a period
SAME = 1e-6  # of a curve's range: tolerance between its end and its beginning


def over_one_period(scene: Scene) -> Scene:
    """A scene of a steady motion with the end of its analysis after one period; any other scene as it is.

    A drive with a ramp has its final speed: the steady motion is that after the ramp.

    Raises
    ------
    SceneError
        Where something does not repeat itself, or the scene states another end.
    MotionError
    """
    if scene.analysis.kind != "steady":
        return scene
    scene = _sped_up(scene)
    base = cycle(scene.motion) or scene.analysis.end_time
    if base is None:
        raise SceneError("analysis.end_time: is required [s], the period of the steady motion, got nothing")
    count, time = _periods(scene, linkage(scene), base, STEADY)
    stated, turns = scene.analysis.revolutions, revolution_steps(scene) is not None
    if stated is not None and abs(stated - count) > WHOLE * count:
        message = f"must be left out, or the {count:g} of the period of the steady motion, got {stated:g}"
        raise SceneError(f"analysis.revolutions: {message}")
    end = scene.analysis.end_time
    if end is not None and abs(end - time) > WHOLE * time:
        message = f"must be left out, or the period of the steady motion, {time:.9g} [s], got {end:.9g}"
        raise SceneError(f"analysis.end_time: {message}")
    keys = {"revolutions": float(count) if turns else None, "end_time": None if turns else time}
    return scene.model_copy(update={"analysis": scene.analysis.model_copy(update=keys)})


def repeats_after(scene: Scene) -> float:
    """The time after which linkage, drive and loads return, at the final speed of the drive [s].

    Raises
    ------
    SceneError
        Where something does not repeat itself, or the period is unknown.
    """
    scene = _sped_up(scene)
    base = cycle(scene.motion)
    if base is None:
        several = len(scene.all_drives) > 1
        got = "several drives" if several else "one that does not rotate continuously or return"
        wanted = "is required [s] but with a drive that repeats its motion"
        raise SceneError(f"fatigue.period: {wanted}, got {got}")
    return _periods(scene, linkage(scene), base, FATIGUE)[1]


def _sped_up(scene: Scene) -> Scene:
    """The scene with constant speeds in place of ramps to them."""

    def later(drive: Drive) -> Drive:
        ramp = drive.motion
        if not isinstance(ramp, Ramp):
            return drive
        return drive.model_copy(update={"motion": ConstantSpeed(speed=ramp.speed)})

    drives = {name: later(drive) for name, drive in scene.drives.items()}
    return scene.model_copy(update={"drive": scene.drive and later(scene.drive), "drives": drives})


def _periods(scene: Scene, rigid: Linkage, base: float, asked: str) -> tuple[int, float]:
    """The period as a multiple of the base, and in seconds."""
    faults = list(_never(scene, asked))
    if faults:
        raise SceneError(faults)
    along = path(rigid, *_range(scene, base))
    reasons: list[str] = []
    for count in range(1, MOST_TURNS + 1):
        reasons = list(_open(scene, along, count * base, asked))
        if not reasons:
            return count, count * base
        if cycle(scene.motion) is None:
            break
    raise SceneError(reasons)


def _range(scene: Scene, base: float) -> tuple[float, float]:
    """Least and greatest place on the linkage's path in all periods to be tried."""
    if cycle(scene.motion) is None:
        most = base if len(scene.all_drives) < 2 else (MOST_TURNS + 1) * base
    else:
        most = (MOST_TURNS + 1) * base if isinstance(scene.motion, ConstantSpeed) else base
    tau = path_parameter(scene, np.linspace(0.0, most, 64 * (1 + round(most / base))))[0]
    return min(0.0, float(tau.min())), max(0.0, float(tau.max()))


def _never(scene: Scene, asked: str) -> Iterator[str]:
    """Faults of drives and loads without a period."""
    where = f"must have a period with {asked}"
    for name, drive in scene.all_drives.items():
        if not isinstance(drive.motion, MotionCurve) and cycle(drive.motion) is None:
            yield f"the drive of joint {name!r}: {where}, got {drive.motion.kind!r} without return_time"
    for name, curve in curves(scene):
        if curve.over == "time" and curve.period is None and not is_constant(curve):
            yield f"{name}: {where}, got a table over time without one: give it its period"


def _open(scene: Scene, along: Path, time: float, asked: str) -> Iterator[str]:
    """Reasons why the linkage has not returned after a time."""
    gone = float(np.ptp(path_parameter(scene, np.array([0.0, time]))[0]))
    laws = {name: drive.motion for name, drive in scene.all_drives.items()}
    for name, motion in laws.items():
        if isinstance(motion, MotionCurve):
            yield from _open_curve(name, motion, time)
    returned = along.periodic and _whole(gone, along.period)
    if not returned and any(_gone(motion, time) for motion in laws.values() if not isinstance(motion, MotionCurve)):
        yield (f"{asked}: must be of a linkage that returns, got one that is elsewhere after {time:.6g} s")
    for name, curve in curves(scene):
        if curve.over == "time" and not is_constant(curve) and curve.period and not _whole(time, curve.period):
            yield f"{name}.period: must be a part of the motion's period, got {curve.period:.6g} s"
    for name, factor in factors(scene):
        if factor.over == "time" or is_constant(factor) or not gone:
            continue
        if factor.period is None:
            yield f"{name}.period: is required with {asked} and a drive that rotates continuously, got nothing"
        elif not _whole(gone, factor.period):
            angle = factor.over == "angle"
            got = f"{math.degrees(factor.period):.6g} deg" if angle else f"{factor.period:.6g} m"
            yield f"{name}.period: must be a part of the motion's period, got {got}"


def _gone(motion: MotionLaw, time: float) -> bool:
    """Whether a drive has not returned after a time."""
    angle = drive_angle(motion, np.linspace(0.0, time, 65))[0]
    return bool(abs(angle[-1] - angle[0]) > SAME * np.ptp(angle))


def _open_curve(name: str, motion: MotionCurve, time: float) -> Iterator[str]:
    """Faults of a curve of motion that does not end as it begins."""
    angle, rate, _ = drive_angle(motion, np.linspace(0.0, time, 65))
    for what, over in (("angle or travel", angle), ("speed", rate)):
        if abs(over[-1] - over[0]) > SAME * np.ptp(over):
            yield (
                f"the drive of joint {name!r}: must end the period with the {what} with which it begins, got "
                f"{over[0]:.6g} and {over[-1]:.6g}"
            )


def _whole(x: float, of: float) -> bool:
    """Whether a number is a whole multiple of another."""
    count = x / of
    return round(count) != 0 and abs(count - round(count)) < WHOLE * max(1.0, abs(count))
