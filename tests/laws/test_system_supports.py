"""Forces that a march of a system has on bodies: hubs of prescribed bodies, efforts of drives, springs and motors."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.dynamics.system.forces.supports import Supports, supports
from kedfem.dynamics.system.march import displacements, march
from kedfem.dynamics.system.starts.deflected import quasi_static
from tests.laws.test_system import elements
from tests.laws.test_system import four_bar as beams
from tests.moving import bar, channels, ran
from tests.rooms.test_driven_efforts import ON_CRANK, four_bar
from tests.systems import Begun, begun


def supported(raw: dict[str, Any], count: int) -> tuple[Begun, Supports]:
    """A march from the quasi-static start, with its forces."""
    of = begun(raw)
    along = of.steps(count)
    _, history = march(of.ready, quasi_static(of.ready, of.motion), along)
    return of, supports(of.ready, of.prepared.scene, history, along)


CELLS = [(acting, crank, frames) for acting in ON_CRANK for crank, frames in
         (("rigid", "rigid-body"), ("rigid", "co-rotational"), ("beam", "rigid-body"))]  # fmt: skip
SOON = {
    ("torsion spring", "rigid", "rigid-body"),
    ("motor", "rigid", "co-rotational"),
    ("spring to the ground", "beam", "rigid-body"),
}


@pytest.mark.parametrize(
    ("acting", "crank", "frames"),
    [pytest.param(*cell, marks=[] if cell in SOON else pytest.mark.long) for cell in CELLS],
)
def test_hub_and_drive_bear_springs_and_motors_on_a_prescribed_link(
    acting: str, crank: str, frames: str
) -> None:
    """As rigid inverse dynamics says: 1 rpm, a third of a turn; a beam bends by some 1e-3 under 1.4 kN."""
    raw = four_bar(crank, ON_CRANK[acting], frames=frames)
    of, forces = supported(raw, 12)
    got = channels(*ran({**raw, "analysis": {**raw["analysis"], "initial": "rest"}}))
    effort, rigid = forces.effort("A"), got["drive/rigid_torque"][1:, 0]
    assert np.abs(rigid).max() > 2.0  # N m
    assert_allclose(effort, rigid, atol=0.01 * np.abs(rigid).max())
    for carried in of.ready.system.model.carried:
        force = forces.hub(carried)[0]
        wanted = got["joints/A/rigid_force"][1:]
        assert_allclose(force[:, :2], wanted[:, :2], atol=0.01 * np.abs(wanted).max() + 1e-3)


@pytest.mark.long
@pytest.mark.parametrize("acting", ["torsion spring", "motor"])
@pytest.mark.parametrize("coupler", ["plane", "solid"])
def test_hubs_bear_what_laws_exert_on_surfaces_that_they_share(acting: str, coupler: str) -> None:
    """The pin's surface of the coupler has points that the rigid crank holds, and others that the law turns."""
    raw = four_bar("rigid", ON_CRANK[acting])
    b, c = (raw["joints"][name]["at"] for name in "BC")
    raw["links"]["coupler"] = bar(coupler, b, c)
    if coupler == "solid":
        raw["links"]["rocker"] = bar(coupler, raw["joints"]["D"]["at"], c)
    _, forces = supported(raw, 6)
    got = channels(*ran({**raw, "analysis": {**raw["analysis"], "initial": "rest"}}))
    rigid = got["drive/rigid_torque"][1:7, 0]
    assert_allclose(forces.effort("A"), rigid, atol=0.01 * np.abs(rigid).max())


def test_a_spring_from_the_driven_crank_to_the_ground_is_in_its_hub() -> None:
    """1417 N at A and 76.7 N m, 1e4 N/m to (0.5, 0): elongation and lever of the crank's pin, by hand."""
    angle = np.radians(60) + np.linspace(0, 2 * np.pi / 3, 13)
    pin = np.hypot(0.05, 0.0866) * np.stack([np.cos(angle), np.sin(angle)])
    arm = np.array([[0.5], [0.0]]) - pin
    length = np.linalg.norm(arm, axis=0)
    pull = 1e4 * (length - length[0])
    torque = pull * (pin[0] * arm[1] - pin[1] * arm[0]) / length
    of, forces = supported(four_bar("rigid", ON_CRANK["spring to the ground"]), 12)
    hub = np.linalg.norm(forces.hub(of.ready.system.model.carried[0])[0], axis=1)
    assert_allclose(hub.max(), pull.max(), rtol=1e-3)
    assert_allclose(pull.max(), 1417, atol=1)
    assert_allclose(forces.effort("A"), -torque[1:], atol=0.005)
    assert_allclose(np.abs(torque).max(), 76.7, atol=0.1)


@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
def test_the_effort_of_a_drive_is_what_energy_and_work_say(frames: str) -> None:
    """∫ T dφ = change of kinetic and elastic energy, less gravity's and the motor's work, more what is damped."""
    more = elements()
    more["springs"]["line"]["damping"] = more["springs"]["turn"]["damping"] = 0.0
    raw = beams(**more, damping={"beta": 0.0})
    of, forces = supported({**raw, "analysis": {**raw["analysis"], "frames": frames, "step": 1e-4}}, 100)
    history, along = forces.history, forces.motion
    effort, phi = forces.effort("A"), along.drives[:, 0]
    work = np.sum(0.5 * (effort[1:] + effort[:-1]) * np.diff(phi))
    change = energy(of, forces)[-1] - energy(of, forces)[0]
    motor = next(n for n, x in enumerate(of.ready.system.constraints) if x.name == "motors.m")
    e, m = history.e[:, motor], history.multiplier[:, motor]
    done = np.sum(0.5 * (m[1:] + m[:-1]) * np.diff(e))
    assert abs(change) > 0.5
    assert_allclose(work, change - done, rtol=2e-3)


def energy(of: Begun, forces: Supports) -> np.ndarray:
    """Kinetic, elastic, of springs and of gravity, over time."""
    history, along, system = forces.history, forces.motion, of.ready.system
    total = history.energy.sum(axis=1)
    for k, (link, body) in enumerate(zip(system.model.links, system.model.bodies, strict=True)):
        d, R = link.d, along.R[:, body, : link.d, : link.d]
        X = link.X[:, :d] * ([1, 1, 0] if link.kind == "beam" else 1)
        spin = np.cross(along.omega[:, body, None], np.eye(3)[None])[:, :, :].transpose(0, 2, 1)[:, :d, :d]
        x = X @ R.transpose(0, 2, 1)
        v = displacements(of.ready, k, history.v) + x @ spin.transpose(0, 2, 1)
        v[:, :, : min(d, 2)] += link.one[:, None] * along.v[:, body, None, :2]
        if link.kind == "beam":
            v[:, :, 2] += link.one * along.omega[:, body, 2, None]
        for c in range(d):
            total = total + 0.5 * np.einsum("tn,tn->t", v[:, :, c], v[:, :, c] @ link.mass[c].T)
        place = (
            displacements(of.ready, k, history.u)[:, :, 1] + x[:, :, 1] + link.one * along.p[:, body, 1, None]
        )
        total = total + 9.81 * place @ link.m1[:, 1]
    for n, each in enumerate(system.constraints):
        if each.name.startswith("springs"):
            total = total + 0.5 * each.law.stiffness * (history.e[:, n] - each.law.free) ** 2
    return total
