"""Joints between links that both move: rows with directions that vary in time."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.accuracy.prepared import Prepared
from kedfem.accuracy.reduction import prepared
from kedfem.accuracy.variants import with_analysis
from kedfem.dynamics.history import Block
from kedfem.dynamics.joints.constraint_matrices import constraint_matrices
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.dynamics.system.forces.exerted import effort, wrench
from kedfem.dynamics.system.forces.supports import supports
from kedfem.errors import MeshError, SceneError
from kedfem.output.words import clock, moment
from kedfem.scene import scene_from
from tests.cells import Cell, scene_of
from tests.joint_checks import directions, interface_values, row_values, unbalanced
from tests.linkages import drive_rates
from tests.moving import bar, cardan, channels, driven_slide, geared, inverted, ran, screwed, state, two_drives
from tests.systems import begun

KINDS = {
    "block on a beam": lambda: inverted("beam", "prismatic", revolutions=0.05),
    "pin in a beam's slot": lambda: inverted("beam", "slot", revolutions=0.05),
    "block on a plane link": lambda: inverted("plane", "prismatic", revolutions=0.03),
    "pin in a plane link's slot": lambda: inverted("plane", "slot", revolutions=0.03),
    "pin in a solid's slot": lambda: inverted("solid", "slot", revolutions=0.02),
    "universal joint": lambda: cardan(revolutions=0.05),
    "two drives": two_drives,
    "driven slide": driven_slide,
    "gears and a shaft": geared,
    "nut on a spindle": screwed,
}


def with_links(raw: dict[str, Any], **changes: Any) -> dict[str, Any]:
    """A scene whose links have other keys."""
    raw["links"] = {name: {**link, **changes.get(name, {})} for name, link in raw["links"].items()}
    return raw


RIGID = {"model": "rigid", "mesh": {"elements": [1, 1, 1]}}
PARTNERS = {
    "a pin that the drive carries": lambda: with_links(inverted("solid", "slot", revolutions=0.02), crank=RIGID),
    "a slot in a rigid arm": lambda: with_links(inverted("solid", "slot", revolutions=0.02), arm=RIGID),
    "a rigid block": lambda: with_links(inverted("solid", "prismatic", revolutions=0.02), block=RIGID),
    "a slot in a reduced arm": lambda: with_links(
        inverted("solid", "slot", revolutions=0.02), arm={"reduction": "modal"}
    ),
}


@pytest.mark.parametrize("kind", list(PARTNERS))
def test_rigid_carried_and_reduced_links_are_partners_too(kind: str) -> None:
    """Forces balance inertia and loads of each; those of the all elastic linkage are near, all links being stiff."""
    scene = scene_from(PARTNERS[kind]())
    ready, _ = prepared(scene, lambda stage: None)
    blocks = list(transient(scene, ready.linkage, ready.path, ready.model, steps_of(scene, ready.model)))
    assert_balanced(ready, blocks)
    like, elastic = ran(inverted("solid", "prismatic" if "block" in kind else "slot", revolutions=0.02))
    got, wanted = channels(ready, blocks), channels(like, elastic)
    for name in ("joints/S/force", "joints/B/force", "drive/torque"):
        assert_allclose(got[name], wanted[name], atol=0.03 * np.abs(wanted[name]).max())


def test_stiffer_links_bear_what_rigid_ones_do() -> None:
    """Drive torque against virtual work of the rigid motion: off by 1/E."""
    off = []
    for E in (2e11, 2e12, 2e13):
        steel = {"density": 7850, "youngs_modulus": E, "poisson_ratio": 0.3}
        raw = inverted("beam", "slot", revolutions=0.25, steps_per_revolution=720, rho_inf=0.8)
        found = channels(*ran(raw | {"materials": {"steel": steel}}))
        left = found["drive/torque"] - found["drive/rigid_torque"]
        off.append(np.abs(left).max() / np.abs(found["drive/rigid_torque"]).max())
    assert_allclose([off[0] / off[1], off[1] / off[2]], 10, rtol=0.1)


@pytest.mark.parametrize("kind", list(KINDS))
def test_the_systems_steps_are_the_monolithic_ones(kind: str) -> None:
    """Two ways to one number."""
    found = []
    for solver in ("monolithic", "condensed"):
        raw = KINDS[kind]()
        raw["analysis"]["solver"] = solver
        ready, blocks = ran(raw)
        links = range(len(ready.model.links))
        found.append([state(blocks, k, name) for name in ("u", "v", "port_forces") for k in links])
    for other in found[1:]:
        for x, y in zip(other, found[0], strict=True):
            assert_allclose(x, y, atol=1e-7 * np.abs(y).max())


@pytest.mark.parametrize("kind", list(KINDS))
def test_joints_stay_closed_and_what_is_free_is_free(kind: str) -> None:
    ready, blocks = ran(KINDS[kind]())
    open_, size = 0.0, 0.0
    for block in blocks:
        rows = constraint_matrices(ready.model.rows, block.motion, ready.model.interface_unknowns)
        for k in range(len(block)):
            z = interface_values(ready.model.joints, [link.u[k] for link in block.links])
            open_ = max(open_, float(np.abs(rows.at(k) @ z)[np.isinf(rows.stiffness)].max()))
            size = max(size, float(np.abs(z).max()))
    assert open_ < 1e-10 * max(size, 1e-3)
    assert size > 1e-8 or kind == "driven slide"  # which holds all of its coupling surface


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "two drives"])
def test_joints_let_the_rigid_motion_pass(kind: str) -> None:
    """Rows see nothing of the linkage's own rigid rates; those of a drive see its own, 1 per radian or metre."""
    ready, blocks = ran(KINDS[kind]())
    motion, model = blocks[-1].motion, ready.model
    rows = constraint_matrices(model.rows, motion, model.interface_unknowns)
    velocities = drive_rates(ready.linkage, ready.path, motion.phi)
    for t in (0, len(motion.t) - 1):
        rates = []
        for link, body in zip(model.links, model.bodies, strict=True):
            v, omega = (x[t, body] for x in velocities)
            u = np.outer(link.one, v) + np.cross(omega, link.X @ motion.R[t, body].T)
            if link.kind == "beam":
                u[:, 2] = omega[2] * link.one
            rates.append(u[:, : link.d])
        seen = rows.at(t) @ interface_values(model.joints, rates)
        held, paced = np.abs(seen) < 1e-7, np.abs(np.abs(seen) - 1) < 1e-7
        assert (held | paced).all()
        assert paced.sum() == sum(x.name in ready.scene.driven_joints for x in model.rows)


def test_the_first_rates_and_accelerations_keep_rows_closed() -> None:
    """e of z + t z' + t² z''/2 grows as t³: eightfold in twice the time. Drawn askew, so that nothing is symmetric."""
    raw = inverted("beam", "slot", revolutions=0.05)
    pin = 0.1 * np.array([np.cos(1.0), np.sin(1.0)])
    arm = pin + np.array([0.3, 0])
    along = arm / np.linalg.norm(arm)
    raw["links"]["crank"] = bar("beam", (0, 0), pin.tolist())
    raw["links"]["arm"] = bar("beam", (-0.3, 0), (0.8 * along - [0.3, 0]).tolist(), 16)
    raw["joints"]["S"] |= {"at": pin.tolist(), "axis": [*along.tolist(), 0]}
    ready, blocks = ran(raw)
    first, later = (
        blocks[0].links,
        constraint_matrices(ready.model.rows, blocks[1].motion, ready.model.interface_unknowns),
    )
    z, z1, z2 = (interface_values(ready.model.joints, [getattr(x, k)[0] for x in first]) for k in "uva")
    t = blocks[1].motion.t[[3, 7]]
    e = [np.abs(later.at(k) @ (z + s * z1 + s**2 / 2 * z2)).max() for k, s in zip((3, 7), t, strict=True)]
    assert_allclose(e[1] / e[0], 8, rtol=0.2)


@pytest.mark.parametrize("kind", list(KINDS))
def test_multipliers_of_the_system_are_what_bears_the_port_forces(kind: str) -> None:
    """Σ Bᵀ R λ = Cᵀ μ: force and moment of each joint along its rows, and the efforts of drive and gears among them."""
    ready, blocks = ran(KINDS[kind]())
    for block in blocks:
        mu, first, forces = row_values(ready, block)[2], 0, supports(block)
        near = 1e-8 * max(np.abs(mu).max(), 1.0)
        for row in ready.model.rows:
            own = mu[:, first : first + len(row.constraints)]
            first += len(row.constraints)
            if row.plus:
                assert_allclose(effort(forces, row.name), own[:, 0], rtol=0, atol=near)
                continue
            force, moment, point = wrench(forces, row)
            assert_allclose(point, block.motion.position(row.bodies[0], row.at), rtol=0, atol=1e-12)
            for got, n in zip((force, moment), directions(row, block.motion), strict=True):
                wanted = np.einsum("tr,trk->tk", own, n)
                assert_allclose(got, wanted, rtol=0, atol=near)
            if row.name in ready.scene.driven_joints:
                axis = block.motion.R[:, row.bodies[1]] @ row.axis
                slides = ready.scene.joints[row.name].kind == "prismatic"
                wanted = ((force if slides else moment) * axis).sum(axis=1)
                number = list(ready.scene.all_drives).index(row.name)
                assert_allclose(effort(forces, number), wanted, rtol=0, atol=near)


@pytest.mark.parametrize("kind", list(KINDS))
def test_joint_forces_balance_inertia_and_loads_of_every_link(kind: str) -> None:
    """Σ joint forces + Σ (P − M R0'') = Σ M δ'', and so of moments: K δ has no resultant, in any frame.

    Generalised-α's own δ'' is that of another instant; the one that balances the forces at a step's end follows from it,
    (1 − α_f) â1 + α_f â0 = (1 − α_m) a1 + α_m a0 (Arnold and Brüls 2007).
    """
    assert_balanced(*ran({**KINDS[kind](), "gravity": [0, -9.81, 0]}))


def assert_balanced(ready: Prepared, blocks: list[Block]) -> None:
    digits = 5e-7 if any(link.rigid for link in ready.model.links) else 1e-8  # rigid links are very stiff ones
    assert max(unbalanced(ready, blocks)) < digits


def test_a_pin_that_does_not_move_along_its_slot_is_a_hinge_across_it() -> None:
    """The slot's line goes through the arm's own hinge: the pin goes around it with the arm, and slides nowhere.

    A hinge at the pin holds along the arm too, which matters little to its bending; beside a hinge the slot is redundant.
    """
    raw = inverted("beam", "slot", end_time=0.05, step=5e-4, revolutions=None, steps_per_revolution=None)
    raw["drive"]["motion"] = {"kind": "cycloidal", "angle": 1.0, "rise": 0.04}
    raw["links"]["arm"] = bar("beam", (0, 0), (0.4, 0), 16)
    raw["joints"]["B"]["at"] = [0, 0]
    _, slot = ran(raw)
    hinge = {"kind": "revolute", "links": ["crank", "arm"], "at": [0.1, 0]}
    _, both = ran({**raw, "joints": {**raw["joints"], "E": hinge}})
    _, alone = ran({**raw, "joints": {**raw["joints"], "S": hinge}})
    across, as_well, wanted = (state(blocks, 1, "g")[:, :, 1] for blocks in (slot, both, alone))
    size = np.abs(wanted).max()
    assert_allclose(across, wanted, atol=1e-5 * size)
    assert_allclose(as_well, wanted, atol=1e-10 * size)


def test_a_pin_that_leaves_its_link_is_refused() -> None:
    """Drawn 0.316 m from the arm's hinge, the pin is 0.4 m away half a revolution on; the arm is 0.348 m long."""
    raw = inverted("beam", "slot", revolutions=1.0)
    raw["links"]["crank"] = bar("beam", (0, 0), (0, 0.1))
    raw["links"]["arm"] = bar("beam", (-0.3, 0), (0.03, 0.11))
    raw["joints"]["S"] |= {"at": [0, 0.1], "axis": [3, 1, 0]}
    wanted = r"joints\.S: the pin must stay on link 'arm', which reaches from -0.316\d* to 0.0316\d* m along the line, "
    with pytest.raises(MeshError, match=wanted + r"got a travel from -0.116\d* to 0.0837\d* m"):
        ran(raw)


def bushed(stiffness: float, damping: float = 0.0, **analysis: Any) -> dict[str, Any]:
    """The block on its arm, in a bushing; and its hinge too."""
    raw = inverted("beam", "prismatic", **{"rho_inf": 0.8, **analysis})
    turning = {"rotational_stiffness": 1e-3 * stiffness, "rotational_damping": 1e-3 * damping}
    raw["joints"]["S"]["bushing"] = {"stiffness": stiffness, "damping": damping, **turning}
    raw["joints"]["C"]["bushing"] = {"stiffness": [stiffness, 2 * stiffness, stiffness]}
    return raw


def test_a_bushing_becomes_the_rigid_joint_as_its_compliance() -> None:
    """1/k: ten times as stiff, a tenth of the difference; 1e14 N/m costs no digits."""
    _, rigid = ran(inverted("beam", "prismatic", rho_inf=0.8))
    wanted = state(rigid, 2, "u")
    off = []
    for k in (1e9, 1e10, 1e14):
        off.append(np.abs(state(ran(bushed(k))[1], 2, "u") - wanted).max() / np.abs(wanted).max())
    assert_allclose(off[0] / off[1], 10, rtol=0.02)
    assert_allclose(off[1] / off[2], 1e4, rtol=0.05)


def test_bushings_are_the_same_in_all_steps() -> None:
    found = []
    for solver in ("monolithic", "condensed"):
        _, blocks = ran(bushed(1e7, 1e3, revolutions=0.05, solver=solver))
        found.append([state(blocks, k, name) for name in ("u", "v", "port_forces") for k in range(3)])
    for other in found[1:]:
        for x, y in zip(other, found[0], strict=True):
            assert_allclose(x, y, atol=1e-8 * np.abs(y).max())


def residual(raw: dict[str, Any]) -> np.ndarray:
    return channels(*ran(raw))["energy/residual"][:, 0]


ACCOUNTS = {
    "bushings": lambda n: bushed(1e5, revolutions=0.25, steps_per_revolution=n),
    "damped bushings": lambda n: bushed(1e5, 1e2, revolutions=0.25, steps_per_revolution=n, rho_inf=0.95),
    "slot": lambda n: inverted("beam", "slot", revolutions=0.25, steps_per_revolution=n),
    "universal joint": lambda n: cardan(revolutions=0.1, steps_per_revolution=n),
}


@pytest.mark.parametrize("kind", list(ACCOUNTS))
def test_energy_is_kept_account_of_to_second_order(kind: str) -> None:
    """Half the step leaves a quarter over, also where more than one block of steps is taken (1024)."""
    left = [np.abs(residual(ACCOUNTS[kind](steps))).max() for steps in (2880, 5760)]
    assert_allclose(left[0] / left[1], 4, rtol=0.1)


def test_numerical_damping_finds_nothing_to_take_from_damped_bushings() -> None:
    """Quasi-static starts feel their dampers, so that nothing vibrates: ρ∞ = 0.5 takes less than the residual, a quarter
    of that with half the step. With dampers left out of the start it took 2.2e-5 J beside 3.5e-6 J.
    """
    taken = []
    for steps in (1440, 2880):
        much, little = (
            residual(bushed(1e5, 1e2, revolutions=0.25, steps_per_revolution=steps, rho_inf=rho_inf))
            for rho_inf in (0.5, 0.95)
        )
        taken.append(np.abs(much - little)[:: steps // 1440].max())
        assert taken[-1] < np.abs(little).max()
    assert_allclose(taken[0] / taken[1], 4, rtol=0.1)


def test_two_rotors_on_shaft_and_bushing_swing_as_two_masses_on_springs() -> None:
    """J1 θ1'' + c θ1' + k1 θ1 + k2 (θ1 − θ2) = 0, J2 θ2'' + k2 (θ2 − θ1) = 0, after the drive has stopped."""
    k1, k2, c, m = 400.0, 150.0, 0.05, 7850 * 0.02 * 0.03
    steps = {"end_time": 0.4, "step": 1e-4, "rho_inf": 0.95}
    raw: dict[str, Any] = {
        "materials": {"steel": {"density": 7850, "youngs_modulus": 2e11, "poisson_ratio": 0.3}},
        "links": {"one": bar("rigid", (0, 0), (0.3, 0)), "two": bar("rigid", (0, 0), (0.2, 0))},
        "joints": {
            "A": {"kind": "revolute", "links": ["ground", "one"], "at": [0, 0]},
            "B": {"kind": "weld", "links": ["two", "one"], "at": [0, 0], "bushing": {"rotational_stiffness": k2}},
        },
        "drive": {"joint": "A", "shaft_stiffness": k1, "shaft_damping": c,
                  "motion": {"kind": "cycloidal", "angle": 0.01, "rise": 0.05}},
        "analysis": steps,
    }  # fmt: skip
    ready, blocks = ran(raw)
    torque = channels(ready, blocks)["drive/torque"][:, 0]
    J = [m * L * (L**2 / 3 + 0.03**2 / 12) for L in (0.3, 0.2)]
    A = np.zeros((4, 4))
    A[:2, 2:] = np.eye(2)
    A[2], A[3] = [-(k1 + k2) / J[0], k2 / J[0], -c / J[0], 0], [k2 / J[1], -k2 / J[1], 0, 0]
    s = np.linalg.eigvals(A)
    t = 1e-4 * np.arange(len(torque))
    after = t > 0.051
    modes = np.exp(np.outer(t[after], s))
    share = np.linalg.lstsq(modes, torque[after].astype(complex), rcond=None)[0]
    assert np.abs(modes @ share - torque[after]).max() < 2e-3 * np.abs(torque).max()


def swung(kind: str, rho_inf: float, revolutions: float) -> None:
    """Runs a linkage on and on: no growth, closed joints, forces that do not swing from step to step."""
    scene = scene_from(inverted("beam", kind, revolutions=revolutions, steps_per_revolution=720, rho_inf=rho_inf))
    ready, blocks = ran(scene.model_dump())
    open_, most, force = 0.0, [], []
    for block in blocks:
        C, z, mu = row_values(ready, block)
        open_ = max(open_, float(np.abs(C @ z[..., None]).max()))
        force.append(mu[:, 0])
        most.append(np.max([np.abs(link.u).max(axis=(1, 2)) for link in block.links], axis=0))
    every, bent = np.concatenate(force), np.concatenate(most)
    n = len(every) // 2
    spectrum = np.abs(np.fft.rfft(every[-n:] * np.hanning(n)))
    assert bent[-720:].max() < 1.02 * bent[1440:2160].max()
    assert np.abs(every[-720:]).max() < 1.02 * np.abs(every[1440:2160]).max()
    assert open_ < 1e-9 * bent.max()
    assert spectrum[-n // 10 :].max() < 1e-6 * spectrum.max()


@pytest.mark.parametrize("kind", ["prismatic", "slot"])
def test_joints_that_slide_neither_grow_nor_swing(kind: str) -> None:
    swung(kind, 0.95, 6)


@pytest.mark.long
@pytest.mark.parametrize("rho_inf", [0.5, 0.8, 0.95])
@pytest.mark.parametrize("kind", ["prismatic", "slot"])
def test_a_hundred_thousand_steps_neither_grow_nor_swing(kind: str, rho_inf: float) -> None:
    swung(kind, rho_inf, 140)


@pytest.mark.parametrize("links", ["plane links", "solids"])
def test_a_link_of_one_element_cannot_bend_along_a_slot(links: str) -> None:
    """Its four stations are as good as dependent: forces there were rounding, displacements off by 0.2 and 40 %."""
    raw = scene_of(Cell("slot", "rigid-body", True, links))
    elements = raw["links"]["link 1"]["mesh"]["elements"]
    raw["links"]["link 1"]["mesh"]["elements"] = [1, *elements[1:]]
    wanted = r"joints\.J: link 'link 1' must have 4 independent deflections .* got 3: give it two elements along the line"
    with pytest.raises(MeshError, match=wanted):
        begun(raw)


def test_what_does_not_suit_such_joints_is_refused() -> None:
    wanted = r"analysis\.rho_inf: must be less than 1 with joints\.S .*, got 1: take 0\.95"
    with pytest.raises(SceneError, match=wanted):
        scene_from(inverted(rho_inf=1.0))
    raw = driven_slide()
    raw["drive"]["shaft_stiffness"] = 1.0
    with pytest.raises(SceneError, match=r"drive\.shaft_stiffness: must be given for an angle .* of 'A'"):
        scene_from(raw)
    raw = bushed(1.0)
    raw["joints"]["S"]["bushing"]["stiffness"] = [1.0, 2.0]
    with pytest.raises(SceneError, match=r"joints\.S\.bushing\.stiffness: must be one number or three"):
        scene_from(raw)
    raw["joints"]["S"]["bushing"]["stiffness"] = -1.0
    with pytest.raises(SceneError, match=r"joints\.S\.bushing\.stiffness: must be positive \[N/m\], got -1$"):
        scene_from(raw)
    raw = inverted("beam", "slot")
    raw["joints"]["S"]["bushing"] = {"rotational_stiffness": 1.0}
    with pytest.raises(SceneError, match=r"joints\.S\.bushing\.rotational_stiffness: must .* got a slot joint"):
        scene_from(raw)


def test_a_light_block_on_a_pin_and_the_pin_itself_in_a_slot_press_alike() -> None:
    """Quick-return both ways, with a stiff arm: the slot bears what the block's hinge does."""
    materials = {"feather": {"density": 1e-3, "youngs_modulus": 2e13, "poisson_ratio": 0.3},
                 "stiff": {"density": 7850, "youngs_modulus": 2e13, "poisson_ratio": 0.3}}  # fmt: skip
    found = []
    for kind in ("slot", "prismatic"):
        raw = inverted("beam", kind, revolutions=0.5, steps_per_revolution=360, rho_inf=0.8) | {"materials": materials}
        for name, link in raw["links"].items():
            link["material"] = "feather" if name == "block" else "stiff"
        found.append(channels(*ran(raw))["joints/S/force" if kind == "slot" else "joints/C/force"])
    assert_allclose(found[0], found[1], atol=1e-3 * np.abs(found[1]).max())


def test_a_solid_block_on_a_planar_beam_tells_its_force() -> None:
    """What the beam, which moves in its plane only, cannot bear of the block is not left open: nothing loads it there."""
    light = {"density": 1e-3, "youngs_modulus": 2.1e11, "poisson_ratio": 0.3}
    found = []
    for block in ({}, RIGID):
        raw = with_links(inverted("beam", "prismatic", revolutions=0.1, steps_per_revolution=360), block=block)
        raw["links"]["block"]["material"] = "light"
        found.append(channels(*ran(raw | {"materials": {"light": light}})))
    for name in ("joints/S/force", "joints/S/moment", "joints/B/force"):
        assert_allclose(found[1][name], found[0][name], atol=0.02 * np.abs(found[0][name]).max())


def test_moments_are_told_by_what_the_drive_does() -> None:
    """Where it comes back or stops, its place is no moment, but for the positions of a static analysis."""
    rising, stopped = driven_slide(), driven_slide()
    rising["analysis"]["end_time"] = 0.1
    static = with_analysis(scene_from(stopped), kind="static")
    scenes = [*map(scene_from, (inverted(), rising, stopped, two_drives())), static]
    told = [(clock(scene), moment(scene, 0.0123, 0.01)) for scene in scenes]
    slid, timed = ("drive travel", "10 mm"), ("time", "12.3 ms")
    assert told == [("drive angle", "0.6°"), slid, timed, timed, slid]
    assert clock(scenes[2], frozen=True) == "drive travel"
