"""Springs and motors on links with nominal frames: the system's steps record what those of the condensed solver do."""

from functools import partial
from typing import Any

import numpy as np
import pytest

from kedfem.accuracy.reduction import prepared
from kedfem.dynamics.acted import ActedSteps
from kedfem.dynamics.actions import actions
from kedfem.dynamics.condensed import CondensedSteps
from kedfem.dynamics.history import Block
from kedfem.dynamics.scheme import generalised_alpha
from kedfem.dynamics.system.steps import SystemSteps
from kedfem.dynamics.transient import Steps, steps_of, transient
from kedfem.results.recording import recording
from kedfem.results.records import Channel
from kedfem.scene import scene_from, time_grid
from tests.rooms.test_acted import balance, four_bar, line, slider_crank

SOLIDS = {"crank": [4, 1, 1], "coupler": [24, 2, 1], "rocker": [4, 1, 1]}
CURVE = {"over": "speed", "at": [-10, 10], "value": [5, -5]}


def bushed() -> dict[str, Any]:
    """A bushing in a hinge and a shaft that gives in the drive, both damped."""
    raw = four_bar("nominal", springs=line(100.0), steps=72)
    raw["joints"]["C"]["bushing"] = {"stiffness": [1e5, 2e5, 1e5], "damping": [10.0, 10.0, 10.0]}
    raw["drive"] |= {"shaft_stiffness": 500.0, "shaft_damping": 0.5}
    return raw


def large() -> dict[str, Any]:
    """Solid links, one of 1,407 unknowns with a sparse factor beside two with dense matrices."""
    raw = four_bar("nominal", "solid", springs=line(20.0), steps=72, damping={"beta": 1e-5, "alpha": 1.0})
    for name, link in raw["links"].items():
        link["mesh"] = {"elements": SOLIDS[name]}
    return raw


DEAR = "solid links, reduced"
SCENES = {
    "springs with dampers": lambda: four_bar("nominal", springs=line(200.0), steps=72),
    "from rest, damped links, rho_inf 0.8": lambda: four_bar(
        "nominal", springs=line(50.0), steps=72, damping={"beta": 1e-5, "alpha": 1.0},
        analysis={"initial": "rest", "rho_inf": 0.8},
    ),
    "motor over speed": lambda: four_bar("nominal", motors={"m": {"joint": "C", "torque": CURVE}}, steps=72),
    "spring along a slide": partial(slider_crank, steps=72, damping=5.0),
    "bushing and shaft": bushed,
    DEAR: lambda: four_bar("nominal", "reduced", springs=line(20.0), steps=36),
    "a large solid link beside small ones": large,
    "plane links": lambda: four_bar(
        "nominal", "plane", springs=line(20.0), motors={"m": {"joint": "C", "torque": CURVE}}, steps=72),
}  # fmt: skip


def channels(raw: dict[str, Any], solver_of: Any) -> tuple[Steps, dict[Channel, np.ndarray]]:
    """All that a run records, over time."""
    ready, _ = prepared(scene_from(raw))
    solver = solver_of(ready.scene, ready.model)
    blocks: list[Block] = list(transient(ready.scene, ready.linkage, ready.path, ready.model, solver))
    every = recording(ready.scene, ready.model)
    return solver, {x.channel: np.concatenate([x.rows(block) for block in blocks]) for x in every}


def condensed(scene: Any, model: Any) -> ActedSteps:
    """The solver that the system's steps replace."""
    scheme = generalised_alpha(time_grid(scene).step, scene.analysis.rho_inf)
    inner = CondensedSteps(model.links, model.joints, scheme, model.damping, None)
    return ActedSteps(inner, actions(scene, model))


@pytest.mark.parametrize(
    "name", [pytest.param(x, marks=pytest.mark.long) if x == DEAR else x for x in SCENES]
)
def test_all_that_is_recorded_is_as_by_the_condensed_solver(name: str) -> None:
    """From rest, of the largest value of all channels in the same unit; that solver finds first rates of bushings by
    differences."""
    within = 1e-7 if name == "bushing and shaft" else 1e-8
    raw = SCENES[name]()
    raw["analysis"]["initial"] = "rest"
    solver, found = channels(raw, steps_of)
    _, wanted = channels(raw, condensed)
    assert isinstance(solver, SystemSteps)
    assert found.keys() == wanted.keys()
    assert any(each.name.startswith(("springs/", "motors/")) for each in found)
    for each, x in wanted.items():
        size = max(float(np.abs(y).max()) for like, y in wanted.items() if like.unit == each.unit)
        assert np.abs(found[each] - x).max() <= within * size, each.name


@pytest.mark.parametrize("spring", [True, False])
def test_quasi_static_starts_of_damped_bushings_and_shafts_do_not_ring(spring: bool) -> None:
    """The energy's residual falls with the square of the step; dampers left out of the start leave 20 to 60 %."""
    left = []
    for steps in (72, 144):
        raw = bushed()
        raw["analysis"]["steps_per_turn"] = steps
        if not spring:
            del raw["springs"]
            raw["gravity"] = [0, -9.81, 0]
        left.append(balance(raw)[0])
    assert left[0] < 5e-4
    assert left[0] / left[1] == pytest.approx(4.0, rel=0.1)


def test_sparse_bodies_move_as_dense_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    """From quasi-static starts, whose iterations end at 1e-10 of deflections; rates are of these over a quarter step."""
    raw = bushed()
    raw |= {"damping": {"beta": 1e-5, "alpha": 1.0}}
    _, wanted = channels(raw, steps_of)
    monkeypatch.setattr("kedfem.dynamics.system.layout.SMALL", 0)
    solver, found = channels(raw, steps_of)
    assert isinstance(solver, SystemSteps)
    assert not solver.ready.bodies.dense.any()
    for each, x in wanted.items():
        size = max(float(np.abs(y).max()) for like, y in wanted.items() if like.unit == each.unit)
        assert np.abs(found[each] - x).max() <= 1e-7 * size, each.name
