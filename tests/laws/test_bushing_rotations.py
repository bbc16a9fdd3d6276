"""Rotations in bushings are rotation vectors: M = k θ about any axis, and the gradient of ½ Σ k θ² where k differ."""

from typing import Any

import numba
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kedfem.dynamics.system.forces import rotations
from kedfem.dynamics.system.march import march
from kedfem.dynamics.system.measures_kernel import rotation_along, tilt_along
from kedfem.dynamics.system.monolithic import monolithic_places as by_monolithic
from kedfem.dynamics.system.record import ROTATION, TILT, Term
from kedfem.dynamics.system.starts.coordinate_rates import value
from kedfem.motion.newton import cross_matrix
from tests.moving import channels, ran
from tests.systems import begun, by_oracle, rows

K = 17.0  # N m/rad
SPREAD = (9.0, 17.0, 40.0)
POINTS = {"o": [0, 0, 0], "x": [0.1, 0, 0], "y": [0, 0.1, 0], "z": [0, 0, 0.1]}
AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1), "oblique": (1, -2, 3), "other": (-3, 1, 2)}
ACROSS = {"x": (1, 0, 0), "y": (0, 1, 0), "oblique": (2, -1, 0)}
HINGES = [("weld", axis) for axis in AXES.values()] + [("revolute", axis) for axis in ACROSS.values()]


def twisted(kind: str, moment: np.ndarray, stiffness: Any, **analysis: Any) -> dict[str, Any]:
    """A block on a bushing of a carriage that a drive holds, under a moment."""
    body = {"model": "rigid", "mass": 1.0, "inertia": [1e-3, 1e-3, 1e-3, 0, 0, 0], "centre": [0, 0, 0]}
    mount = {"kind": kind, "links": ["carriage", "block"], "at": [0, 0, 0], "axis": [0, 0, 1]}
    bushing = {"stiffness": 100.0, "rotational_stiffness": stiffness}
    joints = {
        "D": {"kind": "prismatic", "links": ["ground", "carriage"], "at": [0, 0, 0], "axis": [1, 0, 0]},
        "M": {**mount, "bushing": bushing},
    }
    if kind == "revolute":  # what it releases is held by a spring
        springs = {"S": {"kind": "torsion", "joint": "M", "stiffness": K}}
    return {
        "gravity": [0, 0, 0], "links": {"block": body, "carriage": dict(body)}, "joints": joints,
        "drive": {"joint": "D", "motion": {"kind": "constant_speed", "speed": 1e-9}},
        "loads": {"T": {"kind": "torque", "link": "block", "at": [0, 0, 0], "vector": moment.tolist()}},
        **({"springs": springs} if kind == "revolute" else {}),
        "analysis": {"end_time": 1e-4, "step": 1e-4, "kind": "static", "frames": "co-rotational", **analysis},
        "output": {"probes": {
            name: {"link": "block", "at": at, "quantity": "displacement", "frame": "world"}
            for name, at in POINTS.items()
        }},
    }  # fmt: skip


def found(raw: dict[str, Any]) -> tuple[Rotation, np.ndarray]:
    """Rotation of the block in its balance, and the moment of the bushing on it."""
    every = channels(*ran(raw))
    at = {name: every[f"probes/{name}/displacement"][0] for name in POINTS}
    columns = [10 * (at[name] - at["o"]) for name in "xyz"]
    return Rotation.from_matrix(np.eye(3) + np.column_stack(columns)), every["joints/M/moment"][0]


@pytest.mark.parametrize("angle", [0.05, 0.3])
@pytest.mark.parametrize(("kind", "axis"), HINGES)
def test_a_bushing_that_is_as_stiff_about_all_axes_turns_about_that_of_the_moment(
    kind: str, axis: tuple[int, int, int], angle: float
) -> None:
    """M = k θ, to 1e-8; cosines between axes were off by 7 % at 0.3 rad, and by 2 % at 0.05 about oblique axes."""
    theta = angle * np.array(axis) / np.linalg.norm(axis)
    rotation, moment = found(twisted(kind, K * theta, K))
    np.testing.assert_allclose(rotation.as_rotvec(), theta, rtol=0, atol=1e-8 * angle)
    np.testing.assert_allclose(np.linalg.norm(moment), K * angle, rtol=1e-8)


def test_moments_of_a_bushing_are_the_gradient_of_its_energy() -> None:
    """½ Σ k_i θ_i², θ the rotation vector along axes of the joint, here those of the world less a turn about z."""
    rotation, moment = found(twisted("weld", np.array([2.0, -3.0, 4.0]), SPREAD))
    x, h = np.array([0.0, -1.0, 0.0]), 1e-5  # at right angles to z, and to the world axis farthest from it
    frame = np.stack([x, np.cross([0, 0, 1.0], x), [0, 0, 1.0]])

    def energy(more: np.ndarray) -> float:
        theta = frame @ (Rotation.from_rotvec(more) * rotation).as_rotvec()
        return float(np.array(SPREAD) @ theta**2) / 2

    slope = np.array([(energy(h * e) - energy(-h * e)) / (2 * h) for e in np.eye(3)])
    assert rotation.magnitude() > 0.2
    np.testing.assert_allclose(np.abs(moment), np.abs(slope), rtol=1e-7)  # differences: h² of them


@numba.njit
def along_kernel(tilt: bool, Qi: Any, Qj: Any, axis: Any, b: Any, room: Any) -> float:
    return tilt_along(Qi, Qj, axis, b, room) if tilt else rotation_along(Qi, Qj, b, room)


@pytest.mark.parametrize("kind", [ROTATION, TILT])
@pytest.mark.parametrize("angle", [0.0, 1e-14, 1e-9, 1e-5, 1e-3, 0.03, 0.0999, 0.1001, 0.3, 1.0, 2.0])
def test_values_gradients_and_rates_are_one_rotation(kind: int, angle: float) -> None:
    """Steps, the oracle and starts, each by formulas of its own, and the rotation that was put in."""
    rng = np.random.default_rng(int(1e4 * angle))
    frame, Qj = Rotation.random(rng=rng).as_matrix(), Rotation.random(rng=rng).as_matrix()
    axis, b = frame[2], frame[0]
    n = 0.6 * frame[0] + 0.8 * frame[1] if kind == TILT else 0.48 * frame[0] + 0.64 * frame[1] + 0.6 * axis
    twist = Rotation.from_rotvec(1.3 * axis * (kind == TILT))
    Qi = Qj @ (Rotation.from_rotvec(angle * n) * twist).as_matrix()
    term, room = Term(kind, 0, 1, axis, axis, b), np.zeros((12, 3))
    by_hand = angle * float(n @ b)
    step = along_kernel(kind == TILT, Qi, Qj, axis, b, room)
    apart, gradient = (by_monolithic.rotation_along if kind == ROTATION else by_monolithic.tilt_along)(term, Qi, Qj)
    omega, alpha = rng.normal(size=(2, 3))
    spin = cross_matrix(omega)
    moving = np.stack([Qi, spin @ Qi, (cross_matrix(alpha) + spin @ spin) @ Qi])
    none = np.zeros((3, 3))
    series = value(None, term, (none, moving), (none, np.stack([Qj, 0 * Qj, 0 * Qj])))  # type: ignore[arg-type]
    np.testing.assert_allclose([step, apart, series[0]], by_hand, rtol=0, atol=1e-13)
    if kind == ROTATION:
        moment = rotations.rotation_moment(Qi[None], Qj[None], (Qj @ b)[None])[0]
    else:
        moment = rotations.tilt_moment((Qi @ axis)[None], (Qj @ axis)[None], (Qj @ b)[None])[0]
    np.testing.assert_allclose([room[7], moment], [gradient, gradient], rtol=0, atol=1e-12)
    np.testing.assert_allclose(series[1], gradient @ omega, rtol=0, atol=1e-12)
    h, slopes = 1e-4, []  # the rate's rate by differences: h² of it, and rounding over h
    for s in (h, -h):
        turned = Rotation.from_rotvec(s * omega + s * s / 2 * alpha).as_matrix() @ Qi
        by = (by_monolithic.rotation_along if kind == ROTATION else by_monolithic.tilt_along)(term, turned, Qj)[1]
        slopes.append(float(by @ (omega + s * alpha)))
    np.testing.assert_allclose(series[2], (slopes[0] - slopes[1]) / (2 * h), rtol=0, atol=1e-6)


@pytest.mark.parametrize("kind", ["weld", "revolute"])
def test_steps_with_large_rotations_in_a_bushing_are_those_of_the_oracle(kind: str) -> None:
    """A block that a moment turns by 0.2 rad and more on springs and dampers that differ about all axes."""
    raw = twisted(kind, np.array([2.0, -3.0, 4.0]), SPREAD)
    raw["joints"]["M"]["bushing"]["rotational_damping"] = [0.01, 0.03, 0.02]
    raw["analysis"] = {"end_time": 0.02, "step": 2e-3, "frames": "co-rotational", "rho_inf": 0.8}
    of, count = begun(raw), 10
    wanted, forces = by_oracle(of, count, keeps=kind == "revolute")  # the tangents of a weld change with every step
    _, history = march(of.ready, of.state, of.steps(count))
    assert np.abs(wanted).max() > 5e-3  # of points some 0.03 m from the joint
    np.testing.assert_allclose(rows(of.ready, history.u), wanted, rtol=0, atol=1e-7 * np.abs(wanted).max())
    np.testing.assert_allclose(history.multiplier, forces, rtol=0, atol=1e-6 * np.abs(forces).max())
