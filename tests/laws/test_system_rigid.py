"""Rigid bodies of a system, four points with bars: Euler's equations, lamina inertias, momentum, no stiff penalty."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from kedfem.dynamics.stepping.start import initial_rates
from kedfem.dynamics.system.forces.supports import Supports
from kedfem.dynamics.system.march import march
from kedfem.dynamics.system.ready import displacements
from kedfem.dynamics.system.starts.initial_states import rest
from kedfem.dynamics.system.state import History
from kedfem.dynamics.system.steps import multipliers_of
from kedfem.motion.newton import cross_matrix
from tests.laws.test_system import elements, four_bar
from tests.moving import bar
from tests.systems import Begun, against_oracle, begun

LAMINA = [0.02, 0.05, 0.07, 0.0, 0.0, 0.0]  # kg m²: Ixx + Iyy = Izz
SOLID = [0.03, 0.05, 0.06, 0.0, 0.0, 0.0]


def top(inertia: list[float], spin: list[float], step: float = 1e-3, **more: Any) -> Begun:
    """A body of 2 kg on a ball joint at its centre, the middle of a face of its carrier of next to no mass."""
    link = {**bar("rigid", (-0.1, 0, -0.01), (0.1, 0, -0.01)), "material": "nothing"}
    body = {"kind": "rigid_body", "link": "body", "at": [0, 0, 0], "mass": 2.0, "centre": [0, 0, 0]}
    raw: dict[str, Any] = {
        "links": {"body": link},
        "joints": {"A": {"kind": "spherical", "links": ["ground", "body"], "at": [0, 0, 0]}},
        "materials": {"nothing": {"youngs_modulus": 2e11, "density": 1e-9, "poisson_ratio": 0.3}},
        "bodies": {"mass": {**body, "inertia": inertia}},
        "analysis": {
            "end_time": 1.0, "step": step, "rho_inf": 0.9,
            "initial_motions": {"body": {"at": [0, 0, 0], "angular_velocity": spin}},
        },
        **more,
    }  # fmt: skip
    of = begun(raw, today=False)
    rates = initial_rates(of.prepared.scene, of.prepared.linkage, of.prepared.path, of.ready.system.model)
    return Begun(of.prepared, of.ready, rest(of.ready, of.motion, rates), of.motion)


def orientation(of: Begun, u: np.ndarray) -> np.ndarray:
    """R (T, 3, 3) of the body: u = X (Rᵀ − 1)."""
    X = of.ready.system.model.links[0].X
    rows = displacements(of.ready, 0, u) + X
    return (
        np.linalg.lstsq(X, rows.transpose(1, 0, 2).reshape(len(X), -1), rcond=None)[0]
        .reshape(3, -1, 3)
        .transpose(1, 2, 0)
    )


def euler(inertia: list[float], spin: list[float], end: float) -> np.ndarray:
    """R at the end, I ω' = −ω × I ω in the body."""
    moments = np.array(inertia[:3])

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        R, w = y[:9].reshape(3, 3), y[9:]
        return np.concatenate([(R @ cross_matrix(w)).ravel(), -np.cross(w, moments * w) / moments])

    start = np.concatenate([np.eye(3).ravel(), spin])
    return solve_ivp(rate, (0, end), start, rtol=1e-11, atol=1e-12).y[:9, -1].reshape(3, 3)


@pytest.mark.parametrize("inertia", [LAMINA, SOLID])
def test_a_free_body_turns_as_euler_says(inertia: list[float]) -> None:
    """About its middle axis, which is unstable: order 2 in the step, 1e-3 with 400 steps a second; rigid to rounding."""
    spin, end = [0.05, 8.0, 0.05], 0.8
    wanted, errors = euler(inertia, spin, end), []
    for step in (5e-3, 2.5e-3):
        of = top(inertia, spin, step)
        _, history = march(of.ready, of.state, of.steps(round(end / step)))
        R = orientation(of, history.u)
        assert np.abs(R.transpose(0, 2, 1) @ R - np.eye(3)).max() < 1e-8
        errors.append(np.abs(R[-1] - wanted).max())
    assert errors[1] < 5e-3
    assert 3.5 < errors[0] / errors[1] < 4.6


def test_a_body_keeps_energy_and_momentum() -> None:
    """Over 1 s at ρ∞ = 0.9: both within 1e-4."""
    of = top(SOLID, [3.0, 8.0, 1.0])
    _, history = march(of.ready, of.state, of.steps(1000))
    link = of.ready.system.model.links[0]
    v, x = (displacements(of.ready, 0, y) for y in (history.v, history.u))
    energy = 0.5 * np.einsum("tna,tna->t", v, np.einsum("nm,tma->tna", link.mass[0], v))
    momentum = np.cross(x + link.X, np.einsum("nm,tma->tna", link.mass[0], v)).sum(axis=1)
    assert_allclose(energy, energy[0], rtol=1e-4)
    assert_allclose(momentum, momentum[:1] + 0 * momentum, atol=1e-4 * np.linalg.norm(momentum[0]))


def test_a_body_moves_as_by_the_oracle() -> None:
    of = top(SOLID, [3.0, 8.0, 1.0], gravity=[0, -9.81, 0])
    assert against_oracle(of, 3) < 1e-7


@pytest.mark.parametrize(
    ("frames", "driven", "acting"),
    [("rigid-body", True, False), ("co-rotational", True, True), ("co-rotational", False, True)],
)
def test_a_rigid_link_among_beams_moves_as_by_the_oracle_and_keeps_its_length(
    frames: str, driven: bool, acting: bool
) -> None:
    """In rigid-body frames its bars are linear: one pass a step; else exact. A spring about a hinge and a motor act."""
    more = elements() if acting else {}
    more.get("springs", {}).pop("line", None)  # the oracle's iterations do not converge with it beside bars
    raw = four_bar(**more)
    raw["links"]["coupler"] = bar("rigid", (0.1, 0), (0.35, 0.2))
    of = begun(raw, frames, driven)
    state, history = march(of.ready, of.state, of.steps(5))
    assert against_oracle(of, 3) < 1e-7
    assert (state.passes[2] == 1) == (frames == "rigid-body")
    bars = [n for n, x in enumerate(of.ready.system.constraints) if x.name.startswith("rigid.")]
    assert len(bars) == 6
    assert np.abs(history.e[:, bars]).max() < 1e-12


def joint_force(of: Begun, history: History, k: int, joint: str) -> np.ndarray:
    """What a joint of shared interface points exerts on body k over time, world components (T, 3)."""
    ports = of.ready.system.model.joints[k]
    every = history.port_force @ ports.shares.T
    along = of.motion(of.ready.c.h * np.arange(1, len(every) + 1))
    seen = Supports(multipliers_of(of.ready, history), along)
    every += seen.on_interface(of.ready.system.model.rows) @ ports.from_rows.T
    rows = every.reshape(len(every), len(ports.points), ports.components)
    own = [name == joint for name in ports.joints]
    return np.asarray(rows[:, own].sum(axis=1)[:, :3])


def test_a_rigid_link_strikes_no_higher_than_its_elastic_neighbour_rings() -> None:
    """A rigid arm that spins with a short elastic one at its end, 8 % of the pull: a stiff one rang by more each step."""
    links = {"arm": bar("rigid", (0, 0), (0.5, 0)), "other": bar("beam", (0.5, 0), (0.52, 0), 1)}
    hinge = {"kind": "revolute"}
    joints = {
        "A": {**hinge, "links": ["ground", "arm"], "at": [0, 0]},
        "B": {**hinge, "links": ["arm", "other"], "at": [0.5, 0]},
    }
    analysis = {"end_time": 0.02, "step": 1e-4, "rho_inf": 0.8, "initial_speeds": {"A": 20.0, "B": 0.0}}
    of = begun({"links": links, "joints": joints, "analysis": analysis})
    rates = initial_rates(of.prepared.scene, of.prepared.linkage, of.prepared.path, of.ready.system.model)
    _, history = march(of.ready, rest(of.ready, of.motion, rates), of.steps(40))
    force = np.linalg.norm(joint_force(of, history, 0, "A"), axis=1)
    mass = 7850 * 0.03 * 0.02 * np.array([0.5, 0.02])
    wanted = 20.0**2 * (mass[0] * 0.25 + mass[1] * 0.51)
    assert_allclose(force, wanted, rtol=0.15)
