"""Rigid links bear what they pass on without giving way, however light they are and however long the step is."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.moving import bar, beam_in_space, channels, ran, turned

TURNS = {"x": (0, 0, 0), "y": (0, 0, 90), "oblique": (0, 0, 35), "z": (0, 90, 0), "askew": (20, 50, 70)}


def lifted(step: float, shapeless: bool) -> dict[str, Any]:
    """A lever with a ton at its end on a cylinder of two light rigid links, which a drive moves; 20 kN on 2.5 kg."""
    foot, rod = bar("rigid", (0.5, -0.4), (0.5, -0.2)), bar("rigid", (0.5, -0.2), (0.5, 0))
    if shapeless:
        given = {"model": "rigid", "mass": 2.5, "inertia": [8e-3, 4e-4, 8e-3, 0, 0, 0]}
        foot, rod = {**given, "centre": [0.5, -0.3, 0]}, {**given, "centre": [0.5, -0.1, 0]}
    lever = beam_in_space((0, 0, 0), (1, 0, 0), 2)
    lever["shape"] |= {
        "points": [[0, 0, 0], [0.5, 0, 0], [1, 0, 0]],
        "section": {"kind": "round", "diameter": 0.1},
    }
    if not shapeless:
        lever = bar("beam", (0, 0), (1, 0), 4)
        lever["shape"] |= {"width": 0.1, "thickness": 0.06}
    hinge = {"kind": "revolute", "axis": [0, 0, 1]}
    return {
        "gravity": [0, -9.81, 0],
        "links": {"lever": lever, "foot": foot, "rod": rod},
        "joints": {
            "A": {**hinge, "links": ["ground", "lever"], "at": [0, 0, 0]},
            "P": {**hinge, "links": ["ground", "foot"], "at": [0.5, -0.4, 0]},
            "Q": {**hinge, "links": ["lever", "rod"], "at": [0.5, 0, 0]},
            "C": {"kind": "prismatic", "links": ["rod", "foot"], "at": [0.5, -0.2, 0], "axis": [0, 1, 0]},
        },
        "bodies": {"m": {"kind": "point_mass", "link": "lever", "at": [1, 0, 0], "mass": 1000.0}},
        "drive": {"joint": "C", "motion": {"kind": "polynomial", "travel": 0.05, "rise": 1.0}},
        "damping": {"ratio": 0.02, "frequencies": [5, 200]},
        "analysis": {"end_time": 10 * step, "step": step, "initial": "quasi-static", "frames": "co-rotational"},
        "output": {"probes": {"q": {"link": "rod", "at": [0.5, 0, 0], "quantity": "travel"}}},
    }  # fmt: skip


@pytest.mark.parametrize("step", [1e-3, 5e-3])
@pytest.mark.parametrize("way", TURNS)
def test_a_cylinder_of_rigid_links_is_as_long_as_its_drive_says(way: str, step: float) -> None:
    """Within 2 µm, 20 µm of a slender one in space; 14 mm and more once: links gave by the force times h² over mass."""
    R = Rotation.from_euler("xyz", TURNS[way], degrees=True).as_matrix()
    ready, blocks = ran(turned(lifted(step, way in ("z", "askew")), R))
    found = channels(ready, blocks)["probes/q/travel"]
    x, y = (found @ R[: found.shape[1], :2]).T
    s = np.concatenate([block.motion.t for block in blocks])  # of a second
    asked = 0.4 + 0.05 * (10 * s**3 - 15 * s**4 + 6 * s**5)
    missing = np.abs(np.hypot(x, 0.4 + y) - asked)
    assert missing.max() < (2e-5 if way in ("z", "askew") else 2e-6)
