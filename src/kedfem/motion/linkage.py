"""The linkage as rigid bodies and constraint rows; its mobility and redundancy in the drawn position.

Where frames follow the links, motions may be left free. Nominally joints that bear them are held as drawn while the drive
moves the rest; without a drive everything nominally rests.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from jaxtyping import Float

from kedfem.errors import MotionError
from kedfem.motion.rows import Row, Rows, drive_row, features, free_rows, jacobian, joint_rows, stacked
from kedfem.scene import Joint, Scene, following_links

GROUND = "ground"
RANK_TOLERANCE = 1e-6  # of the largest singular value: axes that far out of true count as parallel


@dataclass(frozen=True, slots=True)
class Linkage:
    """Bodies (ground first) and all rows of joints and drive; also those that hold free motions as drawn.

    bodies : names
    rows : as arrays
    joints : for each row the joint's name
    size : characteristic length, makes rows and columns comparable [m]
    centre : of the joints; poses are those of points drawn there, so that the scene may lie far from the origin [m]
    redundant : joints whose rows repeat what others already hold
    drive : name of the driven joint; None where nothing is driven
    mobility : free motions that the drive leaves; as many rows, the last ones, hold these
    """

    bodies: tuple[str, ...]
    rows: Rows
    joints: tuple[str, ...]
    size: float
    centre: Float[np.ndarray, "3"]
    redundant: tuple[str, ...]
    drive: str | None
    mobility: int = 0


def linkage(scene: Scene) -> Linkage:
    """Rows of all joints and of the drive, with mobility checked where the scene is drawn.

    Raises
    ------
    MotionError
        If a driven linkage cannot move, has a dead point as drawn, or keeps a free motion of links with nominal frames.
    """
    bodies = (GROUND, *scene.links)
    points, centre = joint_points(scene), scene_centre(scene)
    rows = [row for name in scene.joints for row in _rows_of(scene, name, bodies, centre)]
    driven = scene.driven
    if driven is not None:
        rows.append(drive_row(driven, *_pair(scene.joints[driven], bodies), joint_axis(scene.joints[driven])))
    size = (float(np.ptp(points, axis=0).max()) if len(points) else 0.0) or 1.0
    J = drawn_jacobian(rows, len(bodies), size)
    free = 0
    if driven is not None:
        free = _check_mobility(J, rows, bodies, driven, following_links(scene))
        held = _holding(scene, J, bodies, size, free)
        J, rows = np.concatenate([J, drawn_jacobian(held, len(bodies), size)]), rows + held
    else:
        free = J.shape[1] - _rank(J)
    names = tuple(row.joint for row in rows)
    return Linkage(bodies, stacked(rows), names, size, centre, _redundant(J, names), driven, free)


def _rank(J: Float[np.ndarray, "m k"]) -> int:
    """Number of independent rows."""
    s = scipy.linalg.svdvals(J) if len(J) else np.zeros(0)
    return int((s > RANK_TOLERANCE * s.max(initial=0.0)).sum())


def joint_points(scene: Scene) -> Float[np.ndarray, "j 3"]:
    """Places of all joints [m]."""
    return np.array([joint.at for joint in scene.joints.values()]).reshape(-1, 3)


def scene_centre(scene: Scene) -> Float[np.ndarray, "3"]:
    """The middle of all joints [m]; the origin where there are none."""
    points = joint_points(scene)
    return np.asarray(points.mean(axis=0)) if len(points) else np.zeros(3)


def unit(axis: tuple[float, float, float]) -> Float[np.ndarray, "3"]:
    """A direction made a unit vector."""
    return np.asarray(np.asarray(axis) / np.linalg.norm(axis))


def joint_axis(joint: Joint) -> Float[np.ndarray, "3"]:
    """Unit vector of a joint that has an axis: the scene gives one to hinges and asks sliding joints for theirs."""
    return unit(joint.axis or (0.0, 0.0, 1.0))


def _rows_of(scene: Scene, name: str, bodies: tuple[str, ...], centre: np.ndarray) -> list[Row]:
    joint = scene.joints[name]
    axis = None if joint.axis is None else unit(joint.axis)
    i, j = _pair(joint, bodies)
    axes = None
    if joint.axes is not None:
        first = bodies.index(joint.links[0]) == i
        one, other = (unit(each) for each in (joint.axes if first else joint.axes[::-1]))
        axes = (one, other)
    return joint_rows(joint.kind, name, i, j, np.asarray(joint.at) - centre, axis, axes)


def joint_free_rows(scene: Scene, name: str, bodies: tuple[str, ...]) -> list[Row]:
    """Rows of what a joint leaves free."""
    joint = scene.joints[name]
    axis, point = None if joint.axis is None else unit(joint.axis), np.asarray(joint.at) - scene_centre(scene)
    return free_rows(joint.kind, name, *_pair(joint, bodies), point, axis)


def _pair(joint: Joint, bodies: tuple[str, ...]) -> tuple[int, int]:
    """Numbers of a joint's bodies; the ground, where there is one, comes second: directions are fixed in it.

    Of a slot the link with the pin comes first: directions are fixed in the link with the line.
    """
    if joint.kind == "slot":
        return bodies.index(joint.links[0]), bodies.index(joint.links[1])
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


def _check_mobility(
    J: np.ndarray, rows: list[Row], bodies: tuple[str, ...], drive: str, following: frozenset[str]
) -> int:
    """How many motions the drive leaves free; they must be of links whose frames follow."""
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
        return 0
    if mobility == 1:
        raise MotionError(
            f"joints.{drive}: the linkage locks (dead point) at drive angle 0 deg, the drawn position: "
            "draw it at another angle or drive another joint"
        )
    null = Vt[rank:].reshape(-1, len(bodies) - 1, 6)
    if following.issuperset(_moving(null, bodies[1:])):
        return len(null)
    raise MotionError(
        "joints: every motion must be held or driven, got free motion left at drive angle 0 deg: "
        f'{_free_motion(null, bodies[1:])} (with analysis.frames = "following" they may)'
    )


def _holding(scene: Scene, J: np.ndarray, bodies: tuple[str, ...], size: float, free: int) -> list[Row]:
    """Rows that hold, as drawn, as many motions of joints as are free: those that these motions change most."""
    if not free:
        return []
    rows = [
        row for name in scene.joints if name != scene.driven for row in joint_free_rows(scene, name, bodies)
    ]
    _, _, Vt = scipy.linalg.svd(J)
    change = drawn_jacobian(rows, len(bodies), size) @ Vt[-free:].T
    _, _, order = scipy.linalg.qr(change.T, pivoting=True, mode="economic")
    return [rows[k] for k in order[:free]]


def _moving(null: np.ndarray, links: tuple[str, ...]) -> list[str]:
    """The links that take part in free motions."""
    norm = np.linalg.norm(null, axis=2).max(axis=0)
    return [name for name, x in zip(links, norm, strict=True) if x > 1e-6]


def _free_motion(null: np.ndarray, links: tuple[str, ...]) -> str:
    """Free motions in words: which links can still turn or slide, and how."""
    norm, moving = np.linalg.norm(null, axis=2).max(axis=0), _moving(null, links)
    most = int(norm.argmax())
    v, omega = null[np.linalg.norm(null[:, most], axis=1).argmax(), most].reshape(2, 3)
    verb = "turn about" if np.linalg.norm(omega) > 1e-6 else "slide along"
    d = omega if verb == "turn about" else v
    d = d / np.linalg.norm(d) * np.sign(d[np.abs(d).argmax()])
    direction = "(" + ", ".join(f"{x + 0.0:.3g}" for x in np.round(d, 6)) + ")"
    return f"link '{links[most]}' can {verb} {direction}; links that move: {', '.join(moving)}; free motions: {len(null)}"


def _redundant(J: np.ndarray, names: tuple[str, ...]) -> tuple[str, ...]:
    """Joints that own the dependent rows, by rank-revealing QR of Jᵀ."""
    if not names:
        return ()
    _, r, pivot = scipy.linalg.qr(J.T, pivoting=True, mode="economic")
    rank = int((np.abs(np.diag(r)) > RANK_TOLERANCE * abs(r[0, 0])).sum())
    return tuple(sorted({names[k] for k in pivot[rank:]}))
