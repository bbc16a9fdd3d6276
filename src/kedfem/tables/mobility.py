"""What a check shows of the freedom of a linkage: mobility, redundancy, free motions, dead points."""

from collections.abc import Iterator

import numpy as np
from rich.table import Table

from kedfem.motion.dead_point import DeadPoint
from kedfem.motion.linkage import Linkage
from kedfem.motion.messages import place
from kedfem.motion.mobility import Mobility
from kedfem.motion.released_motions import of_joints
from kedfem.motion.released_motions import remedy as held_by
from kedfem.output.words import with_prefix
from kedfem.scene import Scene

CLOSE = np.radians(20.0)  # of a dead point: forces of three times the load and more
FAR = np.radians(30.0)  # estimates of joints from further away are rough


def mobility_table(scene: Scene, link: Linkage, found: Mobility) -> Table:
    """Degrees of freedom, what is held twice, what is not held, and the nearest dead point."""
    table = Table(title="Mobility (in the reference position)", show_header=False)
    driven = f"driven at {of_joints(tuple(scene.driven_joints))}" if found.drives else "none driven"
    table.add_row("degrees of freedom", f"{found.freedom}, {driven}")
    twice = f"{found.redundancy} of them redundant" if found.redundancy else "none redundant"
    table.add_row("joint equations", f"{found.equations}, {twice}")
    for each in found.redundant:
        table.add_row(f"held redundantly at {of_joints(each.joints)}", each.words)
    if found.redundancy:
        table.add_row("without these", found.remedy)
    if found.free:
        table.add_row("free motions", str(sum(motion.basis.shape[1] for motion in found.free)))
    for motion in found.free:
        table.add_row("free", motion.words)
        if found.drives:
            table.add_row("to hold it", held_by(motion))
    for row in _dead_point(link, found.dead_point):
        table.add_row(*row)
    return table


def _dead_point(link: Linkage, found: DeadPoint | None) -> Iterator[tuple[str, str]]:
    if found is None:
        return
    off = f"{np.degrees(FAR):.0f}° or more from it"
    if found.joint is not None and found.off < FAR:
        off = f"joint {found.joint} about {np.degrees(found.off):.2g}° from it"
    weakness = f"smallest singular value {found.weakness:.2g} of the largest"
    yield "closest to a dead point", f"at {place(link, found.tau, '.4g')}, {off} (estimated; {weakness})"
    if found.outside is not None:
        apart, near = _apart(link, abs(found.outside - found.tau)), place(link, found.outside, ".3g")
        yield "dead point outside the range", f"about {apart} from its end, near {near} (estimated)"
    if (found.joint is not None and found.off < CLOSE) or found.outside is not None:
        yield (
            "to keep away from it",
            "drive another joint, limit the drive, or let a flywheel carry the linkage through",
        )


def _apart(link: Linkage, x: float) -> str:
    """A length of the path in words."""
    if len(link.drives) != 1:
        return with_prefix(x, "s")
    return f"{np.degrees(x):.2g}°" if link.drives.turning[0] else with_prefix(x, "m")
