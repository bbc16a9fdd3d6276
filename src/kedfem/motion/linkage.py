"""The linkage as rigid bodies and constraint equations; its mobility and redundancy in the reference position.

With co-rotational frames motions may be free. In the rigid-body motion the joints with free motions stay in the
reference position while the drive moves the rest; without a drive the linkage is at rest.
"""

from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np
import scipy.linalg

from kedfem.arrays import Float
from kedfem.errors import MotionError, SceneError
from kedfem.motion.blocks import Blocks, blocks
from kedfem.motion.constraints import GAP, ConstraintEquation, Rows, stacked, travel_row, turn_row
from kedfem.motion.drives import Drives, drives
from kedfem.motion.joint_equations import (
    GROUND,
    body_names,
    coordinate_row,
    cross_row,
    driven_row,
    joint_free_rows,
    joint_points,
    plane_rows,
    rows_of,
    scene_centre,
    undriven_rows,
)
from kedfem.motion.parts import parts
from kedfem.motion.redundancy import LOOSER, Looser, would_move
from kedfem.motion.released_motions import RANK_TOLERANCE, Reference, free_motions, listed, null_space, planar, rank, span
from kedfem.motion.released_motions import remedy as held_by
from kedfem.motion.values import Poses, features, jacobian
from kedfem.scene import Scene, corotational_links, driven_travel, plane_scene

# by so much less counts each further joint motion, so that rounding chooses none that is to be held
FIRST = 1e-6
MANY = 12  # bodies up to which the rows are solved as one matrix: about as fast then, and in the least squares of QR


@dataclass(frozen=True, slots=True)
class Linkage:
    """Bodies (ground first) and all rows of joints, couplings and drives; also those that hold free motions.

    bodies : names
    rows : as arrays
    joints : for each row the joint's name, or that of the coupling as `gears.NAME`
    size : characteristic length, makes rows and columns comparable [m]
    centre : of the joints, and reference point of all poses, so that the scene may lie far from the origin [m]
    drives : what is driven
    mobility : free motions that the drives leave, of a plane scene in its plane; as many rows, the last ones, hold these
    blocks : how rows are solved entry by entry, of linkages of many bodies
    """

    bodies: tuple[str, ...]
    rows: Rows
    joints: tuple[str, ...]
    size: float
    centre: Float[np.ndarray, "3"]
    drives: Drives
    mobility: int = 0
    blocks: Blocks | None = None

    @property
    def drive(self) -> str | None:
        """Name of the first driven joint; None where nothing is driven."""
        return self.drives.joints[0] if self.drives else None

    @property
    def redundant(self) -> tuple[str, ...]:
        """Joints whose rows repeat what others already hold in the reference position, by rank-revealing QR of Jᵀ."""
        if not self.joints:
            return ()
        J = resting_jacobian(self.rows, len(self.bodies), self.size)
        _, r, pivot = scipy.linalg.qr(J.T, pivoting=True, mode="economic")
        rank = int((np.abs(np.diag(r)) > RANK_TOLERANCE * abs(r[0, 0])).sum())
        return tuple(sorted({self.joints[k] for k in pivot[rank:]}))


def linkage(scene: Scene) -> Linkage:
    """Rows of all joints and of the drive, with mobility checked in the reference position.

    Raises
    ------
    SceneError
        A record that was made beside `scene_from`, so that its tables have not been checked against each other.
    MotionError
        If a driven linkage cannot move, has a dead point in the reference position, or keeps a free motion of links with
        rigid-body frames.
    """
    if not scene.checked:
        wanted = "must be made by scene_from or read_scene"
        raise SceneError(f"the scene: {wanted}, got a record that has not been checked")
    if any(joint.open for joint in scene.joints.values()):
        raise ValueError("a scene whose links are apart in the reference position must be assembled first")
    rows, driven = _all_rows(scene)
    bodies, size, every = body_names(scene), scene_size(scene), stacked(rows)
    several = blocks(every, len(bodies), size) if driven and len(bodies) > MANY else None
    free = 0
    if not driven:
        rest, held = resting_poses(len(bodies)), rows + (plane_rows(bodies) if plane_scene(scene) else [])
        every_part = parts(stacked(held), [row.joint for row in held], len(bodies))
        free = 6 * (len(bodies) - 1) - sum(part.rank(rest, size) for part in every_part)
    elif several is None or not _well_driven(every, several, size):
        reference = reference_linkage(scene, rows)
        if plane_scene(scene):
            across = _across(reference, bodies)
            rows = rows + across
            reference = planar(reference_linkage(scene, rows) if across else reference)
        free = _check_mobility(scene, reference)
        rows = rows + _holding(scene, reference, free)
        every = stacked(rows)
        several = several and blocks(every, len(bodies), size)
    joints = tuple(row.joint for row in rows)
    return Linkage(bodies, every, joints, size, scene_centre(scene), driven, free, several)


def _well_driven(rows: Rows, plan: Blocks, size: float) -> bool:
    """Whether joints and drives hold every motion at first, and each drive can move alone: nothing is to be refused.

    J has the rank of its columns, and its least squares leave nothing of the rates at which one drive moves.
    """
    values = plan.values(rows, features(rows, resting_poses(plan.count + 1)), size)
    greatest, least = plan.extremes(values)[0]
    if least <= RANK_TOLERANCE * greatest:
        return False
    driven = np.flatnonzero(rows.drive >= 0)
    rates = np.zeros((1, rows.count, len(driven)))
    rates[0, driven, np.arange(len(driven))] = 1.0
    return float(np.abs(plan.left(values, rates)).max()) <= RANK_TOLERANCE


def _all_rows(scene: Scene) -> tuple[list[ConstraintEquation], Drives]:
    """All rows of joints, couplings and drives, and these."""
    driven, bodies = drives(scene, scene_size(scene)), body_names(scene)
    driving = [replace(driven_row(scene, name, bodies), drive=k) for k, name in enumerate(scene.all_drives)]
    return undriven_rows(scene) + driving, driven


def reference_linkage(scene: Scene, rows: list[ConstraintEquation] | None = None) -> Reference:
    """A scene's linkage to first order in the reference position, with all its rows unless given; nothing is refused."""
    bodies, size, rows = body_names(scene), scene_size(scene), rows or _all_rows(scene)[0]
    J, names = reference_jacobian(rows, len(bodies), size), tuple(row.joint for row in rows)
    moves = np.array([row.drive is not None for row in rows], bool)
    return Reference(J, names, moves, bodies[1:], scene.joints, scene_centre(scene), size)


def looser_rows(scene: Scene, reference: Reference) -> Looser:
    """Rows that joints would have if they were of a kind that constrains less; driven joints are left as they are."""
    bodies = (GROUND, *reference.links)
    out = {}
    every = sorted(scene.joints.items(), key=lambda each: GROUND in each[1].links)  # bearings stay, if they can
    for name, joint in every:
        for kind in LOOSER.get(joint.kind, ()) if name not in scene.driven_joints else ():
            rows = rows_of(scene, name, bodies, reference.centre, kind)
            out[name, kind] = reference_jacobian(rows, len(bodies), reference.size)
    return out


def resting_poses(bodies: int) -> Poses:
    """All bodies in the reference position, at one time point."""
    return np.tile(np.eye(3), (1, bodies, 1, 1)), np.zeros((1, bodies, 3))


def scene_size(scene: Scene) -> float:
    """Characteristic length [m]: from joint to joint, the farthest; the same however the scene is turned."""
    points = joint_points(scene)
    return float(max((np.linalg.norm(points - point, axis=1).max() for point in points), default=0.0)) or 1.0


def reference_jacobian(rows: list[ConstraintEquation], bodies: int, size: float) -> Float[np.ndarray, "m k"]:
    """Row derivatives in the reference position, lengths divided by `size`."""
    return resting_jacobian(stacked(rows), bodies, size)


def resting_jacobian(rows: Rows, bodies: int, size: float) -> Float[np.ndarray, "m k"]:
    """The same of rows that are arrays already."""
    return np.asarray(jacobian(rows, features(rows, resting_poses(bodies)), bodies, size)[0])


def _check_mobility(scene: Scene, reference: Reference) -> int:
    """How many motions the drive releases; they must be of links with co-rotational frames."""
    k, drives = int(reference.J.shape[1]), int(reference.driven.sum())
    free, mobility = k - rank(reference.J), k - rank(reference.J[~reference.driven])
    driven = ", ".join(f"joints.{name}" for name in scene.driven_joints)
    if mobility == 0:
        moves = would_move(reference, looser_rows(scene, reference))
        raise MotionError(
            f"{driven}: its drive must be able to move the linkage, got a structure without any mobility "
            f"({f'it would move {moves}' if moves else 'the joints constrain every link'}; "
            "is an axis askew, or one joint too many?)"
        )
    if mobility < drives:
        wanted = f"there must be no more drives than the linkage's mobility, {mobility}"
        raise MotionError(f"{driven}: {wanted}, got {drives}")
    if free == 0:
        return 0
    if mobility == drives:
        at = _at_reference(scene)
        other = listed(_other_drives(scene, reference), "or")
        raise MotionError(
            f"{driven}: the linkage locks (dead point) at {at}the reference position: "
            f"give it at another angle or drive {f'joint {other}' if other else 'another joint'}"
        )
    motions = free_motions(reference)
    if corotational_links(scene).issuperset(link for each in motions for link in each.links):
        return free
    words = "; ".join(each.words for each in motions)
    remedies = ["; ".join(held_by(each) for each in motions), 'let these links have frames = "co-rotational"']
    if scene.springs or scene.motors:
        remedies = [f"{remedies[1]}, if springs or motors constrain them", remedies[0]]
    raise MotionError(
        "joints: every motion must be constrained or driven, got free motion left at "
        f"{_at_reference(scene)}the reference position: "
        f"{words}; free motions: {free} (remedy: {'; or '.join(remedies)})"
    )


def _at_reference(scene: Scene) -> str:
    """The reference position of the only drive in words; empty without a drive and with several."""
    if len(scene.all_drives) != 1:
        return ""
    (name,) = scene.all_drives
    return "drive travel 0 mm, " if driven_travel(scene, name) else "drive angle 0 deg, "


def _other_drives(scene: Scene, reference: Reference) -> list[str]:
    """Joints whose drive could move the linkage from its reference position."""
    bodies = (GROUND, *reference.links)
    out = []
    for name, joint in scene.joints.items():
        if joint.kind in {"revolute", "prismatic"} and name not in scene.driven_joints:
            row = reference_jacobian(
                [coordinate_row(scene, name, bodies, joint.kind == "revolute")], len(bodies), reference.size
            )
            if rank(np.concatenate([reference.J[~reference.driven], row])) == reference.J.shape[1]:
                out.append(name)
    return out


def _across(reference: Reference, bodies: tuple[str, ...]) -> list[ConstraintEquation]:
    """Rows that hold the motions that only leave the plane of a plane scene: its links know none of them."""
    released = null_space(reference.J)
    if not released.shape[1]:
        return []
    inside = null_space(planar(reference).J)
    across = span(released - inside @ (inside.T @ released))
    return _most_changed(plane_rows(bodies), across, len(bodies), reference.size)


def _holding(scene: Scene, reference: Reference, free: int) -> list[ConstraintEquation]:
    """Rows that hold as many joint motions as are free in the reference position, of driven joints the last.

    Of a driven joint they are those of its motions that its drives leave.
    """
    if not free:
        return []
    bodies, motions = (GROUND, *reference.links), scipy.linalg.svd(reference.J)[2][-free:].T
    rows = []
    for name in sorted(scene.joints, key=lambda name: name in scene.driven_joints):
        across = [drive.about for drive in scene.driven_joints.get(name, ()) if drive.about is not None]
        every = _free_rows(scene, name, bodies, reference.size, motions)
        rows += [cross_row(scene.joints[name], name, bodies, about) for about in across] or every
    return _most_changed(rows, motions, len(bodies), reference.size)


def _most_changed(
    rows: list[ConstraintEquation], motions: Float[np.ndarray, "k n"], bodies: int, size: float
) -> list[ConstraintEquation]:
    """As many rows as there are motions: those that these change most, of equal ones the first."""
    if not motions.shape[1]:
        return []
    change = reference_jacobian(rows, bodies, size) @ motions
    first = 1 - FIRST * np.arange(len(rows))
    _, _, order = scipy.linalg.qr((first[:, None] * change).T, pivoting=True, mode="economic")
    return [rows[k] for k in order[: motions.shape[1]]]


def _free_rows(
    scene: Scene, name: str, bodies: tuple[str, ...], size: float, motions: np.ndarray
) -> list[ConstraintEquation]:
    """Rows of what a joint releases, along and about directions that these motions have, not the axes of the world."""
    out = []
    for kind, group in groupby(joint_free_rows(scene, name, bodies), key=lambda row: row.kind):
        rows = list(group)
        if len(rows) > 1:
            change = reference_jacobian(rows, len(bodies), size) @ motions
            along = np.array([row.b if kind == GAP else np.cross(row.a, row.b) for row in rows])
            U = np.linalg.svd(along.T @ change)[0]
            i, j, a, kept = rows[0].i, rows[0].j, rows[0].a, U.T[: len(rows)]
            gap = kind == GAP
            rows = [travel_row(name, i, j, a, d) if gap else turn_row(name, i, j, d) for d in kept]
        out += rows
    return out
