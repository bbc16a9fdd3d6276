"""Loads that turn with a link that bends: one answer with and without a drive; forces on slides that turn."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.moving import bar, channels, inverted, ran, state

I = 0.02 * 0.005**3 / 12  # noqa: E741
FOLLOWING = 2 * 2.1e11 * I  # N at the tip of a metre: P L²/EI = 2


def cantilever(held: str, load: dict[str, Any], model: str = "beam", initial: str = "rest") -> dict[str, Any]:
    """A slender steel cantilever that is loaded slowly; held by a drive that hardly turns, or welded."""
    link = bar(model, [0, 0], [1.0, 0], 8)
    link["shape"] |= {"width": 0.005, "thickness": 0.02}
    raw: dict[str, Any] = {
        "links": {"arm": link},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0]}},
        "loads": {"P": {"kind": "force", "link": "arm", "at": [1.0, 0], "vector": [0, FOLLOWING], **load}},
        "damping": {"beta": 0.02},
        "analysis": {"end_time": 0.5, "step": 2e-3, "rho_inf": 0.6, "frames": "co-rotational", "initial": initial},
    }
    if held == "drive":
        motion = {"kind": "cycloidal", "angle": 1e-9, "rise": 1.0}
        return raw | {"drive": {"joint": "A", "motion": motion}}
    return raw | {"joints": {"A": {"kind": "weld", "links": ["ground", "arm"], "at": [0, 0]}}}


def tip(raw: dict[str, Any], k: int = -1) -> np.ndarray:
    """Displacement of the arm's end at a time point."""
    ready, blocks = ran(raw)
    links = ready.model.links
    last = max(range(len(links)), key=lambda j: float(links[j].nodes[:, 0].max()))
    return state(blocks, last, "u")[k, int(links[last].nodes[:, 0].argmax()), :2]


RAMPED = {"frame": "link", "factor": {"time": [0.0, 0.3], "value": [0.0, 1.0]}}


def test_a_load_turns_with_the_link_itself_with_and_without_a_drive() -> None:
    """A follower force bends a cantilever further than the rigid-body frame says: the same tip, whatever holds the
    root."""
    driven, welded = tip(cantilever("drive", RAMPED)), tip(cantilever("weld", RAMPED))
    assert_allclose(driven, welded, atol=1e-4)
    world = tip(cantilever("drive", {**RAMPED, "frame": "world"}))
    assert np.linalg.norm(driven - world) > 0.05  # m


def test_a_factor_over_the_angle_of_the_drive_is_that_over_time() -> None:
    raw = cantilever("drive", RAMPED)
    raw["drive"]["motion"] = {"kind": "constant_speed", "speed": 0.5}
    over = {"over": "angle", "at": [0.0, 0.15], "value": [0.0, 1.0]}
    by_angle = cantilever("drive", {"frame": "link", "factor": over}) | {"drive": raw["drive"]}
    # each of 250 steps stops its iterations at 1e-7 of what moves: how compiled code rounds decides after which one
    assert_allclose(tip(by_angle), tip(raw), atol=2e-5)


def test_a_quasi_static_start_has_loads_that_turn_with_the_link() -> None:
    raw = cantilever("drive", {"frame": "link", "vector": [0, FOLLOWING / 40]}, initial="quasi-static")
    assert_allclose(tip(raw, 0), tip(raw), atol=1e-4)
    assert np.linalg.norm(tip(raw)) > 0.01  # m


ON_SLIDE: dict[str, dict[str, Any]] = {
    "springs": {"kind": "spring", "stiffness": 2000.0},
    "motors": {"force": {"over": "travel", "at": [-0.2, 0.2], "value": [50.0, 90.0]}},
    "limits": {"kind": "travel", "lower": -0.01, "upper": 0.01, "stiffness": 3000.0},
}


@pytest.mark.parametrize("law", ON_SLIDE)
def test_a_force_on_a_slide_between_moving_links_turns_with_it(law: str) -> None:
    """Its power is the drive's, −F ds/dφ, with rigid-body frames too; the slide turns by some 0.4 rad."""
    raw = inverted(kind="prismatic") | {law: {"x": {"joint": "S", **ON_SLIDE[law]}}}
    raw["drive"] = {"joint": "A", "motion": {"kind": "constant_speed", "speed": 1.0}}
    raw["analysis"] = {"kind": "static", "end_time": 1.5, "step": 0.25, "accuracy": "quick"}
    torque = channels(*ran(raw))["drive/torque"][:, 0]
    phi = 0.25 * np.arange(7)
    away = np.stack([0.1 * np.cos(phi) + 0.3, 0.1 * np.sin(phi)])  # of the block from the arm's hinge
    s = np.linalg.norm(away, axis=0) - 0.4
    slope = (away[1] * np.cos(phi) - away[0] * np.sin(phi)) * 0.1 / (s + 0.4)
    force = {
        "springs": -2000.0 * s, "motors": 70.0 + 100.0 * s,
        "limits": -3000.0 * (np.maximum(s - 0.01, 0) + np.minimum(s + 0.01, 0)),
    }[law]  # fmt: skip
    assert_allclose(torque, -force * slope, atol=5e-4 * np.abs(force * slope).max())
