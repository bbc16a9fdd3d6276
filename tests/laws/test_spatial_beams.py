"""Laws of beams in space: {1, y, z} times a line element, a vector in R³ at each function."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from kedfem.dynamics.system.monolithic.monolithic_tangent import rotated_stiffness
from kedfem.links.beams.beam_axis import Axis, smooth_axis, straight_axis
from kedfem.links.beams.section import rectangle
from kedfem.links.beams.spatial_beam import (
    RIGID_NODE_INERTIA,
    rigidities,
    section_strains,
    space_mass,
    space_stiffness,
    space_strains,
    spatial_beam_link,
)
from kedfem.links.bodies import euler_tensor, with_body
from kedfem.links.record import Link
from kedfem.links.surfaces.coupling_surfaces import joint_surface, port_weights
from tests.laws.strategies import LAW, MATERIAL, Motion, motions, rotations, seeds, vectors
from tests.laws.test_hexahedra import ROUNDING, dense_mass, node_rotation
from tests.laws.test_loads_and_joints import kinetic_energy

SECTION = rectangle(0.05, 0.03)
RIGIDITY = rigidities(SECTION, MATERIAL.youngs_modulus, MATERIAL.shear_modulus)


@st.composite
def elements(draw: st.DrawFn) -> np.ndarray:
    """Nodes and directions (m, 3, 3) of an element: 2 nodes, or 3 on a curve in space; turned and twisted at random."""
    random = np.random.default_rng(draw(seeds))
    m = draw(st.sampled_from([2, 3]))
    x = np.zeros((m, 3, 3))
    x[:, 0, 0] = np.array([0.0, 1.0, 0.5])[:m] * random.uniform(0.2, 2.0)
    x[2:, 0] += draw(st.floats(0.0, 0.2)) * x[1, 0, 0] * random.uniform(-1, 1, 3)
    turns = draw(st.floats(0.0, 0.5)) * random.uniform(-1, 1, (m, 3))
    x[:, 1:] = Rotation.from_rotvec(turns).as_matrix()[:, :, 1:].transpose(0, 2, 1)
    whole = Rotation.from_rotvec(random.uniform(-2, 2, 3)).as_matrix()
    x = x @ whole.T
    x[:, 0] += random.uniform(-1, 1, 3)
    return x


def rigid_modes(X: np.ndarray, one: np.ndarray) -> np.ndarray:
    """Six columns (3n, 6): translations and small turns about the axes, Ω X."""
    shifts = [np.outer(one, e) for e in np.eye(3)]
    turns = [np.cross(e, X) for e in np.eye(3)]
    return np.stack([mode.ravel() for mode in (*shifts, *turns)], axis=1)


def element_modes(x: np.ndarray) -> np.ndarray:
    return rigid_modes(x.reshape(-1, 3), np.tile([1.0, 0.0, 0.0], len(x)))


def scaled_values(K: np.ndarray) -> np.ndarray:
    """Eigenvalues once every unknown has unit stiffness: values and slopes differ by lengths squared."""
    scale = 1 / np.sqrt(K.diagonal())
    return np.linalg.eigvalsh(scale[:, None] * K * scale)


@LAW
@given(elements())
def test_rigid_modes_strain_nothing_on_straight_curved_and_twisted_elements(x: np.ndarray) -> None:
    """At any point of the element, not only where it is integrated; hence no forces."""
    for r in np.linspace(-1, 1, 5):
        rows, det_J = space_strains(x, r)
        assert det_J > 0
        assert np.abs(rows.reshape(6, -1) @ element_modes(x)).max() < ROUNDING * np.abs(rows).max()
    for a in range(len(x)):
        inside = section_strains(x[a]).reshape(3, 9) @ element_modes(x)[9 * a : 9 * a + 9]
        assert np.abs(inside).max() < ROUNDING
    K = space_stiffness(x, RIGIDITY)
    assert np.abs(K @ element_modes(x)).max() < ROUNDING * np.abs(K).max()


@LAW
@given(elements())
def test_stiffness_of_an_element_is_semidefinite_with_exactly_six_zeros(x: np.ndarray) -> None:
    K = space_stiffness(x, RIGIDITY)
    assert np.abs(K - K.T).max() < ROUNDING * np.abs(K).max()
    values = scaled_values(K)
    assert np.abs(values[:6]).max() < ROUNDING
    assert values[6] > 1e-6  # (thickness / length)² of the slenderest, far above rounding


@LAW
@given(elements(), rotations)
def test_matrices_of_a_turned_element_are_the_turned_matrices(x: np.ndarray, R: np.ndarray) -> None:
    """m does not change (12), K = T K0 Tᵀ (14), on curved and twisted elements too."""
    K, T = space_stiffness(x, RIGIDITY), np.kron(np.eye(3 * len(x)), R)
    turned = x @ R.T
    turned[:, 0] += [0.3, -0.7, 0.2]
    np.testing.assert_allclose(space_stiffness(turned, RIGIDITY), T @ K @ T.T, atol=ROUNDING * np.abs(K).max())
    m = space_mass(x, SECTION)
    np.testing.assert_allclose(space_mass(turned, SECTION), m, atol=ROUNDING * m.max())
    assert np.linalg.eigvalsh(m).min() > 0


@LAW
@given(elements(), seeds)
def test_strains_of_a_rigid_section_are_those_of_its_turn(x: np.ndarray, seed: int) -> None:
    """u' = θ × t + ε t + γ1 n1 + γ2 n2, p = θ × n1, q = θ × n2: κ1 = −θ'·n2, κ2 = θ'·n1, τ = θ'·t, on a straight element.

    θ linear along it, ε and γ constant: the element holds these fields exactly at its middle.
    """
    random = np.random.default_rng(seed)
    R = np.linalg.qr(random.normal(size=(3, 3)))[0]
    R *= np.linalg.det(R)
    t, n1, n2 = R.T
    length, stretch = 0.7, random.normal(size=3)
    turn, rate = random.normal(size=(2, 3))
    s = length * np.array([-0.5, 0.5, 0.0])
    theta = turn + s[:, None] * rate
    u = s[:, None] * (np.cross(turn, t) + R @ stretch) + s[:, None] ** 2 / 2 * np.cross(rate, t)
    state = np.stack([u, np.cross(theta, n1), np.cross(theta, n2)], axis=1)
    nodes = np.stack([s[:, None] * t, np.tile(n1, (3, 1)), np.tile(n2, (3, 1))], axis=1)
    got = np.einsum("smfc,mfc->s", space_strains(nodes, 0.0)[0], state)
    np.testing.assert_allclose(got, [*stretch, -rate @ n2, rate @ n1, rate @ t], atol=1e-12)


# -- whole links ----------------------------------------------------------------------------------------------


def axis_of(seed: int, curve: str, nodes: int, R: np.ndarray) -> Axis:
    """Through two to four points in space, straight or smooth."""
    random = np.random.default_rng(seed)
    steps = np.array([0.5, 0, 0]) + random.uniform(-0.3, 0.3, (int(random.integers(1, 4)), 3))
    points = np.concatenate([random.uniform(-1, 1, (1, 3)), steps]).cumsum(axis=0) @ R.T
    up = R @ [0.2, 0.1, 1.0]
    return (straight_axis if curve == "straight" else smooth_axis)(points, 2, nodes, up)


def beam_in_space(seed: int, curve: str, nodes: int, R: np.ndarray | None = None) -> Link:
    return spatial_beam_link("any", axis_of(seed, curve, nodes, np.eye(3) if R is None else R), SECTION, MATERIAL)


curves, counts = st.sampled_from(["straight", "smooth"]), st.sampled_from([2, 3])


@LAW
@given(seeds, curves, counts)
def test_stiffness_of_a_beam_in_space_has_exactly_the_six_rigid_modes(seed: int, curve: str, nodes: int) -> None:
    link = beam_in_space(seed, curve, nodes)
    K0 = link.K0.toarray()
    modes = rigid_modes(link.X, link.one)
    assert np.abs(K0 @ modes).max() < ROUNDING * np.abs(K0).max()
    values = scaled_values(K0)
    assert np.abs(values[:6]).max() < ROUNDING
    assert values[6] > 1e-8  # bending of the whole against the hubs


@LAW
@given(seeds, curves, counts, rotations)
def test_matrices_of_a_turned_beam_in_space(seed: int, curve: str, nodes: int, R: np.ndarray) -> None:
    """T M Tᵀ = M (12) and K = T K0 Tᵀ (14) with the corners' hubs."""
    link, turned = beam_in_space(seed, curve, nodes), beam_in_space(seed, curve, nodes, R)
    M, T = dense_mass(link), node_rotation(link, R)
    np.testing.assert_allclose(T @ M @ T.T, M, atol=ROUNDING * M.max())
    np.testing.assert_allclose(dense_mass(turned), M, atol=ROUNDING * M.max())
    K = rotated_stiffness(link.K0, R).toarray()
    np.testing.assert_allclose(turned.K0.toarray(), K, atol=10 * ROUNDING * np.abs(K).max())
    assert np.linalg.eigvalsh(link.mass[0].toarray()).min() > 0


@LAW
@given(motions, vectors, seeds)
def test_kinetic_energy_of_a_rigid_beam_with_a_body_on_its_end(motion: Motion, centre: np.ndarray, seed: int) -> None:
    """½ m v² + ½ ω · I ω of the box, of the body, and of two hubs with Euler tensor h t tᵀ."""
    random = np.random.default_rng(seed)
    L, h, b = random.uniform(0.3, 1.0), 0.05, 0.03
    link = spatial_beam_link(
        "any", straight_axis(np.array([[0.0, 0, 0], [L, 0, 0]]), 2, 3, None), rectangle(h, b), MATERIAL
    )
    mass, spread = random.uniform(0.1, 100), random.uniform(-1, 1, (4, 3))
    inertia = mass * sum(r @ r * np.eye(3) - np.outer(r, r) for r in spread)
    surface = joint_surface(link, "bodies.a", np.array([L, 0, 0]), None)
    loaded = with_body(link, surface, mass, centre, euler_tensor(inertia))
    own, omega = MATERIAL.density * h * b * L, motion.R.T @ motion.omega
    box = own / 12 * np.diag([h**2 + b**2, L**2 + b**2, L**2 + h**2])
    hub = RIGID_NODE_INERTIA * MATERIAL.density * np.sqrt(h * b) * h * b**3 / 12
    v = motion.velocity(np.array([[L / 2, 0, 0], centre]))
    wanted = (own * v[0] @ v[0] + mass * v[1] @ v[1] + omega @ (box + inertia + 2 * hub * np.diag([0, 1, 1])) @ omega) / 2
    velocity = np.cross(motion.omega, link.X @ motion.R.T) + np.outer(link.one, motion.v)
    assert kinetic_energy(loaded, velocity) == pytest.approx(wanted, rel=1e-11)
    np.testing.assert_allclose(link.one @ loaded.m1, own + mass, rtol=1e-11)


@LAW
@given(seeds, curves, motions)
def test_port_weights_of_a_hub_reproduce_affine_fields_and_commute_with_rotation(
    seed: int, curve: str, motion: Motion
) -> None:
    link, turned = beam_in_space(seed, curve, 3), beam_in_space(seed, curve, 3, motion.R)
    random = np.random.default_rng(seed)
    points = random.uniform(-0.5, 0.5, (3, 3))
    value, gradient = random.uniform(-1, 1, 3), random.uniform(-1, 1, (3, 3))
    for k in range(2):
        end = link.nodes[-k]
        W = port_weights(joint_surface(link, "joints.A", end, None), points)
        np.testing.assert_allclose(W @ link.one, 1, atol=1e-12)
        np.testing.assert_allclose(
            W @ (np.outer(link.one, value) + link.X @ gradient), value + points @ gradient, atol=1e-11
        )
        there = port_weights(joint_surface(turned, "joints.A", turned.nodes[-k], None), points @ motion.R.T)
        np.testing.assert_allclose(there, W, atol=1e-11)
