"""Loads on links that are cut into segments: all that a whole link has."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.accuracy.prepared import meshed
from kedfem.scene import scene_from
from tests import scenes
from tests.scenes import bar, constant_speed


def arm(kind: str, **analysis: Any) -> dict[str, Any]:
    segments: dict[str, Any] = {"segments": 4} if analysis.get("frames") else {}
    if kind == "tet10":
        kind, segments["element"] = "solid", "tet10"
    return scenes.arm(
        bar(0.4, 0.02, 0.01, model=kind, **segments),
        constant_speed(1.0),
        gravity=[1.0, -9.81],
        loads={
            "top": {"kind": "surface", "link": "arm", "at": [0.11, 0.01], "vector": [0, -1e4]},
            "all": {"kind": "body", "link": "arm", "vector": [2e3, 0]},
            "tip": {"kind": "force", "link": "arm", "at": [0.4, 0], "vector": [3, 4]},
        },
        analysis={"end_time": 0.1, "step": 1e-3, **analysis},
    )


@pytest.mark.parametrize("kind", ["plane", "solid", "tet10"])
def test_segments_carry_all_loads_of_the_whole_link(kind: str) -> None:
    """Resultants and moments of gravity, of a pressure over the whole upper face, of body and tip force."""
    found = []
    for frames in ({}, {"frames": "co-rotational"}):
        model = meshed(scene_from(arm(kind, **frames))).model
        total = np.zeros((3, 3))
        for link, loads in zip(model.links, model.loads, strict=True):
            F = sum(load.forces for load in loads)
            total[0, : link.d] += link.one @ F
            total[1:] += (link.X.T @ F)[:2] @ np.eye(link.d, 3)
        found.append((len(model.links), total))
    (one, whole), (four, cut) = found
    assert (one, four) == (1, 4)
    assert_allclose(cut, whole, rtol=0, atol=1e-9 * np.abs(whole).max())
    assert whole[0, 1] == pytest.approx(-1e4 * 0.4 * 0.01 + 4 - 9.81 * model_mass(model), rel=1e-9)


def model_mass(model: Any) -> float:
    return sum(float(link.one @ link.m1[:, 0]) for link in model.links)
