"""Rates of quasi-static starts: what dampers feel of them, by hand and whatever the step, in every direction."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kedfem.dynamics.system.starts.deflected import quasi_static
from tests.laws.test_soft_mounts import ARM, HINGED, MOUNT, MOUNTED, PUSH, TURNS, mounted
from tests.laws.test_system import elements, four_bar
from tests.moving import channels, ran
from tests.systems import begun

Raw = dict[str, Any]
FADES, GROWS = 0.017, 4.0  # s, 1/s
FRAMES = ("rigid-body", "co-rotational")


def damped(guided: str, way: str, **analysis: Any) -> tuple[Raw, np.ndarray]:
    """A block whose soft mount has a damper, under a force that grows, and the direction in which it gives."""
    R = Rotation.from_euler("xyz", TURNS[way], degrees=True).as_matrix()
    times = {"initial": "quasi-static", "step": 1e-5, "end_time": 4e-5}
    raw = mounted(guided, "none", R, **times, **analysis)
    raw["joints"]["M"]["bushing"] |= {"damping": FADES * MOUNT, "rotational_damping": FADES * MOUNT * ARM**2}
    raw["loads"]["F"]["factor"] = {"over": "time", "at": [0.0, 0.1], "value": [1.0, 1.0 + 0.1 * GROWS]}
    raw["output"]["probes"]["v"] = {**raw["output"]["probes"]["b"], "quantity": "velocity"}
    return raw, R[:, 2 if guided in HINGED else 0]


def assert_starts(guided: str, way: str, frames: str) -> None:
    """k x + c x' = F (1 + t/T): x' = F/(k T), x = F/k − c x'/k."""
    raw, along = damped(guided, way, frames=frames)
    turns = frames == "co-rotational" and guided in HINGED  # by 6e-4 rad, which three angles see to first order
    found = channels(*ran(raw))
    rate = PUSH / MOUNT * GROWS
    for name, wanted in (("v/velocity", rate), ("b/displacement", PUSH / MOUNT - FADES * rate)):
        x = found[f"probes/{name}"][0]
        assert abs(x @ along - wanted) < (3e-4 if turns else 1e-5) * wanted
        assert np.linalg.norm(x - (x @ along) * along) < 2 * PUSH / MOUNT / ARM * wanted  # along its arc


@pytest.mark.parametrize("frames", FRAMES)
@pytest.mark.parametrize(
    "guided", ["planar", *(pytest.param(x, marks=pytest.mark.long) for x in MOUNTED if x not in {"shaft", "planar"})]
)
@pytest.mark.parametrize("way", TURNS)
def test_a_damped_mount_starts_with_the_rate_that_it_keeps(way: str, guided: str, frames: str) -> None:
    assert_starts(guided, way, frames)


@pytest.mark.parametrize("frames", FRAMES)
def test_rates_of_starts_do_not_depend_on_the_step(frames: str) -> None:
    raw = four_bar(**elements())
    of = [begun({**raw, "analysis": raw["analysis"] | {"frames": frames, "step": h, "end_time": 4 * h}})
          for h in (1e-4, 1e-6)]  # fmt: skip
    v, other = (quasi_static(each.ready, each.motion).v for each in of)
    assert np.linalg.norm(v - other) < 1e-5 * np.linalg.norm(v)
