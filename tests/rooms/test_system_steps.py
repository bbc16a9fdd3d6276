"""Springs and motors on links with rigid-body frames: the system's steps record what those of the oracle do."""

from functools import partial
from typing import Any

import numpy as np
import pytest

from kedfem.accuracy.reduction import prepared
from kedfem.dynamics.history import Block
from kedfem.dynamics.model import Model
from kedfem.dynamics.stepping.scheme import generalised_alpha
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.dynamics.system.steps import Steps, scene_system
from kedfem.results.channels import Channel
from kedfem.results.recording import recording
from kedfem.scene import Scene, scene_from, time_grid
from tests.moving import inverted
from tests.rooms.test_force_elements_on_links import balance, four_bar, line, slider_crank

SOLIDS = {"crank": [4, 1, 1], "coupler": [24, 2, 1], "rocker": [4, 1, 1]}
CURVE = {"over": "speed", "at": [-10, 10], "value": [5, -5]}


def bushed() -> dict[str, Any]:
    """A bushing in a hinge and a shaft that gives in the drive, both damped."""
    raw = four_bar("rigid-body", springs=line(100.0), steps=72)
    raw["joints"]["C"]["bushing"] = {"stiffness": [1e5, 2e5, 1e5], "damping": [10.0, 10.0, 10.0]}
    raw["drive"] |= {"shaft_stiffness": 500.0, "shaft_damping": 0.5}
    return raw


def large() -> dict[str, Any]:
    """Solid links, one of 1,407 unknowns with a sparse factor beside two with dense matrices."""
    raw = four_bar("rigid-body", "solid", springs=line(20.0), steps=72, damping={"beta": 1e-5, "alpha": 1.0})
    for name, link in raw["links"].items():
        link["mesh"] = {"elements": SOLIDS[name]}
    return raw


DEAR = ("solid links, reduced", "plane links", "motor over speed", "spring along a slide")
SCENES = {
    "springs with dampers": lambda: four_bar("rigid-body", springs=line(200.0), steps=72),
    "from rest, damped links, rho_inf 0.8": lambda: four_bar(
        "rigid-body", springs=line(50.0), steps=72, damping={"beta": 1e-5, "alpha": 1.0},
        analysis={"initial": "rest", "rho_inf": 0.8},
    ),
    "motor over speed": lambda: four_bar("rigid-body", motors={"m": {"joint": "C", "torque": CURVE}}, steps=72),
    "spring along a slide": partial(slider_crank, steps=72, damping=5.0),
    "bushing and shaft": bushed,
    "solid links, reduced": lambda: four_bar("rigid-body", "reduced", springs=line(20.0), steps=36),
    "a pin in a slot": lambda: inverted(
        "beam", "slot", steps_per_revolution=72, rho_inf=0.8) | {
            "springs": {"s": {"kind": "torsion", "joint": "B", "stiffness": 20.0, "damping": 0.2}}},
    "plane links": lambda: four_bar(
        "rigid-body", "plane", springs=line(20.0), motors={"m": {"joint": "C", "torque": CURVE}}, steps=72),
}  # fmt: skip


def channels(raw: dict[str, Any], solver_of: Any) -> tuple[Steps, dict[Channel, np.ndarray]]:
    """All that a run records, over time."""
    ready, _ = prepared(scene_from(raw))
    solver = solver_of(ready.scene, ready.model)
    blocks: list[Block] = list(transient(ready.scene, ready.linkage, ready.path, ready.model, solver))
    every = recording(ready.scene, ready.model)
    return solver, {x.channel: np.concatenate([x.rows(block) for block in blocks]) for x in every}


def oracle_of(scene: Scene, model: Model) -> Steps:
    """The oracle on the same model, reduced or not: as of itself, `solver = "monolithic"` reduces nothing."""
    scheme = generalised_alpha(time_grid(scene).step, scene.analysis.rho_inf)
    return Steps(scene, scene_system(scene, model), model, scheme, monolithic=True)


def apart(found: dict[Channel, np.ndarray], wanted: dict[Channel, np.ndarray]) -> float:
    """Largest difference, of the largest value of all channels in the same unit."""
    assert found.keys() == wanted.keys()
    most: dict[str, float] = {}
    for each, x in wanted.items():
        most[each.unit] = max(most.get(each.unit, 0.0), float(np.abs(x).max()))
    return max(float(np.abs(found[each] - x).max()) / most[each.unit] for each, x in wanted.items() if most[each.unit])


@pytest.mark.parametrize("name", [pytest.param(x, marks=pytest.mark.long) if x in DEAR else x for x in SCENES])
def test_all_that_is_recorded_is_as_by_the_oracle(name: str) -> None:
    """It shares the start and the reading of forces, and no step; beside reduced links its tangents keep eight digits."""
    raw = SCENES[name]()
    raw["analysis"]["revolutions"] = 0.06
    solver, found = channels(raw, steps_of)
    _, wanted = channels(raw, oracle_of)
    assert solver.monolithic is None
    assert apart(found, wanted) <= 1e-8
    assert any(each.name.startswith(("springs/", "motors/")) for each in found)


@pytest.mark.parametrize("spring", [True, pytest.param(False, marks=pytest.mark.long)])
def test_quasi_static_starts_of_damped_bushings_and_shafts_do_not_ring(spring: bool) -> None:
    """The energy's residual falls with the square of the step; dampers left out of the start leave 20 to 60 %."""
    left = []
    for steps in (72, 144):
        raw = bushed()
        raw["analysis"]["steps_per_revolution"] = steps
        if not spring:
            del raw["springs"]
            raw["gravity"] = [0, -9.81, 0]
        left.append(balance(raw)[0])
    assert left[0] < 5e-4
    assert left[0] / left[1] == pytest.approx(4.0, rel=0.1)


def undamped() -> dict[str, Any]:
    """The bushing and the shaft without their dampers, for which starts are sought anew."""
    raw = bushed()
    raw["joints"]["C"]["bushing"].pop("damping")
    raw["drive"].pop("shaft_damping")
    raw["springs"] = {name: {**spring, "damping": 0.0} for name, spring in raw["springs"].items()}
    return raw


@pytest.mark.parametrize("scene", [undamped, *(pytest.param(x, marks=pytest.mark.long) for x in (bushed, large))])
def test_sparse_bodies_move_as_dense_ones(scene: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """From quasi-static starts, whose iterations end at 1e-10 of deflections; rates are of these over a quarter step."""
    raw = scene() | {"damping": {"beta": 1e-5, "alpha": 1.0}}
    raw["analysis"]["revolutions"] = 0.1
    found = {}
    for small in (0, 10_000):
        monkeypatch.setattr("kedfem.dynamics.system.layout.SMALL", small)
        solver, found[small] = channels(raw, steps_of)
        assert solver.ready.bodies.dense.all() == (small > 0)
    assert apart(found[0], found[10_000]) <= 1e-7
