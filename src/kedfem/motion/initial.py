"""Velocities of all bodies where a linkage starts to move by itself, from speeds that the scene asks for."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from kedfem.arrays import Float
from kedfem.errors import MotionError
from kedfem.motion.constraints import ANGLE, cross
from kedfem.motion.joint_equations import joint_axis, joint_free_rows, moving_pair
from kedfem.motion.linkage import Linkage, reference_jacobian, resting_jacobian
from kedfem.motion.newton import cross_matrix
from kedfem.motion.released_motions import RANK_TOLERANCE
from kedfem.scene import Scene

TURNING = {"revolute", "screw"}  # joints whose speed is a rotation, of the others it is along the axis
REACHED = 1e-6  # of the fastest speed: velocities that far off are not what was asked for
AXES = "xyz"


@dataclass(frozen=True, slots=True)
class Wanted:
    """One speed that a scene asks for.

    where, unit : for messages
    row : (6 B,) its row on the twists (v, ω) of all bodies, ground first, v at the linkage's centre
    value : [m/s or rad/s]
    """

    where: str
    unit: str
    row: Float[np.ndarray, " k"]
    value: float


def initial_twists(scene: Scene, linkage: Linkage) -> tuple[Float[np.ndarray, "B 3"], Float[np.ndarray, "B 3"]]:
    """Velocities that all joints allow, with the speeds asked for, the drive held: they add to the rigid-body velocities.

    What these leave open: joints that are not named move as little against each other as can be, in the sum of squares
    (slides per size of the linkage); after that bodies as little as can be.

    Returns
    -------
    v, omega : (B, 3) each [m/s, rad/s]
        Velocity of the point that is drawn at the origin, as in `RigidMotion`, and rotational speed; ground first.

    Raises
    ------
    MotionError
        If the joints do not allow these speeds: naming them, with what was asked for and the closest that is possible.
    """
    bodies, size = len(linkage.bodies), linkage.size
    asked = list(_wanted(scene, linkage))
    twists = np.zeros((bodies, 6))
    if any(each.value for each in asked):
        column = np.tile([size, size, size, 1.0, 1.0, 1.0], bodies - 1)
        A, b = np.array([each.row[6:] * column for each in asked]), np.array([each.value for each in asked])
        sizes = np.linalg.norm(A, axis=1)
        free = _allowed(linkage)
        given = scene.analysis.initial_speeds
        other = [row for name, joint in scene.joints.items() for row in joint_free_rows(scene, name, linkage.bodies)
                 if name not in given or (row.kind == ANGLE and joint.kind not in TURNING)]  # fmt: skip
        q = free @ _least(A / sizes[:, None] @ free, b / sizes, reference_jacobian(other, bodies, size) @ free)
        _check_reached(asked, A @ q, size)
        twists[1:] = (q * column).reshape(-1, 6)
    v, omega = twists[:, :3], twists[:, 3:]
    return v - cross(omega, np.broadcast_to(linkage.centre, omega.shape)), np.array(omega)


def _least(
    A: Float[np.ndarray, "w f"], b: Float[np.ndarray, " w"], C: Float[np.ndarray, "c f"]
) -> Float[np.ndarray, " f"]:
    """x nearest to A x = b, of these the least |C x|, of these the least |x|; rows of A are near 1 or as good as zero."""
    A = np.where(np.linalg.norm(A, axis=1, keepdims=True) > RANK_TOLERANCE, A, 0.0)
    x = scipy.linalg.lstsq(A, b, cond=RANK_TOLERANCE)[0]
    Z = scipy.linalg.null_space(A, rcond=RANK_TOLERANCE)
    if Z.shape[1] and len(C):
        # of the size of C: where x leaves C x no way to change, C Z is rounding, and its own size shows nothing
        U, s, Vt = np.linalg.svd(C @ Z, full_matrices=False)
        determined = s > RANK_TOLERANCE * np.linalg.norm(C, 2)
        x = x - Z @ (Vt[determined].T @ ((U[:, determined].T @ (C @ x)) / s[determined]))
    return np.asarray(x)


def _allowed(linkage: Linkage) -> Float[np.ndarray, "k f"]:
    """Orthonormal basis of the scaled twists that all joints allow at first, the drive held but nothing else."""
    bodies = len(linkage.bodies)
    held = len(linkage.joints) - (linkage.mobility if linkage.drive else 0)
    if not held:
        return np.eye(6 * (bodies - 1))
    J = resting_jacobian(linkage.rows, bodies, linkage.size)
    return np.asarray(scipy.linalg.null_space(J[:held], rcond=RANK_TOLERANCE))


def _wanted(scene: Scene, linkage: Linkage) -> Iterator[Wanted]:
    for name, value in scene.analysis.initial_speeds.items():
        joint = scene.joints[name]
        moving, other = moving_pair(joint)
        i, j = linkage.bodies.index(moving), linkage.bodies.index(other)
        row, axis = np.zeros((len(linkage.bodies), 2, 3)), joint_axis(joint)
        if joint.kind in TURNING:
            row[i, 1], row[j, 1] = axis, -axis
        else:
            arm = cross(np.asarray(joint.at) - linkage.centre, axis)
            row[i], row[j] = (axis, arm), (-axis, -arm)
        unit = "rad/s" if joint.kind in TURNING else "m/s"
        yield Wanted(f"analysis.initial_speeds.{name}", unit, row.ravel(), value)
    for name, motion in scene.analysis.initial_motions.items():
        k = linkage.bodies.index(name)
        turn = -cross_matrix(np.asarray(motion.at) - linkage.centre)
        for key, blocks, vector, unit in (
            ("velocity", (np.eye(3), turn), motion.velocity, "m/s"),
            ("angular_velocity", (np.zeros((3, 3)), np.eye(3)), motion.angular_velocity, "rad/s"),
        ):
            for c, value in enumerate(vector or ()):
                row = np.zeros((len(linkage.bodies), 2, 3))
                row[k] = blocks[0][c], blocks[1][c]
                where = f"analysis.initial_motions.{name}.{key} along {AXES[c]}"
                yield Wanted(where, unit, row.ravel(), value)


def _check_reached(asked: list[Wanted], got: Float[np.ndarray, " w"], size: float) -> None:
    """Raise an error for speeds that the joints do not allow together; of rotations at an arm of the linkage's size."""
    arms = np.array([1.0 if each.unit == "m/s" else size for each in asked])
    values = np.array([each.value for each in asked])
    if (np.abs(values - got) * arms <= REACHED * np.abs(values * arms).max()).all():
        return
    lines = []
    for each, x in zip(asked, got.tolist(), strict=True):
        if each.value or abs(x) > REACHED:
            closest = f"(closest possible {round(x, 9) + 0.0:.6g})"
            lines.append(f"{each.where} = {each.value:.6g} {each.unit} {closest}")
    wanted = "the joints must allow the speeds at the start together"
    raise MotionError(f"analysis: {wanted}, got {', '.join(lines)}")
