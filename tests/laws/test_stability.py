"""Balances that a small push leaves for good: columns beyond Euler's load, masts on springs, torques that grow."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kedfem.accuracy.prepared import meshed
from kedfem.analysis import analyse
from kedfem.dynamics.stepping.solvers import steps_of, unstable_balance
from kedfem.dynamics.stepping.transient import transient
from kedfem.scene import scene_from
from tests.laws.test_limits import AXES
from tests.moving import beam_in_space

Raw = dict[str, Any]
E, L, WIDTH = 2.1e11, 0.5, 0.01
EULER = np.pi**2 * E / (4 * L**2)  # of a cantilever, times its second moment of area
STEEL = {"steel": {"youngs_modulus": E, "poisson_ratio": 0.0, "density": 7850.0}}
SURE = 0.03  # of a load below which, and above which, a balance is stable and unstable


def found(raw: Raw) -> str:
    """What is said of the stability of a scene's balances."""
    scene = scene_from({"materials": STEEL, **raw})
    ready = meshed(scene)
    solver = steps_of(scene, ready.model)
    for _ in transient(scene, ready.linkage, ready.path, ready.model, solver):
        pass
    return unstable_balance([solver])


def column(model: str, n: np.ndarray, share: float, slope: float = 0.0) -> Raw:
    """A cantilever along a direction, pressed along it by a share of Euler's load."""
    flat = model in {"plane", "beam"}
    rod = beam_in_space((0, 0, 0), L * n, 8, np.cross(n, [0.3, 0.5, 0.9])) if model == "space" else {
        "model": model, "material": "steel",
        "shape": {"kind": "bar", "between": [[0, 0, 0], (L * n).tolist()], "width": WIDTH, "thickness": 2 * WIDTH},
        "mesh": {"elements": {"beam": 8, "plane": [16, 1], "solid": [8, 1, 1]}[model]},
    }  # fmt: skip
    area = np.pi * 0.02**4 / 64 if model == "space" else 2 * WIDTH**4 / 12
    across = np.cross(n, [0.0, 0.0, 1.0] if flat else [0.3, 0.5, 0.9])
    push = share * EULER * area * (slope * across / np.linalg.norm(across) - n)
    return {
        "gravity": [0, 0, 0], "links": {"rod": rod},
        "joints": {"W": {"kind": "weld", "links": ["rod", "ground"], "at": [0, 0, 0]}},
        "loads": {"P": {"kind": "force", "link": "rod", "at": (L * n).tolist(), "vector": push.tolist()}},
        "analysis": {"kind": "static", "frames": "co-rotational"},
    }  # fmt: skip


CASES = [
    *(("beam", axis) for axis in ("x", "y")),
    *(("space", axis) for axis in AXES),
    ("plane", "x"), ("solid", "x"), ("solid", "z"), ("solid", "oblique"),
]  # fmt: skip


@pytest.mark.parametrize(("model", "axis"), CASES)
def test_a_column_is_stable_below_eulers_load_and_unstable_above(model: str, axis: str) -> None:
    below, above = (found(column(model, AXES[axis], share)) for share in (1 - SURE, 1 + SURE))
    assert below == ""
    assert "is unstable at t = 1 s (link 'rod')" in above


def test_a_column_that_is_pulled_or_bends_beside_its_load_is_stable() -> None:
    assert found(column("beam", AXES["x"], -3.0)) == ""
    assert found(column("beam", AXES["x"], 0.5, slope=0.05)) == ""


DRIVEN = [
    (kind, more) for kind in ("static", "quasi-static") for more in ({"frames": "co-rotational"}, {"stiffening": True})
]


@pytest.mark.parametrize(("kind", "more"), DRIVEN)
@pytest.mark.parametrize("model", ["beam", "space"])
def test_so_is_one_that_a_drive_holds(kind: str, more: Raw, model: str) -> None:
    def at(share: float) -> str:
        raw = column(model, AXES["x"], share)
        raw["joints"] = {"W": {"kind": "revolute", "links": ["ground", "rod"], "at": [0, 0, 0], "axis": "z"}}
        raw["drive"] = {"joint": "W", "motion": {"kind": "constant_speed", "speed": 1e-3}}
        return found(raw | {"analysis": {"kind": kind, "end_time": 1.0, "step": 0.5, **more}})

    assert at(1 - SURE) == ""
    assert "0.5 s, drive angle 0.0286479 deg (link 'rod') and 1 more" in at(1 + SURE)


@pytest.mark.parametrize("more", [{"mesh": {"elements": [24, 2, 2]}}, {"segments": 4}, {"reduction": "modal"}])
def test_so_are_sparse_divided_and_reduced_links(more: Raw) -> None:
    below, above = (column("solid", AXES["oblique"], share) for share in (1 - SURE, 1 + SURE))
    for raw in (below, above):
        raw["links"]["rod"] |= more
    assert found(below) == ""
    assert "link 'rod'" in found(above)


@pytest.mark.parametrize(("axis", "speed"), [("z", 300.0), ("x", 100.0), ("x", 2000.0)])
def test_a_rod_that_spins_is_stable(axis: str, speed: float) -> None:
    """About its end, and about its own axis below and above the speed at which it would bend without Coriolis forces."""
    raw = column("space", AXES["x"], 1.0)
    raw["joints"] = {"W": {"kind": "revolute", "links": ["ground", "rod"], "at": [0, 0, 0], "axis": axis}}
    raw["drive"] = {"joint": "W", "motion": {"kind": "constant_speed", "speed": speed}}
    raw["analysis"] = {"kind": "quasi-static", "frames": "co-rotational", "revolutions": 1}
    raw.pop("loads")
    assert found(raw) == ""


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("weak", [1.0, 1e-2])
def test_a_mast_stands_on_a_spring_that_holds_its_weight(axis: str, weak: float) -> None:
    """k over m g L/2; with a weak spring and little gravity too, where nothing but rounding is near."""
    n, g = AXES[axis], 9.81 * weak
    hinge = np.cross(n, [0.3, 0.5, 0.9])
    mast = {key: x for key, x in beam_in_space((0, 0, 0), L * n, 2, hinge).items() if key != "beam"} | {"model": "rigid"}
    weight = 7850.0 * np.pi * 0.02**2 / 4 * L * g

    def at(share: float, motor: float = 0.0) -> str:
        k = weight * L / 2
        torque = {"over": "angle", "at": [-1.0, 1.0], "value": [-motor * k, motor * k]}
        return found({
            "gravity": (-g * n).tolist(), "links": {"mast": mast},
            "joints": {"A": {"kind": "revolute", "links": ["ground", "mast"], "at": [0, 0, 0], "axis": hinge.tolist()}},
            "springs": {"S": {"kind": "torsion", "joint": "A", "stiffness": share * k}},
            "motors": {"M": {"joint": "A", "torque": torque}} if motor else {},
            "analysis": {"kind": "static"},
        })  # fmt: skip

    assert at(1 + SURE) == ""
    assert "link 'mast'" in at(1 - SURE)
    assert at(2 + SURE, motor=1.0) == ""  # which pushes on as the mast leans
    assert "link 'mast'" in at(2 - SURE, motor=1.0)


def test_a_run_of_an_unstable_balance_is_unreliable(tmp_path: Path) -> None:
    raw = column("beam", AXES["x"], 1.5) | {"materials": STEEL, "output": {"folder": str(tmp_path / "run")}}
    raw["analysis"]["accuracy"] = "quick"
    run = analyse(scene_from(raw))
    assert run.results.status == "unreliable"
    assert "beyond its buckling load" in run.results.reason
    assert any("kind = 'transient'" in each for each in run.warnings)
