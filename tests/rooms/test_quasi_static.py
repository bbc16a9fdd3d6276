"""Quasi-static starts are steady states of the turning links, or errors; springs in joints constrain nothing."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.accuracy.prepared import meshed
from kedfem.scene import scene_from
from tests.moving import bar, ran, state


def arm(part: float) -> dict[str, Any]:
    """An arm that turns at a part of its first natural frequency, under a force that turns with it."""
    first = 1.8751**2 * np.sqrt(2.1e11 * 0.03**2 / 12 / 7850) / 0.5**2  # rad/s, Euler-Bernoulli
    return {
        "links": {"arm": bar("beam", (0, 0), (0.5, 0), 4)},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0]}},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": part * first}},
        "loads": {"P": {"kind": "force", "link": "arm", "at": [0.5, 0], "vector": [0, 10.0], "frame": "link"}},
        "analysis": {"revolutions": 1, "steps_per_revolution": 2000, "initial": "quasi-static"},
    }


@pytest.mark.parametrize("part", [0.5, 0.8, 0.95])
def test_a_quasi_static_start_is_the_steady_state_up_to_the_first_frequency(part: float) -> None:
    """It gave up in silence above 0.7 of that, 25 to 65 % off, and the arm rang. Order 2 in the step of 2π/2000."""
    g = state(ran(arm(part))[1], 0, "g")
    assert_allclose(g, np.broadcast_to(g[0], g.shape), atol=2e-4 * np.abs(g).max())


def test_springs_in_joints_are_no_constraints_among_the_coordinates() -> None:
    """A welded cantilever in a bushing has the coordinates of the free beam: nothing holds them for good."""
    raw = arm(0.1)
    two = {
        "links": raw["links"] | {"end": bar("beam", (0.5, 0), (0.8, 0), 4)},
        "joints": raw["joints"] | {"W": {"kind": "weld", "links": ["arm", "end"], "at": [0.5, 0]}},
    }
    rigid = meshed(scene_from(raw | two)).model
    two["joints"]["W"] = two["joints"]["W"] | {"bushing": {"stiffness": 1e6, "rotational_stiffness": 1e3}}
    soft = meshed(scene_from(raw | two | {"analysis": raw["analysis"] | {"rho_inf": 0.9}})).model
    assert soft.coordinates == rigid.coordinates + 3
