"""Sliders, masses alone on guides: rigid links like others, on the ground and on links that move."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.moving import bar, channels, ran, turned

Raw = dict[str, Any]
Channels = dict[str, np.ndarray]
MASS = 0.7
A, B, C, E = [0.0, 0, 0], [-0.3, 0, 0], [0.1, 0, 0], [0.5, 0, 0]


def beam_in_space(*points: list[float], elements: int) -> Raw:
    shape = {"kind": "polyline", "points": list(points), "width": 0.03, "thickness": 0.02, "up": [0, 0, 1]}
    return {"model": "beam", "beam": "spatial", "material": "steel", "shape": shape, "mesh": {"elements": elements}}


def quick_return(kind: str, block: Raw, **analysis: Any) -> Raw:
    """A crank turns an arm by a block, which slides on the arm while this swings."""
    if kind == "spatial":
        links = {"crank": beam_in_space(A, C, elements=2), "arm": beam_in_space(B, C, E, elements=2)}
    else:
        links = {"crank": bar("beam", A[:2], C[:2], 2), "arm": bar("beam", B[:2], E[:2], 4)}
    z = {"axis": [0, 0, 1]}
    return {
        "links": {**links, "block": {"model": "rigid", "mass": MASS, **block}},
        "joints": {
            "A": {"kind": "revolute", "links": ["ground", "crank"], "at": A, **z},
            "B": {"kind": "revolute", "links": ["ground", "arm"], "at": B, **z},
            "C": {"kind": "revolute", "links": ["crank", "block"], "at": C, **z},
            "S": {"kind": "prismatic", "links": ["block", "arm"], "at": C, "axis": [1, 0, 0]},
        },
        "gravity": [0, -9.81, 0],
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": "120 rpm"}},
        "damping": {"beta": 1e-5},
        "analysis": {
            "revolutions": 0.05, "steps_per_revolution": 720, "initial": "quasi-static", "rho_inf": 0.8, **analysis,
        },
    }  # fmt: skip


def shown(raw: Raw) -> Channels:
    return channels(*ran(raw))


def apart(one: Channels, other: Channels, *names: str) -> float:
    """The largest difference of channels, each of its own peak."""
    return max(float(np.abs(one[x] - other[x]).max() / np.abs(one[x]).max()) for x in names)


FORCES = ("joints/A/force", "joints/B/force", "joints/C/force", "joints/S/force", "drive/torque")
FRAMES = ("rigid-body", "co-rotational")
KINDS = ("planar", "spatial")


@cache
def swung(kind: str, frames: str) -> Channels:
    return shown(quick_return(kind, {}, frames=frames))


@pytest.mark.parametrize("frames", FRAMES)
@pytest.mark.parametrize("kind", KINDS)
def test_a_mass_alone_on_a_link_that_swings_moves_as_the_monolithic_system_does(kind: str, frames: str) -> None:
    other = shown(quick_return(kind, {}, frames=frames, solver="monolithic"))
    assert apart(swung(kind, frames), other, *FORCES) < (1e-8 if frames == "rigid-body" else 1e-7)


@pytest.mark.parametrize("kind", KINDS)
def test_a_mass_alone_is_the_limit_of_bodies_with_ever_less_inertia(kind: str) -> None:
    """Forces are linear in a small moment of inertia: those of two, extrapolated to none."""
    J = MASS * 1e-6  # of a radius of gyration of a millimetre: 3e-7 of the forces
    bodies = ({"centre": C, "inertia": [n * J] * 3 + [0, 0, 0]} for n in (1, 2))
    one, two = (shown(quick_return(kind, body, frames="co-rotational")) for body in bodies)
    limit = {name: 2 * one[name] - two[name] for name in FORCES}
    found = swung(kind, "co-rotational")
    assert apart(one, found, *FORCES) > 1e-7
    assert apart(limit, found, *FORCES) < 3e-8


@pytest.mark.parametrize("frames", FRAMES)
def test_joints_of_a_block_on_an_arm_bear_its_weight_and_inertia(frames: str) -> None:
    """m (a − g) is the sum of both forces on it, to what a step of generalised-α weighs these by; energy closes."""
    raw = quick_return("spatial", {}, frames=frames)
    raw["output"] = {"probes": {"a": {"link": "block", "at": C, "quantity": "total_acceleration"}}}
    found = shown(raw)
    force = found["joints/S/force"] - found["joints/C/force"]  # that of C is on the crank
    inertia = MASS * (found["probes/a/total_acceleration"] - [0, -9.81, 0])
    assert_allclose(force[5:], inertia[5:], atol=2e-3 * np.abs(force).max())
    assert np.abs(found["energy/residual"]).max() < 1e-3 * np.ptp(found["energy/kinetic"])


@pytest.mark.parametrize("turn", ["y", "z", "askew"])
def test_no_answer_depends_on_how_a_guide_that_swings_lies(turn: str) -> None:
    Q = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    R = {"y": np.roll(np.eye(3), 1, axis=0), "z": np.roll(np.eye(3), 2, axis=0), "askew": Q * np.linalg.det(Q)}[turn]
    here, there = swung("spatial", "rigid-body"), shown(turned(quick_return("spatial", {}, frames="rigid-body"), R))
    for name in FORCES:
        back = there[name] @ R if there[name].shape[1] == 3 else there[name]
        assert_allclose(back, here[name], atol=1e-6 * np.abs(here[name]).max(), err_msg=name)
