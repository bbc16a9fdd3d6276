"""What `kedfem new` writes, run, beside statics by hand: virtual work, weights and levers."""

import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.testing import assert_allclose

from kedfem.analysis import analyse
from kedfem.results import Results
from kedfem.scene import scene_from

G = 9.81
STEEL, ALUMINIUM = 7850.0, 2700.0  # kg/m³, of the materials that scenes know by name


def template(kind: str) -> dict[str, Any]:
    return tomllib.loads((files("kedfem") / "templates" / f"{kind}.toml").read_text(encoding="utf-8"))


def run(raw: dict[str, Any], folder: Path, **analysis: Any) -> Results:
    """Without pictures, at plain defaults."""
    raw["analysis"] |= {"accuracy": "quick", **analysis}
    raw["output"] |= {"plots": False, "picture": False}
    return analyse(scene_from(raw, folder)).results


def test_a_press_needs_the_torque_of_its_force_times_the_way_of_its_ram(tmp_path: Path) -> None:
    """T = F dy/dφ, y = r sin φ − √(L² − r² cos² φ); slowly and without weight, so that inertia is little."""
    raw = template("press") | {"gravity": [0, 0, 0]}
    raw["parameters"]["strokes"] = "6 rpm"
    found = run(raw, tmp_path, steps_per_revolution=1440, revolutions=1)
    r, length, phi = 0.03, 0.3, found.angle
    slope = r * np.cos(phi) - r**2 * np.sin(phi) * np.cos(phi) / np.sqrt(length**2 - (r * np.cos(phi)) ** 2)
    force = 1e5 * np.interp(np.degrees(phi), [235, 245, 265, 272], [0.0, 0.7, 1.0, 0.0])
    torque = found.channels["drive/rigid_torque"][1][:, 0]
    assert_allclose(torque, -force * slope, atol=2e-3 * np.abs(force * slope).max())
    pressed = found.channels["probes/rod_stress/stress"][1][:, 0].min()
    assert_allclose(pressed, -1e5 / 0.06**2, rtol=0.01)  # σ = F/A


def test_the_cylinder_of_a_lift_does_the_work_that_lifts_the_weights(tmp_path: Path) -> None:
    """F = dV/dl: the load, the platform, two arms, barrel and rod, lifted slowly."""
    raw = template("scissor_lift")
    raw["drive"]["motion"]["rise"] = "30 s"
    found = run(raw, tmp_path, end_time="30 s", step="0.05 s")
    low = np.radians(20.0)
    arm, area, tube, rod = STEEL * 0.08 * 0.04, 0.08 * 0.04, np.pi * (0.03**2 - 0.025**2), np.pi * 0.015**2

    def place(theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Hinges of the cylinder: a tenth along the first arm, eight tenths along the second."""
        c, s = np.cos(theta), np.sin(theta)
        return np.array([0.1 * c, 0.1 * s]), np.array([0.2 * c, 0.8 * s])

    def length(theta: np.ndarray) -> np.ndarray:
        p, q = place(theta)
        return np.asarray(np.linalg.norm(q - p, axis=0))

    half = length(np.array(low)) / 2
    barrel, piston = STEEL * tube * half, STEEL * rod * half

    def potential(theta: np.ndarray) -> np.ndarray:
        (_, low_end), (_, high_end) = place(theta)
        unit = (high_end - low_end) / length(theta)
        hinges = (500 + STEEL * area) * np.sin(theta) + arm * np.sin(theta)
        return np.asarray(
            G * (hinges + barrel * (low_end + unit * half / 2) + piston * (high_end - unit * half / 2))
        )

    angles = np.linspace(low, np.radians(60.0), 20_001)
    force = np.gradient(potential(angles), angles) / np.gradient(length(angles), angles)
    travel = length(angles) - length(np.array(low))
    expected = np.interp(found.angle, travel, force)
    assert_allclose(found.channels["drive/rigid_force"][1][1:-1, 0], expected[1:-1], rtol=2e-3)
    height = found.channels["probes/platform/position"][1][-1, 1]
    assert_allclose(height, np.sin(np.interp(0.15, travel, angles)), rtol=2e-3)  # less what the arms bend


def test_the_drives_of_a_robot_hold_its_weights(tmp_path: Path) -> None:
    """T = Σ m g x at rest, before the motion and after it."""
    found = run(template("robot_arm"), tmp_path, end_time="1.5 s", step="2 ms")
    upper = ALUMINIUM * np.pi * (0.035**2 - 0.031**2) * 0.4
    fore = ALUMINIUM * np.pi * (0.025**2 - 0.022**2) * 0.35
    for row, shoulder, elbow, tolerance in ((0, 0.0, 0.0, 2e-3), (-1, -40.0, 60.0, 1e-2)):
        a, b = np.radians(shoulder), np.radians(shoulder + elbow)
        hand = 0.35 * np.cos(b)
        about_elbow = G * (3 * hand + fore * hand / 2)
        about_shoulder = about_elbow + G * ((3 + fore) * 0.4 * np.cos(a) + upper * 0.2 * np.cos(a))
        for name, torque in (("elbow", about_elbow), ("shoulder", about_shoulder)):
            value = found.channels[f"drive/{name}/torque"][1][row, 0]
            assert_allclose(abs(value), torque, rtol=tolerance)
        assert abs(found.channels["drive/turn/torque"][1][row, 0]) < 0.05 * about_shoulder
