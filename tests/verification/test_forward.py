"""Mechanisms that nobody prescribes, against closed forms: rigid ones, and beams stiff enough to be taken for rigid."""

from typing import Any

import numpy as np
import pytest
from scipy.special import ellipk

from kedfem.accuracy.prepared import meshed
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.results.audit import Account
from kedfem.results.balance import Balance
from kedfem.results.recording import recording, rows
from kedfem.scene import scene_from
from tests import scenes
from tests.momentum import Momentum, momentum

LENGTH, WIDTH, THICKNESS, DENSITY = 0.5, 0.03, 0.02, 7850.0
MASS = DENSITY * LENGTH * WIDTH * THICKNESS
INERTIA = MASS * (4 * LENGTH**2 + WIDTH**2) / 12  # about its end
MODELS = ["rigid", "beam"]
Run = tuple[np.ndarray, dict[str, np.ndarray], tuple[Balance, Momentum]]


def bar(model: str, x: float = 0.0) -> dict[str, Any]:
    link = scenes.bar(LENGTH, WIDTH, THICKNESS, model=model)
    link["shape"]["between"] = [[x, 0], [x + LENGTH, 0]]
    return link


def arm(model: str, end_time: float, step: float, **more: Any) -> dict[str, Any]:
    analysis = {"end_time": end_time, "step": step, **more.pop("analysis", {})}
    return scenes.arm(bar(model), None, analysis=analysis, **more)


def ran(raw: dict[str, Any]) -> Run:
    """Times, channels of one column, and how energy and momentum balance."""
    scene = scene_from(raw)
    ready = meshed(scene)
    account = Account(ready.model)
    recorded = recording(scene, ready.model, account)
    blocks = list(transient(scene, ready.linkage, ready.path, ready.model, steps_of(scene, ready.model)))
    found = [rows(recorded, block) for block in blocks]
    channels = {name: np.concatenate([x[name][:, 0] for x in found]) for name in found[0]}
    return (
        np.concatenate([block.motion.t for block in blocks]),
        channels,
        (account.balance, momentum(ready.model, blocks)),
    )


def order(errors: list[float]) -> float:
    """Of convergence, from errors with steps halved."""
    return float(np.log2(errors[-2] / errors[-1]))


@pytest.mark.parametrize("model", MODELS)
def test_a_compound_pendulum_swings_as_elliptic_integrals_say(model: str) -> None:
    """From rest level with its pin: the period is 4 K(sin 45°) √(J / (m g L/2)); it is back after one."""
    g = 9.81
    period = 4 * ellipk(0.5) * np.sqrt(INERTIA / (MASS * g * LENGTH / 2))
    errors = []
    for steps in (200, 400):
        t, x, _ = ran(arm(model, 1.25 * period, period / steps, gravity=[0, -g]))
        rate = np.gradient(x["joints/A/angle"], t)
        back = np.flatnonzero((rate[:-1] > 0) & (rate[1:] <= 0))[-1]  # where it turns, after a whole swing
        found = t[back] + (t[1] - t[0]) * rate[back] / (rate[back] - rate[back + 1])
        errors.append(abs(found / period - 1))
        assert x["joints/A/angle"].min() == pytest.approx(-np.pi, rel=2e-3)
    assert errors[-1] < 2e-4
    if model == "rigid":  # a beam vibrates from its start, which hides where it turns to 1e-4
        assert order(errors) > 1.5


@pytest.mark.parametrize("model", MODELS)
def test_a_motor_whose_torque_falls_with_speed_comes_up_exponentially(model: str) -> None:
    """T = T0 (1 − ω/ω0): ω = ω0 (1 − exp(−t/τ)), τ = J ω0 / T0; from the other end of the joint's links alike."""
    T0, w0 = 5.0, 40.0
    tau = INERTIA * w0 / T0
    errors = []
    for steps in (500, 1000):
        motor = {"joint": "A", "torque": {"over": "speed", "at": [0, w0], "value": [T0, 0]}}
        t, x, (balance, _) = ran(arm(model, 2 * tau, tau / steps, motors={"m": motor}))
        turned = w0 * (t - tau * (1 - np.exp(-t / tau)))
        errors.append(float(np.abs(x["motors/m/angle"] - turned).max()) / turned[-1])
    assert errors[-1] < 1e-3
    if model == "rigid":  # a beam vibrates from the sudden torque, which hides the order
        assert order(errors) > 1.5
    assert x["motors/m/speed"][-1] == pytest.approx(w0 * (1 - np.exp(-2)), rel=1e-3)
    assert balance.energy < 2e-3


@pytest.mark.parametrize("model", MODELS)
def test_an_arm_on_a_torsion_spring_rings_down(model: str) -> None:
    """J φ'' + c φ' + k (φ − φ0) = 0 from φ = φ' = 0."""
    k, zeta, free = 20.0, 0.1, 0.6
    w = np.sqrt(k / INERTIA)
    c = 2 * zeta * np.sqrt(k * INERTIA)
    spring = {"kind": "torsion", "joint": "A", "stiffness": k, "damping": c, "free_angle": free}
    errors = []
    for steps in (200, 400):
        t, x, _ = ran(arm(model, 3 * 2 * np.pi / w, 2 * np.pi / w / steps, springs={"s": spring}))
        wd = w * np.sqrt(1 - zeta**2)
        expected = free * (1 - np.exp(-zeta * w * t) * (np.cos(wd * t) + zeta * w / wd * np.sin(wd * t)))
        errors.append(float(np.abs(x["joints/A/angle"] - expected).max()) / free)
    assert errors[-1] < 1e-3


@pytest.mark.parametrize("model", MODELS)
def test_an_arm_set_going_coasts(model: str) -> None:
    """No force about the pin: ω stays as at the start, and the kinetic energy with it."""
    t, x, _ = ran(arm(model, 1.0, 0.002, analysis={"initial_speeds": {"A": "60 rpm"}}))
    # the error of a step: (ω h)²/12 = 1.3e-5, and as much again from the deformation
    np.testing.assert_allclose(x["joints/A/angle"], 2 * np.pi * t, rtol=1e-4, atol=1e-12)
    np.testing.assert_allclose(x["energy/kinetic"], 0.5 * INERTIA * (2 * np.pi) ** 2, rtol=2e-4)


def test_two_flying_links_on_a_spring_keep_momentum_and_energy() -> None:
    """Hinged to each other, with spin, a torsion spring and a damperless line spring between them; nothing else."""
    raw = {
        "links": {"one": bar("rigid"), "other": bar("rigid", LENGTH)},
        "joints": {"B": {"kind": "revolute", "links": ["one", "other"], "at": [LENGTH, 0]}},
        "springs": {
            "t": {"kind": "torsion", "joint": "B", "stiffness": 10, "free_angle": 0.5},
            "l": {"kind": "spring", "stiffness": 300, "free_length": 0.5,
                  "between": [{"link": "one", "at": [0, 0]}, {"link": "other", "at": [2 * LENGTH, 0]}]},
        },
        "analysis": {"end_time": 1.0, "step": 0.001, "rho_inf": 1.0,
                     "initial_motions": {"one": {"at": [0, 0], "velocity": [0.3, 0.2], "angular_velocity": [0, 0, 5]}}},
    }  # fmt: skip
    _, x, (_, kept) = ran(raw)
    stored = 0.5 * 10 * (x["springs/t/angle"] - 0.5) ** 2 + 0.5 * 300 * (x["springs/l/length"] - 0.5) ** 2
    total = x["energy/kinetic"] + x["energy/strain"] + stored
    assert np.ptp(x["springs/t/angle"]) > 0.5  # they swing
    np.testing.assert_allclose(total, total[0], rtol=2e-3)
    assert kept.linear < 1e-6
    assert kept.angular < 1e-4


def test_a_pendulum_hangs_on_a_driven_crank() -> None:
    """Released level on a crank that stands still, it swings as one on the ground; the drive's motion does not matter."""
    raw = arm("rigid", 0.5, 0.001, gravity=[0, -9.81])
    _, alone, _ = ran(raw)
    raw["links"]["crank"] = bar("beam", -LENGTH)
    raw["joints"] = {
        "O": {"kind": "revolute", "links": ["ground", "crank"], "at": [-LENGTH, 0]},
        "A": {"kind": "revolute", "links": ["crank", "arm"], "at": [0, 0]},
    }
    raw["drive"] = {"joint": "O", "motion": {"kind": "constant_speed", "speed": 0}}
    raw["analysis"]["frames"] = "co-rotational"
    raw["springs"] = {"look": {"kind": "torsion", "joint": "A", "damping": 1e-9}}
    _, hung, _ = ran(raw)
    np.testing.assert_allclose(-hung["springs/look/angle"], alone["joints/A/angle"], atol=5e-3)
