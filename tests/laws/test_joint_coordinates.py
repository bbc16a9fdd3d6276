"""Springs, motors and limits on a chosen coordinate of planar and universal joints, by formulas of their own."""

import re
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from kedfem.errors import SceneError
from kedfem.scene import scene_from
from tests.moving import beam_in_space, channels, ran, turned

DIRECTIONS = {
    "z": np.eye(3), "x": Rotation.from_euler("y", 90, degrees=True).as_matrix(),
    "y": Rotation.from_euler("x", -90, degrees=True).as_matrix(),
    "oblique": Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix(),
}  # fmt: skip
MASS, INERTIA, OMEGA, RADIUS = 2.0, 3e-3, 4.0, 0.3
STIFF, DAMP, PUSH, FREE = 300.0, 1.5, 6.0, 0.02
TWIST, LAG, TORQUE = 0.9, 0.3, 0.11
BODY = {"model": "rigid", "mass": MASS, "inertia": [INERTIA] * 3 + [0, 0, 0]}
SKEW = np.array([0.6, 0.8])  # direction of a force in the plane


def table(step: float = 5e-4, frames: str = "co-rotational") -> dict[str, Any]:
    """A puck on a turntable about z: springs along x and y of the table and about z, a force and a torque."""
    x, y = [1, 0, 0], [0, 1, 0]
    return {
        "gravity": [0, 0, 0],
        "links": {"table": BODY | {"centre": [0, 0, 0]}, "puck": BODY | {"centre": [RADIUS, 0, 0]}},
        "joints": {
            "A": {"kind": "revolute", "links": ["table", "ground"], "at": [0, 0, 0], "axis": [0, 0, 1]},
            "P": {"kind": "planar", "links": ["puck", "table"], "at": [RADIUS, 0, 0], "axis": [0, 0, 1]},
        },
        "springs": {
            "x": {"kind": "spring", "joint": "P", "along": x, "stiffness": STIFF, "free_travel": FREE},
            "y": {"kind": "spring", "joint": "P", "along": y, "stiffness": 2 * STIFF, "damping": DAMP},
            "turn": {"kind": "torsion", "joint": "P", "stiffness": TWIST, "free_angle": LAG},
        },
        "motors": {
            "f": {"joint": "P", "along": [*SKEW.tolist(), 0], "force": PUSH},
            "t": {"joint": "P", "torque": TORQUE},
        },
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": OMEGA}},
        "analysis": {"end_time": 0.4, "step": step, "rho_inf": 0.9, "frames": frames, "accuracy": "quick"},
    }  # fmt: skip


def puck(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Displacements on the table (T, 2) and the rotation (T,), from rest there: its equation in the table's frame."""
    k, c = np.diag([STIFF, 2 * STIFF]), np.diag([0.0, DAMP])
    turning = 2 * OMEGA * np.array([[0.0, -1.0], [1.0, 0.0]])
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [OMEGA**2 * np.eye(2) - k / MASS, -turning - c / MASS]])
    constant = np.array([0, 0, STIFF * FREE + PUSH * SKEW[0], PUSH * SKEW[1]]) / MASS + [0, 0, OMEGA**2 * RADIUS, 0]
    still = np.linalg.solve(A, -constant)
    path = np.array([still + expm(A * x) @ -still for x in t])[:, :2]
    mean = LAG + TORQUE / TWIST
    return path, mean * (1 - np.cos(np.sqrt(TWIST / INERTIA) * t))


def every_channel(raw: dict[str, Any]) -> dict[str, np.ndarray]:
    return channels(*ran(raw))


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_a_puck_on_a_turntable_between_springs(direction: str) -> None:
    found = every_channel(turned(table(), DIRECTIONS[direction]))
    t = np.linspace(0, 0.4, len(found["springs/x/travel"]))
    path, angle = puck(t)
    size = np.abs(path).max()
    assert_allclose(found["springs/x/travel"][:, 0], path[:, 0], atol=1e-3 * size)
    assert_allclose(found["springs/y/travel"][:, 0], path[:, 1], atol=1e-3 * size)
    assert_allclose(found["motors/f/travel"][:, 0], path @ SKEW, atol=1e-3 * size)
    assert_allclose(found["springs/turn/angle"][:, 0], angle, atol=2e-3 * np.abs(angle).max())
    assert_allclose(found["motors/t/angle"][:, 0], found["springs/turn/angle"][:, 0], atol=1e-12)


BEND, K, STEADY = 0.6, (0.4, 0.25), 0.03


def shafts(kind: str, **more: Any) -> dict[str, Any]:
    """Two shafts with a cross between them, at BEND; springs about both of its axes, and a motor about one."""
    d, n = np.array([np.cos(BEND), np.sin(BEND), 0]), [-np.sin(BEND), np.cos(BEND), 0]
    end = (0.25 * d).tolist()
    links: dict[str, Any] = {
        "first": beam_in_space((-0.3, 0, 0), (0, 0, 0), 2), "second": beam_in_space((0, 0, 0), end, 2),
    }  # fmt: skip
    if kind == "rigid":
        light = {"model": "rigid", "mass": 1e-6, "inertia": [1e-9, 1e-9, 1e-9, 0, 0, 0]}
        links = {name: {**light, "centre": at} for name, at in (("first", [-0.2, 0, 0]), ("second", end))}
    return {
        "gravity": [0, 0, 0], "links": links,
        "joints": {
            "A": {"kind": "revolute", "links": ["ground", "first"], "at": [-0.3, 0, 0], "axis": [1, 0, 0]},
            "U": {"kind": "universal", "links": ["first", "second"], "at": [0, 0, 0], "axes": [[0, 0, 1], n]},
            "B": {"kind": "cylindrical", "links": ["second", "ground"], "at": end, "axis": d.tolist()},
        },
        "springs": {
            "one": {"kind": "torsion", "joint": "U", "about": "first", "stiffness": K[0], "free_angle": LAG},
            "two": {"kind": "torsion", "joint": "U", "about": "second", "stiffness": K[1]},
        },
        "motors": {"m": {"joint": "U", "about": "second", "torque": STEADY}},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 0.5}},
        "analysis": {"end_time": 6.0, "step": 0.3, "rho_inf": 0.5, "kind": "quasi-static", "accuracy": "quick", **more},
    }  # fmt: skip


def cross_angles(phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angles about the first shaft's axis of the cross and about the second's, by vectors."""
    x, z, d, n = (
        np.eye(3)[0],
        np.eye(3)[2],
        np.array([np.cos(BEND), np.sin(BEND), 0]),
        np.array([-np.sin(BEND), np.cos(BEND), 0]),
    )
    out = []
    for angle in phi:
        first = Rotation.from_rotvec(angle * x)
        a1 = first.apply(z)
        a2 = np.cross(a1, d) / np.linalg.norm(np.cross(a1, d))
        second = Rotation.from_rotvec(np.arctan2(d @ np.cross(n, a2), n @ a2) * d)
        drawn1, drawn2 = first.apply(n), second.apply(z)
        out.append(
            (np.arctan2(a1 @ np.cross(drawn1, a2), drawn1 @ a2), np.arctan2(a2 @ np.cross(drawn2, a1), drawn2 @ a1))
        )
    one, two = np.array(out).T
    return one, two


@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
@pytest.mark.parametrize("kind", ["rigid", "beam"])
@pytest.mark.parametrize("direction", ["z", "oblique"])
def test_springs_about_both_axes_of_a_cross_do_what_virtual_work_says(kind: str, frames: str, direction: str) -> None:
    found = every_channel(turned(shafts(kind, frames=frames), DIRECTIONS[direction]))
    phi = 0.5 * np.linspace(0, 6.0, len(found["drive/torque"]))
    (one, two), small = cross_angles(phi), 1e-5
    rates = [(b - a) / (2 * small) for a, b in zip(cross_angles(phi - small), cross_angles(phi + small), strict=True)]
    torque = K[0] * (one - LAG) * rates[0] + (K[1] * two - STEADY) * rates[1]
    within = 1e-6 if kind == "rigid" else 1e-3
    assert np.abs(two).max() > 0.5
    assert_allclose(found["springs/one/angle"][:, 0], one, atol=within)
    assert_allclose(found["springs/two/angle"][:, 0], two, atol=within)
    assert_allclose(found["motors/m/angle"][:, 0], two, atol=within)
    assert_allclose(found["drive/torque"][:, 0], torque, atol=within * np.abs(torque).max())


@pytest.mark.parametrize(
    ("scene", "section", "change", "said"),
    [
        (table, "springs/x", {"along": None}, "springs.x.along: is required on a planar joint"),
        (
            table,
            "motors/f",
            {"along": [0, 0.6, 0.8]},
            "motors.f.along: must be in the plane of joint 'P', got 53.1301 deg",
        ),
        (table, "springs/turn", {"about": "puck"}, "springs.turn.about: must be given on a universal joint only"),
        (lambda: shafts("rigid"), "springs/one", {"about": None}, "springs.one.about: is required on a universal joint"),
        (lambda: shafts("rigid"), "motors/m", {"about": "third"}, "motors.m.about: must name a link of the joint"),
    ],
)
def test_coordinates_that_a_joint_has_not_are_refused(scene: Any, section: str, change: Any, said: str) -> None:
    raw, (kind, name) = scene(), section.split("/")
    raw[kind][name] = {key: value for key, value in (raw[kind][name] | change).items() if value is not None}
    with pytest.raises(SceneError, match=re.escape(said)):
        scene_from(raw)
