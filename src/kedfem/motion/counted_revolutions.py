"""Angles unwrapped from one time point to the next, as laws over an angle need beyond half a revolution."""

from collections.abc import Iterator

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import MotionError
from kedfem.motion.constraints import perpendiculars
from kedfem.motion.coordinates import rotation_about
from kedfem.motion.joint_equations import coordinate_axis, ordered
from kedfem.motion.linkage import Linkage
from kedfem.motion.path import Path, place_on
from kedfem.scene import AngleLimit, Scene, TorsionSpring, corotational, path_parameter, time_grid

MOST = 0.9 * np.pi  # between two time points [rad]: less than half a revolution, with a margin for elastic motion


def require_counted(scene: Scene, link: Linkage, along: Path) -> None:
    """Refuse time points between which a joint rotates so far that its revolutions cannot be counted for laws.

    Raises
    ------
    MotionError
    """
    if link.drive is None:
        return
    counting = sorted(set(_counting(scene)), key=str)
    grid = time_grid(scene)
    tau = path_parameter(scene, grid.step * np.arange(grid.steps + 1 if counting else 1))[0]
    faults = []
    for where, joint, about in counting:
        most = float(np.abs(np.diff(angle_along(scene, link, along, joint, tau, about))).max(initial=0.0))
        if most > MOST:
            faults.append(
                f"{where}: joint {joint!r} must rotate by less than {np.degrees(MOST):.0f} deg between time points, so "
                f"that its revolutions can be counted, got {np.degrees(most):.4g} deg: take {most / MOST:.2g} "
                "times as many"
            )
    if faults:
        raise MotionError("\n".join(faults))


def _counting(scene: Scene) -> Iterator[tuple[str, str, str | None]]:
    """Place in the scene, joint, and link about whose axis, of angles whose revolutions are counted: for laws, and with
    co-rotational frames for gears and screws."""
    for name, spring in scene.springs.items():
        if isinstance(spring, TorsionSpring):
            yield f"springs.{name}", spring.joint, spring.about
    for name, motor in scene.motors.items():
        if motor.torque is not None:
            yield f"motors.{name}", motor.joint, motor.about
    for name, limit in scene.limits.items():
        if isinstance(limit, AngleLimit):
            yield f"limits.{name}", limit.joint, limit.about
    if corotational(scene):
        for name, gear in scene.gears.items():
            turning = (joint for joint, turns in zip(gear.joints, gear.turning, strict=True) if turns)
            yield from ((f"gears.{name}", joint, None) for joint in turning)
        yield from ((f"joints.{name}", name, None) for name, joint in scene.joints.items() if joint.kind == "screw")


def angle_along(
    scene: Scene, link: Linkage, along: Path, name: str, tau: Float[np.ndarray, " T"], about: str | None = None
) -> Float[np.ndarray, " T"]:
    """Angle of a joint about its axis at places of the path, unwrapped from the reference position [rad].

    Parameters
    ----------
    about : of a universal joint, the link about whose axis it is
    """
    joint = scene.joints[name]
    one, other = ordered(joint, about)
    i, j, b = link.bodies.index(one), link.bodies.index(other), coordinate_axis(joint, about)
    a = perpendiculars(b)[0] if about is None else coordinate_axis(joint, one)
    turn = np.unwrap(rotation_about(along.R[:, i], along.R[:, j], b, a))
    turn -= 2 * np.pi * np.round(turn[np.abs(along.phi).argmin()] / (2 * np.pi))
    k, s, turns = place_on(along, tau)
    there = np.minimum(k + 1, len(turn) - 1)
    return np.asarray(turn[k] + s * (turn[there] - turn[k]) + turns * (turn[-1] - turn[0]))
