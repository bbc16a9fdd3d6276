"""Initial velocities of all bodies of a linkage without a drive, from the speeds that the scene gives."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg

from kedfem.arrays import Float
from kedfem.errors import MotionError
from kedfem.motion.constraints import GAP, stacked
from kedfem.motion.joint_equations import coordinate_row, joint_free_rows
from kedfem.motion.linkage import Linkage
from kedfem.motion.newton import cross_matrix
from kedfem.motion.path import Path
from kedfem.motion.released_motions import RANK_TOLERANCE
from kedfem.motion.rigid import rigid_motion
from kedfem.motion.values import Poses, features, jacobian
from kedfem.scene import Scene, path_parameter
from kedfem.vectors import cross

TURNING = {"revolute", "screw"}  # joints whose speed is a rotation, of the others it is along the axis
REACHED = 1e-6  # of the fastest speed: tolerance of requested speeds
AXES = "xyz"


@dataclass(frozen=True, slots=True)
class RequestedSpeed:
    """One requested speed of a scene.

    where, unit : for messages
    row : (6 B,) its row on the twists (v, ω) of all bodies, ground first, v at the linkage's centre
    value : [m/s or rad/s]
    rigid : its value in the rigid-body motion
    """

    where: str
    unit: str
    row: Float[np.ndarray, " k"]
    value: float
    rigid: float = 0.0

    @property
    def more(self) -> float:
        """Difference from the rigid-body motion."""
        return self.value - self.rigid


def initial_twists(
    scene: Scene, linkage: Linkage, along: Path
) -> tuple[Float[np.ndarray, "B 3"], Float[np.ndarray, "B 3"]]:
    """Velocities to add to those of the rigid-body motion at the start, for the requested speeds.

    They are compatible with all joints, the drive held. Among these, joints without a requested speed have the least
    speeds, in the sum of squares (slides per size of the linkage), and then bodies.

    Returns
    -------
    v, omega : (B, 3) each [m/s, rad/s]
        Velocity of the reference origin, as in `RigidMotion`, and angular velocity; ground first.

    Raises
    ------
    MotionError
        If the joints do not allow these speeds: with the requested speeds and the closest possible ones.
    """
    bodies, size, given = len(linkage.bodies), linkage.size, scene.analysis.initial_speeds
    twists = np.zeros((bodies, 6))
    if not (given or scene.analysis.initial_motions):
        return twists[:, :3], twists[:, 3:]
    t = np.zeros(1)
    motion = rigid_motion(linkage, along, t, path_parameter(scene, t))
    arm = motion.R @ linkage.centre
    poses = motion.R, motion.p - linkage.centre + arm
    rigid = np.concatenate([motion.v + cross(motion.omega, arm), motion.omega], axis=2).ravel()
    asked = [replace(each, rigid=float(each.row @ rigid)) for each in _wanted(scene, linkage, poses)]
    if any(each.more for each in asked):
        column = np.tile([size, size, size, 1.0, 1.0, 1.0], bodies - 1)
        A, b = np.array([each.row[6:] * column for each in asked]), np.array([each.more for each in asked])
        sizes = np.linalg.norm(A, axis=1)
        free = _allowed(linkage, poses)
        other = [row for name, joint in scene.joints.items() for row in joint_free_rows(scene, name, linkage.bodies)
                 if name not in given or (row.kind != GAP and joint.kind not in TURNING)]  # fmt: skip
        loose = stacked(other)
        C = jacobian(loose, features(loose, poses), bodies, size)[0]
        q = free @ _least(A / sizes[:, None] @ free, b / sizes, C @ free)
        _check_reached(asked, A @ q, size)
        twists[1:] = (q * column).reshape(-1, 6)
    v, omega = twists[:, :3], twists[:, 3:]
    return v - cross(omega, motion.R[0] @ linkage.centre), np.array(omega)


def _least(
    A: Float[np.ndarray, "w f"], b: Float[np.ndarray, " w"], C: Float[np.ndarray, "c f"]
) -> Float[np.ndarray, " f"]:
    """x of least |A x − b|, of these of least |C x|, of these of least |x|; rows of A have length 1 or are rounding."""
    A = np.where(np.linalg.norm(A, axis=1, keepdims=True) > RANK_TOLERANCE, A, 0.0)
    x = scipy.linalg.lstsq(A, b, cond=RANK_TOLERANCE)[0]
    Z = scipy.linalg.null_space(A, rcond=RANK_TOLERANCE)
    if Z.shape[1] and len(C):
        # relative to C: where C x cannot change, C Z is rounding
        U, s, Vt = np.linalg.svd(C @ Z, full_matrices=False)
        determined = s > RANK_TOLERANCE * np.linalg.norm(C, 2)
        x = x - Z @ (Vt[determined].T @ ((U[:, determined].T @ (C @ x)) / s[determined]))
    return np.asarray(x)


def _allowed(linkage: Linkage, poses: Poses) -> Float[np.ndarray, "k f"]:
    """Orthonormal basis of the scaled twists that all joints allow in a position with the drive held."""
    bodies = len(linkage.bodies)
    held = len(linkage.joints) - (linkage.mobility if linkage.drive else 0)
    if not held:
        return np.eye(6 * (bodies - 1))
    J = jacobian(linkage.rows, features(linkage.rows, poses), bodies, linkage.size)[0]
    return np.asarray(scipy.linalg.null_space(J[:held], rcond=RANK_TOLERANCE))


def _wanted(scene: Scene, linkage: Linkage, poses: Poses) -> Iterator[RequestedSpeed]:
    """All requested speeds of a scene, of joints and of links in their poses at the start."""
    bodies = len(linkage.bodies)
    for name, value in scene.analysis.initial_speeds.items():
        turns = scene.joints[name].kind in TURNING
        row = stacked([coordinate_row(scene, name, linkage.bodies, turns)])
        rates = np.append(np.zeros(6), jacobian(row, features(row, poses), bodies)[0, 0])
        yield RequestedSpeed(f"analysis.initial_speeds.{name}", "rad/s" if turns else "m/s", rates, value)
    for name, motion in scene.analysis.initial_motions.items():
        k = linkage.bodies.index(name)
        turn = -cross_matrix(poses[0][0, k] @ (np.asarray(motion.at) - linkage.centre))
        for key, blocks, vector, unit in (
            ("velocity", (np.eye(3), turn), motion.velocity, "m/s"),
            ("angular_velocity", (np.zeros((3, 3)), np.eye(3)), motion.angular_velocity, "rad/s"),
        ):
            for c, value in enumerate(vector or ()):
                rates = np.zeros((bodies, 2, 3))
                rates[k] = blocks[0][c], blocks[1][c]
                where = f"analysis.initial_motions.{name}.{key} along {AXES[c]}"
                yield RequestedSpeed(where, unit, rates.ravel(), value)


def _check_reached(asked: list[RequestedSpeed], got: Float[np.ndarray, " w"], size: float) -> None:
    """Raise an error for speeds that the joints do not allow together; of rotations at an arm of the linkage's size.

    Parameters
    ----------
    got : speeds added to the rigid-body motion
    """
    arms = np.array([1.0 if each.unit == "m/s" else size for each in asked])
    more, values = np.array([each.more for each in asked]), np.array([[each.value, each.rigid] for each in asked])
    if (np.abs(more - got) * arms <= REACHED * np.abs(values * arms[:, None]).max()).all():
        return
    lines = []
    for each, x in zip(asked, (got + values[:, 1]).tolist(), strict=True):
        if each.value or abs(x) > REACHED:
            closest = f"(closest possible {round(x, 9) + 0.0:.6g})"
            lines.append(f"{each.where} = {each.value:.6g} {each.unit} {closest}")
    wanted = "the joints must allow the speeds at the start together"
    raise MotionError(f"analysis: {wanted}, got {', '.join(lines)}")
