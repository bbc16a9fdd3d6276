"""Slides whose coupling surface is a face across their direction: a ram held at its end bears moments there."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.laws.test_positions import AXES, E, across, values

L, SIDE, FORCE, SPRING = 0.2, 0.01, 10.0, 1e6
KINDS: dict[str, dict[str, Any]] = {
    "solid": {"mesh": {"elements": [8, 1, 1]}},
    "beam": {"beam": "spatial", "mesh": {"elements": 2}},
    "rigid": {},
}


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("model", KINDS)
def test_a_ram_bends_as_a_cantilever(axis: str, model: str) -> None:
    """F L³/3EI + F L/κGA across it, F/k along it; its guide bears F L. Rigid ones keep their direction."""
    n, d = AXES[axis], across(AXES[axis])
    shape = {
        "kind": "bar", "between": [[0, 0, 0], (L * d).tolist()], "width": SIDE, "thickness": SIDE,
        "up": np.cross(n, d).tolist(),
    }  # fmt: skip
    end = {"link": "ram", "at": (L * d).tolist()}
    got = values({
        "links": {"ram": {"model": model, "material": "steel", "shape": shape, **KINDS[model]}},
        "joints": {"S": {"kind": "prismatic", "links": ["ram", "ground"], "at": [0, 0, 0], "axis": d.tolist()}},
        "springs": {"k": {"kind": "spring", "joint": "S", "stiffness": SPRING}},
        "loads": {"F": {"kind": "force", **end, "vector": (FORCE * (n + d)).tolist()}},
        "analysis": {"kind": "static"}, "output": {"probes": {"end": {**end, "quantity": "travel"}}},
    })  # fmt: skip
    inertia, shear = SIDE**4 / 12, E / 2.6 * SIDE**2 * 5 / 6
    bent = 0.0 if model == "rigid" else FORCE * L**3 / (3 * E * inertia) + FORCE * L / shear
    scale = FORCE * L**3 / (3 * E * inertia)
    assert_allclose(got["probes/end/travel"] @ n, bent, atol=1e-2 * scale)  # the face is held on the average
    pushed = FORCE / SPRING + (0.0 if model == "rigid" else FORCE * L / (E * SIDE**2))
    assert_allclose(got["probes/end/travel"] @ d, pushed, atol=1e-2 * pushed + scale**2 / L)
    moment = -np.cross(L * d, FORCE * n)
    assert_allclose(got["joints/S/moment"], [moment] * 2, atol=1e-2 * FORCE * L)
