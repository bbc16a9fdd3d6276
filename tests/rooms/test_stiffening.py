"""Geometric stiffening: stresses of the rigid-body motion, solvers, order in time, iterations, where none converge."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.accuracy.histories import histories, relative_errors, worst
from kedfem.accuracy.prepared import Prepared, meshed
from kedfem.accuracy.reduction import prepared
from kedfem.dynamics import stiffening
from kedfem.dynamics.joints.constraint_matrices import constraint_matrices
from kedfem.dynamics.joints.ports import add_port_forces
from kedfem.dynamics.matrices.closed import closed
from kedfem.dynamics.rigid_body import forcings, motions
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.start import started
from kedfem.dynamics.stepping.transient import transient
from kedfem.dynamics.system.march import march
from kedfem.dynamics.system.state import State
from kedfem.errors import SceneError, SolveError
from kedfem.links.point_rows import point_rows
from kedfem.links.reduced import rigid_modes
from kedfem.motion.rigid import rigid_motion
from kedfem.scene import path_parameter, scene_from
from tests.verification.stiffening import turning_scene

from .test_dynamics import four_bar, slider_crank
from .test_steps import displacements, mixed


def stiff(raw: dict[str, Any], **analysis: Any) -> dict[str, Any]:
    raw["analysis"] |= {"stiffening": True, **analysis}
    return raw


def sliding() -> dict[str, Any]:
    raw = slider_crank("rigid")
    raw["analysis"] = {"revolutions": 0.25, "steps_per_revolution": 120}
    return raw


def loaded() -> dict[str, Any]:
    """Everything that can put stress on a link: gravity, forces that turn and that do not, bodies."""
    raw = mixed()
    raw["gravity"] = [3.0, -9.81, 0.0]
    raw["loads"] = {
        "a": {"kind": "force", "link": "rocker", "at": "C", "vector": [300, 200, 0], "frame": "link"},
        "b": {"kind": "force", "link": "crank", "at": "B", "vector": [-100, 400, 0]},
        "c": {"kind": "body", "link": "coupler", "vector": [1e5, 2e5, 0], "frame": "link"},
        "d": {"kind": "body", "link": "rocker", "vector": [1e5, 2e5, 0]},
    }
    return raw


@pytest.mark.parametrize("made", [loaded, sliding, lambda: four_bar("plate")])
def test_stress_modes_hold_every_stress_of_the_rigid_body_motion(made: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Port forces are those of `closed`; Σ s_i g_i is the static deflection but for rigid motion."""
    monkeypatch.setattr(stiffening, "NEGLIGIBLE", 0.0)  # bending of planar beams has no stress stiffness
    ready = meshed(scene_from(made()))
    model = ready.model
    t = np.array([0.0, 0.013, 0.04])
    motion = rigid_motion(ready.linkage, ready.path, t, path_parameter(ready.scene, t))
    found = stiffening.stiffening(model)
    forcing = forcings(model, motion)
    stressed = found.over(forcing, motion)
    rows = constraint_matrices(model.rows, motion, model.interface_unknowns)
    frozen, loads = closed(found.parts, [each.R for each in forcing], rows), [each.F @ each.R for each in forcing]
    deflections, port_forces = frozen.deflections(loads), frozen.forces(loads)
    for k in range(len(t)):
        load, g, forces = ([x[k] for x in every] for every in (loads, deflections, port_forces))
        for i, (link, joint, modes) in enumerate(zip(model.links, model.joints, found.modes, strict=True)):
            total = load[i].copy()
            add_port_forces(total, joint, forces[i][: len(joint.keep)])
            state = np.tensordot(stressed[i][k], modes.states, 1)
            left = (link.K0 @ state.ravel()).reshape(total.shape) - total
            near = max(1e-6 * np.abs(total).max(), 1e-12 * np.abs(load[i]).max())  # a slider that is held has no total
            assert_allclose(left, 0, rtol=0, atol=near)  # of solids, held at three nodes
            B = np.linalg.qr(rigid_modes(link))[0]
            beside = (g[i] - state).ravel()
            beside -= B @ (B.T @ beside)
            # what remains beside rigid motion, of the deflection's size
            assert np.abs(beside).max() < 1e-6 * np.abs(g[i]).max()


@pytest.mark.parametrize("rho_inf", [1.0, 0.8])
@pytest.mark.parametrize(("made", "effect"), [(loaded, 0.02), (sliding, 3e-4)])
def test_stiffened_steps_of_the_system_are_the_monolithic_ones(made: Any, effect: float, rho_inf: float) -> None:
    ready = meshed(scene_from(stiff(made(), initial="quasi-static", rho_inf=rho_inf)))
    system, monolithic, plain = (
        displacements(ready, steps_of(ready.scene.model_copy(update={"analysis": analysis}), ready.model))
        for given in ({}, {"solver": "monolithic"}, {"stiffening": False})
        for analysis in [ready.scene.analysis.model_copy(update=given)]
    )
    for got, wanted in zip(system, monolithic, strict=True):
        # rounding, amplified by the stiffness of the links along their line, and what the passes leave
        assert_allclose(got, wanted, rtol=0, atol=1e-8 * np.abs(wanted).max())
    assert np.abs(plain[0] - system[0]).max() > effect * np.abs(plain[0]).max()


@pytest.mark.parametrize(("kind", "solver"), [("beam", "condensed"), ("plate", "condensed"), ("beam", "monolithic")])
def test_only_a_scene_that_asks_for_stiffening_has_it(kind: str, solver: str) -> None:
    raw = four_bar(kind, solver=solver)
    ready = meshed(scene_from(raw))
    for scene, wanted in ((ready.scene, False), (scene_from(stiff(raw)), True)):
        found = steps_of(scene, ready.model)
        assert (found.monolithic is not None) is (solver == "monolithic")
        assert (found.stiffening is not None) is wanted


def tip(ready: Prepared) -> np.ndarray:
    """Displacements (T, k) of all links."""
    blocks = transient(ready.scene, ready.linkage, ready.path, ready.model, steps_of(ready.scene, ready.model))
    return np.concatenate([np.hstack([x.u.reshape(len(b), -1) for x in b.links]) for b in blocks])


@pytest.mark.parametrize("rho_inf", [1.0, 0.6])
def test_stiffened_steps_are_of_second_order(rho_inf: float) -> None:
    """At t = 0.02 s; beams soft enough for a step to resolve all of their motion that counts."""
    raw = stiff(four_bar("beam", revolutions=0.2, rho_inf=rho_inf, initial="quasi-static"))
    raw["drive"]["motion"]["speed"] = "300 rpm"
    raw["damping"] = {"alpha": 0.0, "beta": 1e-4}
    last = []
    for steps in (1000, 2000, 4000, 8000):
        raw["analysis"]["steps_per_revolution"] = steps
        last.append(tip(meshed(scene_from(raw)))[-1])
    errors = [np.abs(x - y).max() for x, y in pairwise(last)]
    slopes = np.log2(np.divide(errors[:-1], errors[1:]))
    assert_allclose(slopes, 2.0, atol=0.15)
    assert errors[-1] < 1e-4 * np.abs(last[-1]).max()


def test_what_stiffening_changes_grows_with_the_square_of_the_speed() -> None:
    """Stresses and deflections are of the order of speed², so their product, of the deflection, is."""
    effect = []
    for rpm in (60, 120, 240):
        raw = four_bar("beam", steps_per_revolution=720, initial="quasi-static", rho_inf=0.9)
        raw["drive"]["motion"]["speed"] = f"{rpm} rpm"
        raw["damping"] = {"alpha": 0.0, "beta": 1e-3}  # so that no vibration is left
        plain, stiffened_ = tip(meshed(scene_from(raw))), tip(meshed(scene_from(stiff(raw))))
        effect.append(np.abs(stiffened_ - plain).max() / np.abs(plain).max())
    slopes = np.diff(np.log2(effect))
    assert_allclose(slopes, 2.0, atol=0.3)
    assert effect[0] < 2e-3


def test_a_step_takes_few_passes() -> None:
    """720 steps a revolution at 600 rpm, from rest: two in which the term settles, and one that finds it settled."""
    ready = meshed(scene_from(stiff(four_bar("beam", steps_per_revolution=720, revolutions=0.5))))
    solver = steps_of(ready.scene, ready.model)
    start = started(ready.scene, ready.linkage, ready.path, ready.model, solver)
    assert isinstance(start, State)
    ((first, motion),) = motions(ready.scene, ready.linkage, ready.path)
    last, _ = march(solver.ready, start, motion)
    assert (first, len(motion.t)) == (1, 360)
    assert last.passes[0] < 3.5 * 360
    assert last.passes[1] == 0


@pytest.mark.parametrize("kind", ["beam", "spatial"])
def test_where_stiffening_is_no_small_term_the_run_ends_and_says_so(kind: str) -> None:
    """A thin arm that turns fast, in steps far too long: what is done is kept."""
    shape = {"kind": "bar", "between": ["A", "B"], "width": 0.002, "thickness": 0.002}
    arm = {"material": "steel", "model": "beam", "shape": shape, "mesh": {"elements": 6}}
    arm |= {"beam": "spatial"} if kind == "spatial" else {}
    raw = {
        "points": {"A": [0, 0], "B": [1, 0]},
        "links": {"arm": arm},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": "A", "axis": [0, 0, 1]}},
        "drive": {"joint": "A", "motion": {"kind": "ramp", "speed": 200.0, "time": 0.5}},
        "gravity": [0, -9.81, 0],
        "analysis": {"end_time": 0.5, "step": 0.01, "stiffening": True},
    }  # fmt: skip
    ready = meshed(scene_from(raw))
    solver, steps = steps_of(ready.scene, ready.model), 0

    def all_of_it() -> None:
        nonlocal steps
        for block in transient(ready.scene, ready.linkage, ready.path, ready.model, solver):
            assert np.isfinite(block.links[0].u).all()
            steps += len(block)

    said = r"at step \d+, t = 0\.\d+ s, .*: stiffening is not a small term; take frames = \"co-rotational\", take a"
    with pytest.raises(SolveError, match=said):
        all_of_it()
    assert 1 < steps < 50


def test_reduced_links_are_stiffened_as_full_ones_are() -> None:
    raw = stiff(four_bar("bar", revolutions=0.5, steps_per_revolution=240, initial="quasi-static"))
    full = histories(meshed(scene_from(raw)))
    for link in raw["links"].values():
        link["reduction"] = "modal"
    ready, _ = prepared(scene_from(raw))
    assert all(link.full is not None for link in ready.model.links)
    assert worst(relative_errors(histories(ready), full)) < 2e-3
    raw["analysis"]["stiffening"] = False
    assert worst(relative_errors(histories(ready), full)) < worst(
        relative_errors(histories(meshed(scene_from(raw))), full)
    )


def test_stiffening_is_true_or_false() -> None:
    with pytest.raises(SceneError, match=r"analysis\.stiffening"):
        scene_from(stiff(four_bar("beam"), stiffening="yes"))


@pytest.mark.parametrize(("beam", "component", "mu"), [("planar", 1, 5.0), ("spatial", 2, 20.0)])
def test_a_fast_rotor_starts_at_rest_in_its_own_frame(beam: str, component: int, mu: float) -> None:
    """Stress stiffness is many times K0 across the arm there; a force that turns with it leaves it where it is."""
    shape = {"kind": "bar", "between": ["A", "B"], "width": 0.02, "thickness": 0.02}
    force = [0.0, 0.0, 0.0]
    force[component] = 1.0  # below, the start's rate is lost in the rounding of the stretch by centrifugal forces
    speed = mu * np.sqrt(1e9 * 0.02**2 / 12 / 1000)
    raw = {
        "points": {"A": [0, 0], "B": [1, 0]},
        "materials": {"m": {"density": 1000, "youngs_modulus": 1e9, "poisson_ratio": 0.0}},
        "links": {
            "arm": {
                "material": "m", "model": "beam", "beam": beam, "shape": shape, "mesh": {"elements": 6}
            }
        },
        "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": "A", "axis": [0, 0, 1]}},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": speed}},
        "loads": {"tip": {"kind": "force", "link": "arm", "at": "B", "vector": force, "frame": "link"}},
        "analysis": {"revolutions": 0.5, "steps_per_revolution": 2000, "stiffening": True, "initial": "quasi-static"},
    }  # fmt: skip
    ready = meshed(scene_from(raw))
    blocks = transient(ready.scene, ready.linkage, ready.path, ready.model, steps_of(ready.scene, ready.model))
    at = point_rows(ready.model.links[0], "tip", np.array([1.0, 0, 0])).value
    g = np.concatenate([np.einsum("n,tnd->td", at, block.links[0].g) for block in blocks])
    for c in {0, component}:
        assert np.abs(g[0, c]) > 0
        assert_allclose(g[:, c], g[0, c], rtol=2e-4)  # the start's rate is of second order in the step


@pytest.mark.parametrize("beam", ["planar", "spatial"])
def test_an_arm_that_turns_faster_than_it_vibrates_stands_by_its_tension(beam: str) -> None:
    """μ = 6, above 3.516: without stiffening a small force across it makes it run away."""
    assert np.abs(tip(meshed(turning_scene(6.0, beam, [0, 1e-3, 0], True)))).max() < 0.1
    with pytest.raises(SolveError, match="must stay finite"):
        tip(meshed(turning_scene(6.0, beam, [0, 1e-3, 0], False)))
