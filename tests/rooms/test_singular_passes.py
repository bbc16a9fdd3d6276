"""Undriven mechanisms that pass a singular position say when; others, and driven ones, do not."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kedfem.accuracy.prepared import meshed
from kedfem.accuracy.singular import SingularPasses
from kedfem.analysis import analyse
from kedfem.dynamics.stepping.levels import level_steps, leveled
from kedfem.scene import read_scene, scene_from

EXAMPLES = Path(__file__).parents[2] / "examples"
OBLIQUE = np.linalg.qr(np.array([[2.0, -1.0, 2.0], [1.0, 2.0, 3.0], [-2.0, 1.0, 1.0]]))[0]
PLANES = {
    "xy": np.eye(3),
    "yz": np.roll(np.eye(3), 1, axis=0),
    "zx": np.roll(np.eye(3), 2, axis=0),
    "oblique": OBLIQUE * np.sign(np.linalg.det(OBLIQUE)),
}


def falling(
    coupler: float, rocker: float, ground: float, T: np.ndarray = PLANES["xy"], rigid: tuple[str, ...] = ()
) -> dict[str, Any]:
    """A four-bar whose crank of 0.2 m falls from 60 degrees, in a plane turned by T."""
    B, D = np.array([0.1, 0.2 * math.sin(math.pi / 3), 0]), np.array([ground, 0, 0])
    L = float(np.linalg.norm(D - B))
    x = (coupler**2 - rocker**2 + L**2) / (2 * L)
    e = (D - B) / L
    C = B + x * e + math.sqrt(coupler**2 - x**2) * np.array([-e[1], e[0], 0])
    A, B, C, D, z, down = ((T @ v).tolist() for v in (np.zeros(3), B, C, D, [0, 0, 1], [0, -9.81, 0]))
    ends = {"crank": (A, B), "coupler": (B, C), "rocker": (C, D)}
    pairs = {"A": ("ground", "crank", A), "B": ("crank", "coupler", B), "C": ("coupler", "rocker", C)}
    pairs["D"] = ("rocker", "ground", D)
    return {
        "gravity": down,
        "links": {
            name: {
                "material": "steel",
                "shape": {"kind": "bar", "between": list(p), "width": 0.02, "thickness": 0.01},
                **({"model": "rigid"} if name in rigid else {"model": "beam", "mesh": {"elements": 1}}),
            }
            for name, p in ends.items()
        },
        "joints": {
            name: {"kind": "revolute", "links": [one, other], "at": at, "axis": z}
            for name, (one, other, at) in pairs.items()
        },
        "damping": {"beta": 1e-5},
        "analysis": {"end_time": 0.3, "step": 1e-3},
        "output": {"animation": False},
    }


def looked_at(raw: dict[str, Any]) -> SingularPasses:
    ready = meshed(scene_from(raw))
    passes = SingularPasses(ready)
    for block in leveled(ready.scene, ready.linkage, ready.path, ready.model, level_steps(ready.scene, ready.model)):
        passes.add(block)
    return passes


@pytest.mark.parametrize("plane", PLANES)
def test_equal_links_that_fold_are_told_with_the_time(plane: str) -> None:
    """All of 0.2 m and mass m: crank and rocker fall alike from 60 to 0 degrees, ∫ dθ/θ' is 0.241 s.

    (2/3 + 1) m l² θ'²/2 = 2 m g l (sin 60° − sin θ).
    """
    passes = looked_at(falling(0.2, 0.2, 0.2, PLANES[plane]))
    (said,) = passes.warnings()
    theta = np.pi / 3 * (1 - np.linspace(0, 1, 4001)[1:] ** 2)  # θ' = 0 at the start: substituted
    speed = np.sqrt(2 * 1.2 * 9.81 / 0.2 * (np.sin(np.pi / 3) - np.sin(theta)))
    falls = np.trapezoid(2 * np.pi / 3 * np.linspace(0, 1, 4001)[1:] / speed, np.linspace(0, 1, 4001)[1:])
    assert passes.worst
    assert passes.worst.when == pytest.approx(falls, abs=2e-3)
    assert said.startswith(f"at {passes.worst.when:.4g} s the mechanism comes near a singular position")
    assert "shorter step" in said


def test_rigid_links_and_a_kite_are_told_too() -> None:
    assert looked_at(falling(0.2, 0.2, 0.2, rigid=("crank", "coupler"))).warnings()
    assert looked_at(falling(0.3, 0.3, 0.2)).warnings()


@pytest.mark.parametrize("plane", ["xy", "oblique"])
def test_ordinary_linkages_that_fall_are_not(plane: str) -> None:
    """Singular values stay above a tenth of the largest: no two links' lengths add up to those of the others."""
    for lengths in ((0.3, 0.25, 0.35), (0.2, 0.21, 0.2)):
        passes = looked_at(falling(*lengths, PLANES[plane]))
        assert passes.warnings() == ()
        assert passes.worst
        assert passes.worst.of_largest > 0.1


def test_driven_scenes_and_a_motor_are_not() -> None:
    driven = falling(0.2, 0.2, 0.2)
    driven["drive"] = {"joint": "A", "motion": {"kind": "cycloidal", "angle": -0.5, "rise": 0.3}}
    assert looked_at(driven).warnings() == ()
    ready = meshed(read_scene(EXAMPLES / "motor_four_bar" / "scene.toml"))
    passes = SingularPasses(ready)
    solvers = level_steps(ready.scene, ready.model)
    for block in leveled(ready.scene, ready.linkage, ready.path, ready.model, solvers):
        passes.add(block)
    assert passes.worst
    assert passes.worst.largest > 0.0
    assert passes.warnings() == ()


def test_a_run_says_so(tmp_path: Path) -> None:
    raw = falling(0.2, 0.2, 0.2)
    raw["output"] = {"animation": False, "plots": False, "picture": False, "folder": str(tmp_path / "results")}
    said = [x for x in analyse(scene_from(raw)).warnings if "singular position" in x]
    assert len(said) == 1
