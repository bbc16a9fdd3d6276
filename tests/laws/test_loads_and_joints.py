"""Laws of inertia loads, port points and attached bodies: constants of the link serve every position."""

from contextlib import nullcontext

import numpy as np
import pytest
from hypothesis import given

from kedfem.dynamics.elastic_model import with_scene_body
from kedfem.dynamics.loads import applied
from kedfem.errors import MeshError
from kedfem.links.bodies import euler_tensor, inertia_of, with_body, with_point_mass
from kedfem.links.build import bare_links
from kedfem.links.record import Link, mass_times
from kedfem.links.surfaces.coupling_surfaces import (
    CouplingSurface,
    face_surface,
    joint_surface,
    port_weights,
    surface_weights,
)
from kedfem.mesh import SolidMesh
from kedfem.motion.newton import cross_matrix
from kedfem.motion.rigid import RigidMotion
from kedfem.scene import scene_from
from tests.laws.strategies import (
    LAW,
    MATERIAL,
    Beam,
    Motion,
    beams,
    hexahedra,
    motions,
    ring,
    rings,
    rotated,
    seeds,
    solid,
    vectors,
)
from tests.laws.test_hexahedra import dense_mass

Z = np.array([0.0, 0.0, 1.0])


def planar(motion: Motion) -> Motion:
    """The part of a motion that keeps a beam in its plane."""
    angle = motion.p[2]
    R = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    return Motion(R, motion.p * [1, 1, 0], motion.omega * [0, 0, 1], motion.v * [1, 1, 0])


def at_one_instant(motion: Motion, alpha: np.ndarray, p2: np.ndarray) -> RigidMotion:
    """One time point of a body with number 1, R'' = ([α]× + [ω]×²) R."""
    R2 = (cross_matrix(alpha) + cross_matrix(motion.omega) @ cross_matrix(motion.omega)) @ motion.R

    def both(x: np.ndarray) -> np.ndarray:
        return np.stack([np.zeros_like(x), x])[None]

    zero = np.zeros(1)
    R, p, omega = both(motion.R), both(motion.p), both(motion.omega)
    none = np.zeros((len(zero), 0))
    return RigidMotion(zero, zero, R, p, omega, both(alpha), both(motion.v), both(R2), both(p2), none)


def point_acceleration(motion: Motion, alpha: np.ndarray, p2: np.ndarray, X: np.ndarray) -> np.ndarray:
    """Textbook kinematics of a rigid body: p'' + α × r + ω × (ω × r), r = R X."""
    r = X @ motion.R.T
    return p2 + np.cross(alpha, r) + np.cross(motion.omega, np.cross(motion.omega, r))


# -- inertia load -------------------------------------------------------------------------------------------


@LAW
@given(hexahedra(), motions, vectors, vectors)
def test_inertia_load_of_a_solid_is_literally_minus_M_R0(
    mesh: SolidMesh, motion: Motion, alpha: np.ndarray, p2: np.ndarray
) -> None:
    """m·1 and m·X serve in place of M R0'' at the nodes, [KED, eq. (17)]."""
    link = solid(mesh)
    got = applied(link, (), at_one_instant(motion, alpha, p2), 1)[0]
    wanted = -dense_mass(link) @ point_acceleration(motion, alpha, p2, link.X).ravel()
    np.testing.assert_allclose(got.ravel(), wanted, atol=1e-12 * np.abs(wanted).max())


@LAW
@given(beams(), motions, vectors, vectors)
def test_inertia_load_of_a_beam_is_literally_minus_M_R0(
    beam: Beam, motion: Motion, alpha: np.ndarray, p2: np.ndarray
) -> None:
    """R0'' = (x'', y'', θ'') at the nodes, [KED, eq. (22)]."""
    link = beam.link()
    motion, alpha, p2 = planar(motion), alpha * [0, 0, 1], p2 * [1, 1, 0]
    got = applied(link, (), at_one_instant(motion, alpha, p2), 1)[0]
    R02 = point_acceleration(motion, alpha, p2, link.X * [1, 1, 0])
    R02[:, 2] = alpha[2]
    wanted = -dense_mass(link) @ R02.ravel()
    np.testing.assert_allclose(got.ravel(), wanted, atol=1e-12 * max(np.abs(wanted).max(), 1e-300))


# -- port points --------------------------------------------------------------------------------------------


def bore(link: Link, motion: Motion) -> CouplingSurface:
    """The coupling surface on the bore of a ring that has moved rigidly."""
    return joint_surface(link, "joints.A", motion.p, motion.R @ Z)


@LAW
@given(rings(), motions, seeds)
def test_port_weights_of_a_bore_sum_to_one_and_reproduce_affine_fields(
    mesh: SolidMesh, motion: Motion, seed: int
) -> None:
    link = solid(rotated(mesh, motion))
    random = np.random.default_rng(seed)
    points = motion.p + random.uniform(-0.5, 0.5, (3, 3))
    W = port_weights(bore(link, motion), points)
    np.testing.assert_allclose(W.sum(axis=1), 1, atol=1e-12)
    value, gradient = random.uniform(-1, 1, 3), random.uniform(-1, 1, (3, 3))
    np.testing.assert_allclose(W @ (value + link.X @ gradient), value + points @ gradient, atol=1e-11)


@LAW
@given(rings(), motions, seeds)
def test_port_weights_commute_with_rotation(mesh: SolidMesh, motion: Motion, seed: int) -> None:
    """Weights of the moved link are those of the link at rest, and scalar: W (u Rᵀ) = (W u) Rᵀ."""
    rest = Motion(np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3))
    random = np.random.default_rng(seed)
    points = random.uniform(-0.3, 0.3, (2, 3))
    here, there = solid(mesh), solid(rotated(mesh, motion))
    W = port_weights(bore(here, rest), points)
    W_moved = port_weights(bore(there, motion), motion.moved(points))
    np.testing.assert_allclose(W_moved, W, atol=1e-11 * np.abs(W).max())
    g = random.uniform(-1, 1, (here.n, 3))
    np.testing.assert_allclose(W_moved @ (g @ motion.R.T), (W @ g) @ motion.R.T, atol=1e-11)


@pytest.mark.parametrize("nodes", [10, 20, 27])
@LAW
@given(motions)
def test_surface_weights_of_a_face_sum_to_its_area(nodes: int, motion: Motion) -> None:
    """The top of a ring between parabolas, each through three points of 45°: triangles and 2/3 chord · height."""
    link = solid(rotated(ring(nodes), motion))
    top = motion.moved(np.array([[0.175, 0.0, 0.1]]))[0]
    area = surface_weights(link, face_surface(link, "loads.push", top)).sum()
    half = np.pi / 8
    of_unit_radius = 8 * (np.sin(2 * half) / 2 + 4 / 3 * np.sin(half) * (1 - np.cos(half)))
    assert area == pytest.approx(of_unit_radius * (0.25**2 - 0.1**2), rel=1e-12)


# -- attached bodies ----------------------------------------------------------------------------------------


def kinetic_energy(link: Link, velocity: np.ndarray) -> float:
    """½ vᵀ M v."""
    return float((velocity * mass_times(link.mass, velocity)).sum() / 2)


@LAW
@given(rings(), motions, vectors, seeds)
def test_kinetic_energy_with_a_body_is_that_of_link_and_rigid_body(
    mesh: SolidMesh, motion: Motion, centre: np.ndarray, seed: int
) -> None:
    """T = T_link + ½ m v² + ½ ω · I ω in any rigid motion, I turned with the link."""
    rest = Motion(np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3))
    link = solid(mesh)
    random = np.random.default_rng(seed)
    mass, spread = random.uniform(0.1, 100), random.uniform(-1, 1, (4, 3))
    inertia = mass * sum(r @ r * np.eye(3) - np.outer(r, r) for r in spread)
    loaded = with_body(link, bore(link, rest), mass, centre, euler_tensor(inertia))
    velocity = motion.velocity(link.X)
    v, omega = motion.velocity(centre), motion.R.T @ motion.omega
    body = mass * v @ v / 2 + omega @ inertia @ omega / 2
    wanted = kinetic_energy(link, velocity) + body
    assert kinetic_energy(loaded, velocity) == pytest.approx(wanted, rel=1e-11)
    # m·1 and m·X of the record follow
    total = MATERIAL.density * link.volume.sum() + mass
    np.testing.assert_allclose(loaded.m1.sum(axis=0), total, rtol=1e-11)
    np.testing.assert_allclose(loaded.mX, loaded.mass[0] @ link.X, atol=1e-11 * mass)


@LAW
@given(beams(), motions, seeds)
def test_kinetic_energy_of_a_beam_with_a_body_on_its_node(beam: Beam, motion: Motion, seed: int) -> None:
    """In the plane: ½ m v² + ½ I_zz ω², the centre on the node."""
    link, motion, random = beam.link(), planar(motion), np.random.default_rng(seed)
    node = link.X[0]
    mass, inertia = random.uniform(0.1, 10), np.diag(random.uniform(0.1, 5, 3))
    loaded = with_body(link, joint_surface(link, "joints.A", node, Z), mass, node, euler_tensor(inertia))
    velocity = motion.velocity(link.X * [1, 1, 0])
    velocity[:, 2] = motion.omega[2]
    v = motion.velocity(node * [1, 1, 0])
    wanted = kinetic_energy(link, velocity) + mass * v @ v / 2 + inertia[2, 2] * motion.omega[2] ** 2 / 2
    assert kinetic_energy(loaded, velocity) == pytest.approx(wanted, rel=1e-11)


@LAW
@given(rings(), motions, seeds)
def test_kinetic_energy_with_a_slider_is_that_of_link_and_point_mass(mesh: SolidMesh, motion: Motion, seed: int) -> None:
    rest = Motion(np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3))
    link = solid(mesh)
    random = np.random.default_rng(seed)
    mass, point = random.uniform(0.1, 100), random.uniform(-0.2, 0.2, 3)
    loaded = with_point_mass(link, port_weights(bore(link, rest), point[None])[0], mass)
    velocity, v = motion.velocity(link.X), motion.velocity(point)
    wanted = kinetic_energy(link, velocity) + mass * v @ v / 2
    assert kinetic_energy(loaded, velocity) == pytest.approx(wanted, rel=1e-11)


@LAW
@given(vectors, vectors)
def test_euler_tensor_of_point_masses_is_the_sum_of_their_dyads(a: np.ndarray, b: np.ndarray) -> None:
    """G = ½ tr(I) 1 − I = Σ m r rᵀ, for masses 2 and 3 kg."""
    inertia = sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in ((2.0, a), (3.0, b)))
    wanted = 2 * np.outer(a, a) + 3 * np.outer(b, b)
    np.testing.assert_allclose(euler_tensor(inertia), wanted, atol=1e-13)
    np.testing.assert_allclose(inertia_of(wanted), inertia, atol=1e-13)


def test_a_flywheel_turns_about_the_hinge_that_it_sits_on() -> None:
    """A pin's slot along x is there too, and is named first: J about z is added all the same, not J/2."""
    bar = {"model": "beam", "material": "steel"}
    bar["shape"] = {"kind": "bar", "between": [[0, 0], [0.1, 0.2]], "width": 0.01, "thickness": 0.01}
    pin = {"at": [0.1, 0.2]}
    scene = scene_from(
        {
            "links": {"arm": bar, "fork": bar, "rod": bar},
            "joints": {
                "slot": {"kind": "slot", "links": ["arm", "fork"], "axis": "x", **pin},
                "hinge": {"kind": "revolute", "links": ["arm", "rod"], **pin},
            },
            "bodies": {"wheel": {"kind": "flywheel", "link": "arm", "inertia": 0.3, **pin}},
            "analysis": {"end_time": 1.0, "step": 0.1},
        }
    )
    arm = bare_links(scene)["arm"]
    loaded = with_scene_body(scene, "bodies.wheel", scene.bodies["wheel"], {"arm": arm})[1]
    assert loaded.mass[2].sum() - arm.mass[2].sum() == pytest.approx(0.3, rel=1e-9)


def test_a_flywheel_on_a_flat_face_is_refused_where_its_axis_tilts() -> None:
    """A face does not show how its link rotates about the direction across the axis: 16 % of a torque were missing."""
    rod = {
        "material": "steel",
        "shape": {"kind": "bar", "width": 0.02, "thickness": 0.02},
        "mesh": {"elements": [2, 1, 1]},
    }
    links = {name: {**rod, "shape": {**rod["shape"], "between": ends}} for name, ends in (
        ("carrier", [[0, 0, 0], [0.3, 0, 0]]), ("arm", [[0.3, 0, 0], [0.5, 0, 0]]))}  # fmt: skip
    joints = {
        "tilt": {"kind": "revolute", "links": ["ground", "carrier"], "at": [0, 0, 0], "axis": [0, 1, 0]},
        "hinge": {"kind": "revolute", "links": ["carrier", "arm"], "at": [0.3, 0, 0], "axis": [0, 0, 1]},
    }
    raw = {
        "links": links, "joints": joints, "analysis": {"end_time": 1.0, "step": 0.1},
        "bodies": {"wheel": {"kind": "flywheel", "link": "arm", "inertia": 0.3, "at": [0.3, 0, 0]}},
    }  # fmt: skip
    for axis, tilts in (([0, 1, 0], True), ([0, 0, 1], False)):
        joints["tilt"]["axis"] = axis
        scene = scene_from(raw)
        arm = bare_links(scene)["arm"]
        with (
            pytest.raises(MeshError, match="tilt must sit on a bore, got a flat face of 'arm'")
            if tilts
            else nullcontext()
        ):
            with_scene_body(scene, "bodies.wheel", scene.bodies["wheel"], {"arm": arm})
