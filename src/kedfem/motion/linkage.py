"""The linkage as rigid bodies and constraint rows; its mobility and redundancy in the drawn position."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from jaxtyping import Float

from kedfem.errors import MotionError
from kedfem.motion.rows import Row, Rows, drive_row, features, jacobian, joint_rows, stacked
from kedfem.scene import Joint, Scene

GROUND = "ground"
RANK_TOLERANCE = 1e-6  # of the largest singular value: axes that far out of true count as parallel


@dataclass(frozen=True, slots=True)
class Linkage:
    """Bodies (ground first) and all rows of joints and drive.

    bodies : names
    rows : as arrays
    joints : for each row the joint's name
    size : characteristic length, makes rows and columns comparable [m]
    centre : of the joints; poses are those of points drawn there, so that the scene may lie far from the origin [m]
    redundant : joints whose rows repeat what others already hold
    drive : name of the driven joint
    """

    bodies: tuple[str, ...]
    rows: Rows
    joints: tuple[str, ...]
    size: float
    centre: Float[np.ndarray, "3"]
    redundant: tuple[str, ...]
    drive: str


def linkage(scene: Scene) -> Linkage:
    """Rows of all joints and of the drive, with mobility checked where the scene is drawn.

    Raises
    ------
    MotionError
        If the linkage cannot move, has a dead point as drawn, or keeps a free motion.
    """
    bodies = (GROUND, *scene.links)
    points = np.array([joint.at for joint in scene.joints.values()])
    centre = points.mean(axis=0)
    rows = [row for name in scene.joints for row in _rows_of(scene, name, bodies, centre)]
    driven = scene.drive.joint
    rows.append(drive_row(driven, *_pair(scene.joints[driven], bodies), joint_axis(scene.joints[driven])))
    size = float(np.ptp(points, axis=0).max()) or 1.0
    J = drawn_jacobian(rows, len(bodies), size)
    _check_mobility(J, rows, bodies, driven)
    names = tuple(row.joint for row in rows)
    return Linkage(bodies, stacked(rows), names, size, centre, _redundant(J, names), driven)


def unit(axis: tuple[float, float, float]) -> Float[np.ndarray, "3"]:
    """A direction made a unit vector."""
    return np.asarray(np.asarray(axis) / np.linalg.norm(axis))


def joint_axis(joint: Joint) -> Float[np.ndarray, "3"]:
    """Unit vector of a joint that has an axis: the scene gives one to hinges and asks sliding joints for theirs."""
    return unit(joint.axis or (0.0, 0.0, 1.0))


def _rows_of(scene: Scene, name: str, bodies: tuple[str, ...], centre: np.ndarray) -> list[Row]:
    joint = scene.joints[name]
    i, j = _pair(joint, bodies)
    axis = None if joint.axis is None else unit(joint.axis)
    return joint_rows(joint.kind, name, i, j, np.asarray(joint.at) - centre, axis)


def _pair(joint: Joint, bodies: tuple[str, ...]) -> tuple[int, int]:
    """Numbers of a joint's bodies; the ground, where there is one, comes second: directions are fixed in it."""
    i, j = sorted((bodies.index(link) for link in joint.links), reverse=True)
    return i, j


def drawn_jacobian(rows: list[Row], bodies: int, size: float) -> Float[np.ndarray, "m k"]:
    """Row derivatives in the drawn position, lengths divided by `size`."""
    arrays = stacked(rows)
    poses = (np.tile(np.eye(3), (1, bodies, 1, 1)), np.zeros((1, bodies, 3)))
    f = features(arrays, poses, np.zeros(1))
    return scaled(jacobian(arrays, f, bodies)[0], arrays, size)


def scaled(J: Float[np.ndarray, "... m k"], rows: Rows, size: float) -> Float[np.ndarray, "... m k"]:
    """J with gap rows and rotation columns in units of `size`: entries of order one."""
    row = np.where(rows.kind == 0, 1 / size, 1.0)[:, None]
    column = np.tile([size, size, size, 1.0, 1.0, 1.0], J.shape[-1] // 6)
    return np.asarray(J * row * column)


def _check_mobility(J: np.ndarray, rows: list[Row], bodies: tuple[str, ...], drive: str) -> None:
    _, s, Vt = scipy.linalg.svd(J)
    rank = int((s > RANK_TOLERANCE * s[0]).sum())
    without = J[[row.b_drive is None for row in rows]]
    mobility = J.shape[1] - int(np.linalg.matrix_rank(without, tol=RANK_TOLERANCE * s[0]))
    if mobility == 0:
        raise MotionError(
            f"joints.{drive}: its drive must be able to move the linkage, got a structure without any mobility "
            "(the joints hold every link; is an axis askew, or one joint too many?)"
        )
    if rank == J.shape[1]:
        return
    if mobility == 1:
        raise MotionError(
            f"joints.{drive}: the linkage locks (dead point) at drive angle 0 deg, the drawn position: "
            "draw it at another angle or drive another joint"
        )
    motion = _free_motion(Vt[rank:].reshape(-1, len(bodies) - 1, 6), bodies[1:])
    raise MotionError(
        f"joints: every motion must be held or driven, got free motion left at drive angle 0 deg: {motion}"
    )


def _free_motion(null: np.ndarray, links: tuple[str, ...]) -> str:
    """Free motions in words: which links can still turn or slide, and how."""
    norm = np.linalg.norm(null, axis=2).max(axis=0)
    moving = [name for name, x in zip(links, norm, strict=True) if x > 1e-6]
    most = int(norm.argmax())
    v, omega = null[np.linalg.norm(null[:, most], axis=1).argmax(), most].reshape(2, 3)
    verb = "turn about" if np.linalg.norm(omega) > 1e-6 else "slide along"
    d = omega if verb == "turn about" else v
    d = d / np.linalg.norm(d) * np.sign(d[np.abs(d).argmax()])
    direction = "(" + ", ".join(f"{x + 0.0:.3g}" for x in np.round(d, 6)) + ")"
    return f"link '{links[most]}' can {verb} {direction}; links that move: {', '.join(moving)}; free motions: {len(null)}"


def _redundant(J: np.ndarray, names: tuple[str, ...]) -> tuple[str, ...]:
    """Joints that own the dependent rows, by rank-revealing QR of Jᵀ."""
    _, r, pivot = scipy.linalg.qr(J.T, pivoting=True, mode="economic")
    rank = int((np.abs(np.diag(r)) > RANK_TOLERANCE * abs(r[0, 0])).sum())
    return tuple(sorted({names[k] for k in pivot[rank:]}))
