"""Rigid motion as a table: a crank in closed form, rates against differences of the file itself, refusals."""

import csv
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from kedfem.cli import USER_ERROR
from kedfem.errors import MotionError, OutputError
from kedfem.export import export_motion
from kedfem.scene import Scene

from ..linkages import linkage_scene, moved_scene, rssr
from ..scenes import cycloidal
from .test_cli import Command, run_kedfem

__all__ = ["run_kedfem"]  # a fixture

AXES = {"x": [1, 0, 0], "y": [0, 1, 0], "z": [0, 0, 1], "oblique": [0.6, -0.5, 0.62]}
PIVOT, ARM, RISE, END, STEPS = np.array([0.3, -0.2, 0.1]), 0.15, 9.0, 0.5, 1500
KEYS = ("position", "orientation", "velocity", "angular_velocity", "acceleration", "angular_acceleration")
SKETCH = """
links.crank = {}
joints.A = { kind = "revolute", links = ["ground", "crank"], at = [0, 0] }
drive = { joint = "A", motion = { kind = "constant_speed", speed = 1.0 } }
analysis = { kind = "static", end_time = 1.0, step = 0.1 }
"""
Table = dict[str, np.ndarray]


def table_of(scene: Scene, path: Path) -> Table:
    export_motion(scene, path)
    return read(path)


def read(path: Path) -> Table:
    """The columns of a file; those of one vector together."""
    with path.open(encoding="utf-8") as file:
        names = next(csv.reader(file))
    values = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
    out: dict[str, list[np.ndarray]] = {}
    for name, column in zip(names, values.T, strict=True):
        key = name.rsplit(" ", 2)[0] if name.startswith("links/") else name
        out.setdefault(key, []).append(column)
    return {key: np.squeeze(np.array(columns).T) for key, columns in out.items()}


def crank(axis: np.ndarray) -> tuple[Scene, np.ndarray]:
    """A crank with a link welded to its tip; the arm, at a right angle to the axis."""
    arm = np.cross(axis, [0.31, 0.9, -0.2])
    arm *= ARM / np.linalg.norm(arm)
    joints = {"A": ("revolute", "ground", "crank", PIVOT, axis), "B": ("weld", "crank", "tip", PIVOT + arm)}
    return linkage_scene(joints, motion=cycloidal(RISE, END), end_time=END, step=END / STEPS), arm


@pytest.mark.parametrize("axis", AXES)
def test_a_crank_moves_as_in_closed_form(axis: str, tmp_path: Path) -> None:
    """Its quaternion goes on through 2π, beyond the first block of time points; caps: nine digits are written."""
    n = np.array(AXES[axis], float) / np.linalg.norm(AXES[axis])
    scene, arm = crank(n)
    got = table_of(scene, tmp_path / "motion.csv")
    s = np.linspace(0, 1, STEPS + 1)
    assert_allclose(got["time [s]"], END * s, atol=1e-9)
    phi = RISE * (s - np.sin(2 * np.pi * s) / (2 * np.pi))
    rate = RISE / END * (1 - np.cos(2 * np.pi * s))
    second = RISE / END**2 * 2 * np.pi * np.sin(2 * np.pi * s)
    assert_allclose(got["drive angle [rad]"], phi, atol=1e-8)
    e = np.cos(phi)[:, None] * arm + np.sin(phi)[:, None] * np.cross(n, arm)
    f = np.cross(n, e)
    wanted = {
        "position": PIVOT + e,
        "orientation": np.column_stack([np.cos(phi / 2), np.sin(phi / 2)[:, None] * n]),
        "velocity": rate[:, None] * f,
        "angular_velocity": rate[:, None] * n,
        "acceleration": second[:, None] * f - (rate**2)[:, None] * e,
        "angular_acceleration": second[:, None] * n,
    }
    for key in KEYS:
        scale = np.abs(wanted[key]).max()
        assert_allclose(got[f"links/tip/{key}"], wanted[key], atol=1e-7 * scale, err_msg=key)
    assert_allclose(got["links/crank/position"], np.tile(PIVOT, (STEPS + 1, 1)), atol=1e-9)


def test_rates_are_the_differences_of_the_file(tmp_path: Path) -> None:
    """A spatial four-bar linkage, oblique, over two turns: central differences are right to h² = 1.6e-5 (cap 1e-4)."""
    R = Rotation.from_rotvec([0.4, -0.7, 0.9]).as_matrix()
    h = 0.004
    joints = moved_scene(rssr(0.9), R, np.array([0.2, 0.1, -0.3]))
    scene = linkage_scene(joints, end_time=4 * np.pi, step=4 * np.pi / round(4 * np.pi / h))
    got = table_of(scene, tmp_path / "motion.csv")
    t = got["time [s]"]

    def rate(x: np.ndarray) -> np.ndarray:
        return (x[2:] - x[:-2]) / (t[2:] - t[:-2])[:, None]

    for link in scene.links:
        x, q, v, omega, a, alpha = (got[f"links/{link}/{key}"] for key in KEYS)
        assert_allclose(np.linalg.norm(q, axis=1), 1, atol=1e-8)
        w, u = q[1:-1, :1], q[1:-1, 1:]
        dw, du = rate(q)[:, :1], rate(q)[:, 1:]
        spin = 2 * (w * du - dw * u - np.cross(du, u))  # 2 q' q*, a right-handed turn in world components
        pairs = {"velocity": (rate(x), v), "angular velocity": (spin, omega),
                 "acceleration": (rate(v), a), "angular acceleration": (rate(omega), alpha)}  # fmt: skip
        for key, (found, written) in pairs.items():
            scale = max(np.abs(written).max(), 1.0)
            assert_allclose(found, written[1:-1], atol=1e-4 * scale, err_msg=f"{link} {key}")


def test_a_sketch_of_joints_alone_is_enough(run_kedfem: Command, tmp_path: Path) -> None:
    """By the command, of a static analysis too, whose mechanism moves as its drive says."""
    path = tmp_path / "scene.toml"
    path.write_text(SKETCH)
    said = run_kedfem("export", path, "--motion", "motion.csv")
    assert said.code == 0
    assert "rigid motion of crank: 11 time points" in said.out
    got = read(tmp_path / "motion.csv")
    assert_allclose(got["links/crank/orientation"][-1], [np.cos(0.5), 0, 0, np.sin(0.5)], atol=1e-9)


def test_what_is_refused(tmp_path: Path, run_kedfem: Command) -> None:
    scene, _ = crank(np.array([0.0, 0, 1]))
    with pytest.raises(OutputError, match=r"must end in \.csv, got '\.txt'"):
        export_motion(scene, tmp_path / "motion.txt")
    with pytest.raises(MotionError, match="drive: is required for kinematics, got none"):
        export_motion(scene.model_copy(update={"drive": None}), tmp_path / "motion.csv")
    assert not list(tmp_path.iterdir())
    for more, got in (
        ([], "none of them"),
        (["--link", "rod", "--motion", "m.csv"], "--link, --motion"),
        (["--file", "m.npz"], "--file"),
    ):
        done = run_kedfem("export", "scene.toml", *more)
        assert done.code == USER_ERROR
        assert f"or --gltf FILE, got {got}: " in " ".join(done.err.split())
