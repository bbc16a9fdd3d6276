"""Quasi-static starts of scenes that nothing drives: links begin deflected as their rigid-body acceleration asks."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.moving import channels, ran, state
from tests.rooms.test_initial_deflection import BENDING, LENGTH, MASS

from .test_follower_loads import ASKEW, arm

GRAVITY, AXIS = 9.81, {"x": [[0, 0, 1], [1, 0, 0], [0, 1, 0]], "y": [[0, 1, 0], [0, 0, 1], [1, 0, 0]]}


def released(kind: str, R: np.ndarray, elements: int = 6, **analysis: Any) -> dict[str, Any]:
    """An arm along R e_x that hangs on a hinge about R e_z, and falls along −R e_y."""
    down = R @ [0, -GRAVITY, 0]
    return {
        "links": {"arm": arm(kind, R, elements)},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0, 0], "axis": R[:, 2].tolist()}},
        "gravity": down.tolist() if kind != "beam" else down[:2].tolist(),
        "analysis": {"end_time": 0.01, "step": 2e-5, "rho_inf": 0.95, **analysis},
    }  # fmt: skip


def strain(raw: dict[str, Any]) -> np.ndarray:
    """Strain energy over time [J]."""
    ready, blocks = ran(raw)
    return sum(state(blocks, k, "strain") for k in range(len(ready.model.links)))


CASES = [
    ("beam", np.eye(3), 6),
    ("spatial beam", np.eye(3), 6),
    ("spatial beam", np.array(AXIS["x"]).T, 6),
    ("spatial beam", np.array(AXIS["y"]).T, 6),
    ("spatial beam", ASKEW, 6),
    ("solid", ASKEW, 6),
    ("solid", np.eye(3), 18),
]


@pytest.mark.parametrize(("kind", "R", "elements"), CASES)
def test_an_arm_that_is_released_is_bent_at_once_and_does_not_ring(kind: str, R: Any, elements: int) -> None:
    """Angular acceleration 3 g/(2 L): each metre bears m (g − α x), whose bending moments are in closed form."""
    x = np.linspace(0, LENGTH, 20_001)
    rest = LENGTH - x
    M = MASS[kind] * GRAVITY * (
        rest**2 / 2 - 3 / (4 * LENGTH) * (LENGTH**2 * rest - (LENGTH**3 - x**3) / 3)
    )  # fmt: skip
    energy = np.trapezoid(M**2, x) / (2 * BENDING[kind])
    found = strain(released(kind, R, elements, initial="quasi-static"))
    assert_allclose(found[0], energy, rtol=0.02)
    assert np.abs(found / found[0] - 1).max() < 0.03
    assert strain(released(kind, R, elements)).max() > 2 * energy


@pytest.mark.parametrize(("kind", "R", "elements"), CASES[:6])
def test_damping_in_proportion_to_mass_slows_what_nothing_drives(kind: str, R: Any, elements: int) -> None:
    """Its force is −α M v, of a rigid motion −α times its momentum: ω = ω₀ exp(−α t); the energy is dissipated."""
    alpha, end = 8.0, 0.1
    raw = released(kind, R, 2, end_time=end, step=1e-3, rho_inf=0.8, initial_speeds={"A": 4.0})
    found = channels(*ran({**raw, "gravity": [0.0] * len(raw["gravity"]), "damping": {"alpha": alpha}}))
    t = np.linspace(0, end, len(found["energy/kinetic"]))
    kinetic, dissipated = found["energy/kinetic"][:, 0], found["energy/dissipated"][:, 0]
    assert_allclose(kinetic, kinetic[0] * np.exp(-2 * alpha * t), rtol=1e-4)
    assert_allclose(dissipated, kinetic[0] - kinetic, atol=1e-4 * kinetic[0])
    assert np.abs(found["energy/residual"]).max() < 1e-4 * kinetic[0]


def test_an_arm_that_spins_freely_begins_stretched() -> None:
    """Tension m ω² (L² − x²)/2 has the energy m² ω⁴ L⁵/(15 E A); from rest it rings."""
    omega, area, E = 30.0, 0.02**2, 2.1e11
    raw = released("beam", np.eye(3), initial="quasi-static", initial_speeds={"A": omega}) | {"gravity": [0, 0]}
    found = strain(raw)
    assert_allclose(found, MASS["beam"] ** 2 * omega**4 * LENGTH**5 / (15 * E * area), rtol=0.01)
