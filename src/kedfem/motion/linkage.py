"""The linkage as rigid bodies and constraint rows; its mobility and redundancy in the drawn position.

Where frames follow the links, motions may be left free. Nominally joints that bear them are held as drawn while the drive
moves the rest; without a drive everything nominally rests.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from jaxtyping import Float

from kedfem.errors import MotionError
from kedfem.motion.freedom import RANK_TOLERANCE, Drawn, free_motions, listed, rank
from kedfem.motion.freedom import remedy as held_by
from kedfem.motion.redundancy import LOOSER, Looser, would_move
from kedfem.motion.rows import Row, Rows, drive_row, features, free_rows, jacobian, joint_rows, stacked
from kedfem.scene import Joint, Scene, following_links

GROUND = "ground"


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
    rows, drawn = _drawn(scene)
    J, bodies, size = drawn.J, (GROUND, *drawn.links), drawn.size
    free = 0
    if scene.driven is not None:
        free = _check_mobility(scene, drawn)
        held = _holding(scene, J, bodies, size, free)
        J, rows = np.concatenate([J, drawn_jacobian(held, len(bodies), size)]), rows + held
    else:
        free = J.shape[1] - rank(J)
    names = tuple(row.joint for row in rows)
    return Linkage(bodies, stacked(rows), names, size, drawn.centre, _redundant(J, names), scene.driven, free)


def _drawn(scene: Scene) -> tuple[list[Row], Drawn]:
    """All rows of joints and drive, and their derivatives as drawn."""
    bodies = (GROUND, *scene.links)
    points, centre = joint_points(scene), scene_centre(scene)
    rows = [row for name in scene.joints for row in _rows_of(scene.joints[name], name, bodies, centre)]
    joints = len(rows)
    rows += [_drive_row(scene, name, bodies) for name in scene.driven_joints]
    size = (float(np.ptp(points, axis=0).max()) if len(points) else 0.0) or 1.0
    J = drawn_jacobian(rows, len(bodies), size)
    names, driven = tuple(row.joint for row in rows), np.arange(len(rows)) >= joints
    return rows, Drawn(J, names, driven, bodies[1:], scene.joints, centre, size)


def drawn_linkage(scene: Scene) -> Drawn:
    """A scene's linkage to first order as drawn; nothing is refused."""
    return _drawn(scene)[1]


def looser_rows(scene: Scene, drawn: Drawn) -> Looser:
    """Rows that joints would have if they were of a kind that holds less; driven joints are left as they are."""
    bodies = (GROUND, *drawn.links)
    out = {}
    for name, joint in sorted(
        scene.joints.items(), key=lambda each: GROUND in each[1].links
    ):  # bearings stay, if they can
        for kind in LOOSER.get(joint.kind, ()) if name not in scene.driven_joints else ():
            rows = _rows_of(joint.model_copy(update={"kind": kind}), name, bodies, drawn.centre)
            out[name, kind] = drawn_jacobian(rows, len(bodies), drawn.size)
    return out


def _drive_row(scene: Scene, name: str, bodies: tuple[str, ...]) -> Row:
    joint = scene.joints[name]
    return drive_row(name, *_pair(joint, bodies), joint_axis(joint))


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


def _rows_of(joint: Joint, name: str, bodies: tuple[str, ...], centre: np.ndarray) -> list[Row]:
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


def _check_mobility(scene: Scene, drawn: Drawn) -> int:
    """How many motions the drive leaves free; they must be of links whose frames follow."""
    k, drives = int(drawn.J.shape[1]), int(drawn.driven.sum())
    free, mobility = k - rank(drawn.J), k - rank(drawn.J[~drawn.driven])
    driven = ", ".join(f"joints.{name}" for name in scene.driven_joints)
    if mobility == 0:
        moves = would_move(drawn, looser_rows(scene, drawn))
        raise MotionError(
            f"{driven}: its drive must be able to move the linkage, got a structure without any mobility "
            f"({f'it would move {moves}' if moves else 'the joints hold every link'}; "
            "is an axis askew, or one joint too many?)"
        )
    if free == 0:
        return 0
    if mobility == drives:
        other = listed(_other_drives(scene, drawn), "or")
        raise MotionError(
            f"{driven}: the linkage locks (dead point) at drive angle 0 deg, the drawn position: "
            f"draw it at another angle or drive {f'joint {other}' if other else 'another joint'}"
        )
    motions = free_motions(drawn)
    if following_links(scene).issuperset(link for each in motions for link in each.links):
        return free
    words = "; ".join(each.words for each in motions)
    raise MotionError(
        "joints: every motion must be held or driven, got free motion left at drive angle 0 deg: "
        f"{words}; free motions: {free} (remedy: {'; '.join(held_by(each) for each in motions)}; "
        'or let these links have frames = "following")'
    )


def _other_drives(scene: Scene, drawn: Drawn) -> list[str]:
    """Hinges on the ground that could drive the linkage from where it is drawn."""
    bodies = (GROUND, *drawn.links)
    out = []
    for name, joint in scene.joints.items():
        if joint.kind == "revolute" and GROUND in joint.links and name not in scene.driven_joints:
            row = drawn_jacobian([_drive_row(scene, name, bodies)], len(bodies), drawn.size)
            if rank(np.concatenate([drawn.J[~drawn.driven], row])) == drawn.J.shape[1]:
                out.append(name)
    return out


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


def _redundant(J: np.ndarray, names: tuple[str, ...]) -> tuple[str, ...]:
    """Joints that own the dependent rows, by rank-revealing QR of Jᵀ."""
    if not names:
        return ()
    _, r, pivot = scipy.linalg.qr(J.T, pivoting=True, mode="economic")
    rank = int((np.abs(np.diag(r)) > RANK_TOLERANCE * abs(r[0, 0])).sum())
    return tuple(sorted({names[k] for k in pivot[rank:]}))
