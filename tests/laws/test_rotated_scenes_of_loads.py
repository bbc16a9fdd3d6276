"""Loads that turn with their links, in scenes drawn along x, y, z and obliquely: closed forms, and no axis is another."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from kedfem.analysis import analyse
from kedfem.scene import scene_from

Raw = dict[str, Any]
LONG, WIDE = 0.5, 0.02
ACROSS = {  # what turns the load, along z where it is drawn, into these
    "x": Rotation.from_rotvec([0, np.pi / 2, 0]).as_matrix(), "y": Rotation.from_rotvec([-np.pi / 2, 0, 0]).as_matrix(),
    "z": np.eye(3), "oblique": Rotation.from_rotvec([0.9, -0.7, 1.3]).as_matrix(),
}  # fmt: skip
CASES = [
    ("rigid", "force"), ("rigid", "line"), ("beam", "force"), ("beam", "body"), ("beam", "line"), ("beam", "pressure"),
    ("solid", "force"), ("solid", "body"),
    ("solid", "surface"), ("solid", "pressure"),
]  # fmt: skip


def arm(kind: str, R: np.ndarray) -> Raw:
    """Half a metre of steel along R e_x, of square section."""
    ends = [[0.0, 0.0, 0.0], (R @ [LONG, 0, 0]).tolist()]
    shape = {"kind": "bar", "between": ends, "width": WIDE, "thickness": WIDE, "up": R[:, 2].tolist()}
    more: Raw = {
        "beam": {"beam": "spatial", "mesh": {"elements": 2}},
        "solid": {"mesh": {"elements": [4, 1, 1]}, "segments": 4},
        "plane": {"mesh": {"elements": [4, 1]}, "segments": 2},
    }.get(kind, {})
    if kind == "plane":
        del shape["up"]
    return {"model": kind, "material": "steel", "shape": shape, **more}


def push(load: str, R: np.ndarray, size: float) -> Raw:
    """Down the thickness of the arm, at its end or all along."""
    down, end, face = R @ [0, 0, -size], (R @ [LONG, 0, 0]).tolist(), (R @ [LONG / 2 + 0.01, 0, WIDE / 2]).tolist()
    return {"link": "arm", "kind": load} | {
        "force": {"at": end, "vector": down.tolist(), "frame": "link"},
        "line": {"vector": (down / LONG).tolist(), "frame": "link"},
        "body": {"vector": (down / (LONG * WIDE**2)).tolist(), "frame": "link"},
        "surface": {"at": face, "vector": (down / (LONG * WIDE)).tolist(), "frame": "link"},
        "pressure": {"at": face, "pressure": size / (LONG * WIDE)},
    }[load]


def ended(link: Raw, load: Raw, joint: Raw, R: np.ndarray, folder: Path, **analysis: Any) -> list[np.ndarray]:
    """Travel of the tip, force and moment of the joint at the end, by the axes in which the scene is drawn."""
    raw = {
        "links": {"arm": link}, "loads": {"push": load},
        "joints": {"A": {"links": ["ground", "arm"], "at": [0, 0, 0], **joint}},
        "analysis": {"frames": "co-rotational", "accuracy": "quick", **analysis},
        "output": {
            "plots": False, "picture": False, "animation": False,
            "probes": {"tip": {"link": "arm", "at": (R @ [LONG, 0, 0]).tolist(), "quantity": "travel"}},
        },
    }  # fmt: skip
    channels = analyse(scene_from(raw, folder)).results.channels
    found = [channels[name][1][-1] for name in ("probes/tip/travel", "joints/A/force", "joints/A/moment")]
    return [x @ R[: len(x), : len(x)] if len(x) > 1 else x for x in found]


@pytest.mark.parametrize("drawn", [pytest.param(x, marks=[] if x == "z" else pytest.mark.long) for x in ACROSS])
@pytest.mark.parametrize(("kind", "load"), CASES)
def test_a_load_along_any_axis_turns_a_hinged_arm_as_its_moment_says(
    kind: str, load: str, drawn: str, tmp_path: Path
) -> None:
    """θ = M t²/2J, through more than a radian, about a hinge across arm and load; steps and bending leave 1e-4 of it."""
    R, end, size = ACROSS[drawn], 0.2, 30.0
    hinge = {"kind": "revolute", "axis": R[:, 1].tolist()}
    steps = {"end_time": end, "step": 1e-3, "rho_inf": 0.8}
    tip = ended(arm(kind, R), push(load, R, size), hinge, R, tmp_path, **steps)[0]
    J = 7850 * LONG * WIDE**2 * (LONG**2 / 3 + WIDE**2 / 12)
    theta = size * LONG * (1 if load == "force" else 0.5) * end**2 / 2 / J
    assert 1 < theta < 4
    assert_allclose(tip, LONG * np.array([np.cos(theta) - 1, 0, -np.sin(theta)]), atol=2e-4 * theta * LONG)


@pytest.mark.parametrize("drawn", [*(pytest.param(x, marks=pytest.mark.long) for x in "xy"), "oblique"])
@pytest.mark.parametrize("load", ["pressure", "force", "body"])
def test_a_bent_cantilever_is_the_same_however_it_is_drawn(load: str, drawn: str, tmp_path: Path) -> None:
    """Bent by a fifth of its length: how a segment turns is seen by no axes of the scene."""
    size, foot = 8000.0 if load == "force" else 20000.0, {"kind": "weld"}
    drawings = (np.eye(3), ACROSS[drawn])
    here, there = (ended(arm("solid", R), push(load, R, size), foot, R, tmp_path, kind="static") for R in drawings)
    assert -0.3 < here[0][2] < -0.05
    for one, other in zip(here, there, strict=True):
        assert_allclose(other, one, atol=1e-7 * np.abs(one).max())


def test_a_plane_cantilever_under_pressure_is_the_same_however_it_is_drawn(tmp_path: Path) -> None:
    found = []
    for angle in (0.0, np.pi / 2, 0.7):
        R = Rotation.from_rotvec([0, 0, angle]).as_matrix()
        at = (R @ [LONG / 2 + 0.01, WIDE / 2, 0]).tolist()
        load = {"kind": "pressure", "link": "arm", "at": at, "pressure": 2e6}
        found.append(ended(arm("plane", R), load, {"kind": "weld"}, R, tmp_path, kind="static"))
    assert -0.3 < found[0][0][1] < -0.05
    for there in found[1:]:
        for one, other in zip(found[0], there, strict=True):
            assert_allclose(other, one, atol=1e-7 * np.abs(one).max())
