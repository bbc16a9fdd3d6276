"""What `kedfem new` writes, run, beside statics by hand: virtual work, weights and levers."""

import itertools
import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.interpolate import PchipInterpolator

from kedfem.analysis import analyse
from kedfem.cli.new import new
from kedfem.errors import OutputError
from kedfem.results import Results
from kedfem.scene import read_scene, scene_from
from kedfem.scene.records.units import si_number

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
        return np.asarray(G * (hinges + barrel * (low_end + unit * half / 2) + piston * (high_end - unit * half / 2)))

    angles = np.linspace(low, np.radians(60.0), 20_001)
    force = np.gradient(potential(angles), angles) / np.gradient(length(angles), angles)
    travel = length(angles) - length(np.array(low))
    expected = np.interp(found.angle, travel, force)
    assert_allclose(found.channels["drive/rigid_force"][1][1:-1, 0], expected[1:-1], rtol=2e-3)
    height = found.channels["probes/platform/position"][1][-1, 1]
    assert_allclose(height, np.sin(np.interp(0.15, travel, angles)), rtol=2e-3)  # less what the arms bend


def test_the_drives_of_a_robot_hold_its_weights(tmp_path: Path) -> None:
    """T = −Σ m g x about y at rest, before and after the motion: the shoulder raises by 40°, the elbow lowers by 60°."""
    raw = template("robot_arm")
    raw["output"]["probes"]["hand"] = {"link": "forearm", "at": "H", "quantity": "position"}
    found = run(raw, tmp_path, end_time="1.5 s", step="2 ms")
    up = 0.4 + 0.4 * np.sin(np.radians(40.0)) - 0.35 * np.sin(np.radians(20.0))
    assert_allclose(found.channels["probes/hand/position"][1][-1, 2], up, atol=2e-3)  # less what the arms bend
    upper = ALUMINIUM * np.pi * (0.035**2 - 0.031**2) * 0.4
    fore = ALUMINIUM * np.pi * (0.025**2 - 0.022**2) * 0.35
    for row, shoulder, elbow, tolerance in ((0, 0.0, 0.0, 2e-3), (-1, -40.0, 60.0, 1e-2)):
        a, b = np.radians(shoulder), np.radians(shoulder + elbow)
        hand = 0.35 * np.cos(b)
        about_elbow = G * (3 * hand + fore * hand / 2)
        about_shoulder = about_elbow + G * ((3 + fore) * 0.4 * np.cos(a) + upper * 0.2 * np.cos(a))
        for name, torque in (("elbow", about_elbow), ("shoulder", about_shoulder)):
            value = found.channels[f"drive/{name}/torque"][1][row, 0]
            assert_allclose(value, -torque, rtol=tolerance)
        assert abs(found.channels["drive/turn/torque"][1][row, 0]) < 0.05 * about_shoulder


def tube(outer: float, wall: float) -> float:
    """Area [m²]."""
    return float(np.pi * (outer**2 - (outer - 2 * wall) ** 2) / 4)


def test_the_strut_of_a_wishbone_bears_the_wheel_by_its_ratio(tmp_path: Path) -> None:
    """Virtual work of tyre, strut and weights as the lower arm turns; and both springs follow their laws on the bump."""
    raw = template("wishbone")
    points = {k: np.array(v) for k, v in raw["points"].items() if isinstance(v, list)}
    A, B, C, D, W, T = (points[k] for k in "ABCDWT")
    S = A + 0.6 * (B - A)
    found = run(raw, tmp_path, kind="static", initial="rest", end_time=0.05, step=0.025)

    def across(r: np.ndarray) -> np.ndarray:
        return np.array([-r[1], r[0]])

    beside = D - B
    turns = np.column_stack([across(D - C), -across(beside)])  # of upper arm and upright, per turn of the lower arm
    upper, upright = np.linalg.solve(turns, across(B - A))
    wheel = across(B - A) + upright * across(W - B)
    foot = across(S - A)
    shortens = foot @ (T - S) / np.linalg.norm(T - S)
    area, post = (tube(0.04, 0.004), tube(0.028, 0.003)), 0.05 * 0.04
    sinks = (
        area[0] * np.linalg.norm(B - A) * (B - A)[0] / 2
        + area[1] * np.linalg.norm(D - C) * upper * (D - C)[0] / 2
        + post * np.linalg.norm(W - B) * (across(B - A) + upright * across(W - B) / 2)[1]
        + post * np.linalg.norm(D - W) * (across(B - A) + upright * across((W + D) / 2 - B))[1]
    )
    tyre, strut = (-found.channels[f"springs/{name}/force"][1][:, 0] for name in ("tyre", "strut"))
    weights = G * (STEEL * sinks + 25 * wheel[1])
    assert_allclose(strut[0], (tyre[0] * wheel[1] - weights) / shortens, rtol=5e-3)
    travel = found.channels["probes/wheel/travel"][1]
    assert_allclose(tyre[-1], 3000 + 2e5 * (0.04 - travel[-1, 1]), rtol=2e-3)  # the road is 40 mm higher
    length = found.channels["springs/strut/length"][1][:, 0]
    assert_allclose(strut, 4680 + 4e4 * (np.linalg.norm(T - S) - length), rtol=1e-9)


def test_the_cylinders_of_an_excavator_hold_all_beyond_them(tmp_path: Path) -> None:
    """Q = ∂V/∂θ of the three hinges, and the cylinders' forces by F · ∂l/∂θ = Q."""
    raw = template("excavator")
    found = run(raw, tmp_path, kind="static", initial="rest", end_time=2.0, step=2.0)
    X = {k: np.array(v, float) for k, v in raw["points"].items() if isinstance(v, list)}
    X["S"] = X["E"] + 0.15 * (X["H"] - X["E"])
    pairs = (("P", "Q"), ("R", "F"), ("S", "G"))
    half = [np.linalg.norm(X[b] - X[a]) / 2 for a, b in pairs]
    barrel, rod = STEEL * tube(0.12, 0.01), STEEL * np.pi * 0.07**2 / 4
    beams = {"AQKRE": 0.3 * 0.12, "FESH": 0.22 * 0.1, "GHL": 0.1 * 0.08}
    parts = ((0, "A", "QKREFSHGL"), (1, "E", "FSHGL"), (2, "H", "GL"))

    def placed(theta: np.ndarray) -> dict[str, np.ndarray]:
        now = dict(X)
        for k, hinge, beyond in parts:
            c, s = np.cos(theta[k]), np.sin(theta[k])
            R = np.array([[c, -s], [s, c]])
            now |= {name: now[hinge] + R @ (now[name] - now[hinge]) for name in beyond if name != hinge}
        return now

    def lengths(now: dict[str, np.ndarray]) -> np.ndarray:
        return np.array([np.linalg.norm(now[b] - now[a]) for a, b in pairs])

    def potential(now: dict[str, np.ndarray]) -> float:
        V = 1200 * now["L"][1]
        for line, area in beams.items():
            for a, b in itertools.pairwise(line):
                V += STEEL * area * np.linalg.norm(X[b] - X[a]) * (now[a] + now[b])[1] / 2
        for (a, b), h in zip(pairs, half, strict=True):
            u = (now[b] - now[a]) / np.linalg.norm(now[b] - now[a])
            V += barrel * h * (now[a] + u * h / 2)[1] + rod * h * (now[b] - u * h / 2)[1]
        return float(G * V)

    d = 1e-6 * np.eye(3)
    Q = np.array([potential(placed(x)) - potential(placed(-x)) for x in d]) / 2e-6
    ratios = np.array([lengths(placed(x)) - lengths(placed(-x)) for x in d]) / 2e-6
    force = np.linalg.solve(ratios, Q)
    names = ("boom", "stick", "bucket")
    values = [found.channels[f"drive/{name}_cylinder/force"][1][0, 0] for name in names]
    assert_allclose(values, force, rtol=3e-3)  # elastic links bend by so much


def test_the_legs_of_a_stewart_platform_bear_weight_and_inertia(tmp_path: Path) -> None:
    """Σ F l' = V' + M(z) z'': all legs extend alike, from rest, so that the platform heaves."""
    raw = template("stewart")
    found = run(raw, tmp_path, end_time=4e-4, step=4e-4)
    z, below, above = 0.6, 0.5, 0.35
    turn = np.radians(40)  # between a leg's ends, seen from above
    foot = np.array([below, 0, 0])
    head = np.array([above * np.cos(turn), above * np.sin(turn), z])
    length = np.linalg.norm(head - foot)
    u, h = (head - foot) / length, length / 2
    up = np.array([0, 0, 1.0])
    rises = u[2]  # dl/dz
    swings = (up - u * rises) / length  # du/dz
    barrel, rod = STEEL * tube(0.05, 0.005) * h, STEEL * np.pi * 0.025**2 / 4 * h
    corners = [np.radians(a) for a in (-50, 50, 70, 170, 190, 290, 310)]
    ring = np.abs(np.diff(np.exp(1j * np.array(corners)))).sum() * above * 0.04 * 0.02 * ALUMINIUM
    mass = 200 + ring
    slope = G * (mass + 6 * (barrel * (swings * h / 2)[2] + rod * (up - swings * h / 2)[2]))
    inner, outer = swings * h, up - swings * h  # velocities of barrel's and rod's ends in the middle, per z'
    M = mass + 6 * (barrel / 3 * inner @ inner + rod / 3 * (up @ up + up @ outer + outer @ outer))
    acceleration = 0.03 * (2 * np.pi) ** 2 / rises
    forces = [found.channels[f"drive/{leg}_{k}/force"][1][0, 0] for leg in ("left", "right") for k in (1, 2, 3)]
    assert_allclose(np.sum(forces) * rises, slope + M * acceleration, rtol=1e-3)


def test_a_valve_opens_by_the_ratio_of_its_rocker(tmp_path: Path) -> None:
    """F = i (F0 + k i s) with i = 4/3: closed, and 7 mm lifted."""
    found = run(template("valve_train"), tmp_path, kind="static", initial="rest", end_time=0.004, step=0.004)
    ratio, lift = 4 / 3, np.array([0, 0.007])
    expected = ratio * (250 + 3e4 * ratio * lift)
    assert_allclose(found.channels["drive/rigid_force"][1][:, 0], expected, rtol=5e-3)  # the rocker's arms turn
    assert_allclose(found.channels["drive/force"][1][:, 0], expected, rtol=1e-2)
    stem = found.channels["probes/stem_stress/stress"][1][:, 0]
    assert_allclose(stem, -expected / ratio / (np.pi * 0.003**2), rtol=1e-2)


def test_a_panel_ends_on_its_stop_under_what_is_left_of_its_spring(tmp_path: Path) -> None:
    """k (150° − φ) = K (φ − 90°), and the outer panel straight on: by 2 φ against the inner one."""
    found = run(template("panel"), tmp_path, step=0.05)
    k, stop = 0.7, 100.0
    phi = (k * np.radians(150) + stop * np.radians(90)) / (k + stop)
    assert_allclose(found.channels["joints/A/angle"][1][-1, 0], -phi, rtol=1e-5)
    assert_allclose(found.channels["joints/B/angle"][1][-1, 0], 2 * phi, rtol=1e-5)
    assert_allclose(found.channels["probes/tip/position"][1][-1, 0], 1.6, rtol=1e-3)


@pytest.mark.parametrize("kind", ["wishbone", "excavator", "valve_train"])
def test_a_template_starts_as_it_is(kind: str, tmp_path: Path) -> None:
    """In motion, with its own step and start, for five steps: no warning of its model, and energy is kept."""
    raw = template(kind)
    step = si_number(raw["analysis"]["step"], "s")
    found = run(raw, tmp_path, end_time=5 * step)
    assert found.status == "complete"
    assert not [line for line in found.warnings if not line.startswith("estimated error")]


@pytest.mark.long
def test_a_rod_from_cad_is_pressed_by_the_gas_as_by_hand(tmp_path: Path) -> None:
    """The torque by virtual work, slowly; σ = F/A in the web of its shank, where the gas presses most."""
    (tmp_path / "connecting_rod.step").write_bytes((files("kedfem") / "templates" / "connecting_rod.step").read_bytes())
    raw = template("cad_slider_crank")
    raw["parameters"]["speed"] = "6 rpm"
    raw["output"]["report"] = False
    found = run(raw, tmp_path, steps_per_revolution=360, revolutions=1)
    r, length, phi = 0.04, 0.14, np.radians(60.0) + found.angle
    slope = -r * np.sin(phi) - r**2 * np.sin(phi) * np.cos(phi) / np.sqrt(length**2 - (r * np.sin(phi)) ** 2)
    degrees = np.array([0.0, 60.0, 120.0, 200.0, 270.0, 300.0, 312.0, 335.0])
    share = np.array([0.3, 0.08, 0.0, 0.0, 0.25, 0.6, 1.0, 0.6])
    force = 8e3 * PchipInterpolator(np.append(degrees, 360.0), np.append(share, 0.3))(np.degrees(found.angle))
    torque = found.channels["drive/rigid_torque"][1][:, 0]
    inner = (found.angle > np.radians(60.0)) & (found.angle < np.radians(335.0))  # away from the seam of the period
    assert_allclose(torque[inner], (force * slope)[inner], atol=2e-3 * np.abs(force * slope).max())
    area = 2 * 0.004 * 0.018 + (0.022 - 2 * 0.004) * 0.006  # of its flanges and web, halfway
    pressed = found.channels["probes/shank/stress"][1][:, 0].min()
    beta = np.arcsin(r / length * np.sin(np.radians(12.0)))  # of the rod with the slide, 312 deg on
    assert_allclose(pressed, -8e3 / np.cos(beta) / area, rtol=5e-3)


def test_parts_of_a_template_are_written_beside_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    new("cad-slider-crank")
    read_scene("cad-slider-crank.toml")
    drawn = Path(__file__).parents[2] / "geometry" / "connecting_rod.step"
    assert Path("connecting_rod.step").read_bytes() == drawn.read_bytes()
    with pytest.raises(OutputError, match=r"connecting_rod\.step: must be a new file"):
        new("cad-slider-crank", Path("other.toml"))
    assert not Path("other.toml").exists()
