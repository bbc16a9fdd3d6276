"""The account of energy with geometric stiffening: it closes with the square of the step, in every direction."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.laws.test_soft_mounts import TURNS
from tests.moving import bar, beam_in_space, channels, ran, turned

Raw = dict[str, Any]
RISE: Raw = {"joint": "A", "motion": {"kind": "ramp", "speed": 200.0, "time": 0.05, "shape": "smooth"}}


def spinning(arm: Raw, step: float) -> Raw:
    """An arm that is brought to a speed at which stiffening is a seventh of its stiffness, under gravity."""
    hinge = {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0, 0][: 3 if arm.get("beam") else 2]}
    if arm.get("beam"):
        hinge["axis"] = [0, 0, 1]
    return {
        "links": {"arm": arm}, "joints": {"A": hinge}, "drive": RISE, "gravity": [0, -9.81, 0],
        "analysis": {"end_time": 0.05, "step": step, "rho_inf": 1.0, "initial": "rest", "stiffening": True},
    }  # fmt: skip


def four_bar(step: float, sprung: bool = False) -> Raw:
    """A four-bar of thin beams, with a spring that pulls its rocker if asked for."""
    places = {"crank": [[0, 0], [0.1, 0]], "coupler": [[0.1, 0], [0.3, 0.2]], "rocker": [[0.3, 0.2], [0.3, -0.05]]}
    links = {name: bar("beam", *ends, 4) for name, ends in places.items()}
    for link in links.values():
        link["shape"]["width"] = 0.008
    ends = ["ground", *places, "ground"]
    at = [[0, 0], [0.1, 0], [0.3, 0.2], [0.3, -0.05]]
    joints = {name: {"kind": "revolute", "links": ends[k : k + 2], "at": at[k]} for k, name in enumerate("ABCD")}
    pulled = [{"link": "rocker", "at": at[2]}, {"link": "ground", "at": [0.3, 0.6]}]
    spring = {"kind": "spring", "between": pulled, "stiffness": 2e3, "preload": 500.0}
    analysis = {"end_time": 0.1, "step": step, "rho_inf": 1.0, "initial": "quasi-static", "stiffening": True}
    raw = {"links": links, "joints": joints, "analysis": analysis}
    raw["drive"] = {"joint": "A", "motion": {"kind": "constant_speed", "speed": "600 rpm"}}
    return raw | ({"springs": {"s": spring}} if sprung else {})


def missing(raw: Raw) -> float:
    """The largest residual, of the largest energy."""
    found = channels(*ran(raw))
    scale = max(float(np.abs(found[f"energy/{name}"]).max()) for name in ("kinetic", "strain", "work"))
    return float(np.abs(found["energy/residual"]).max()) / scale


def assert_closes(rough: Raw, fine: Raw) -> None:
    """Four times as well with half the step, and to 3e-4: without the work of the stresses 0.3 to 5 % are missing."""
    one, other = missing(rough), missing(fine)
    assert 3.0 < one / other < 5.0
    assert other < 3e-4


@pytest.mark.parametrize("sprung", [False, True])
def test_the_account_of_a_four_bar_closes(sprung: bool) -> None:
    assert_closes(four_bar(2.5e-4, sprung), four_bar(1.25e-4, sprung))


@pytest.mark.parametrize("model", ["beam", pytest.param("plane", marks=pytest.mark.long)])
def test_the_account_of_a_spinning_arm_closes(model: str) -> None:
    arm = bar(model, (0, 0), (0.5, 0))
    assert_closes(spinning(arm, 5e-4), spinning(arm, 2.5e-4))


@pytest.mark.long
@pytest.mark.parametrize("way", TURNS)
def test_so_does_that_of_one_in_space(way: str) -> None:
    R = Rotation.from_euler("xyz", TURNS[way], degrees=True).as_matrix()
    arm = beam_in_space((0, 0, 0), (0.5, 0, 0))
    assert_closes(*(turned(spinning(arm, step), R) for step in (5e-4, 2.5e-4)))
