"""A bar of steel along each axis, of each kind of link, on a driven hinge of the ground."""

from pathlib import Path
from typing import Any

import numpy as np

from kedfem.scene import Scene, scene_from
from tests.scenes import cycloidal

L, WIDTH, HEIGHT, E, NU, RHO = 0.4, 0.03, 0.02, 210e9, 0.3, 7850.0
START = np.array([0.1, -0.05, 0.2])
AXES = {"x": [1, 0, 0], "y": [0, 1, 0], "z": [0, 0, 1], "oblique": [0.6, -0.5, 0.62]}
KINDS: dict[str, dict[str, Any]] = {
    "solid": {"mesh": {"elements": [6, 1, 1]}},
    "reduced": {"reduction": "modal", "mesh": {"elements": [6, 1, 1]}},
    "spatial_beam": {"model": "beam", "mesh": {"elements": 6}},
    "plane": {"model": "plane", "mesh": {"elements": [6, 1]}},
    "beam": {"model": "beam", "mesh": {"elements": 6}},
}
FLAT = ("plane", "beam")
CASES = [(kind, axis) for kind in KINDS for axis in AXES if kind not in FLAT or axis in ("x", "y")]


def bar_scene(kind: str, axis: str, folder: Path, **more: Any) -> Scene:
    """A bar between two joints, turned about the first, its other end welded to another piece of bar; more sections."""
    e = np.array(AXES[axis], float) / np.linalg.norm(AXES[axis])
    start = START * [1, 1, 0] if kind in FLAT else START
    across = np.array([0.0, 0, 1]) if kind in FLAT else np.cross(e, [0.31, 0.9, -0.2])
    ends = [list(start), list(start + L * e), list(start + 1.1 * L * e)]
    if kind in FLAT:
        ends = [end[:2] for end in ends]
    section = {"kind": "bar", "width": WIDTH, "thickness": HEIGHT}
    arm = {"material": "steel", "shape": {**section, "between": ends[:2]}, **KINDS[kind]}
    tip = {"material": "steel", "shape": {**section, "between": ends[1:]}}
    tip |= KINDS[kind] if kind in FLAT else {"model": "rigid"}
    axes = {} if kind in FLAT else {"axis": list(across)}
    raw = {
        "links": {"arm": arm, "tip": tip},
        "joints": {
            "A": {"kind": "revolute", "links": ["ground", "arm"], "at": ends[0], **axes},
            "B": {"kind": "weld", "links": ["arm", "tip"], "at": ends[1]},
        },
        "drive": {"joint": "A", "motion": cycloidal(0.5, 0.1)},
        "damping": {"ratio": 0.02, "frequencies": [50, 500]},
        "analysis": {"end_time": 0.1, "step": 1e-3, "accuracy": "quick"},
    }  # fmt: skip
    return scene_from({**raw, **more}, folder)
