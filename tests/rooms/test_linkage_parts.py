"""Parts of a linkage: their ranks add up to that of all its constraints; chains have no closed ones, loops do."""

from pathlib import Path

import numpy as np
import pytest
from benchmarks.links import TOPOLOGIES

from kedfem.motion.linkage import linkage, resting_poses
from kedfem.motion.parts import parts
from kedfem.motion.released_motions import rank
from kedfem.motion.values import features, jacobian
from kedfem.scene import Scene, read_scene, scene_from

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*/scene.toml"))


def ranks(scene: Scene) -> tuple[int, int, int]:
    """Of all constraints at once, summed over the parts, and the number of parts with closed loops."""
    of = linkage(scene)
    rest = resting_poses(len(of.bodies))
    f = features(of.rows, rest, np.zeros((1, len(of.rows.angles))))
    whole = rank(jacobian(of.rows, f, len(of.bodies), of.size)[0])
    found = list(parts(of.rows, of.joints, len(of.bodies)))
    assert sum(part.freedoms for part in found) == 6 * (len(of.bodies) - 1)
    return whole, sum(part.rank(rest, of.size) for part in found), sum(part.closed for part in found)


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.parent.name)
def test_ranks_of_the_parts_of_examples_add_up(path: Path) -> None:
    whole, parted, _ = ranks(read_scene(path))
    assert whole == parted


@pytest.mark.parametrize(
    ("topology", "held", "closed"),
    [("pendulum, no drive", 105, 0), ("one drive, loops in a row", 126, 1), ("a drive on each four-bar", 126, 7)],
)
def test_ranks_and_loops_of_many_links(topology: str, held: int, closed: int) -> None:
    """Loops in a row share links; four-bars side by side share the ground alone."""
    assert ranks(scene_from(TOPOLOGIES[topology](21))) == (held, held, closed)
