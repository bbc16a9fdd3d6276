"""Slots along rigid links without elements: by numbers, or lines of few nodes, as the dynamics by hand has them."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kedfem.accuracy.histories import histories
from kedfem.accuracy.prepared import meshed
from kedfem.errors import MeshError
from kedfem.scene import scene_from

RADIUS, SPEED, PIVOT, MASS, INERTIA = 0.2, 10.0, np.array([0.5, 0.2]), 2.0, np.array([0.02, 0.02, 0.03])
FRAMES = {
    "z": np.eye(3), "y": Rotation.from_rotvec([np.pi / 2, 0, 0]).as_matrix(),
    "x": Rotation.from_rotvec([0, np.pi / 2, 0]).as_matrix(),
    "oblique": Rotation.from_rotvec([0.5, -1.0, 0.3]).as_matrix(),
}  # fmt: skip


def rotated(angle: float, v: Any) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * v[0] - s * v[1], s * v[0] + c * v[1]])


def direction(askew: float) -> np.ndarray:
    """Of the slot, in the reference position: from the pin's centre to the pivot, turned."""
    d = rotated(askew, PIVOT - [RADIUS, 0.0])
    return np.asarray(d / np.linalg.norm(d))


def numbers(R: np.ndarray, mass: float, centre: list[float], inertia: Any) -> dict[str, Any]:
    J = (R @ np.diag(inertia) @ R.T)[[0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]
    return {"model": "rigid", "mass": mass, "centre": (R @ centre).tolist(), "inertia": J.tolist()}


def quick_return(R: np.ndarray, askew: float) -> dict[str, Any]:
    """A crank whose pin turns a guide about a pivot of its own; all in one plane of any direction."""

    def world(*x: float) -> list[float]:
        return np.asarray(R @ np.array([*x, 0.0, 0.0][:3])).tolist()

    return {
        "links": {
            "crank": numbers(R, 1.0, [RADIUS / 2, 0.0, 0.0], [0.01] * 3),
            "guide": numbers(R, MASS, [0.3, 0.05, 0.0], INERTIA),
        },
        "joints": {
            "A": {"kind": "revolute", "links": ["ground", "crank"], "at": world(0.0), "axis": world(0, 0, 1)},
            "S": {"kind": "slot", "links": ["crank", "guide"], "at": world(RADIUS), "axis": world(*direction(askew))},
            "D": {"kind": "revolute", "links": ["ground", "guide"], "at": world(*PIVOT), "axis": world(0, 0, 1)},
        },
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": SPEED}},
        "gravity": world(0, -9.81),
        "analysis": {"revolutions": 0.4, "steps_per_revolution": 720, "initial": "quasi-static"},
    }


def by_hand(t: np.ndarray, askew: float) -> tuple[np.ndarray, np.ndarray]:
    """The pin's force on the guide and the drive's torque: Newton's law of the guide, whose line stays on the pin."""
    n0, pin0 = rotated(np.pi / 2, direction(askew)), np.array([RADIUS, 0.0]) - PIVOT
    away, centre = pin0 @ n0, np.array([0.3, 0.05]) - PIVOT

    def pin(t: float) -> np.ndarray:
        return RADIUS * np.array([np.cos(SPEED * t), np.sin(SPEED * t)])

    def turn(t: float) -> float:  # the angle between pivot-pin and the line's normal is arccos(away / distance)
        w = pin(t) - PIVOT
        side = np.sign(pin0[0] * n0[1] - pin0[1] * n0[0])
        seen = np.arctan2(pin0[0] * w[1] - pin0[1] * w[0], pin0 @ w)
        return float(seen + side * (np.arccos(away / np.hypot(*w)) - np.arccos(away / np.hypot(*pin0))))

    forces, torques, h = [], [], 1e-4
    for at in t:
        angle = turn(at)
        acceleration = (turn(at + h) - 2 * angle + turn(at - h)) / h**2
        c, n, P = rotated(angle, centre), rotated(angle, n0), pin(at)
        w = P - PIVOT
        moment = (INERTIA[2] + MASS * centre @ centre) * acceleration + c[0] * MASS * 9.81
        forces.append(moment / (w[0] * n[1] - w[1] * n[0]))
        torques.append((P[0] * n[1] - P[1] * n[0]) * forces[-1] + 9.81 * P[0] / 2)
    return np.array(forces), np.array(torques)


@pytest.mark.parametrize("askew", [0.0, 0.8], ids=["through the pivot", "askew"])
@pytest.mark.parametrize("frame", FRAMES)
def test_a_slot_on_a_link_by_numbers_bears_what_newton_says(frame: str, askew: float) -> None:
    """The hand's own error are differences of 1e-4 s."""
    found = histories(meshed(scene_from(quick_return(FRAMES[frame], askew))))
    force, torque = (found.channels[name][1] for name in ("joints/S/force", "drive/torque"))
    forces, torques = by_hand(found.time, askew)
    assert np.abs(np.linalg.norm(force, axis=1) - np.abs(forces)).max() < 3e-6 * np.abs(forces).max()
    assert np.abs(torque[:, 0] - torques).max() < 3e-6 * np.abs(torques).max()


def polyline(*points: list[float]) -> dict[str, Any]:
    shape = {"kind": "polyline", "points": list(points), "width": 0.02, "thickness": 0.02}
    return {"model": "rigid", "material": "steel", "shape": shape}


def test_a_slot_on_a_rigid_line_needs_no_elements_but_two_nodes_and_its_length() -> None:
    raw = quick_return(np.eye(3), 0.0)
    raw["links"]["guide"] = polyline([0.5, 0.2], [-0.1, -0.2])
    assert histories(meshed(scene_from(raw))).time.size
    raw["links"]["guide"] = polyline([0.5, 0.2], [0.19, -0.02 / 3])
    with pytest.raises(MeshError, match=r"^joints\.S: the pin must stay on link 'guide', which reaches from"):
        meshed(scene_from(raw))
    raw["joints"]["S"]["axis"] = [0, 1]
    with pytest.raises(
        MeshError, match=r"^joints\.S: the line of a slot must run along the axis of the rigid line 'guide'"
    ):
        meshed(scene_from(raw))
