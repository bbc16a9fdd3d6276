"""The system's and monolithic steps of one model; the compiled loop without its compiler; runs that end early."""

import signal
import sys
from dataclasses import replace
from types import FrameType
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.accuracy.histories import Histories, relative_errors, worst
from kedfem.accuracy.prepared import Prepared, meshed
from kedfem.dynamics.rigid_body import motions
from kedfem.dynamics.stepping.marks import Mark
from kedfem.dynamics.stepping.scheme import generalised_alpha
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.start import started
from kedfem.dynamics.stepping.transient import transient
from kedfem.dynamics.system import (
    algebra_kernel,
    bodies_kernel,
    constraints_kernel,
    ends_kernel,
    interface_kernel,
    linear_kernel,
    products_kernel,
    reference,
    rigid_frame_kernel,
)
from kedfem.dynamics.system.steps import Steps, scene_system
from kedfem.errors import SolveError
from kedfem.motion.rigid import rigid_motion
from kedfem.results import Channel
from kedfem.scene import drive_angle, scene_from, time_grid
from tests.moving import snapshots

from .test_dynamics import four_bar, slider_crank

KERNELS = (
    algebra_kernel, bodies_kernel, constraints_kernel, ends_kernel, interface_kernel, linear_kernel, products_kernel,
    rigid_frame_kernel,
)  # fmt: skip


def mixed() -> dict[str, Any]:
    """A beam, a solid and a plane link."""
    raw = four_bar("bar", revolutions=0.25, steps_per_revolution=120)
    for link in raw["links"].values():
        link["mesh"] = {"elements": [3, 1, 1]}
    raw["links"]["crank"] |= {"model": "beam", "mesh": {"elements": 3}}
    raw["links"]["coupler"] |= {"model": "plane", "mesh": {"elements": [3, 1]}}
    return raw


def sliding() -> dict[str, Any]:
    raw = slider_crank("rigid")
    raw["analysis"] = {"revolutions": 0.25, "steps_per_revolution": 120}
    return raw


def displacements(ready: Prepared, solver: Steps) -> tuple[np.ndarray, np.ndarray]:
    """All links' displacements and port forces over time."""
    found = snapshots(ready.scene, ready.linkage, ready.path, ready.model, solver)
    each = [
        (np.concatenate([x.u.ravel() for x in s.states]), np.concatenate([x.port_forces for x in s.states]))
        for s in found
    ]
    return np.array([u for u, _ in each]), np.array([f for _, f in each])


@pytest.mark.parametrize("rho_inf", [1.0, 0.9, 0.5])
@pytest.mark.parametrize("made", [mixed, sliding])
def test_the_systems_steps_are_the_monolithic_ones(made: Any, rho_inf: float) -> None:
    ready = meshed(scene_from(made()))
    model = ready.model
    scheme = generalised_alpha(time_grid(ready.scene).step, rho_inf)
    monolithic, system = (
        displacements(ready, Steps(ready.scene, scene_system(ready.scene, model), model, scheme, which))
        for which in (True, False)
    )
    assert model.damping.present
    for got, wanted in zip(system, monolithic, strict=True):
        # rounding, amplified by the stiffness of the links along their line
        assert_allclose(got, wanted, rtol=0, atol=2e-8 * np.abs(wanted).max())


def test_the_loop_is_the_same_without_its_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    raw = mixed()
    raw["analysis"]["revolutions"] = 0.05
    raw["analysis"]["rho_inf"] = 0.8
    ready = meshed(scene_from(raw))
    fast = displacements(ready, steps_of(ready.scene, ready.model))
    counted = []

    def plain(*arguments: Any) -> Any:
        counted.append(1)
        return march_plain(*arguments)

    march_plain = linear_kernel.marched_linear.py_func
    for module in KERNELS:
        for name, each in list(vars(module).items()):
            if hasattr(each, "py_func"):
                monkeypatch.setattr(module, name, each.py_func)
    monkeypatch.setattr(reference, "by_address", lambda record: record)
    monkeypatch.setattr(linear_kernel, "marched_linear", plain)
    slow = displacements(ready, steps_of(ready.scene, ready.model))
    assert counted
    for got, wanted in zip(slow, fast, strict=True):
        assert_allclose(got, wanted, rtol=0, atol=1e-9 * np.abs(wanted).max())  # sums in another order


def test_rigid_motion_of_later_turns_is_that_of_the_first() -> None:
    raw = four_bar("beam", revolutions=3, steps_per_revolution=200)
    ready = meshed(scene_from(raw))
    law, points = ready.scene.drive.motion, 0
    for first, motion in motions(ready.scene, ready.linkage, ready.path):
        t = time_grid(ready.scene).step * np.arange(first, first + len(motion.t))
        wanted = rigid_motion(ready.linkage, ready.path, t, drive_angle(law, t))
        points += len(t)
        for name in ("t", "phi", "R", "omega", "alpha", "p2"):
            there = getattr(wanted, name)
            assert_allclose(getattr(motion, name), there, rtol=0, atol=1e-9 * max(np.abs(there).max(), 1.0))
    assert points == 600


def test_what_was_finite_before_a_blow_up_is_handed_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kedfem.dynamics.rigid_body.POINTS", 256)
    ready = meshed(scene_from(four_bar("beam", revolutions=1, steps_per_revolution=300)))
    solver = steps_of(ready.scene, ready.model)
    advance, left, seen = solver.advance, [270], []  # not finite from a step in the second block on

    def breaking(*given: Any) -> Any:
        links, exerted, state = advance(*given)
        if left[0] <= len(links[1].g):
            links[1].g[left[0] - 1 :] = np.nan
        left[0] -= len(links[1].g)
        return links, exerted, state

    monkeypatch.setattr(solver, "advance", breaking)

    def all_of_it() -> None:
        for block in transient(ready.scene, ready.linkage, ready.path, ready.model, solver):
            seen.append((block.step, len(block)))
            assert all(np.isfinite(link.g).all() for link in block.links)

    with pytest.raises(SolveError, match=r"got none at step 270, t = 0\.09 s, drive angle 324 deg"):
        all_of_it()
    assert seen == [(0, 1), (1, 256), (257, 13)]


def test_relative_errors_are_of_the_peak_and_interpolate() -> None:
    t = np.linspace(0, 1, 11)
    fine = np.linspace(0, 1, 41)

    def run(time: np.ndarray, values: dict[str, np.ndarray]) -> Histories:
        channels = {name: (Channel(name, ("x", "y")[: v.shape[1]], "N", "world", ""), v) for name, v in values.items()}
        return Histories(time, channels)

    def vectors(time: np.ndarray, off: float = 0.0) -> np.ndarray:
        return np.column_stack([3 * time**3, 4 * time**3 + off])

    names = ("joints/A/force", "joints/B/moment", "joints/C/force")
    reference = run(fine, {
        names[0]: vectors(fine), names[1]: vectors(fine), names[2]: np.full((41, 1), 1e-9), "drive/torque": fine[:, None]
    })  # fmt: skip
    found = run(
        t, {names[0]: vectors(t, 0.1), names[1]: vectors(t), names[2]: np.ones((11, 1)), "drive/torque": t[:, None]}
    )
    errors = relative_errors(found, reference)
    # √(3² + 4²) = 5 at the end; moments do not count, nor does what is 1e-9 of other forces; a cubic spline is exact
    assert set(errors) == {names[0], "drive/torque"}
    assert_allclose([errors[names[0]], errors["drive/torque"]], [0.1 / 5, 0.0], rtol=0, atol=1e-14)
    assert worst(errors) == pytest.approx(0.02)
    assert worst({}) == 0.0
    flat = run(t, {names[0]: vectors(t)[:, :1]})  # of a planar link: what it does not have is zero
    assert relative_errors(flat, reference)[names[0]] == pytest.approx(4 / 5)
    half = run(t[:6], {names[0]: vectors(t[:6], 0.1)})
    assert relative_errors(half, reference)[names[0]] == pytest.approx(0.1 / 5)


def test_a_signal_as_a_large_link_begins_to_be_solved_ends_the_march(monkeypatch: pytest.MonkeyPatch) -> None:
    """Before the first instruction of the function that compiled steps call back, where no `try` of its own helps."""
    monkeypatch.setattr("kedfem.dynamics.system.sparse.TAKEN", 0)  # else compiled steps solve by themselves
    ready = meshed(scene_from(four_bar("plate", revolutions=0.1, steps_per_revolution=40)))
    solver: Any = steps_of(ready.scene, ready.model)
    start = started(ready.scene, ready.linkage, ready.path, ready.model, solver)
    calls: list[str] = []

    def watch(frame: FrameType, event: str, _: Any) -> None:
        if event == "call" and frame.f_code.co_qualname == "solver.<locals>.solved":
            calls.append(event)
            if len(calls) == 3:
                signal.raise_signal(signal.SIGINT)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored where a shell runs the tests beside it
    sys.setprofile(watch)
    try:
        with pytest.raises(KeyboardInterrupt):
            list(transient(ready.scene, ready.linkage, ready.path, ready.model, solver, Mark(start=start)))
    finally:
        sys.setprofile(None)
        after = signal.signal(signal.SIGINT, before)
    assert len(calls) >= 3
    assert after is signal.default_int_handler


def test_an_interruption_while_a_large_link_is_solved_ends_the_march(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compiled steps call back for sparse factors: what is raised there must not be printed and forgotten."""
    monkeypatch.setattr("kedfem.dynamics.system.sparse.TAKEN", 0)  # else compiled steps solve by themselves
    ready = meshed(scene_from(four_bar("plate", revolutions=0.1, steps_per_revolution=40)))
    solver: Any = steps_of(ready.scene, ready.model)

    def stopped(r: np.ndarray) -> Any:
        raise KeyboardInterrupt

    start = started(ready.scene, ready.linkage, ready.path, ready.model, solver)
    solver.ready.parts[1] = replace(solver.ready.parts[1], solve=stopped)
    given = ready.scene, ready.linkage, ready.path, ready.model, solver, Mark(start=start)
    with pytest.raises(KeyboardInterrupt):
        list(transient(*given))
