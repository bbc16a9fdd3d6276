"""Geometric stiffening of links with rigid-body frames beside links with co-rotational ones, which know it themselves."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from kedfem.accuracy.prepared import meshed
from kedfem.dynamics.modes.stiffened import frozen_linkage
from kedfem.dynamics.rigid_body import forcings
from kedfem.dynamics.stiffening import stiffening
from kedfem.dynamics.system.steps import scene_system
from kedfem.errors import SceneError
from kedfem.motion.rigid import rigid_motion
from kedfem.scene import path_parameter, scene_from
from tests.cells import Cell, apart, run_of, scene_of
from tests.moving import turned
from tests.systems import begun

Raw = dict[str, Any]
TURNS = {"z": np.eye(3), "x": np.eye(3)[[2, 0, 1]], "oblique": Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix()}
#: joint, kinds of its links, whether the crank is the co-rotational one, turn
MIXED = [
    ("revolute", "planar beams", False, "z"), ("revolute", "planar beams", True, "z"),
    ("prismatic", "plane links", True, "z"), ("slot", "planar beams", False, "z"),
    ("revolute", "beams in space", False, "z"), ("prismatic", "beams in space", True, "x"),
    ("cylindrical", "beams in space", False, "oblique"), ("universal", "beams in space", True, "oblique"),
    ("prismatic", "solids", False, "x"), ("revolute", "solids", True, "oblique"), ("slot", "solids", False, "z"),
]  # fmt: skip


def mixed(joint: str, links: str, crank: bool, law: str = "loads", turn: str = "z") -> Raw:
    """A fast chain with stiffening, one of its links with co-rotational frames."""
    raw = scene_of(Cell(joint, "stiffening", True, links, law))
    raw["drive"]["motion"]["speed"] = 30.0  # so that stresses change displacements by 1e-5 and more
    raw["links"]["crank" if crank else next(x for x in raw["links"] if x != "crank")]["frames"] = "co-rotational"
    return turned(raw, TURNS[turn]) if turn != "z" else raw


@pytest.mark.long
@pytest.mark.parametrize(("joint", "links", "crank", "turn"), MIXED)
def test_stiffened_links_beside_co_rotational_ones_move_as_by_the_oracle(
    joint: str, links: str, crank: bool, turn: str
) -> None:
    raw = mixed(joint, links, crank, turn=turn)
    of = begun(raw)
    found, wanted = run_of(of), run_of(of, monolithic=True)
    assert apart(found, wanted) < 1e-8
    plain = run_of(begun({**raw, "analysis": {**raw["analysis"], "stiffening": False}}))
    assert apart(plain, found) > 3e-6


def stresses(raw: Raw, link: str) -> np.ndarray:
    """Stress stiffness of a link at some times, (T, n, n)."""
    ready = meshed(scene_from(raw))
    t = np.linspace(0.0, 3e-3, 3)
    motion = rigid_motion(ready.linkage, ready.path, t, path_parameter(ready.scene, t))
    found = stiffening(ready.model)
    k = [each.name for each in ready.model.links].index(link)
    modes, s = found.modes[k], found.over(forcings(ready.model, motion), motion)[k]
    return np.array(
        [np.asarray(each.toarray() if hasattr(each, "toarray") else each) for each in map(modes.stiffness, s)]
    )


@pytest.mark.parametrize("law", ["loads", "loads that turn"])
@pytest.mark.parametrize("links", ["planar beams", "beams in space"])
def test_stresses_are_those_that_all_links_with_rigid_body_frames_have(links: str, law: str) -> None:
    """Of the rigid-body motion, with which loads turn: one on a co-rotational link stresses the crank either way."""
    raw = mixed("revolute", links, crank=False, law=law)
    other = next(x for x in raw["links"] if x != "crank")
    raw["loads"]["f"] |= {"link": other, "vector": [1e3, 2e3, 0]}
    found = stresses(raw, "crank")
    del raw["links"][other]["frames"]
    wanted = stresses(raw, "crank")
    assert_allclose(found, wanted, rtol=0, atol=1e-7 * np.abs(wanted).max())


def test_frequencies_refuse_stiffening_beside_co_rotational_links() -> None:
    """Which feel that they turn, and would have no tension beside it."""
    ready = meshed(scene_from(mixed("revolute", "planar beams", crank=True)))
    with pytest.raises(
        SceneError, match=r"rigid-body frames of all links for frequencies .* co-rotational ones of crank"
    ):
        frozen_linkage(ready.scene, scene_system(ready.scene, ready.model), ready.linkage, ready.path, 2, free=False)
