"""Laws of reduced links: the same equation in the span of a few modes, and an estimate that can be trusted."""

from copy import deepcopy
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.accuracy.histories import histories, relative_errors, worst
from kedfem.accuracy.prepared import Prepared, meshed, training_motion
from kedfem.accuracy.reduction import reduced
from kedfem.dynamics.joints.constraint_matrices import constraint_matrices
from kedfem.dynamics.matrices.closed import closed
from kedfem.dynamics.model import Model
from kedfem.dynamics.modes.bases import bases
from kedfem.dynamics.modes.reduction import Basis, static_parts
from kedfem.dynamics.modes.residual import residual_deflections
from kedfem.dynamics.reduced_model import reduced_model
from kedfem.dynamics.rigid_body import forcings
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.system.steps import with_element_points
from kedfem.links.reduced import rigid, rigid_modes
from kedfem.scene import scene_from
from tests import scenes
from tests.moving import snapshots
from tests.rooms.test_dynamics import four_bar
from tests.scenes import bar, cycloidal

KINDS = ["beam", "bar", "tetrahedra", "plane", "spatial"]
TURNED = 0.7  # rad


@pytest.fixture(autouse=True)
def _no_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KEDFEM_CACHE", "off")


def arm(kind: str, **analysis: Any) -> dict[str, Any]:
    """A cantilever that swings under its weight; spatial: a bent beam under weight across its plane."""
    link = bar(0.5, 0.02, 0.03, model="solid", mesh={"elements": [10, 2, 1]})
    if kind == "tetrahedra":
        link |= {"element": "tet10"}
    if kind == "plane":
        link |= {"model": "plane", "mesh": {"elements": [10, 2]}}
    if kind in {"beam", "spatial"}:
        link |= {"model": "beam", "mesh": {"elements": 10}}
    if kind == "spatial":
        points = [[0, 0], [0.3, 0.1], [0.5, 0]]
        link["shape"] = {"kind": "polyline", "points": points, "width": 0.02, "thickness": 0.03}
    return scenes.arm(
        link,
        cycloidal(1, 0.1),
        gravity=[0, 0, -9.81] if kind == "spatial" else [0, -9.81, 0],
        damping={"beta": 1e-5},
        analysis={"end_time": 0.1, "step": 1e-3, **analysis},
    )


def found_bases(full: Prepared) -> list[Basis]:
    made = bases(full.model, training_motion(full), static_parts(full.model))
    return [basis for basis in made if basis is not None]


def with_modes(full: Prepared, count: int) -> Model:
    return reduced_model(full.model, [basis.first(count) for basis in found_bases(full)])


@pytest.mark.parametrize("kind", KINDS)
def test_a_reduced_link_is_a_link(kind: str) -> None:
    """Mass 1, 1 and X held exactly, rigid modes strain nothing, K0 symmetric and positive semidefinite."""
    full = meshed(scene_from(arm(kind)))
    link = with_modes(full, 12).links[0]
    whole, Q = link.full, link.Q
    assert whole is not None
    assert Q is not None
    assert_allclose(Q.T @ (whole.mass[0] @ Q), np.eye(link.n), rtol=0, atol=1e-12)
    assert_allclose(Q @ link.one, whole.one, rtol=0, atol=1e-10)
    columns = 2 if link.planar else 3
    assert_allclose((Q @ link.X)[:, :columns], whole.X[:, :columns], rtol=0, atol=1e-10)
    assert_allclose(link.K0, link.K0.T, rtol=0, atol=0)
    values = np.linalg.eigvalsh(link.K0)
    assert values[0] > -1e-12 * values[-1]
    modes = rigid_modes(link)
    assert np.abs(link.K0 @ modes).max() < 1e-11 * values[-1] * np.abs(modes).max()
    assert np.count_nonzero(values > 1e-9 * values[-1]) <= link.unknowns - modes.shape[1]


@pytest.mark.parametrize("kind", ["beam", "plane", "bar"])
def test_all_functions_give_the_full_answer(kind: str) -> None:
    raw = arm(kind, initial="quasi-static")
    raw["links"]["arm"]["mesh"] = {
        "beam": {"elements": 3},
        "plane": {"elements": [3, 1]},
        "bar": {"elements": [3, 1, 1]},
    }[kind]
    full = meshed(scene_from(raw))
    rng = np.random.default_rng(1)
    mixed = [rng.normal(size=(link.n, link.n)) for link in full.model.links]
    small = replace(full, model=reduced_model(full.model, mixed))
    # rounding, of stiffnesses 1e6 times as large as that of bending
    assert worst(relative_errors(histories(small), histories(full))) < 1e-7


@pytest.mark.parametrize("kind", KINDS)
def test_a_reduced_link_is_too_stiff_and_less_so_with_more_functions(kind: str) -> None:
    """Galerkin: the work of the loads on their static deflection, uᵀ F, rises with the space up to the full."""
    full = meshed(scene_from(arm(kind)))
    work = [static_work(reduced_model(full.model, [b.first(n) for b in found_bases(full)]), full) for n in (5, 8, 11, 20)]
    exact = static_work(full.model, full)
    assert np.all(np.diff(work) >= -1e-9 * exact)
    assert work[-1] <= exact * (1 + 1e-9)
    assert_allclose(work[-1], exact, rtol=1e-3)
    assert work[0] < work[-1] * (1 - 1e-7)


def static_work(model: Model, full: Prepared) -> float:
    motion = training_motion(full)
    last = forcings(model, motion.part(-1, len(motion.t)))
    F = [each.F @ each.R for each in last]
    rows = constraint_matrices(model.rows, motion.part(-1, len(motion.t)), model.interface_unknowns)
    u = closed(static_parts(model), [each.R for each in last], rows).deflections(F)
    return sum(float(np.vdot(x, f)) for x, f in zip(u, F, strict=True))


def test_a_scene_that_is_turned_has_the_same_forces_turned() -> None:
    """Q ⊗ R³ is closed under rotation: the same functions do, whatever the directions that they came from."""
    raw = four_bar("bar", revolutions=0.1, steps_per_revolution=240, initial="quasi-static")
    for link in raw["links"].values():
        link["mesh"] = {"elements": [8, 1, 1]}
    turned = deepcopy(raw)
    turned["points"]["D"] = [0.9144 * np.cos(TURNED), 0.9144 * np.sin(TURNED)]
    turned["points"]["B"]["angle"] = np.radians(60) + TURNED
    here, there = (meshed(scene_from(each)) for each in (raw, turned))
    Q = [basis.first(14) for basis in found_bases(here)]
    found = [histories(replace(x, model=reduced_model(x.model, Q))) for x in (here, there)]
    c, s = np.cos(TURNED), np.sin(TURNED)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    for joint in "ABCD":
        a, b = (run.channels[f"joints/{joint}/force"][1] for run in found)
        assert_allclose(b, a @ R.T, rtol=0, atol=1e-7 * np.abs(a).max())  # rounding; z is held more than once


@pytest.mark.parametrize("spring", [False, True])
@pytest.mark.parametrize("kind", ["beam", "bar"])
def test_the_full_models_own_state_leaves_no_residual(kind: str, spring: bool) -> None:
    """With average acceleration the balance holds at the end of each step, what a spring exerts in it."""
    raw = arm(kind, rho_inf=1.0)
    del raw["damping"]
    if spring:
        ends = [{"link": "ground", "at": [0.5, 0.4, 0]}, {"link": "arm", "at": [0.5, 0, 0]}]
        raw["springs"] = {"s": {"kind": "spring", "between": ends, "stiffness": 2000.0}}
    full = meshed(scene_from(raw))
    parts, points = static_parts(full.model), with_element_points(full.scene, full.linkage, full.model)
    states = list(snapshots(full.scene, full.linkage, full.path, full.model, steps_of(full.scene, full.model)))
    size = max(np.abs(s.states[0].g).max() for s in states)
    for left in residual_deflections(full.model, parts, full.model, states[1::30], points):
        assert np.abs(left[0]).max() < 1e-7 * size
    wrong = states[50]
    wrong.states[0].a[:] *= 1.01
    assert np.abs(residual_deflections(full.model, parts, full.model, [wrong], points)[0][0]).max() > 1e-5 * size


def four_bars(speed: str) -> dict[str, Any]:
    raw = four_bar("bar", revolutions=0.5, steps_per_revolution=240, initial="quasi-static")
    raw["drive"]["motion"]["speed"] = speed
    for link in raw["links"].values():
        link["mesh"] = {"elements": [10, 2, 1]}
    return raw


@pytest.mark.parametrize(
    ("raw", "count"), [(arm("bar"), 6), (four_bars("150 rpm"), 9), (four_bars("400 rpm"), 9)], ids=["arm", "slow", "fast"]
)
def test_the_estimate_is_near_the_error(raw: dict[str, Any], count: int) -> None:
    full = meshed(scene_from(raw))
    names = list(raw["links"])
    found = reduced(full, names, 1e-9, dict.fromkeys(names, count))
    true = relative_errors(histories(found.ready), histories(full))
    assert worst(true) > 1e-4  # else there is nothing to estimate
    assert 1 / 3 < worst(found.estimate) / worst(true) < 3


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(3))
def test_statics_do_not_depend_on_how_the_functions_are_mixed(kind: str, seed: int) -> None:
    """A reduced link is held where it moves, not at one function of many: any basis of the span gives one answer."""
    full = meshed(scene_from(arm(kind)))
    Q = with_modes(full, 12).links[0].Q  # mass-orthonormal: none is lost in the others when they are mixed
    assert Q is not None
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(Q.shape[1], Q.shape[1])))[0]
    work = [static_work(reduced_model(full.model, [each]), full) for each in (Q, Q @ turn)]
    assert_allclose(work[1], work[0], rtol=1e-6)  # rounding, of sections 1e6 times as stiff as the beam


def test_a_rigid_coupler_of_beams_can_be_held() -> None:
    """Two functions, 1 and the place along it: the second alone does not see the link move as a whole."""
    work = [rigid_coupler_work(angle) for angle in np.linspace(0, 6, 5)]
    assert_allclose(work, work[0], rtol=1e-6)  # the direction of the drawing does not matter


def rigid_coupler_work(angle: float) -> float:
    raw = four_bar("beam")
    raw["points"]["D"] = [0.9144 * np.cos(angle), 0.9144 * np.sin(angle)]
    raw["points"]["B"]["angle"] = np.radians(60) + angle
    shape = {"kind": "polyline", "points": ["B", "C"], "width": 0.0254, "thickness": 0.0254}
    raw["links"]["coupler"] = {"material": "alloy", "model": "rigid", "shape": shape}
    full = meshed(scene_from(raw))
    assert full.model.links[1].kind == "beam"
    return static_work(full.model, full)


@pytest.mark.parametrize("angle", np.linspace(0, np.pi, 7))
def test_a_rigid_straight_beam_has_two_functions_whatever_its_direction(angle: float) -> None:
    raw = arm("beam")
    raw["links"]["arm"]["shape"]["between"] = [[0, 0], [0.5 * np.cos(angle), 0.5 * np.sin(angle)]]
    link = rigid(meshed(scene_from(raw)).model.links[0])
    assert link.n == 2  # 1 and the place along it; rows (u, v, ψ) of both hold all rigid motion
    stiff = np.abs(link.K0).max()
    assert np.abs(link.K0 @ rigid_modes(link)).max() < 1e-12 * stiff
    assert np.count_nonzero(np.linalg.eigvalsh(link.K0) > 1e-9 * stiff) >= 1
