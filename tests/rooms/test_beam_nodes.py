"""Where a beam has nodes: at every joint on its axis, whatever the elements, the kind of joint and the direction."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kedfem.links.build import bare_link
from kedfem.scene import scene_from
from kedfem.scene.checks.capabilities import KINDS
from tests.partners import joint

TURNS = {
    "x": np.eye(3), "y": np.roll(np.eye(3), 1, axis=0), "z": np.roll(np.eye(3), 2, axis=0),
    "oblique": Rotation.from_rotvec([0.4, -0.9, 0.6]).as_matrix(),
}  # fmt: skip
BETWEEN = 0.37  # m, of 0.5: where no node of one, two, three or five elements is


def pair(kind: str, R: np.ndarray, elements: int | None) -> dict[str, Any]:
    """A beam on the ground, and another that a joint of a kind holds beside its middle."""

    def at(*x: float) -> list[float]:
        return [float(y) for y in R @ np.array(x)]

    middle = at(BETWEEN, 0, 0)
    bars = {"arm": (at(0, 0, 0), at(0.5, 0, 0)), "block": (middle, at(BETWEEN, 0.2, 0))}
    links: dict[str, Any] = {
        name: {"model": "beam", "beam": "spatial", "material": "steel",
               "shape": {"kind": "bar", "between": list(ends), "width": 0.02, "thickness": 0.01}}
        for name, ends in bars.items()
    }  # fmt: skip
    if elements is not None:
        links["arm"]["mesh"] = {"elements": elements}
    axis = R @ np.array([1.0, 0.0, 0.0])
    held = {
        "A": {"kind": "revolute", "links": ["ground", "arm"], "at": at(0, 0, 0), "axis": at(0, 0, 1)},
        "J": joint(kind, ("block", "arm"), middle, axis),
    }
    drive = {"joint": "A", "motion": {"kind": "constant_speed", "speed": 1.0}}
    return {"links": links, "joints": held, "drive": drive, "analysis": {"end_time": 0.01, "step": 1e-3}}


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("kind", KINDS)
def test_a_beam_has_a_node_at_a_joint_between_its_ends(kind: str, turn: str) -> None:
    R = TURNS[turn]
    for elements in (None, 1, 3):
        nodes = bare_link(scene_from(pair(kind, R, elements)), "arm").nodes
        nearest = np.linalg.norm(nodes - R @ [BETWEEN, 0, 0], axis=1).min()
        if kind == "slot":  # its pin is anywhere along the beam
            assert nearest > 1e-3
        else:
            assert nearest < 1e-12


def test_nodes_stay_where_they_are_if_one_is_at_the_joint() -> None:
    raw = pair("prismatic", np.eye(3), 5)
    raw["links"]["arm"]["shape"]["between"][1] = [0.74, 0.0, 0.0]
    raw["links"]["arm"]["mesh"] = {"elements": 2}
    nodes = bare_link(scene_from(raw), "arm").nodes
    np.testing.assert_allclose(np.unique(nodes[:, 0].round(9)), np.linspace(0, 0.74, len(nodes)), atol=1e-9)
