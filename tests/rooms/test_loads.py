"""Loads for suppliers: closed forms of equivalent loads, of rotating and sinusoidal ones, and what a run reports."""

import csv
import json
from math import gamma, pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.analysis import analyse
from kedfem.errors import OutputError
from kedfem.kinematics import kinematics
from kedfem.loads import loads
from kedfem.results import Channel, Results, read_results
from kedfem.results.forces.loads import BALL, ROLLER, DriveLoad, drive_summary, equivalent_load, in_axes, polar_axes
from kedfem.scene import scene_from
from kedfem.tables import loads_tables
from tests.reliability.fuzz import short
from tests.scenes import example

TURN = np.linspace(0.0, 2 * pi, 20_001)
OMEGA, LENGTH, SIDE, DENSITY = 30.0, 0.4, 0.02, 7800.0
MASS = DENSITY * LENGTH * SIDE**2


def table(path: Path) -> dict[str, np.ndarray]:
    """Columns of a CSV by name."""
    with path.open(encoding="utf-8", newline="") as file:
        header, *lines = csv.reader(file)
    return dict(zip(header, np.array(lines, float).T, strict=True))


def spun(axis: list[float], along: list[float], folder: Path) -> Path:
    """Kinematics of a bar that spins about one end, at right angles to the axis."""
    raw: dict[str, Any] = {
        "materials": {"steel8": {"density": DENSITY, "youngs_modulus": 2e11, "poisson_ratio": 0.3}},
        "links": {"my bar": {"material": "steel8", "shape": {
            "kind": "bar", "between": [[0, 0, 0], (LENGTH * np.array(along)).tolist()], "width": SIDE, "thickness": SIDE,
            "up": axis}}},
        "joints": {"A 1": {"kind": "revolute", "links": ["ground", "my bar"], "at": [0, 0, 0], "axis": axis}},
        "drive": {"joint": "A 1", "motion": {"kind": "constant_speed", "speed": OMEGA}},
        "analysis": {"revolutions": 2, "steps_per_revolution": 90},
        "output": {"plots": False, "animation": False},
    }  # fmt: skip
    kinematics(scene_from(raw, folder), folder / "run")
    return folder / "run"


@pytest.mark.parametrize("p", [BALL, ROLLER])
def test_a_constant_load_is_its_own_equivalent(p: float) -> None:
    rate = OMEGA * (1.5 + np.sin(TURN))
    assert_allclose(equivalent_load(TURN, np.full(len(TURN), 70.0), rate, p), 70.0, rtol=1e-12)


@pytest.mark.parametrize("p", [BALL, ROLLER])
def test_a_sinusoidal_load_has_the_mean_of_the_sines_power(p: float) -> None:
    """Mean of |sin x|^p over a revolution: Γ((p + 1)/2) / (√π Γ(p/2 + 1)); of p = 3 it is 4/(3π)."""
    mean = gamma((p + 1) / 2) / (pi**0.5 * gamma(p / 2 + 1))
    found = equivalent_load(TURN, 50.0 * np.abs(np.sin(TURN)), np.full(len(TURN), -OMEGA), p)
    assert_allclose(found, 50.0 * mean ** (1 / p), rtol=1e-7)
    assert_allclose(gamma(2) / (pi**0.5 * gamma(2.5)), 4 / (3 * pi))


def test_loads_count_by_the_revolutions_under_them() -> None:
    """Load a at speed 1 for a second, 2a at speed 3 for two: P_m³ = (a³ + 6 (2a)³)/7; standing counts for nothing."""
    t = np.array([0.0, 1.0, 1.0, 3.0, 3.0, 9.0])
    P, rate = np.array([10.0, 10, 20, 20, 90, 90]), np.array([1.0, 1, -3, -3, 0, 0])
    assert_allclose(equivalent_load(t, P, rate, 3), ((1000 + 6 * 8000) / 7) ** (1 / 3), rtol=1e-12)
    assert np.isnan(equivalent_load(t, P, 0 * rate, 3))
    assert equivalent_load(t, 0 * P, rate, 3) == 0.0


def test_a_standing_load_runs_backwards_round_a_turning_shaft() -> None:
    c, s, zero = np.cos(TURN), np.sin(TURN), 0 * TURN
    R = np.stack([np.stack([c, -s, zero], 1), np.stack([s, c, zero], 1), np.stack([zero, zero, zero + 1], 1)], 1)
    standing = in_axes(np.tile([5.0, 0, 2], (len(TURN), 1)), R)
    assert_allclose(standing, np.stack([5 * c, -5 * s, zero + 2], 1), atol=1e-12)
    turning = in_axes(np.stack([5 * c, 5 * s, zero], 1), R)
    assert_allclose(turning, np.tile([5.0, 0, 0], (len(TURN), 1)), atol=1e-12)


@pytest.mark.parametrize(
    "axis", [[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0], [-1.0, 0, 0], [0.6, 0, 0.8], [2**-0.5, 2**-0.5, 0]]
)
def test_the_axes_of_a_polar_diagram_are_right_handed(axis: list[float]) -> None:
    e1, e2 = polar_axes(np.array(axis))
    assert_allclose(np.cross(e1, e2), axis, atol=1e-14)
    assert_allclose([e1 @ e1, e2 @ e2, e1 @ e2], [1, 1, 0], atol=1e-14)


@pytest.mark.parametrize(
    ("axis", "along"),
    [
        pytest.param([1.0, 0, 0], [0, 0, 1.0], marks=pytest.mark.long),
        pytest.param([0, 1.0, 0], [1.0, 0, 0], marks=pytest.mark.long),
        ([0, 0, 1.0], [0, 1.0, 0]),
        ([2 / 3, 2 / 3, 1 / 3], [2**-0.5, -(2**-0.5), 0]),
    ],
)
def test_a_spinning_bar_is_held_by_its_centrifugal_force(axis: list[float], along: list[float], tmp_path: Path) -> None:
    """m ω² L/2 along the bar, constant in the bar's axes, once round in the ground's; no torque, no power."""
    found = loads(spun(axis, along, tmp_path), last=1.0)
    held = MASS * OMEGA**2 * LENGTH / 2
    told = table(found.folder / "joint A 1.csv")
    assert len(told["time [s]"]) == 91
    inside = np.stack([told[f"on my bar, its axes {c} [N]"] for c in "xyz"], 1)
    assert_allclose(inside, -held * np.tile(along, (91, 1)), atol=1e-7 * held)
    ground = np.stack([told[f"on ground, its axes {c} [N]"] for c in "xyz"], 1)
    e1, e2 = np.array(along), np.cross(axis, along)
    turned = np.outer(np.cos(told["drive angle [rad]"]), e1) + np.outer(np.sin(told["drive angle [rad]"]), e2)
    assert_allclose(ground, held * turned, atol=1e-7 * held)
    row, drive = found.joints["A 1"], found.drives["A 1"]
    names = ("peak", "mean", "rms", "largest bearing load", "equivalent, ball bearing", "equivalent, roller bearing")
    assert_allclose([row[f"{name} [N]"] for name in names], held, rtol=1e-9)
    assert row["largest axial [N]"] < 1e-9 * held
    assert_allclose(told["speed of my bar against ground [rad/s]"], OMEGA, rtol=1e-8)
    assert abs(drive["rms [N m]"]) < 1e-9 * held * LENGTH
    assert (found.folder / "joint A 1.png").stat().st_size > 20_000


@pytest.mark.parametrize("axis", [[1.0, 0, 0], [0, 0.6, 0.8]])
def test_the_power_of_a_sliding_drive_is_the_rate_of_kinetic_energy(axis: list[float], tmp_path: Path) -> None:
    shape = {"kind": "bar", "between": [[0, 0], [0.2, 0]], "width": 0.02, "thickness": 0.02}
    raw = {
        "links": {"ram": {"material": "steel", "shape": shape, "mesh": {"elements": [4, 1, 1]}}},
        "joints": {"S": {"kind": "prismatic", "links": ["ground", "ram"], "at": [0, 0], "axis": axis}},
        "drive": {"joint": "S", "motion": {"kind": "cycloidal", "travel": 0.1, "rise": 0.05}},
        "analysis": {"end_time": 0.05, "step": 0.00025},
        "output": {"plots": False, "animation": False},
    }
    kinematics(scene_from(raw, tmp_path), tmp_path / "run")
    found = loads(tmp_path / "run")
    told = table(found.folder / "drive S.csv")
    t = told["time [s]"]
    v = 0.1 / 0.05 * (1 - np.cos(2 * pi * t / 0.05))  # of the cycloidal law
    assert_allclose(told["rate [m/s]"], v, atol=1e-8 * v.max())
    a = np.gradient(v, t, edge_order=2)
    mass = np.max(told["force [N]"]) / (2 * pi * 0.1 / 0.05**2)
    assert_allclose(told["power [W]"], mass * a * v, atol=1e-3 * np.max(told["power [W]"]))
    assert abs(found.drives["S"]["mean power [W]"]) < 1e-9 * abs(found.drives["S"]["largest power [W]"])
    with pytest.raises(OutputError, match=r"^--last: counts revolutions of the drive, got a drive that slides"):
        loads(tmp_path / "run", last=1.0)


def test_an_elastic_run_tells_the_work_of_its_drive(tmp_path: Path) -> None:
    """Torque times speed adds up to the work of supports, by the same rule; mirrored forces have one magnitude."""
    run = analyse(scene_from(short(example("four_bar_beams")), tmp_path))
    found = loads(run.folder)
    told = table(found.folder / "drive A.csv")
    t, power = told["time [s]"], told["power [W]"]
    work = run.results.channels["energy/work"][1][:, 1]
    done = np.concatenate([[0.0], np.cumsum(np.diff(t) * (power[1:] + power[:-1]) / 2)])
    assert_allclose(done, work, atol=1e-6 * np.abs(work).max())
    for name in run.results.channels["joints/B/force"][0].columns:
        assert f"on crank, world {name} [N]" in table(found.folder / "joint B.csv")
    joint = table(found.folder / "joint B.csv")
    for link in ("crank", "coupler"):
        inside = np.stack([joint[f"on {link}, its axes {c} [N]"] for c in "xyz"], 1)
        assert_allclose(np.linalg.norm(inside, axis=1), joint["magnitude [N]"], rtol=1e-7)
    assert set(found.joints) == {"A", "B", "C", "D"}
    assert [len(each.rows) for each in loads_tables(found)] == [4, 1]
    assert list(table_of_rows(found.folder / "joints.csv")) == ["A", "B", "C", "D"]


def table_of_rows(path: Path) -> dict[str, list[str]]:
    with path.open(encoding="utf-8", newline="") as file:
        _, *lines = csv.reader(file)
    return {first: rest for first, *rest in lines}


KINDS = [
    *(pytest.param(x, marks=pytest.mark.long) for x in ("rssr", "universal_joint_shaft")),
    "quick_return",
    "five_bar_robot",
]


@pytest.mark.parametrize("name", KINDS)
def test_joints_of_every_kind_are_told(name: str, tmp_path: Path) -> None:
    """Loads in each link's axes, turned back by the link's pose, are the world's."""
    kinematics(scene_from(short(example(name)), tmp_path), tmp_path / "run")
    results = read_results(tmp_path / "run" / "results.h5")
    found = loads(tmp_path / "run")
    whole = {
        key.split("/")[1] for key, (channel, _) in results.channels.items()
        if key.endswith("/rigid_force") and channel.columns == ("x", "y", "z")
    }  # fmt: skip
    assert set(found.joints) - {key.split("/")[1] for key in results.channels if key.endswith("/force")} <= whole
    assert set(found.joints) >= whole
    assert json.loads(results.scene_json)["joints"].keys() >= found.joints.keys()
    for joint in found.joints:
        told = table(found.folder / f"joint {joint}.csv")
        sizes = [np.linalg.norm(np.stack([x for key, x in told.items() if key.startswith(f"on {link}, its")], 1), axis=1)
                 for link in json.loads(results.scene_json)["joints"][joint]["links"]]  # fmt: skip
        assert_allclose(sizes, [told["magnitude [N]"]] * 2, rtol=1e-7)


def test_without_a_drive_loads_are_in_the_worlds_axes_and_it_is_said(tmp_path: Path) -> None:
    run = analyse(scene_from(short(example("motor_four_bar")), tmp_path))
    found = loads(run.folder)
    assert any("without a drive the links' orientation is not in the results" in x for x in found.warnings)
    joint = table(found.folder / "joint B.csv")
    assert "magnitude [N]" in joint
    assert not any("its axes" in name for name in joint)
    assert np.isnan(found.joints["B"]["equivalent, ball bearing [N]"])
    assert not list(found.folder.glob("*.png"))
    table_of_joints = loads_tables(found)[0]
    assert [str(column.header) for column in table_of_joints.columns] == ["joint", "peak", "at", "mean", "rms"]
    assert table_of_joints.caption is None


def test_of_several_drives_peaks_are_told_by_their_time() -> None:
    """Results have the position of the first drive alone."""
    time = np.linspace(0.0, 1.0, 5)
    effort = np.array([1.0, 2.0, 5.0, 2.0, 1.0])
    load, rows = DriveLoad("A", "N", effort, None), np.ones(5, bool)
    for names, told in (("drive/force",), True), (("drive/A/force", "drive/B/force"), False):
        channels = {x: (Channel(x, ("force",), "N", "", ""), effort[:, None]) for x in names}
        results = Results(time, time, channels, "complete", "{}")
        found = drive_summary(load, results, rows)
        assert found["time of largest [s]"] == 0.5
        assert any(name.startswith("drive at") for name in found) is told


def test_what_cannot_be_asked_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"results\.h5: must be a results file of kedfem, got no such file"):
        loads(tmp_path / "results.h5")
    folder = spun([0, 0, 1.0], [1.0, 0, 0], tmp_path)
    with pytest.raises(OutputError, match=r"^--last: must be positive, got 0"):
        loads(folder, last=0.0)
