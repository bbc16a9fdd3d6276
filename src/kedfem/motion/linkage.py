"""The linkage as rigid bodies and constraint equations; its mobility and redundancy in the reference position.

With co-rotational frames motions may be free. In the rigid-body motion joints with free motions are locked in the
reference position while the drive moves the others; without a drive the linkage is at rest.
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
from kedfem.motion.redundancy import ALTERNATIVES, AlternativeRows, mobilising_change
from kedfem.motion.released_motions import (
    RANK_TOLERANCE,
    LinearLinkage,
    free_motions,
    listed,
    null_space,
    planar,
    rank,
    span,
)  # fmt: skip
from kedfem.motion.released_motions import remedy as held_by
from kedfem.motion.values import Poses, features, jacobian
from kedfem.scene import Scene, corotational_links, driven_travel, plane_scene

# relative weight by which later joint motions count less, so that rounding does not choose the locked ones
FIRST = 1e-6
MANY = 12  # bodies up to which the rows are solved as one dense matrix, which is about as fast, and by QR


@dataclass(frozen=True, slots=True)
class Linkage:
    """Bodies (ground first) and all rows of joints, couplings and drives, and those that lock free motions.

    bodies : names
    rows : as arrays
    joints : for each row the joint's name, or that of the coupling as `gears.NAME`
    size : characteristic length by which rows and columns are scaled [m]
    centre : mean of the joints, the reference point of all poses, as the scene may lie far from the origin [m]
    drives : its drives
    mobility : number of free motions with drives held, of a plane scene in its plane, locked by as many last rows
    blocks : sparse solution of the rows, of linkages of many bodies
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
        """Joints with redundant rows in the reference position, by rank-revealing QR of Jᵀ."""
        if not self.joints:
            return ()
        J = reference_jacobian(self.rows, len(self.bodies), self.size)
        _, r, pivot = scipy.linalg.qr(J.T, pivoting=True, mode="economic")
        rank = int((np.abs(np.diag(r)) > RANK_TOLERANCE * abs(r[0, 0])).sum())
        return tuple(sorted({self.joints[k] for k in pivot[rank:]}))


def linkage(scene: Scene) -> Linkage:
    """Rows of all joints and of the drive, with mobility checked in the reference position.

    Raises
    ------
    SceneError
        A record that was not made by `scene_from`, whose tables have not been checked against each other.
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
        reference = linearised_linkage(scene, rows)
        if plane_scene(scene):
            across = _across(reference, bodies)
            rows = rows + across
            reference = planar(linearised_linkage(scene, rows) if across else reference)
        free = _check_mobility(scene, reference)
        rows = rows + _holding(scene, reference, free)
        every = stacked(rows)
        several = several and blocks(every, len(bodies), size)
    return Linkage(bodies, every, tuple(row.joint for row in rows), size, scene_centre(scene), driven, free, several)


def _well_driven(rows: Rows, plan: Blocks, size: float) -> bool:
    """Whether joints and drives constrain every motion in the reference position, and each drive can move alone.

    J has full column rank, and its least squares have no residual for the rate of a single drive.
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
    """All rows of joints, couplings and drives, and the drives."""
    driven, bodies = drives(scene, scene_size(scene)), body_names(scene)
    driving = [replace(driven_row(scene, name, bodies), drive=k) for k, name in enumerate(scene.all_drives)]
    return undriven_rows(scene) + driving, driven


def linearised_linkage(scene: Scene, rows: list[ConstraintEquation] | None = None) -> LinearLinkage:
    """A scene's linkage linearised in the reference position, by all its rows if none are given; nothing is refused."""
    bodies, size, rows = body_names(scene), scene_size(scene), rows or _all_rows(scene)[0]
    J, names = reference_jacobian(rows, len(bodies), size), tuple(row.joint for row in rows)
    moves = np.array([row.drive is not None for row in rows], bool)
    return LinearLinkage(J, names, moves, bodies[1:], scene.joints, scene_centre(scene), size)


def alternative_rows(scene: Scene, reference: LinearLinkage) -> AlternativeRows:
    """Rows of joints if they were of another kind that constrains less; not of driven joints."""
    bodies = (GROUND, *reference.links)
    out = {}
    every = sorted(scene.joints.items(), key=lambda each: GROUND in each[1].links)  # those of the ground last
    for name, joint in every:
        for kind in ALTERNATIVES.get(joint.kind, ()) if name not in scene.driven_joints else ():
            rows = rows_of(scene, name, bodies, reference.centre, kind)
            out[name, kind] = reference_jacobian(rows, len(bodies), reference.size)
    return out


def resting_poses(bodies: int) -> Poses:
    """All bodies in the reference position, at one time point."""
    return np.tile(np.eye(3), (1, bodies, 1, 1)), np.zeros((1, bodies, 3))


def scene_size(scene: Scene) -> float:
    """Characteristic length [m]: the largest distance of two joints, the same in a rotated scene."""
    points = joint_points(scene)
    return float(max((np.linalg.norm(points - point, axis=1).max() for point in points), default=0.0)) or 1.0


def reference_jacobian(rows: list[ConstraintEquation] | Rows, bodies: int, size: float) -> Float[np.ndarray, "m k"]:
    """Derivatives of rows in the reference position, lengths divided by `size`."""
    every = rows if isinstance(rows, Rows) else stacked(rows)
    return np.asarray(jacobian(every, features(every, resting_poses(bodies)), bodies, size)[0])


def _check_mobility(scene: Scene, reference: LinearLinkage) -> int:
    """Number of free motions with drives held, which must be of links with co-rotational frames."""
    k, drives = int(reference.J.shape[1]), int(reference.driven.sum())
    free, mobility = k - rank(reference.J), k - rank(reference.J[~reference.driven])
    driven = ", ".join(f"joints.{name}" for name in scene.driven_joints)
    if mobility == 0:
        moves = mobilising_change(reference, alternative_rows(scene, reference))
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


def _other_drives(scene: Scene, reference: LinearLinkage) -> list[str]:
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


def _across(reference: LinearLinkage, bodies: tuple[str, ...]) -> list[ConstraintEquation]:
    """Rows that lock out-of-plane motions of a plane scene, whose links have none."""
    released = null_space(reference.J)
    if not released.shape[1]:
        return []
    inside = null_space(planar(reference).J)
    across = span(released - inside @ (inside.T @ released))
    return _most_changed(plane_rows(bodies), across, len(bodies), reference.size)


def _holding(scene: Scene, reference: LinearLinkage, free: int) -> list[ConstraintEquation]:
    """Rows that lock as many joint motions as are free in the reference position, those of driven joints last.

    Of a driven joint they are of the motions that its drives do not prescribe.
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
    """As many rows as there are motions, those with the largest changes in these, of equal ones the first."""
    if not motions.shape[1]:
        return []
    change = reference_jacobian(rows, bodies, size) @ motions
    first = 1 - FIRST * np.arange(len(rows))
    _, _, order = scipy.linalg.qr((first[:, None] * change).T, pivoting=True, mode="economic")
    return [rows[k] for k in order[: motions.shape[1]]]


def _free_rows(
    scene: Scene, name: str, bodies: tuple[str, ...], size: float, motions: np.ndarray
) -> list[ConstraintEquation]:
    """Rows of what a joint releases, along and about the directions of these motions instead of the world's axes."""
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
