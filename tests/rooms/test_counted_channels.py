"""Which channels count where errors are told: not forces that are rounding beside moments, nor these beside forces."""

from typing import Any

import numpy as np
import pytest

from kedfem.accuracy.estimates import budget, error_monitor
from kedfem.accuracy.histories import Histories, counted, relative_errors
from kedfem.accuracy.histories import histories as run
from kedfem.accuracy.mesh_estimate import mesh_errors
from kedfem.accuracy.prepared import meshed
from kedfem.accuracy.step_estimate import single_errors
from kedfem.results import Channel
from kedfem.results.differences import scales
from kedfem.scene import scene_from
from tests.scenes import cycloidal


def histories(force: float, moment: float, size: float) -> Histories:
    """A balanced rotor: forces of its joint, and the torque of its drive."""
    made = {
        "joints/A/force": (Channel("joints/A/force", ("x", "y", "z"), "N", "world", ""), force),
        "drive/torque": (Channel("drive/torque", ("torque",), "N m", "world", ""), moment),
    }
    every = {name: (each, np.full((3, len(each.columns)), value)) for name, (each, value) in made.items()}
    return Histories(np.linspace(0.0, 1.0, 3), every, size=size)


@pytest.mark.parametrize(
    ("force", "moment", "size", "names"),
    [
        (7e-7, 13.0, 0.5, {"drive/torque"}),
        (1e-3, 13.0, 0.5, {"joints/A/force", "drive/torque"}),
        (1e-3, 13.0, 1e-3, {"drive/torque"}),
        (50.0, 1e-5, 0.5, {"joints/A/force"}),
        (7e-7, 0.0, 0.5, {"joints/A/force"}),
    ],
)
def test_what_is_rounding_beside_others_does_not_count(force: float, moment: float, size: float, names: set[str]) -> None:
    """Forces against moments at the arm of the linkage's size, by 1e-6 as against other forces."""
    assert counted(histories(force, moment, size)).keys() == names


def scaled(errors: dict[str, float], sizes: dict[str, float], unit: str = "N") -> tuple[dict[str, float], set[str]]:
    """Relative errors, and which channels are zero beside others."""
    zeros: set[str] = set()
    by = scales(errors, {name: (unit, size) for name, size in sizes.items()}, zeros)
    return {name: error / by[name] for name, error in errors.items()}, zeros


@pytest.mark.parametrize(
    ("size", "error", "relative"),
    [
        (1.0, 2.0, 0.002),  # below 0.3 % of the others
        (1.0, 0.5, 0.0005),
        (50.0, 60.0, 0.06),  # less than its own error
        (50.0, 5.0, 0.1),
        (200.0, 300.0, 1.5),  # 20 % of the others: not zero, but wrong
        (1000.0, 2000.0, 2.0),  # the largest of all
    ],
)
def test_what_is_zero_beside_others_has_errors_of_these(size: float, error: float, relative: float) -> None:
    found, zeros = scaled({"A": 10.0, "S": error}, {"A": 1000.0, "S": size})
    assert found == {"A": 0.01, "S": pytest.approx(relative)}
    assert zeros == ({"S"} if relative == error / 1000.0 and size < 1000.0 else set())
    assert scaled({"A": 10.0, "S": error}, {"A": 1000.0, "S": size}, "N m")[0]["S"] == pytest.approx(error / size)


@pytest.mark.parametrize(("elastic", "whole"), [
    ("displacement", "position"), ("deflection", "travel"), ("velocity", "total_velocity"),
    ("acceleration", "total_acceleration"),
])  # fmt: skip
@pytest.mark.parametrize("size", [1e-3, 1e-7])
def test_what_a_link_bends_is_not_zero_beside_how_far_it_moves(elastic: str, whole: str, size: float) -> None:
    """A probe of the position made 12 % of the displacement 0.1 %: it is 1 mm beside 1 m."""
    sizes = {f"probes/tip/{elastic}": size, f"probes/tip/{whole}": 1.0}

    def recorded(factor: float) -> Histories:
        every = {name: (Channel(name, ("x",), "SI", "", ""), np.full((3, 1), x * factor)) for name, x in sizes.items()}
        return Histories(np.linspace(0.0, 1.0, 3), every)

    found = relative_errors(recorded(1.1), recorded(1.0))
    assert found == pytest.approx(dict.fromkeys(sizes, 0.1))


def rotor(steps: int = 300) -> dict[str, Any]:
    """Two halves that balance each other, of one and of two elements, whose joint on the ground carries nothing."""
    halves = {"left": (-0.5, 1), "right": (0.5, 2)}
    links = {}
    for name, (x, elements) in halves.items():
        shape = {"kind": "bar", "between": [[0, 0], [x, 0]], "width": 0.02, "thickness": 0.02}
        links[name] = {
            "model": "beam",
            "material": "steel",
            "element": "beam3",
            "mesh": {"elements": elements},
            "shape": shape,
        }
    joints = {
        "A": {"kind": "revolute", "links": ["ground", "left"], "at": [0, 0]},
        "W": {"kind": "weld", "links": ["left", "right"], "at": [0, 0]},
    }
    drive = {"joint": "A", "motion": cycloidal(3.0, 0.2)}
    return {"links": links, "joints": joints, "drive": drive, "analysis": {"end_time": 0.2, "step": 0.2 / steps}}


def test_a_joint_that_carries_nothing_has_errors_of_those_that_do() -> None:
    """The force on the ground is what elements of unequal length leave, 6 % of that between the halves; all of it is
    error, and was 1,400 % of what finer elements leave."""
    ready = meshed(scene_from(rotor()))
    zeros: set[str] = set()
    base = run(ready)
    found = mesh_errors(ready, base, {}, zeros)
    sizes = counted(base)
    assert zeros == {"joints/A/force"}
    assert found["joints/A/force"] == pytest.approx(sizes["joints/A/force"] / sizes["joints/W/force"], rel=0.2)
    limits = budget(ready, error_monitor(ready), None, base).limits
    assert [x.partition(":")[0] for x in limits] == ["joints/A/force by itself"]


def test_levels_and_marches_have_the_same_scale() -> None:
    """A guide that carries nothing but what the step leaves, beside a joint that is followed well."""
    t = np.linspace(0.0, 1.0, 101)

    def recorded(every: int) -> Histories:
        noise = (-1.0) ** np.arange(0, len(t), 1)[::every] * 1e-3 * every
        values = {"joints/A/force": 1000 * np.sin(6 * t[::every]), "joints/S/force": noise}
        made = {name: (Channel(name, ("x",), "N", "", ""), x[:, None]) for name, x in values.items()}
        return Histories(t[::every], made)

    zeros: set[str] = set()
    finer, _ = single_errors(recorded(1), recorded(2), False, zeros)
    assert zeros == {"joints/S/force"}
    assert finer["joints/S/force"] < 1e-5
