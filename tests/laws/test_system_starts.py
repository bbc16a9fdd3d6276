"""Where marches of a system begin: exact rates of constraints, deflections without vibration, static balance, plucked."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.dynamics.joints.attachments import interface_matrix
from kedfem.dynamics.system.march import march
from kedfem.dynamics.system.ready import displacements
from kedfem.dynamics.system.starts import modified_newton
from kedfem.dynamics.system.starts.coordinate_rates import coordinates, places
from kedfem.dynamics.system.starts.deflected import plucked, quasi_static, static
from kedfem.dynamics.system.starts.initial_states import rest
from kedfem.dynamics.system.starts.instant import Instant
from kedfem.dynamics.system.starts.open_joints import stands_off
from kedfem.errors import SolveError
from tests.laws.test_system import HINGE, KINDS, elements, four_bar
from tests.moving import bar
from tests.spatial_joints import BEAMS
from tests.systems import Begun, assembled_deflection, begun, rows

Raw = dict[str, Any]
ENDS = {"crank": ((0, 0), (0.1, 0)), "coupler": ((0.1, 0), (0.35, 0.2)), "rocker": ((0.35, 0.2), (0.4, 0))}
STEEL = 7850.0 * 0.03 * 0.02  # kg/m of `bar`


def at(raw: Raw, frames: str | None = None, **more: Any) -> Begun:
    """A scene as a system; the state at rest that comes with it is not examined."""
    return begun(raw, frames, **more)


@pytest.mark.parametrize(
    ("kind", "frames"),
    [
        (kind, frames)
        for kind in ("slot", "screw", "gears, rack", "springs")
        for frames in ("rigid-body", "co-rotational")
    ],
)
def test_rates_of_coordinates_are_those_of_their_values(kind: str, frames: str) -> None:
    """Differences of fourth order over values; gradients too. Errors of differences: h⁴ and rounding/h², 1e-8."""
    of = at(four_bar(**elements()) if kind == "springs" else BEAMS[kind](), frames)
    system, k, h, t0 = of.ready.system, of.ready.system.unknowns, 1e-4, 0.01
    rng = np.random.default_rng(3)
    z = rng.standard_normal((3, k)) * np.array([[1e-3], [1e-2], [0.1]])

    def value(t: float, x: np.ndarray) -> np.ndarray:
        return coordinates(system, places(of.motion(np.array([t]))), np.stack([x, 0 * x, 0 * x]))[0]

    found = coordinates(system, places(of.motion(np.array([t0]))), z)
    e = [value(t0 + s * h, z[0] + s * h * z[1] + (s * h) ** 2 / 2 * z[2]) for s in range(-2, 3)]
    first = np.array([1, -8, 0, 8, -1]) / 12 / h
    second = np.array([-1, 16, -30, 16, -1]) / 12 / h**2
    assert_allclose(found[1], first @ e, atol=1e-7 * np.abs(found[1]).max())
    assert_allclose(found[2], second @ e, atol=1e-6 * np.abs(found[2]).max())
    x = rng.standard_normal(k)
    moved = (value(t0, z[0] + 1e-5 * x) - value(t0, z[0] - 1e-5 * x)) / 2e-5
    now = Instant(of.ready, of.motion, t0)
    C, measured = now.measured(z[0], z[1])
    assert_allclose(C @ x, moved, atol=1e-5 * np.abs(moved).max())
    exact, shown = now.coordinates(z)[:2], ~of.ready.constraints.linear | now.always.rated
    assert_allclose(measured[0], exact[0], atol=1e-13 * np.abs(exact[0]).max())  # what balances take, by compiled code
    assert_allclose(measured[1, shown], exact[1, shown], atol=1e-12 * np.abs(exact[1]).max())


@pytest.mark.parametrize(
    "kind", ["screw", *(pytest.param(x, marks=pytest.mark.long) for x in KINDS if x not in {"bushings", "screw"})]
)
def test_quasi_static_starts_solve_the_assembled_equations(kind: str) -> None:
    """Of rigid-body frames, without dampers, which feel rates."""
    raw = BEAMS[kind]()
    of = at({**raw, "analysis": {**raw["analysis"], "frames": "rigid-body"}})
    wanted = assembled_deflection(of.ready, of.motion(np.zeros(1)))
    found = rows(of.ready, quasi_static(of.ready, of.motion).u[None])[0]
    assert np.abs(found - wanted).max() < 1e-7 * np.abs(wanted).max()


@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
def test_quasi_static_starts_do_not_vibrate(frames: str) -> None:
    """Springs, dampers, a motor over speed: after 20 steps as the quasi-static deflection there; from rest 40 % off."""
    raw = four_bar(**elements())
    of = at({**raw, "analysis": {**raw["analysis"], "frames": frames}})
    _, history = march(of.ready, quasi_static(of.ready, of.motion), of.steps(20))
    wanted = quasi_static(of.ready, of.motion, time=20 * of.ready.c.h).u
    _, shaken = march(of.ready, rest(of.ready, of.motion), of.steps(20))
    size = np.linalg.norm(wanted)
    assert np.linalg.norm(history.u[-1] - wanted) < 3e-4 * size
    assert np.linalg.norm(shaken.u[-1] - wanted) > 0.1 * size


@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
def test_rates_of_quasi_static_starts_are_those_of_their_deflections(frames: str) -> None:
    """Of fourth order over half a step, found one by one; joints are closed."""
    raw = four_bar(**elements())
    of = at({**raw, "analysis": {**raw["analysis"], "frames": frames}})
    h = of.ready.c.h / 8
    u = [quasi_static(of.ready, of.motion, time=k * h).u for k in range(5)]
    start = quasi_static(of.ready, of.motion)
    wanted = np.array([-25, 48, -36, 16, -3]) @ u / 12 / h
    assert np.linalg.norm(start.v - wanted) < 1e-4 * np.linalg.norm(wanted)
    joints, parts = of.ready.system.model.joints, of.ready.parts
    for x in (start.u, start.v):
        ends = np.split(x, of.ready.bodies.at[1:-1])
        w = np.concatenate([part.W @ each for part, each in zip(parts, ends, strict=True)])
        B = interface_matrix(joints).toarray()
        open_ = w - B @ np.linalg.lstsq(B, w, rcond=None)[0]
        assert np.abs(open_).max() < 1e-9 * np.abs(w).max()


@pytest.mark.parametrize("sparse", [False, True])
@pytest.mark.parametrize("turned", [0.5, 2.0, 4.0])
def test_a_bar_that_spins_faster_than_it_vibrates_is_deflected_exactly(
    turned: float, sparse: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """E A u'' + ρ A Ω² (x + u) = 0: u = sin k x / (k cos k L) − x, k = Ω √(ρ/E); its first frequency is at k L = π/2."""
    L, E = 0.5, 1e9
    if sparse:
        monkeypatch.setattr("kedfem.dynamics.system.layout.SMALL", 0)
    k = turned / L
    speed = k * np.sqrt(E / 7850)
    raw: Raw = {
        "links": {"arm": {**bar("beam", (0, 0), (L, 0), 16), "material": "soft"}},
        "joints": {"A": {**HINGE, "links": ["ground", "arm"], "at": [0, 0]}},
        "materials": {"soft": {"youngs_modulus": E, "density": 7850, "poisson_ratio": 0.3}},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": speed}},
        "analysis": {"end_time": 1e-3, "step": 1e-4, "rho_inf": 0.8, "frames": "rigid-body"},
    }
    of = at(raw)
    u = displacements(of.ready, 0, quasi_static(of.ready, of.motion).u[None])[0, :, 0]
    X = of.ready.system.model.links[0].X[:, 0]
    wanted = np.sin(k * X) / (k * np.cos(k * L)) - X
    assert_allclose(u, wanted, atol=2e-5 * np.abs(wanted).max())  # 16 quadratic elements


def arm(**more: Any) -> Raw:
    """An arm on a hinge."""
    raw: Raw = {
        "links": {"arm": bar("beam", (0, 0), (0.5, 0), 8)},
        "joints": {"A": {**HINGE, "links": ["ground", "arm"], "at": [0, 0]}},
        "analysis": {"end_time": 0.02, "step": 1e-4, "rho_inf": 0.8},
    }
    return {**raw, "analysis": {**raw["analysis"], **more.pop("analysis", {})}, **more}


def spinning(speed: float, driven: bool) -> Begun:
    """The arm at a speed, by a drive or by itself."""
    if driven:
        drive = {"joint": "A", "motion": {"kind": "constant_speed", "speed": speed}}
        return at(arm(drive=drive, analysis={"frames": "co-rotational"}))
    return at(arm(analysis={"initial_speeds": {"A": speed}}))


def test_an_arm_that_spins_freely_starts_as_one_that_is_driven() -> None:
    """At a speed where it is 1e-3 of its length longer."""
    speed = 300.0
    driven, free = spinning(speed, driven=True), spinning(speed, driven=False)
    wanted = displacements(driven.ready, 0, quasi_static(driven.ready, driven.motion).u[None])[0]
    start = quasi_static(free.ready, free.motion, free_rates(free))
    found = displacements(free.ready, 0, start.u[None])[0]
    assert np.abs(wanted).max() > 1e-5
    assert_allclose(found, wanted, atol=1e-7 * np.abs(wanted).max())
    _, history = march(free.ready, start, free.steps(100))
    energy = history.energy.sum(axis=1)
    assert_allclose(energy, energy[0], rtol=1e-3)


def free_rates(of: Begun) -> list[np.ndarray]:
    """The rates that its scene asks for."""
    from kedfem.dynamics.stepping.start import initial_rates

    return initial_rates(of.prepared.scene, of.prepared.linkage, of.prepared.path, of.ready.system.model)


def test_a_rigid_link_that_spins_begins_with_what_holds_it() -> None:
    """m Ω² L/2 at its hinge from the first step on; without the strain that carries it, it would ring by all of that."""
    raw = arm(analysis={"initial_speeds": {"A": 20.0}})
    raw["links"]["arm"] = bar("rigid", (0, 0), (0.5, 0))
    of = at(raw)
    _, history = march(of.ready, rest(of.ready, of.motion, free_rates(of)), of.steps(10))
    force = np.linalg.norm(history.port_force.reshape(10, -1, 3).sum(axis=1), axis=1)
    assert_allclose(force, STEEL * 0.5 * 20.0**2 * 0.25, rtol=1e-4)


def held_up() -> Begun:
    """The arm on a spring about its hinge, under gravity."""
    return at(arm(gravity=[0, -9.81, 0], springs={"s": {"kind": "torsion", "joint": "A", "stiffness": 200.0}}))


def test_static_balance_stays() -> None:
    """Turned by M cos φ = k φ, M = m g L/2; no force is left, so that nothing moves."""
    of = held_up()
    start = static(of.ready, of.motion)
    _, history = march(of.ready, start, of.steps(50))
    assert np.abs(history.u - start.u).max() < 1e-8 * np.abs(start.u).max()
    moment = STEEL * 0.5 * 9.81 * 0.25
    angle = -start.e[0, 0]
    assert_allclose(200 * angle, moment * np.cos(angle), rtol=1e-4)  # it bends


def test_what_is_plucked_swings_back() -> None:
    """F L³/(3 E I) at the tip of a clamped arm; 97 % of it swings as the first mode, and is on the other side after half
    a period of that."""
    raw = arm()
    raw["joints"]["A"] = {"kind": "weld", "links": ["ground", "arm"], "at": [0, 0]}
    of = at(raw)
    forces = [np.zeros((link.n, 3)) for link in of.ready.system.model.links]
    last = len(forces) - 1
    tip = int(np.argmax(of.ready.system.model.links[last].X[:, 0]))
    forces[last][tip, 1] = 10.0
    start = plucked(of.ready, of.motion, forces)
    v = displacements(of.ready, last, start.u[None])[0, tip, 1]
    bending = 2.1e11 * 0.02 * 0.03**3 / 12
    assert_allclose(v, 10 * 0.5**3 / (3 * bending), rtol=0.01)
    assert np.abs(start.v).max() == 0
    period = 2 * np.pi * 0.5**2 / 1.8751**2 * np.sqrt(STEEL / bending)
    count = round(period / 2 / of.ready.c.h)
    _, history = march(of.ready, start, of.steps(count))
    back = displacements(of.ready, last, history.u)[:, tip, 1]
    assert (2 * 0.97 - 1) * v < -back.min() < 1.001 * v


def test_a_link_that_hangs_free_has_no_static_balance_and_says_so() -> None:
    of = at(arm(gravity=[0, -9.81, 0], springs={"s": {"kind": "torsion", "joint": "A", "stiffness": 1e-9}}))
    with pytest.raises(SolveError, match=r"analysis\.initial: .*links that nothing constrains"):
        static(of.ready, of.motion)


def test_a_start_knows_the_turns_of_its_drive() -> None:
    """After more than half a revolution coordinates of driven hinges are zero, not 2 π."""
    raw = four_bar(drive={"joint": "A", "motion": {"kind": "constant_speed", "speed": 100.0}})
    of = at({**raw, "analysis": {**raw["analysis"], "frames": "co-rotational", "end_time": 0.1}})
    now = Instant(of.ready, of.motion, 0.05)
    assert now.motion.drives[0, 0] > np.pi
    assert np.abs(now.coordinates(np.zeros((3, of.ready.system.unknowns)))[0]).max(initial=0.0) < 1e-9


@pytest.mark.parametrize("kind", ["gears, rack", "screw"])
def test_a_balance_with_open_joints_is_none(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Iterations of large motions once settled with an upright turned over and torn off its wishbones, as if in balance.

    A link that is moved off its shared points is named, and so is a constraint that is not met.
    """
    of = at(BEAMS[kind](), "co-rotational")
    now = Instant(of.ready, of.motion, 0.0)
    u = quasi_static(of.ready, of.motion, []).u
    assert stands_off(now, u, None) == ""
    z = now.interface(u)
    rates = np.random.default_rng(5).standard_normal(len(z))
    opened = np.concatenate(
        [np.linalg.pinv(part.W) @ (joint.B @ (z + 0.1 * rates)[joint.columns]) for part, joint in zip(
            of.ready.parts, of.ready.system.model.joints, strict=True)]
    )  # fmt: skip
    assert "would be open by" in stands_off(now, opened, None)
    first = of.ready.bodies.at[1]
    off = u + np.where(np.arange(len(u)) < first, 0.05 * np.sign(u + 1e-30), 0.0)
    assert "off its joints" in stands_off(now, off, None)
    monkeypatch.setattr(modified_newton, "iterated", lambda *_: off)
    with pytest.raises(SolveError, match=r"link '\w+' would be .* m off its joints"):
        quasi_static(of.ready, of.motion, [])
