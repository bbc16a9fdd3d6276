"""Mobility of a linkage in words: free motions, redundant equations and dead points, by names of links and joints."""

from dataclasses import dataclass

from kedfem.motion.dead_point import DeadPoint, nearest_dead_point
from kedfem.motion.joint_equations import PLANE
from kedfem.motion.linkage import Linkage, alternative_rows, linearised_linkage
from kedfem.motion.path import Path
from kedfem.motion.redundancy import Redundant, redundancy, redundant, remedy
from kedfem.motion.released_motions import FreeMotion, free_motions, in_plane, planar, rank
from kedfem.scene import Scene, plane_scene


@dataclass(frozen=True, slots=True)
class Mobility:
    """Degrees of freedom of a linkage in the reference position, with redundant constraints and free motions.

    freedom : degrees of freedom, drives released
    drives : number of driven coordinates
    equations, redundancy : number of the joints' equations, and of redundant ones among them
    redundant : redundant constraints, by joints
    remedy : how to avoid them; empty where there are none
    free : free motions with drives held
    dead_point : nearest over the drive's range; None without a drive, or without a closed loop
    plane : whether all is counted in the plane, as the links are planar
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
    reference = linearised_linkage(scene)
    alternatives = alternative_rows(scene, reference)
    if plane := plane_scene(scene):
        alternatives = {key: in_plane(rows) for key, rows in alternatives.items()}
        reference = planar(reference)
    joined = ~reference.of(PLANE) & ~reference.driven
    count, loops = redundancy(reference), len(scene.joints) - len(scene.links)
    return Mobility(
        freedom=reference.J.shape[1] - rank(reference.J[~reference.driven]), drives=int(reference.driven.sum()),
        equations=int(joined.sum()), redundancy=count, redundant=tuple(redundant(reference)) if count else (),
        remedy=remedy(reference, alternatives) if count else "", free=tuple(free_motions(reference)),
        dead_point=nearest_dead_point(scene, link, along) if loops and reference.driven.any() else None, plane=plane,
    )  # fmt: skip
