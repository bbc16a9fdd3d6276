"""The rigid-body motion of all links as a table, for multibody programs, animation and controllers."""

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from kedfem.arrays import Float
from kedfem.motion.linkage import Linkage
from kedfem.motion.rigid import RigidMotion
from kedfem.results.recorded import drive_channel
from kedfem.results.table import DIGITS, drive_heading, text_file
from kedfem.scene import Scene

QUANTITIES = (
    ("position", "xyz", "m"), ("orientation", "wxyz", "-"), ("velocity", "xyz", "m/s"),
    ("angular_velocity", "xyz", "rad/s"), ("acceleration", "xyz", "m/s^2"),
    ("angular_acceleration", "xyz", "rad/s^2"),
)  # fmt: skip
"""Quantities of each link, in world components."""


def write_motion(path: Path, scene: Scene, linkage: Linkage, blocks: Iterable[RigidMotion]) -> int:
    """Write the motion of all links as comma-separated values, a row for each time point; returns their number.

    Parameters
    ----------
    blocks : the motion, in consecutive parts of the time
    """
    names = ["time [s]", drive_heading(drive_channel(scene)), *_columns(list(scene.links))]
    last: dict[int, Float[np.ndarray, "4"]] = {}
    count = 0
    with text_file(path) as file:
        csv.writer(file, lineterminator="\n").writerow(names)
        for motion in blocks:
            rows = [motion.t[:, None], motion.phi[:, None]]
            for name in scene.links:
                body = linkage.bodies.index(name)
                q = continuous_quaternions(motion.R[:, body], last.get(body))
                last[body] = q[-1]
                rows += _rows(motion, body, reference_point(scene, name), q)
            np.savetxt(file, np.hstack(rows), fmt=DIGITS, delimiter=",")
            count += len(motion.t)
    return count


def reference_point(scene: Scene, name: str) -> Float[np.ndarray, "3"]:
    """Point of a link's first joint in the reference position; the origin for a link without joints [m]."""
    at = (joint.at for joint in scene.joints.values() if name in joint.links)
    return np.asarray(next(at, (0.0, 0.0, 0.0)), float)


def continuous_quaternions(
    R: Float[np.ndarray, "T 3 3"], before: Float[np.ndarray, "4"] | None = None
) -> Float[np.ndarray, "T 4"]:
    """Unit quaternions w, x, y, z of rotations, each with the sign that is nearer to the previous one.

    Parameters
    ----------
    before : quaternion of the time point before the first; without it the first has w ≥ 0
    """
    from scipy.spatial.transform import Rotation

    q = np.asarray(Rotation.from_matrix(R).as_quat(canonical=True))[:, [3, 0, 1, 2]]
    near = np.einsum("tk,tk->t", q, np.vstack([q[:1] if before is None else before, q[:-1]]))
    return q * np.cumprod(np.where(near < 0, -1.0, 1.0))[:, None]


def _columns(links: Sequence[str]) -> list[str]:
    every = [f"{quantity} {x} [{unit}]" for quantity, components, unit in QUANTITIES for x in components]
    return [f"links/{name}/{column}" for name in links for column in every]


def _rows(
    motion: RigidMotion, body: int, at: Float[np.ndarray, "3"], q: Float[np.ndarray, "T 4"]
) -> list[Float[np.ndarray, "T c"]]:
    """All quantities of a body, in the order of QUANTITIES."""
    velocity, acceleration = motion.velocity(body, at), motion.acceleration(body, at)
    turning = motion.omega[:, body], motion.alpha[:, body]
    return [motion.position(body, at), q, velocity, turning[0], acceleration, turning[1]]
