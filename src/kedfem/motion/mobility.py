"""What a linkage can do, holds twice, and comes close to: in words that name links and joints."""

from dataclasses import dataclass, replace

import numpy as np

from kedfem.arrays import Float
from kedfem.motion.dead_point import DeadPoint, nearest_dead_point
from kedfem.motion.linkage import Linkage, drawn_linkage, looser_rows
from kedfem.motion.path import Path
from kedfem.motion.redundancy import Redundant, redundancy, redundant, remedy
from kedfem.motion.released_motions import RANK_TOLERANCE, Drawn, FreeMotion, free_motions, rank
from kedfem.scene import Scene, plane_scene

PLANE = "the plane"
ACROSS = np.array([2, 3, 4])  # columns of a link that leave the xy plane: v_z, ω_x, ω_y


@dataclass(frozen=True, slots=True)
class Mobility:
    """Degrees of freedom of a linkage in the reference position, and what is amiss with them.

    freedom : motions that the joints leave, drives free
    drives : how many of them are driven
    equations, redundancy : of the joints, and how many of these others imply
    redundant : what they hold redundantly, by joints
    remedy : how to do without; empty where nothing is redundant
    free : motions that drives release
    dead_point : nearest over the drive's range; None where nothing is driven, or no loop is closed that could lock
    plane : whether all is counted in the plane alone, as planar links know no other motion
    """

    freedom: int
    drives: int
    equations: int
    redundancy: int
    redundant: tuple[Redundant, ...]
    remedy: str
    free: tuple[FreeMotion, ...]
    dead_point: DeadPoint | None
    plane: bool


def mobility(scene: Scene, link: Linkage, along: Path) -> Mobility:
    """Degrees of freedom, redundant equations, free motions and the nearest dead point of a linkage."""
    drawn = drawn_linkage(scene)
    looser = looser_rows(scene, drawn)
    if plane := plane_scene(scene):
        looser = {key: _in_plane(rows) for key, rows in looser.items()}
        drawn = planar(drawn)
    joined = ~drawn.of(PLANE) & ~drawn.driven
    count, loops = redundancy(drawn), len(scene.joints) - len(scene.links)
    return Mobility(
        freedom=drawn.J.shape[1] - rank(drawn.J[~drawn.driven]), drives=int(drawn.driven.sum()),
        equations=int(joined.sum()), redundancy=count, redundant=tuple(redundant(drawn)) if count else (),
        remedy=remedy(drawn, looser) if count else "", free=tuple(free_motions(drawn)),
        dead_point=nearest_dead_point(scene, link, along) if loops and drawn.driven.any() else None, plane=plane,
    )  # fmt: skip


def free_motion_count(scene: Scene, link: Linkage) -> int:
    """Free motions that the drives leave; of a plane scene in its plane alone, and all others if it has none there."""
    if not link.mobility or not plane_scene(scene):
        return link.mobility
    drawn = planar(drawn_linkage(scene))
    return drawn.J.shape[1] - rank(drawn.J) or link.mobility


def planar(drawn: Drawn) -> Drawn:
    """A linkage whose links the xy plane holds: of each joint and drive what is left of its rows there."""
    keys = list(zip(drawn.rows, drawn.driven.tolist(), strict=True))
    rows = {key: _in_plane(drawn.J[[each == key for each in keys]]) for key in dict.fromkeys(keys)}
    held = np.eye(drawn.J.shape[1]).reshape(len(drawn.links), 6, -1)[:, ACROSS].reshape(-1, drawn.J.shape[1])
    names = [name for (name, _), J in rows.items() for _ in J] + [PLANE] * len(held)
    driven = [moves for (_, moves), J in rows.items() for _ in J] + [False] * len(held)
    return replace(drawn, J=np.concatenate([*rows.values(), held]), rows=tuple(names), driven=np.array(driven, bool))


def _in_plane(rows: Float[np.ndarray, "m k"]) -> Float[np.ndarray, "n k"]:
    """Independent equations that the rows of one joint are between motions in the plane."""
    left = rows.copy().reshape(len(rows), -1, 6)
    left[:, :, ACROSS] = 0.0
    _, s, Vt = np.linalg.svd(left.reshape(rows.shape), full_matrices=False)
    return np.asarray(Vt[s > RANK_TOLERANCE * s.max(initial=0.0)])
