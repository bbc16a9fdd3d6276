"""Rates of quasi-static starts: what dampers feel of them, by hand and whatever the step, in every direction."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kedfem.dynamics.system.starts import deflected
from kedfem.dynamics.system.starts.deflected import quasi_static
from kedfem.errors import SolveError
from tests.laws.test_follower_loads import ASKEW
from tests.laws.test_soft_mounts import ARM, HINGED, MOUNT, MOUNTED, PUSH, TURNS, mounted
from tests.laws.test_system import elements, four_bar
from tests.moving import channels, ran, state
from tests.rooms.test_initial_deflection import plucked
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


AROUND = [("beam", np.eye(3)), *(pytest.param(*x, marks=pytest.mark.long) for x in (
    ("spatial beam", ASKEW), ("spatial beam", np.eye(3)[[2, 0, 1]]), ("solid", ASKEW)))]  # fmt: skip


@pytest.mark.parametrize("frames", FRAMES)
@pytest.mark.parametrize(("kind", "R"), AROUND)
def test_what_is_let_go_of_a_link_that_turns_is_at_rest_in_it(kind: str, R: np.ndarray, frames: str) -> None:
    """v = ω × u. Without it ω δ shakes the arm along its own axis, and the force at its hinge, m ω² L/2, by twice as
    much; it keeps the Coriolis force of the tip's swing, some 10 % of that."""
    speed, force = 60.0, R @ [40.0, 200.0, 0.0]
    raw = plucked(kind, R, "drive", frames)
    if frames == "rigid-body":
        raw["links"]["arm"].pop("segments", None)
    raw["drive"]["motion"] = {"kind": "constant_speed", "speed": speed}
    go = raw["analysis"]["initial_deflection"]["tip"]
    go["force"] = force[: len(go["force"])].tolist()
    raw["analysis"] |= {"end_time": 1e-3, "step": 2.5e-5}
    ready, blocks = ran(raw)
    for k, link in enumerate(ready.model.links):
        u, v = (state(blocks, k, name)[0] for name in "uv")
        if kind == "beam":
            u, v = (x * [1.0, 1.0, 0.0] for x in (u, v))
        assert np.abs(v - np.cross(speed * R[:, 2], u)).max() < 1e-5 * speed * np.abs(u).max(), link.name
    hinge = np.linalg.norm(channels(ready, blocks)["joints/A/force"], axis=1)
    assert np.abs(hinge / hinge[0] - 1).max() < 0.2


def test_what_is_let_go_with_rates_that_do_not_settle_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """As of a rod far off on a damped hinge, whose damper would push by their rounding."""
    differenced = deflected.differenced_rates
    monkeypatch.setattr(deflected, "differenced_rates", lambda *x: (differenced(*x)[0], np.inf))
    with pytest.raises(SolveError, match="rates with dampers do not converge"):
        ran(plucked("beam", np.eye(3), "drive", "rigid-body"))
