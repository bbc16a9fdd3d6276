"""Bushings say what they bear: joints on more of them than hold a link, in balance with its loads."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from tests.moving import channels, ran, turned

TURNS = {"x": (0, 0, 0), "y": (0, 0, 90), "z": (0, 90, 0), "oblique": (20, 50, 70)}
MASS, PUSH = 1.5, [30.0, -7.0, 11.0]
MOUNTS = {"A": [0, 0, 0], "B": [0.2, 0, 0], "C": [0.05, 0.15, 0.03]}
CENTRE = np.mean(list(MOUNTS.values()), axis=0).tolist()
GRAVITY = [0.7, 2.0, -9.81]


def block(kind: str, analysis: str) -> dict[str, Any]:
    """A rigid block on three bushings of the ground or, where positions follow a drive, of a carriage that turns."""
    body = {"model": "rigid", "mass": MASS, "inertia": [2e-3, 3e-3, 4e-3, 0, 0, 0], "centre": CENTRE}
    soft = {"stiffness": 2e4, "damping": 100.0} | ({"rotational_stiffness": 30.0} if kind == "weld" else {})
    driven = analysis == "quasi-static"
    base = "carriage" if driven else "ground"
    raw: dict[str, Any] = {
        "gravity": GRAVITY, "links": {"block": body},
        "joints": {n: {"kind": kind, "links": [base, "block"], "at": at, "bushing": soft} for n, at in MOUNTS.items()},
        "loads": {"F": {"kind": "force", "link": "block", "at": MOUNTS["B"], "vector": PUSH}},
        "analysis": {"kind": analysis, "end_time": 0.24, "rho_inf": 0.8, "frames": "co-rotational",
                     "step": 2e-3 if analysis == "transient" else 0.12},
        "output": {"probes": {
            n: {"link": "block", "at": at, "quantity": "position"} for n, at in MOUNTS.items()
        }},
    }  # fmt: skip
    if driven:
        raw["links"]["carriage"] = dict(body)
        raw["joints"]["D"] = {"kind": "revolute", "links": ["ground", "carriage"], "at": [0, 0, 0], "axis": [1, 0, 0]}
        raw["drive"] = {"joint": "D", "motion": {"kind": "constant_speed", "speed": 1e-4}}
    return raw


@pytest.mark.parametrize("turn", [pytest.param(x, marks=[] if x in "x oblique" else pytest.mark.long) for x in TURNS])
@pytest.mark.parametrize("analysis", ["static", "quasi-static", pytest.param("transient", marks=pytest.mark.long)])
@pytest.mark.parametrize("kind", ["spherical", "weld"])
def test_bushings_that_share_a_block_bear_its_weight_and_loads(kind: str, analysis: str, turn: str) -> None:
    """Moments too, at rest; they had no channels, as those of more rigid joints than needed."""
    R = Rotation.from_euler("xyz", TURNS[turn], degrees=True).as_matrix()
    raw = turned(block(kind, analysis), R)
    every = channels(*ran(raw))
    x = {n: every[f"probes/{n}/position"][-1] for n in MOUNTS}
    borne = {n: every[f"joints/{n}/force"][-1] for n in MOUNTS}
    sign = -1.0 if analysis == "quasi-static" else 1.0  # on the carriage
    weight, push = MASS * (R @ GRAVITY), R @ PUSH
    size = max(np.abs(f).max() for f in borne.values())
    assert_allclose(sign * sum(borne.values()) + weight + push, 0, atol=1e-7 * size)
    about = np.cross(np.mean(list(x.values()), axis=0), weight) + np.cross(x["B"], push)
    about += sign * sum(np.cross(x[n], f) for n, f in borne.items())
    if kind == "weld":
        about += sign * sum(every[f"joints/{n}/moment"][-1] for n in MOUNTS)
    assert_allclose(about, 0, atol=1e-7 * size * 0.2)
