"""Rigid inverse dynamics: against Newton and Euler by hand, virtual work, balance of power; what statics leave open."""

from typing import Any

import numpy as np
import pytest
import scipy.linalg
from benchmarks.scenes import mechanisms
from numpy.testing import assert_allclose

from kedfem.accuracy.prepared import meshed, moving
from kedfem.dynamics.inertias import Inertias, acting, inertias_of_links, inertias_of_model
from kedfem.dynamics.loads import applied
from kedfem.dynamics.rigid_body import motions
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.links.build import bare_links
from kedfem.links.record import in_space
from kedfem.motion.linkage import Linkage
from kedfem.motion.reactions import Reactions, reactions
from kedfem.motion.rigid import RigidMotion, rigid_motion
from kedfem.results.forces.rigid import RigidForces, determined, rigid_forces
from kedfem.results.recording import recording
from kedfem.scene import Scene, drive_angle, path_parameter, scene_from, time_grid

from ..linkages import drive_rates, linkage_scene
from ..rigid_energy import kinetic_energy, load_power
from .test_dynamics import four_bar

Array = np.ndarray
SPEED, GRAVITY, WIDTH = 2 * np.pi, np.array([0.0, -9.81]), 0.0254
DENSITY, FLYWHEEL = 2796.0, 8.065e-2


def forces_of(raw: dict[str, Any], t: Array) -> tuple[dict[str, Array], RigidMotion, Inertias, RigidForces]:
    """All rigid channels of a scene at given times."""
    scene = scene_from(raw)
    linked, along = moving(scene)
    masses = inertias_of_links(scene, linked, bare_links(scene))
    motion = rigid_motion(linked, along, t, path_parameter(scene, t))
    found = rigid_forces(scene, linked, masses, along)
    return found.rows(motion), motion, masses, found


# -- by hand, in the plane ------------------------------------------------------------------------------------


def bar(length: float) -> tuple[float, float]:
    """Mass, and inertia about its centre, of a square bar."""
    m = DENSITY * WIDTH**2 * length
    return m, m * (length**2 + WIDTH**2) / 12


def balance(parts: list[tuple[float, float, Array, float, dict[int, Array], Array, float]], unknowns: int) -> Array:
    """Newton and Euler of links in a plane, three equations each.

    parts : mass, inertia, centre's acceleration, angular acceleration, unknown → (force's direction, arm from the centre,
    couple) rows, external force, external moment about the centre
    """
    A, b = np.zeros((3 * len(parts), unknowns)), np.zeros(3 * len(parts))
    for k, (m, J, a, alpha, borne, f, moment) in enumerate(parts):
        for column, (fx, fy, couple) in borne.items():
            A[3 * k : 3 * k + 3, column] = fx, fy, couple
        b[3 * k : 3 * k + 3] = [*(m * a - f), J * alpha - moment]
    return np.linalg.solve(A, b)


def pin(column: int, arm: Array, sign: float = 1.0) -> dict[int, Array]:
    """A pin's two unknown force components at an arm from a link's centre, with their moments."""
    return {column: sign * np.array([1.0, 0.0, -arm[1]]), column + 1: sign * np.array([0.0, 1.0, arm[0]])}


def vector(z: complex) -> Array:
    return np.array([z.real, z.imag])


def four_bar_by_hand(t: float, pull: Array, share: float) -> Array:
    """Forces at A, B, C, D [N] and the torque on the crank [N m]: loop closure in complex numbers, then nine equations.

    A force acts on the crank at a share of its length, gravity on all links, a flywheel is on the rocker's shaft.
    """
    a, b, c, d, w = 0.3048, 0.9144, 0.762, 0.9144, SPEED
    q = np.radians(60) + w * t
    B = a * np.exp(1j * q)
    span = abs(d - B)
    x = (b**2 - c**2 + span**2) / (2 * span)
    C = B + (d - B) / span * (x + 1j * np.sqrt(b**2 - x**2))  # to the left of B → D
    e, g = (C - B) / b, (C - d) / c
    # rates: iw a e^{iq} + i w3 b e − i w4 c g = 0, and once more
    M = np.array([[(1j * b * e).real, -(1j * c * g).real], [(1j * b * e).imag, -(1j * c * g).imag]])
    w3, w4 = np.linalg.solve(M, -vector(1j * w * B))
    rest = -(w**2) * B - w3**2 * b * e + w4**2 * c * g
    a3, a4 = np.linalg.solve(M, -vector(rest))
    aB = -(w**2) * B
    centres = (B / 2, B + b * e / 2, d + c * g / 2)
    accelerations = (aB / 2, aB + (1j * a3 - w3**2) * b * e / 2, (1j * a4 - w4**2) * c * g / 2)
    joints = (0j, B, C, complex(d))
    (m2, J2), (m3, J3), (m4, J4) = (bar(x) for x in (a, b, c))
    arm = lambda k, at: vector(joints[at] - centres[k])  # noqa: E731
    external = m2 * GRAVITY + pull
    lever = vector(share * B - centres[0])
    parts = [
        (m2, J2, vector(accelerations[0]), 0.0, pin(0, arm(0, 0)) | pin(2, arm(0, 1)) | {8: np.array([0, 0, 1.0])},
         external, lever[0] * pull[1] - lever[1] * pull[0]),
        (m3, J3, vector(accelerations[1]), a3, pin(2, arm(1, 1), -1.0) | pin(4, arm(1, 2)), m3 * GRAVITY, 0.0),
        (m4, J4 + FLYWHEEL, vector(accelerations[2]), a4, pin(4, arm(2, 2), -1.0) | pin(6, arm(2, 3)), m4 * GRAVITY, 0.0),
    ]  # fmt: skip
    return balance(parts, 9)


def loaded_four_bar(kind: str, frame: str = "world") -> dict[str, Any]:
    raw = four_bar(kind)
    raw["drive"]["motion"]["speed"] = "60 rpm"
    raw["gravity"] = [0, -9.81, 0]
    raw["points"]["P"] = {"between": ["A", "B"], "fraction": 0.6}
    raw["loads"] = {"pull": {"kind": "force", "link": "crank", "at": "P", "vector": [3, 20, 0], "frame": frame}}
    return raw


@pytest.mark.parametrize("kind", ["beam", "bar"])
@pytest.mark.parametrize("frame", ["world", "link"])
def test_a_four_bar_bears_what_newton_and_euler_say(kind: str, frame: str) -> None:
    t = np.linspace(0.0, 1.0, 17)
    found, *_ = forces_of(loaded_four_bar(kind, frame), t)
    for k, now in enumerate(t):
        turn = SPEED * now if frame == "link" else 0.0
        pull = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ [3.0, 20.0]
        wanted = four_bar_by_hand(now, pull, 0.6)
        got = [found[f"joints/{name}/rigid_force"][k, :2] for name in "ABCD"]
        # said of the first link: crank from ground, crank from coupler, coupler from rocker, rocker from ground
        assert_allclose(np.concatenate(got), wanted[:8], rtol=0, atol=1e-10 * np.abs(wanted).max())
        assert_allclose(found["drive/rigid_torque"][k], wanted[8:], rtol=0, atol=1e-10 * np.abs(wanted).max())
        assert_allclose(found["joints/A/rigid_moment"][k, -1], wanted[8], rtol=0, atol=1e-10 * np.abs(wanted).max())


def slider_crank_by_hand(t: float) -> Array:
    """Forces at A, B, C, the guide's side force, the torque; crank r, rod l of bars, a piston of 0.7 kg, 600 rpm."""
    r, rod_length, w, mp = 0.08, 0.24, 20 * np.pi, 0.7
    q = np.pi / 2 + w * t
    s = r / rod_length * np.sin(q)
    c = np.sqrt(1 - s**2)
    s1, s2 = (r / rod_length * w * np.cos(q), -r / rod_length * w**2 * np.sin(q))  # the rates of s
    b1 = -s1 / c  # the rod's angle is −asin(s)
    b2 = -(s2 / c + s * s1**2 / c**3)
    B = r * np.array([np.cos(q), np.sin(q)])
    C = B + rod_length * np.array([c, -s])
    aB = -(w**2) * B
    rod = C - B
    across = np.array([-rod[1], rod[0]])
    aC = aB + b2 * across - b1**2 * rod
    assert abs(aC[1]) < 1e-9 * np.abs(aC).max()  # the piston stays on its line
    (m2, J2), (m3, J3) = bar(r), bar(rod_length)
    zero = np.zeros(2)
    parts = [
        (m2, J2, aB / 2, 0.0, pin(0, -B / 2) | pin(2, B / 2) | {7: np.array([0, 0, 1.0])}, zero, 0.0),
        (m3, J3, (aB + aC) / 2, b2, pin(2, -rod / 2, -1.0) | pin(4, rod / 2), zero, 0.0),
        (mp, 1.0, aC, 0.0, pin(4, zero, -1.0) | {6: np.array([0, 1.0, 0]), 8: np.array([0, 0, 1.0])}, zero, 0.0),
    ]
    return balance(parts, 9)


def test_a_slider_crank_bears_what_newton_and_euler_say() -> None:
    beam = {"material": "alloy", "model": "beam"}
    shape = {"kind": "bar", "width": WIDTH, "thickness": WIDTH}
    raw = {
        **mechanisms()["slider-crank"],
        "materials": {"alloy": {"density": DENSITY, "youngs_modulus": 7e10, "shear_modulus": 2.7e10}},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": "600 rpm"}},
        "links": {
            "crank": {**beam, "shape": {**shape, "between": ["A", "B"]}},
            "rod": {**beam, "shape": {**shape, "between": ["B", "C"]}},
            "piston": {"model": "rigid", "mass": 0.7},
        },
    }
    t = np.linspace(0.0, 0.1, 13)
    found, *_ = forces_of(raw, t)
    for k, now in enumerate(t):
        wanted = slider_crank_by_hand(now)
        got = np.concatenate([found[f"joints/{name}/rigid_force"][k, :2] for name in "ABC"])
        close = 1e-10 * np.abs(wanted).max()
        assert_allclose(got, wanted[:6], rtol=0, atol=close)
        assert_allclose(found["joints/guide/rigid_force"][k, :2], [0.0, wanted[6]], rtol=0, atol=close)
        assert_allclose(found["drive/rigid_torque"][k], wanted[7], rtol=0, atol=close)


# -- laws -----------------------------------------------------------------------------------------------------


def spatial() -> dict[str, Any]:
    """RSSR under gravity with a force that follows its coupler, a rigid body on its rocker, a drive that speeds up."""
    raw = dict(mechanisms()["RSSR"])
    raw["drive"] = {"joint": "A", "motion": {"kind": "ramp", "speed": "300 rpm", "time": 0.1}}
    raw["gravity"] = [1.0, -2.0, -9.81]
    raw["loads"] = {
        "pull": {"kind": "force", "link": "coupler", "at": "N", "vector": [30, 20, -10], "frame": "link",
                 "factor": {"time": [0.0, 0.05, 0.2], "value": [0.0, 1.0, 0.5]}}
    }  # fmt: skip
    inertia = [0.002, 0.003, 0.004, 1e-4, 2e-4, -1e-4]
    raw["bodies"] = {
        "tool": {"kind": "rigid_body", "link": "rocker", "at": "D", "mass": 0.5, "inertia": inertia,
                 "centre": [0.32, -0.08, 0.27]}
    }  # fmt: skip
    return raw


@pytest.mark.parametrize("raw", [spatial(), mechanisms()["slider-crank"], loaded_four_bar("beam", "link")])
def test_power_of_drive_and_loads_is_what_kinetic_energy_grows_by(raw: dict[str, Any]) -> None:
    h = 1e-4
    t = 0.02 + h * np.arange(701)  # within the ramp
    found, motion, masses, _ = forces_of({**raw, "analysis": {"revolutions": 3}}, t)
    T = kinetic_energy(masses, motion)
    # eighth-order central differences
    growth = sum(c * (T[4 + k : len(T) - 4 + k] - T[4 - k : len(T) - 4 - k])
                 for k, c in zip((1, 2, 3, 4), (4 / 5, -1 / 5, 4 / 105, -1 / 280), strict=True)) / h  # fmt: skip
    speed = drive_angle(scene_from(raw).motion, t)[1]
    power = load_power(masses, motion) + found["drive/rigid_torque"][:, 0] * speed
    assert np.abs(growth).max() > 1.0  # W
    assert_allclose(growth, power[4:-4], rtol=0, atol=1e-10 * np.abs(power).max() + 1e-15 * T.max() / h)


@pytest.mark.parametrize(
    "raw", [spatial(), mechanisms()["slider-crank"], loaded_four_bar("plate"), loaded_four_bar("beam", "link")]
)
@pytest.mark.parametrize("carried", [False, True])
def test_the_drives_torque_is_that_of_virtual_work_on_all_nodes(raw: dict[str, Any], carried: bool) -> None:
    raw = {key: x for key, x in raw.items() if key != "bodies"}
    if carried:
        crank = {key: x for key, x in raw["links"]["crank"].items() if key != "mesh"}
        raw = {**raw, "links": {**raw["links"], "crank": {**crank, "model": "rigid"}}}
    ready = meshed(scene_from(raw))
    model = ready.model
    _, motion = next(motions(ready.scene, ready.linkage, ready.path))
    masses = inertias_of_model(ready.scene, ready.linkage, model)
    found = rigid_forces(ready.scene, ready.linkage, masses, ready.path).rows(motion)
    work = np.zeros(len(motion.t))
    v, omega = drive_rates(ready.linkage, ready.path, motion.phi)
    every = [*zip(model.links, model.bodies, model.loads, strict=True),
             *((x.link, x.body, x.loads) for x in model.prescribed)]  # fmt: skip
    for link, body, loads in every:  # −Σ F · ∂R0/∂φ, with the sliders' mass on the nodes that carry it
        F = applied(link, loads, motion, body)
        f = in_space(link, F)
        x = np.einsum("tij,nj->tni", motion.R[:, body], link.X)
        rate = link.one[:, None] * v[:, None, body] + np.cross(omega[:, None, body], x)
        work -= np.einsum("tni,tni->t", f, rate)
        if link.kind == "beam":
            work -= omega[:, body, 2] * (F[:, :, 2] @ link.one)
    torque = found["drive/rigid_torque"][:, 0]
    assert (len(model.prescribed) == 1) == carried
    assert_allclose(torque, work, rtol=0, atol=1e-11 * np.abs(work).max())


def test_forces_of_all_joints_on_a_link_balance_its_inertia_and_loads() -> None:
    t = np.linspace(0.0, 0.2, 9)
    _, motion, masses, forces = forces_of(spatial(), t)
    force, moment = acting(masses, motion)
    found, scene, linked = reactions(forces.linkage, motion), forces.scene, forces.linkage
    wrench = np.concatenate([force, moment], axis=2)[:, 1:].reshape(len(t), -1, 1)
    for name in scene.links:
        body = linked.bodies.index(name)
        total = np.concatenate([force[:, body], moment[:, body]], axis=1)
        for key, each in scene.joints.items():
            if name in each.links:
                f, m = (found.responses(x) @ wrench for x in found.on(key, body, linked.centre))
                total += np.concatenate([f, m], axis=1)[..., 0]
        assert_allclose(total, 0.0, atol=1e-10 * np.abs(wrench).max())


def test_the_link_of_a_joint_and_the_other_bear_opposite_forces() -> None:
    t = np.linspace(0.0, 0.2, 5)
    _, motion, _, forces = forces_of(spatial(), t)
    found, linked = reactions(forces.linkage, motion), forces.linkage
    at = np.asarray(forces.scene.joints["B"].at)
    crank, coupler = (found.on("B", linked.bodies.index(name), at) for name in ("crank", "coupler"))
    assert_allclose(crank, -coupler, atol=1e-12)
    assert np.abs(crank[0]).max() > 0.1


# -- what statics leave open ----------------------------------------------------------------------------------


def drawn(raw: Any) -> tuple[Scene, Linkage, Reactions, RigidForces]:
    scene = raw if isinstance(raw, Scene) else scene_from(raw)
    linked, along = moving(scene)
    t = np.linspace(0.0, time_grid(scene).end, 4)
    motion = rigid_motion(linked, along, t, path_parameter(scene, t))
    masses = inertias_of_links(scene, linked, bare_links(scene))
    return scene, linked, reactions(linked, motion), rigid_forces(scene, linked, masses, along)


def columns(forces: RigidForces) -> dict[str, tuple[str, ...]]:
    return {each.channel.name: each.channel.columns for each in forces.every}


def test_hinges_of_a_planar_linkage_bear_known_forces_in_its_plane_only() -> None:
    *_, forces = drawn(four_bar("beam"))
    expected = {f"joints/{name}/rigid_force": ("x", "y") for name in "ABCD"}
    assert columns(forces) == expected | {
        "joints/A/rigid_moment": ("z",), "drive/rigid_torque": ("torque",)
    }  # fmt: skip


def test_in_a_plane_askew_what_is_open_is_said_and_left_out() -> None:
    R = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    R *= np.linalg.det(R)
    raw = four_bar("bar")
    scene = scene_from(raw)
    points = {name: (R @ scene.points[name]).tolist() for name in scene.points}
    joints = {name: {**x, "axis": R[:, 2].tolist()} for name, x in raw["joints"].items()}
    turned = {**raw, "points": points, "joints": joints, "bodies": {}}
    t = np.linspace(0.0, 0.1, 5)
    straight, *_ = forces_of({**raw, "bodies": {}}, t)
    found, *_, forces = forces_of(turned, t)
    for name in "ABCD":
        key = f"joints/{name}/rigid_force"
        flat = np.column_stack([straight[key], np.zeros(5)])
        assert_allclose(found[key], flat @ R.T, atol=1e-8 * np.abs(flat).max())
    said = next(x.channel.description for x in forces.every if x.channel.name == "joints/B/rigid_force")
    n = R[:, 2] if f"{R[0, 2]:.3g}" in said else -R[:, 2]
    shown = f"({n[0]:.3g}, {n[1]:.3g}, {n[2]:.3g})"
    assert said.endswith(f"without the part along {shown}, which is statically indeterminate")


def test_two_hinges_on_one_shaft_share_what_they_bear_in_an_unknown_way() -> None:
    table = {
        "A": ("revolute", "ground", "rotor", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        "E": ("revolute", "rotor", "ground", (0.0, 0.0, 0.2), (0.0, 0.0, 1.0)),
    }
    *_, forces = drawn(linkage_scene(table))
    assert columns(forces) == {"joints/A/rigid_moment": ("z",), "drive/rigid_torque": ("torque",)}


def test_a_hinge_alone_bears_all_that_there_is() -> None:
    table = {"A": ("revolute", "ground", "rotor", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))}
    *_, alone = drawn(linkage_scene(table))
    assert columns(alone)["joints/A/rigid_force"] == ("x", "y", "z")
    assert columns(alone)["joints/A/rigid_moment"] == ("x", "y", "z")


@pytest.mark.parametrize("raw", [four_bar("beam"), four_bar("bar"), mechanisms()["slider-crank"], spatial()])
def test_what_is_told_does_not_depend_on_how_redundant_rows_share(raw: dict[str, Any]) -> None:
    _, linked, found, forces = drawn(raw)
    rng = np.random.default_rng(0)
    J = found.factor.J
    for k in range(len(J)):
        null = scipy.linalg.null_space(J[k].T, rcond=1e-9)
        assert bool(null.shape[1]) == bool(linked.redundant)
        change = null @ rng.normal(size=null.shape[1])
        moved = False
        for each in forces.every:
            A = forces.channel_of(found, each)[k]
            assert np.abs(A.T @ change).max() < 1e-9 * max(np.abs(A).max(), 1.0)
        for name, each in forces.scene.joints.items():
            body = linked.bodies.index(next(x for x in each.links if x != "ground"))
            borne = found.on(name, body, np.asarray(each.at))[:, k]
            moved |= bool(np.abs(np.swapaxes(borne, 1, 2) @ change).max() > 1e-3)
        assert moved == bool(null.shape[1])


def test_told_columns() -> None:
    n = np.array([0.0, 0.6, 0.8])
    full = np.eye(3)
    assert determined(np.zeros((3, 3)), full)[0] == ("x", "y", "z")
    assert determined(np.diag([0.0, 0.0, 1.0]), full)[0] == ("x", "y")
    assert determined(np.eye(3), full)[0] == ()
    assert determined(np.zeros((3, 3)), np.zeros((3, 3)))[0] == ()  # a ball bears no moment
    columns_, P, text = determined(np.outer(n, n), full)
    assert columns_ == ("x", "y", "z")
    assert_allclose(P, np.eye(3) - np.outer(n, n), atol=1e-12)
    assert "(0, 0.6, 0.8)" in text or "(0, -0.6, -0.8)" in text


# -- in an elastic run ----------------------------------------------------------------------------------------


def test_rigid_channels_of_many_turns_are_those_of_the_first_again_where_loads_are() -> None:
    raw = four_bar("beam", revolutions=3.5, steps_per_revolution=50)
    ready = meshed(scene_from(raw))
    recorded = {x.channel.name: x for x in recording(ready.scene, ready.model, None, ready.path)}
    blocks = []
    for block in transient(ready.scene, ready.linkage, ready.path, ready.model, steps_of(ready.scene, ready.model)):
        blocks += [block.part(k, min(k + 23, len(block))) for k in range(0, len(block), 23)]
    key = "joints/B/rigid_force"
    found = np.concatenate([recorded[key].rows(block) for block in blocks])
    t = ready.scene and np.concatenate([block.motion.t for block in blocks])
    wanted, *_ = forces_of(raw, t)
    assert_allclose(found, wanted[key], rtol=0, atol=1e-9 * np.abs(wanted[key]).max())
    assert len(found) == 176


def test_a_run_without_a_drive_has_no_rigid_counterpart() -> None:
    raw = four_bar("beam")
    raw = {**raw, "analysis": {"end_time": 0.01, "step": 1e-3}, "damping": {}}
    del raw["drive"]
    ready = meshed(scene_from(raw))
    assert not [x for x in recording(ready.scene, ready.model, None, ready.path) if "rigid" in x.channel.name]


def test_motions_that_are_free_have_no_rigid_forces() -> None:
    """What holds the flail in the rigid linkage is no joint: the drive's torque without it would be another one."""
    table = {
        "A": ("revolute", "ground", "arm", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        "B": ("revolute", "arm", "flail", (0.3, 0.0, 0.0), (0.0, 0.0, 1.0)),
    }
    *_, forces = drawn(linkage_scene(table, frames="co-rotational"))
    assert not list(columns(forces))


def five_bar() -> dict[str, Any]:
    """Two cranks with drives of their own and two links between, of beams."""
    points = {"A": [0, 0], "B": [-0.1, 0.2], "C": [0.1, 0.45], "D": [0.3, 0.2], "E": [0.2, 0]}
    pairs = {"one": "AB", "two": "BC", "three": "CD", "four": "DE"}
    shape = {"kind": "bar", "width": 0.01, "thickness": 0.02}
    joints = {"A": ("ground", "one"), "B": ("one", "two"), "C": ("two", "three"), "D": ("three", "four"),
              "E": ("four", "ground")}  # fmt: skip
    law = {"kind": "cycloidal", "rise": 1.0}
    return {
        "points": points,
        "gravity": [0, -9.81, 0],
        "links": {
            name: {"material": "steel", "model": "beam", "shape": {**shape, "between": list(ends)}}
            for name, ends in pairs.items()
        },
        "joints": {name: {"kind": "revolute", "links": list(x), "at": name} for name, x in joints.items()},
        "drives": {
            "left": {"joint": "A", "motion": {**law, "angle": 0.4}},
            "right": {"joint": "E", "motion": {**law, "angle": -0.3}},
        },
        "analysis": {"end_time": 1.0, "step": 0.01},
    }


def slide_driven() -> dict[str, Any]:
    """A crank that is turned by its slider."""
    raw = {key: x for key, x in mechanisms()["slider-crank"].items() if key != "output"}
    raw["drive"] = {"joint": "guide", "motion": {"kind": "cycloidal", "travel": -0.05, "rise": 1.0}}
    return {**raw, "points": {**raw["points"], "B": {"from": "A", "distance": 0.08, "angle": "60 deg"}},
            "analysis": {"end_time": 1.0, "step": 0.01}}  # fmt: skip


@pytest.mark.parametrize(
    ("raw", "channels"),
    [(five_bar(), ("drive/A/rigid_torque", "drive/E/rigid_torque")), (slide_driven(), ("drive/rigid_force",))],
)
def test_all_drives_together_give_the_power(raw: dict[str, Any], channels: tuple[str, ...]) -> None:
    scene = scene_from(raw)
    h = 1e-3
    t = 0.2 + h * np.arange(401)
    linked, along = moving(scene)
    masses = inertias_of_links(scene, linked, bare_links(scene))
    motion = rigid_motion(linked, along, t, path_parameter(scene, t))
    found = rigid_forces(scene, linked, masses, along).rows(motion)
    speeds = [drive_angle(each.motion, t)[1] for each in scene.all_drives.values()]
    T = kinetic_energy(masses, motion)
    growth = np.gradient(T, h, edge_order=2)
    power = load_power(masses, motion)
    for name, speed in zip(channels, speeds, strict=True):
        power = power + found[name][:, 0] * speed
    inner = slice(1, -1)
    # second-order differences of a motion within one second
    assert_allclose(growth[inner], power[inner], rtol=0, atol=2e-5 * np.abs(power).max() + 1e-9)
    assert np.abs(growth).max() > 1e-3
