"""The condensed step against the monolithic one, joints at all times, forces in balance, work counted."""

import tomllib
from collections.abc import Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.dynamics.elastic_model import elastic_model
from kedfem.dynamics.history import Snapshot
from kedfem.dynamics.joints.attachments import interface_matrix
from kedfem.dynamics.joints.ports import port_values, port_vectors
from kedfem.dynamics.matrices import substructure
from kedfem.dynamics.matrices.substructure import mass_substructure
from kedfem.dynamics.model import Model
from kedfem.dynamics.rigid_body import drive_range
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.system.steps import Steps
from kedfem.links.record import mass_times
from kedfem.motion.linkage import linkage
from kedfem.motion.path import path
from kedfem.scene import scene_from
from tests import scenes
from tests.moving import snapshots
from tests.scenes import arm, bar, constant_speed

BAR = {"width": 0.0254, "thickness": 0.0254}
PLATE = {"kind": "plate_link", "width": 0.0254, "thickness": 0.0254, "eye_diameter": 0.045, "bore_diameter": 0.02}


def four_bar(kind: str, **analysis: Any) -> dict[str, Any]:
    """[KED]'s four-bar (Nath and Ghosh 1980) of beams, solid bars, plate links or plane plate links, some damping."""
    shape = PLATE if kind in {"plate", "plane"} else {"kind": "bar", **BAR}
    given = {"model": kind} if kind in {"beam", "plane"} else {}
    across = {"elements_across": 1}
    mesh = {"beam": {"elements": 2}, "bar": {"elements": [6, 1, 1]}, "plate": across, "plane": across}[kind]
    return scenes.four_bar(
        (0.3048, 0.9144, 0.762, 0.9144),
        {"material": "alloy", "shape": shape, "mesh": mesh, **given},
        constant_speed("600 rpm"),
        materials={"alloy": {"density": 2796, "youngs_modulus": 7.031e10, "shear_modulus": 2.712e10}},
        bodies={"flywheel": {"kind": "flywheel", "link": "rocker", "at": "D", "inertia": 8.065e-2}},
        damping={"alpha": 0.5, "beta": 1e-5},
        analysis={"revolutions": 1, "steps_per_revolution": 120, "rho_inf": 1.0, **analysis},
    )


def run(raw: Mapping[str, Any]) -> tuple[Model, Steps, list[Snapshot]]:
    scene = scene_from(raw)
    joined = linkage(scene)
    along = path(joined, *drive_range(scene))
    model = elastic_model(scene, joined)
    solver = steps_of(scene, model)
    return model, solver, list(snapshots(scene, joined, along, model, solver))


@pytest.mark.parametrize(
    ("kind", "steps", "bound"), [("beam", 720, 1e-8), ("bar", 120, 1e-8), ("plate", 24, 1e-7), ("plane", 120, 1e-7)]
)
@pytest.mark.parametrize("rho_inf", [1.0, pytest.param(0.8, marks=pytest.mark.long)])
def test_condensed_is_monolithic_over_a_whole_turn(kind: str, steps: int, bound: float, rho_inf: float) -> None:
    model, solver, fast = run(four_bar(kind, rho_inf=rho_inf, steps_per_revolution=steps))
    _, monolithic, slow = run(four_bar(kind, rho_inf=rho_inf, steps_per_revolution=steps, solver="monolithic"))
    assert monolithic.monolithic is not None
    assert solver.factorisations == len(model.links) == 3  # one per link, for the whole revolution
    peak = max(np.abs(s.u).max() for snapshot in slow for s in snapshot.states)
    for a, b in zip(fast, slow, strict=True):
        for s, r in zip(a.states, b.states, strict=True):
            # rounding; of the plates the monolithic step's alone is 8e-8, by the library that factors it
            assert_allclose(s.u, r.u, rtol=0, atol=bound * peak)
    forces = np.concatenate([s.port_forces for s in slow[-1].states])
    got = np.concatenate([s.port_forces for s in fast[-1].states])
    assert_allclose(got, forces, rtol=0, atol=1e-6 * np.abs(forces).max())


@pytest.mark.parametrize("element", ["hex27", "hex20"])
def test_mass_is_solved_exactly_under_a_heavy_flywheel(element: str) -> None:
    """36 kg m² on the bore of a plate of 1 kg: M x = b for the start at rest, to rounding."""
    raw = four_bar("plate")
    raw["links"]["rocker"]["element"] = element
    raw["bodies"]["flywheel"]["inertia"] = 36.0
    scene = scene_from(raw)
    model = elastic_model(scene, linkage(scene))
    rocker = next(k for k, link in enumerate(model.links) if link.name == "rocker")
    link = model.links[rocker]
    b = np.random.default_rng(0).uniform(-1, 1, (link.n, 3))
    x = mass_substructure(link, model.joints[rocker]).solve(b)
    # backward stable: of the sizes that are added, not of b
    assert_allclose(mass_times(link.mass, x), b, rtol=0, atol=1e-10 * np.abs(link.mass[0]).max() * np.abs(x).max())


@pytest.mark.parametrize("kind", ["beam", "bar"])
def test_condensed_is_monolithic_however_long_the_step(kind: str) -> None:
    raw = four_bar(kind, steps_per_revolution=36)
    raw["drive"]["motion"]["speed"] = "6 rpm"  # a step of 0.28 s: the free links hang on their inertia by a thread
    _, _, fast = run(raw)
    raw["analysis"]["solver"] = "monolithic"
    _, _, slow = run(raw)
    peak = max(np.abs(s.u).max() for snapshot in slow for s in snapshot.states)
    for a, b in zip(fast, slow, strict=True):
        for s, r in zip(a.states, b.states, strict=True):
            assert_allclose(s.u, r.u, rtol=0, atol=1e-8 * peak)


@pytest.mark.parametrize("kind", ["beam", "plate", "plane"])
def test_joints_are_closed_in_displacement_velocity_and_acceleration(kind: str) -> None:
    model, _, snapshots = run(four_bar(kind, rho_inf=0.9, initial="quasi-static"))
    for snapshot in snapshots[:: len(snapshots) // 10]:
        for field in "uva":
            values = [getattr(s, field) for s in snapshot.states]
            size = max(np.abs(x).max() for x in values)
            B = interface_matrix(model.joints).toarray()
            held = np.concatenate([port_values(joint, x) for joint, x in zip(model.joints, values, strict=True)])
            z = np.linalg.lstsq(B, held, rcond=None)[0]
            # W u = B z: the residual is rounding, of differences divided by the step for rates
            assert_allclose(held, B @ z, rtol=0, atol={"u": 1e-12, "v": 1e-9, "a": 1e-6}[field] * size)


@pytest.mark.parametrize("kind", ["beam", "plate", "plane"])
def test_joint_forces_balance_inertia_and_loads_of_every_link(kind: str) -> None:
    raw = four_bar(kind)
    raw["gravity"] = [0, -9.81, 0]
    raw["damping"] = {"beta": 1e-5}  # inner damping carries no resultant
    model, _, snapshots = run(raw)
    for snapshot in snapshots[1::17]:
        for link, joint, s in zip(model.links, model.joints, snapshot.states, strict=True):
            # Newton's second law of the whole link: Σ λ + Σ (P − M R0'') = Σ M δ''
            force = s.R @ (port_vectors(joint, s.port_forces) * ([1, 1, 0] if link.kind == "beam" else 1)).sum(axis=0)
            left = (mass_times(link.mass, s.a) - s.F).sum(axis=0)
            if link.kind == "beam":
                left = left * [1, 1, 0]
            assert_allclose(force, left, rtol=0, atol=1e-8 * np.abs(s.F).sum())


def test_damping_takes_nothing_from_a_bent_link_that_turns() -> None:
    """C acts on the rate of the co-rotated deformation: steady turning of a stretched bar is not resisted.

    SSLV105 in small: u(L) = ρ ω² L³/(3E), to first order in the load, whatever the damping.
    """
    raw = spinning_beam()
    tips = []
    for damping in ({}, {"alpha": 2e3, "beta": 1e-3}):
        raw["damping"] = damping
        _, _, snapshots = run(raw)
        state = snapshots[-1].states[0]
        tips.append(state.g[-1])
    assert_allclose(tips[1], tips[0], rtol=0, atol=1e-4 * np.abs(tips[0]).max())


def spinning_beam() -> dict[str, Any]:
    analysis = {"revolutions": 1, "steps_per_revolution": 720, "initial": "quasi-static"}
    return arm(bar(model="beam", mesh={"elements": 4}), constant_speed(100), analysis=analysis)


def test_quasi_static_start_does_not_vibrate() -> None:
    _, _, snapshots = run(spinning_beam())
    stretch = np.array([x.states[0].g[-1, 0] for x in snapshots])
    assert np.ptp(stretch) < 1e-3 * stretch.mean()
    at_rest = spinning_beam()
    at_rest["analysis"]["initial"] = "rest"
    _, _, snapshots = run(at_rest)
    stretch = np.array([x.states[0].g[-1, 0] for x in snapshots])
    assert np.ptp(stretch) > 1.5 * stretch.mean()  # undamped, it swings between none and twice the mean


def slider_crank(piston: str) -> dict[str, Any]:
    """Beams with a rigid slider of 2 kg, or with that mass on the rod and the rod's end itself guided."""
    beam = {"model": "beam", "material": "steel", "mesh": {"elements": 3}}
    bar = {"kind": "bar", "width": 0.02, "thickness": 0.02}
    raw: dict[str, Any] = {
        "points": {"A": [0, 0], "B": [0, 0.08], "C": {"from": "B", "distance": 0.3, "along": ["A", [1, 0]]}},
        "links": {
            "crank": {**beam, "shape": {**bar, "between": ["A", "B"]}},
            "rod": {**beam, "shape": {**bar, "between": ["B", "C"]}},
            "piston": {"model": "rigid", "mass": 2.0},
        },
        "joints": {
            "A": {"kind": "revolute", "links": ["ground", "crank"], "at": "A"},
            "B": {"kind": "revolute", "links": ["crank", "rod"], "at": "B"},
            "C": {"kind": "revolute", "links": ["rod", "piston"], "at": "C"},
            "guide": {"kind": "prismatic", "links": ["ground", "piston"], "at": "C", "axis": "x"},
        },
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 60}},
        "damping": {"beta": 1e-5},
        "analysis": {"revolutions": 0.5, "steps_per_revolution": 360, "initial": "quasi-static"},
    }
    if piston == "on the rod":
        raw["links"]["piston"]["mass"] = 0
        raw["bodies"] = {"mass": {"kind": "point_mass", "link": "rod", "at": "C", "mass": 2.0}}
    return raw


def test_a_sliders_mass_is_as_if_at_the_end_of_its_rod() -> None:
    a, b = run(slider_crank("rigid")), run(slider_crank("on the rod"))
    for x, y in zip(a[2], b[2], strict=True):
        for s, r in zip(x.states[:2], y.states[:2], strict=True):  # crank and rod
            assert_allclose(s.u, r.u, rtol=0, atol=1e-9 * np.abs(r.u).max())


def test_a_slider_moves_along_its_guide_only() -> None:
    model, _, snapshots = run(slider_crank("rigid"))
    (k,) = (k for k, link in enumerate(model.links) if link.name == "piston")
    for snapshot in snapshots:
        moved = snapshot.states[k].u
        assert np.abs(moved[:, 1]).max() < 1e-9 * np.abs(moved[:, 0]).max()


def test_changing_the_raw_scene_does_not_change_the_next_run() -> None:
    raw = slider_crank("rigid")
    before = deepcopy(raw)
    run(raw)
    assert raw == before


@pytest.mark.parametrize("rho_inf", [1.0, 0.8, 0.4])
def test_recorded_torque_is_of_the_steps_end_and_of_order_two(rho_inf: float) -> None:
    """A stiff arm swung by a smooth law: twice the steps, a quarter of the torque's error, whatever ρ∞."""
    raw = spinning_beam()
    raw["damping"] = {"beta": 2e-4}
    raw["drive"]["motion"] = {"kind": "polynomial", "order": 7, "angle": 1, "rise": 0.1}
    errors = []
    reference = torque_of(raw, 3200, 1.0)
    for steps in (200, 400):
        errors.append(np.abs(torque_of(raw, steps, rho_inf) - reference[:: 3200 // steps]).max())
    assert errors[0] < 0.02 * np.abs(reference).max()
    assert 3.3 < errors[0] / errors[1] < 4.8


def torque_of(raw: dict[str, Any], steps: int, rho_inf: float) -> np.ndarray:
    """The hub's moment over time."""
    raw["analysis"] = {"end_time": 0.1, "step": 0.1 / steps, "rho_inf": rho_inf, "initial": "quasi-static"}
    _, _, snapshots = run(raw)
    return np.array([x.states[0].port_forces[2] for x in snapshots])


def test_a_force_on_a_slider_never_turns() -> None:
    forces = []
    for frame in ("world", "link"):
        raw = slider_crank("rigid")
        raw["loads"] = {"push": {"kind": "force", "link": "piston", "at": "C", "vector": [-100, 0], "frame": frame}}
        _, _, snapshots = run(raw)
        forces.append(np.array([x.states[1].port_forces for x in snapshots]))
    assert_allclose(forces[1], forces[0], rtol=0, atol=1e-12 * np.abs(forces[0]).max())


def test_one_step_of_a_table_that_ends_with_it() -> None:
    raw = spinning_beam()
    raw["drive"]["motion"] = {"kind": "curve", "time": [0, 0.03, 0.06, 0.1], "value": [0, 0.1, 0.4, 1]}
    for initial in ("rest", "quasi-static"):
        raw["analysis"] = {"end_time": 0.1, "step": 0.1, "initial": initial}
        assert len(run(raw)[2]) == 2


def worst_difference(a: list[Snapshot], b: list[Snapshot]) -> float:
    """Of the displacements, of the second's peak."""
    peak = max(np.abs(s.u).max() for snapshot in b for s in snapshot.states)
    pairs = [(s, r) for x, y in zip(a, b, strict=True) for s, r in zip(x.states, y.states, strict=True)]
    return max(float(np.abs(s.u - r.u).max()) for s, r in pairs) / peak


@pytest.mark.long
@pytest.mark.parametrize(("example", "steps", "bound"), [("four_bar_beams", 720, 1e-8), ("four_bar_solids", 90, 1e-7)])
def test_condensed_is_monolithic_over_a_turn_of_the_examples(
    example: str, steps: int, bound: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The solids at 150 rpm are too badly conditioned for 1e-8 between the two: the monolithic step alone, its matrix
    factored by another library, differs by 6e-8 of the peak. The condensed step keeps to 1e-8 of itself."""
    file = Path(__file__).parents[2] / "examples" / example / "scene.toml"
    raw = tomllib.loads(file.read_text(encoding="utf-8"))
    raw["analysis"] |= {"revolutions": 1, "steps_per_revolution": steps}
    _, _, fast = run(raw)
    monkeypatch.setattr(substructure, "ANCHORAGE", 1.0)  # another Ã, so other rounding errors
    _, _, again = run(raw)
    assert worst_difference(again, fast) < 5e-9
    raw["analysis"]["solver"] = "monolithic"
    _, _, slow = run(raw)
    assert worst_difference(fast, slow) < bound
