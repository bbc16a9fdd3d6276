"""Static balances far from the drawn position: an arm that a torsion spring turns against its weight, as by hand."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from kedfem.accuracy.histories import histories
from kedfem.accuracy.prepared import meshed
from kedfem.scene import scene_from

WIDTH, THICKNESS, DENSITY, STIFFNESS, GRAVITY = 0.02, 0.01, 7850.0, 50.0, 9.81
LINES = {"straight": [[0.0, 0.0], [0.3, 0.0]], "bent": [[0.0, 0.0], [0.2, 0.0], [0.3, 0.1]]}
FRAMES = {
    "plane": np.eye(3),
    "x": Rotation.from_rotvec([0, np.pi / 2, 0]).as_matrix(),
    "oblique": Rotation.from_rotvec([0.5, -1.0, 0.3]).as_matrix(),
}


def arm(model: str, line: str, free: float, R: np.ndarray, ground: str = "ground") -> dict[str, Any]:
    def world(*x: float) -> list[float]:
        return np.asarray(R @ np.array([*x, 0.0][:3])).tolist()

    shape = {
        "kind": "polyline", "points": [world(*P) for P in LINES[line]], "width": WIDTH, "thickness": THICKNESS,
        "up": world(0.0, 0.0, 1.0),
    }  # fmt: skip
    return {
        "links": {"arm": {"model": model, "material": "steel", "shape": shape}},
        "joints": {"A": {"kind": "revolute", "links": ["arm", ground], "at": [0, 0, 0], "axis": world(0, 0, 1)}},
        "springs": {"t": {"kind": "torsion", "joint": "A", "stiffness": STIFFNESS, "free_angle": free}},
        "gravity": world(0.0, -GRAVITY),
        "output": {"probes": {"tip": {"link": "arm", "at": world(*LINES[line][-1]), "quantity": "position"}}},
        "analysis": {"kind": "static"},
    }


def by_hand(line: str, free: float) -> tuple[np.ndarray, float]:
    """Tip in the plane, and the weight: k (φ₀ − φ) = m g x(φ)."""
    points = np.array(LINES[line])
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    mass = DENSITY * WIDTH * THICKNESS * lengths.sum()
    centre = lengths @ (points[1:] + points[:-1]) / 2 / lengths.sum()

    def turned(angle: float, v: np.ndarray) -> np.ndarray:
        c, s = np.cos(angle), np.sin(angle)
        return np.array([c * v[0] - s * v[1], s * v[0] + c * v[1]])

    angle = brentq(lambda x: STIFFNESS * (free - x) - mass * GRAVITY * turned(x, centre)[0], free - 1, free + 1)
    return turned(angle, points[-1]), mass * GRAVITY


CASES = [
    *(("rigid", line, free, frame) for line in LINES for free in (0.3, -2.0) for frame in FRAMES),
    ("beam", "straight", 0.3, "plane"), ("beam", "straight", 1.0, "plane"),
]  # fmt: skip


@pytest.mark.parametrize(("model", "line", "free", "frame"), CASES)
def test_an_arm_on_a_torsion_spring_balances_where_it_does_by_hand(
    model: str, line: str, free: float, frame: str
) -> None:
    """However far it is from the drawn position; elastic arms bend by some 1e-5 of their length."""
    R = FRAMES[frame]
    found = histories(meshed(scene_from(arm(model, line, free, R)))).channels
    place, (tip, weight) = found["probes/tip/position"][1][-1], by_hand(line, free)
    assert_allclose(place, (R @ [*tip, 0.0])[: len(place)], atol=3e-6 if model == "rigid" else 3e-5)
    assert_allclose(found["joints/A/force"][1][-1], R @ [0.0, weight, 0.0], atol=1e-5 * weight)


def test_a_pendulum_on_what_a_drive_moves_begins_in_its_balance() -> None:
    """The same arm on a driven crank that hardly moves yet, and bends by 2e-5 of its length, quasi-static."""
    raw = arm("rigid", "straight", 1.0, np.eye(3), "crank")
    crank = {"kind": "polyline", "points": [[-0.1, 0.0], [0.0, 0.0]], "width": WIDTH, "thickness": THICKNESS}
    raw["links"] = {"crank": {"model": "beam", "material": "steel", "shape": crank}} | raw["links"]
    raw["joints"]["O"] = {"kind": "revolute", "links": ["ground", "crank"], "at": [-0.1, 0.0]}
    raw["drive"] = {"joint": "O", "motion": {"kind": "constant_speed", "speed": 1e-4}}
    raw["analysis"] = {"end_time": 1e-3, "step": 1e-3, "frames": "co-rotational", "initial": "quasi-static"}
    found = histories(meshed(scene_from(raw))).channels
    assert_allclose(found["probes/tip/position"][1][0][:2], by_hand("straight", 1.0)[0], atol=1e-4)
