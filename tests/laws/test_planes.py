"""Laws of plane links: those of hexahedra in two dimensions, and what the thickness and plane stress add."""

import numpy as np
import pytest
import skfem
from hypothesis import given, settings
from hypothesis import strategies as st
from skfem.models.elasticity import linear_elasticity

from kedfem.dynamics.loads import applied
from kedfem.dynamics.system.monolithic.monolithic_tangent import rotated_stiffness
from kedfem.links.bodies import euler_tensor, flywheel_tensor, with_body
from kedfem.links.plane import plane_basis, plane_link, plane_stress
from kedfem.links.point_rows import point_rows
from kedfem.links.record import Link
from kedfem.links.recovery import nodal_stress, stress_recovery
from kedfem.links.solid import elastic_stiffness, gradient_products, solid_link, sparsity_pattern
from kedfem.links.surfaces.coupling_surfaces import face_surface, is_flat, joint_surface, port_weights, surface_weights
from kedfem.mesh import QuadMesh
from kedfem.mesh.elements.hexahedra import extruded, rectangle_quads
from kedfem.mesh.elements.shape_functions import QUAD9, shape_gradients
from kedfem.scene import Material
from tests.laws.strategies import (
    LAW,
    MATERIAL,
    Motion,
    examples,
    planar_rotations,
    plane,
    quadrilaterals,
    rotated,
    seeds,
    vectors,
)
from tests.laws.test_hexahedra import ROUNDING
from tests.laws.test_loads_and_joints import Z, at_one_instant, kinetic_energy, point_acceleration

planar_motions = st.builds(
    lambda R, p, w, v: Motion(R, p * [1, 1, 0], w * [0, 0, 1], v * [1, 1, 0]), planar_rotations, vectors, vectors, vectors
)


def gauss_area(mesh: QuadMesh) -> float:
    """Σ w det J with 4 × 4 Gauss points: exact, det J being of degree 3 at most in either direction."""
    xi, w = np.polynomial.legendre.leggauss(4)
    at = np.stack(np.meshgrid(xi, xi, indexing="ij"), axis=-1).reshape(-1, 2)
    J = np.einsum("eak,qaj->eqkj", mesh.points[mesh.cells, :2], shape_gradients(QUAD9, at))
    return float((np.linalg.det(J) @ np.outer(w, w).ravel()).sum())


def plane_modes(X: np.ndarray) -> np.ndarray:
    """Three unit columns (2n, 3): two translations and a small turn about z."""
    r = X[:, :2] - X[:, :2].mean(axis=0)
    turn = np.stack([-r[:, 1], r[:, 0]], axis=1).ravel()
    modes = np.stack([np.tile([1.0, 0], len(X)), np.tile([0, 1.0], len(X)), turn], axis=1)
    return modes / np.linalg.norm(modes, axis=0)


def inside(link: Link) -> np.ndarray:
    return np.asarray(link.X[link.cells[0]].mean(axis=0))


@LAW
@given(quadrilaterals(), planar_motions)
def test_functions_sit_on_the_nodes_and_det_J_moves_with_them(mesh: QuadMesh, motion: Motion) -> None:
    here, there = plane(mesh), plane(rotated(mesh, motion))
    np.testing.assert_allclose(here.X[here.cells], mesh.points[mesh.cells], atol=1e-15)
    np.testing.assert_allclose(there.basis.dx, here.basis.dx, rtol=0, atol=ROUNDING * here.basis.dx.max())
    assert here.basis.dx.min() > 0


@LAW
@given(quadrilaterals(), planar_motions)
def test_mass_is_of_the_right_sum_and_the_same_in_every_frame(mesh: QuadMesh, motion: Motion) -> None:
    """Σ m = ρ t A, A by an independent quadrature; the same matrix for u and v, [KED, eqs. (9)(12)]."""
    link, there = plane(mesh), plane(rotated(mesh, motion))
    m = link.mass[0].toarray()
    assert link.d == len(link.mass) == 2
    assert link.mass[0] is link.mass[1]
    assert np.linalg.eigvalsh(m).min() > 0
    np.testing.assert_allclose(there.mass[0].toarray(), m, atol=ROUNDING * m.max())
    volume = mesh.thickness * gauss_area(mesh)
    assert m.sum() == pytest.approx(MATERIAL.density * volume, rel=1e-12)
    assert link.volume.sum() == pytest.approx(volume, rel=1e-12)
    np.testing.assert_allclose(link.mX[:, :2], m @ link.X[:, :2], atol=1e-12 * np.abs(m).sum())
    assert not link.mX[:, 2].any()


@LAW
@given(quadrilaterals())
def test_stiffness_is_semidefinite_with_exactly_the_three_rigid_modes(mesh: QuadMesh) -> None:
    link = plane(mesh)
    K = link.K0.toarray()
    assert np.abs(K - K.T).max() < ROUNDING * np.abs(K).max()
    assert np.linalg.norm(K @ plane_modes(link.X)) < ROUNDING * np.linalg.norm(K)
    values = np.linalg.eigvalsh(K)
    assert np.abs(values[:3]).max() < ROUNDING * values[-1]
    # the softest elastic mode of a valid element of these sides is far above rounding
    assert values[3] > 1e-6 * values[-1]


@LAW
@given(quadrilaterals(), planar_motions, seeds)
def test_energy_and_stresses_do_not_depend_on_the_frame(mesh: QuadMesh, motion: Motion, seed: int) -> None:
    """½ δᵀ K δ = ½ gᵀ K0 g with δ = T g, [KED, eqs. (13)(14)]; stresses in link axes turn with the link."""
    here, there = plane(mesh), plane(rotated(mesh, motion), axes=motion.R)
    R = motion.R[:2, :2]
    g = np.random.default_rng(seed).uniform(-1, 1, (here.n, 2))
    delta = (g @ R.T).ravel()
    energy = g.ravel() @ here.K0 @ g.ravel() / 2
    assert delta @ rotated_stiffness(here.K0, R) @ delta / 2 == pytest.approx(energy, rel=1e-12)
    assert delta @ there.K0 @ delta / 2 == pytest.approx(energy, rel=1e-11)
    stress = point_rows(here, "here", inside(here)).stress @ g.ravel()
    turned = point_rows(there, "there", motion.moved(inside(here))).stress @ delta
    np.testing.assert_allclose(turned, stress, atol=1e-9 * np.abs(stress).max())


@LAW
@given(quadrilaterals(), seeds)
def test_linear_fields_pass_the_patch_test_in_plane_stress(mesh: QuadMesh, seed: int) -> None:
    """u = H x: stress by Hooke's law for σ_zz = 0 everywhere, E t ∫ of its energy, no force on an inner node."""
    link = plane(mesh)
    H = np.random.default_rng(seed).uniform(-1, 1, (2, 2))
    g = link.X[:, :2] @ H.T
    (xx, yy), xy = np.diag(H), H[0, 1] + H[1, 0]
    E, nu = MATERIAL.youngs_modulus, MATERIAL.poisson_ratio
    c = E / (1 - nu**2)
    exact = np.array([c * (xx + nu * yy), c * (yy + nu * xx), 0, E / (2 * (1 + nu)) * xy, 0, 0])
    size = np.abs(exact).max()
    np.testing.assert_allclose(point_rows(link, "here", inside(link)).stress @ g.ravel(), exact, atol=1e-10 * size)
    np.testing.assert_allclose(nodal_stress(stress_recovery(link), g), np.tile(exact, (link.n, 1)), atol=1e-10 * size)
    energy = exact @ [xx, yy, 0, xy, 0, 0] / 2 * link.volume.sum()
    assert g.ravel() @ link.K0 @ g.ravel() / 2 == pytest.approx(energy, rel=1e-11)
    force = (link.K0 @ g.ravel()).reshape(-1, 2)
    inner = np.setdiff1d(np.arange(link.n), link.basis.get_dofs().flatten())
    assert np.abs(force[inner]).max() < 1e-11 * np.abs(force).max()


@settings(LAW, max_examples=examples(6))  # the vector form is slow
@given(quadrilaterals(), st.floats(-0.5, 0.45))
def test_stiffness_is_that_of_the_vector_form(mesh: QuadMesh, nu: float) -> None:
    """Three scalar matrices against scikit-fem's own linear elasticity on the vector-valued element."""
    basis = plane_basis(mesh)
    lame = (nu / ((1 + nu) * (1 - 2 * nu)), 1 / (2 * (1 + nu)))  # E = 1 Pa
    K0 = elastic_stiffness(gradient_products(basis, sparsity_pattern(basis)), lame).toarray()
    vector = skfem.Basis(basis.mesh, skfem.ElementVector(basis.elem), quadrature=basis.quadrature)
    K = linear_elasticity(*lame).assemble(vector).toarray()
    here = np.empty(len(K), int)
    for component in range(2):
        here[vector.element_dofs[component::2]] = 2 * basis.element_dofs + component
    np.testing.assert_allclose(K0[np.ix_(here, here)], K, atol=ROUNDING * np.abs(K).max())


@pytest.mark.parametrize("nu", [-0.3, 0.0, 0.3, 0.49])
def test_plane_stress_constants_are_those_of_the_textbook(nu: float) -> None:
    """λ* = E ν / (1 − ν²), λ* + 2 μ = E / (1 − ν²)."""
    lam, mu = plane_stress(Material(density=1, youngs_modulus=1, poisson_ratio=nu).lame())
    assert lam == pytest.approx(nu / (1 - nu**2), abs=1e-15)
    assert lam + 2 * mu == pytest.approx(1 / (1 - nu**2), rel=1e-14)


def test_without_contraction_a_plane_link_is_the_solid_moving_in_its_plane() -> None:
    """ν = 0: plane stress is plane strain, and the hexahedra swept from the quadrilaterals hold the same energy."""
    material = Material(density=2700, youngs_modulus=70e9, poisson_ratio=0.0)
    quads, cells = rectangle_quads(0.3, 0.1, 3, 2)
    flat = plane_link("flat", QuadMesh(np.pad(quads, ((0, 0), (0, 1))), cells, 0.02), material, np.eye(3))
    solid = solid_link("solid", extruded(quads, cells, 0.02, 1), material, np.eye(3))

    def field(X: np.ndarray) -> np.ndarray:
        x, y = X[:, 0] / 0.3, X[:, 1] / 0.1
        return np.stack([np.sin(x) * y, np.cos(2 * x + y)], axis=1)

    g, h = field(flat.X), np.pad(field(solid.X), ((0, 0), (0, 1)))
    assert g.ravel() @ flat.K0 @ g.ravel() == pytest.approx(h.ravel() @ solid.K0 @ h.ravel(), rel=1e-11)
    assert np.vdot(g, flat.mass[0] @ g) == pytest.approx(np.vdot(h, solid.mass[0] @ h), rel=1e-12)


# -- coupling surfaces --------------------------------------------------------------------------------------------------


def disc(z: float = 0.9) -> Link:
    """A ring of radii 0.1 and 0.25 about the origin, thickness 0.02, in a plane away from z = 0."""
    radii, around = np.linspace(0.1, 0.25, 3), 12
    angle = np.arange(2 * around) * np.pi / around
    points = np.stack(
        [np.outer(np.cos(angle), radii), np.outer(np.sin(angle), radii), np.full((len(angle), 3), z)], axis=-1
    )
    middle = 2 * np.arange(around)[:, None] + 1
    cells = (middle + QUAD9[:, 1]) % (2 * around) * 3 + 1 + QUAD9[:, 0]
    return plane(QuadMesh(points.reshape(-1, 3), cells, 0.02))


@LAW
@given(seeds)
def test_a_bore_reads_value_and_gradient_of_affine_fields_exactly(seed: int) -> None:
    link, random = disc(), np.random.default_rng(seed)
    a, H = random.uniform(-1, 1, 2), random.uniform(-1, 1, (2, 2))
    surface = joint_surface(link, "joints.A", np.zeros(3), Z)
    u = a + link.X[:, :2] @ H.T
    point = random.uniform(-1, 1, 3)  # its z plays no part
    np.testing.assert_allclose(port_weights(surface, point[None, :]) @ u, (a + H @ point[:2])[None, :], atol=1e-13)
    np.testing.assert_allclose(surface.fit[1:] @ u, [*H.T, [0, 0]], atol=1e-12)
    np.testing.assert_allclose(port_weights(surface, point[None, :]).sum(), 1, atol=1e-13)
    # the circle of radius 0.1 is chords of parabolas: its spread is r/√2 to their fourth order
    np.testing.assert_allclose(surface.spread, [0.1 / np.sqrt(2), 0.1 / np.sqrt(2), 0], rtol=1e-4)


def test_edges_have_the_area_of_length_times_thickness() -> None:
    link = disc()
    bore = joint_surface(link, "joints.A", np.zeros(3), Z)
    rim = face_surface(link, "loads.p.at", np.array([0.25, 0, 0]))
    # 2 π r t; quadratic edges of 30° are 8e-5 short
    assert surface_weights(link, bore).sum() == pytest.approx(2 * np.pi * 0.1 * 0.02, rel=1e-4)
    assert surface_weights(link, rim).sum() == pytest.approx(2 * np.pi * 0.25 * 0.02, rel=1e-4)
    quads, cells = rectangle_quads(0.3, 0.1, 3, 2)
    bar = plane(QuadMesh(np.pad(quads, ((0, 0), (0, 1))), cells, 0.02))
    end = face_surface(bar, "loads.p.at", np.array([0.3, 0.01, 0]))
    assert len(end.facets) == 2
    weights = surface_weights(bar, end)
    assert weights.sum() == pytest.approx(0.1 * 0.02, rel=1e-13)
    assert (bar.X[weights != 0, 0] == 0.3).all()
    np.testing.assert_allclose(end.origin, [0.3, 0, 0], atol=1e-15)
    np.testing.assert_allclose(np.abs(end.directions[0]), [0, 1, 0], atol=1e-15)


# -- inertia ------------------------------------------------------------------------------------------------


@LAW
@given(quadrilaterals(), planar_motions, vectors, vectors)
def test_inertia_load_is_literally_minus_M_R0(mesh: QuadMesh, motion: Motion, alpha: np.ndarray, p2: np.ndarray) -> None:
    """m·1 and m·X serve in place of M R0'' at the nodes, [KED, eq. (17)]."""
    link, alpha, p2 = plane(mesh), alpha * [0, 0, 1], p2 * [1, 1, 0]
    got = applied(link, (), at_one_instant(motion, alpha, p2), 1)[0]
    wanted = -link.mass[0] @ point_acceleration(motion, alpha, p2, link.X * [1, 1, 0])[:, :2]
    np.testing.assert_allclose(got, wanted, atol=1e-12 * max(np.abs(wanted).max(), 1e-300))


@LAW
@given(planar_motions, vectors, seeds)
def test_kinetic_energy_with_a_body_is_that_of_link_and_rigid_body(motion: Motion, centre: np.ndarray, seed: int) -> None:
    """In the plane: T = T_link + ½ m v² + ½ I_zz ω², the centre anywhere, its z of no account."""
    link, random = disc(), np.random.default_rng(seed)
    surface = joint_surface(link, "joints.A", np.zeros(3), Z)
    mass, spread = random.uniform(0.1, 100), random.uniform(-1, 1, (4, 3))
    inertia = mass * sum(r @ r * np.eye(3) - np.outer(r, r) for r in spread)
    loaded = with_body(link, surface, mass, centre, euler_tensor(inertia))
    velocity = motion.velocity(link.X * [1, 1, 0])[:, :2]
    v = motion.velocity(centre * [1, 1, 0])
    wanted = kinetic_energy(link, velocity) + (mass * v @ v + inertia[2, 2] * motion.omega[2] ** 2) / 2
    assert kinetic_energy(loaded, velocity) == pytest.approx(wanted, rel=1e-11)
    np.testing.assert_allclose(loaded.m1.sum(axis=0), MATERIAL.density * link.volume.sum() + mass, rtol=1e-11)


@pytest.mark.parametrize("where", ["bore", "edge"])
def test_a_flywheel_adds_its_inertia_about_z(where: str) -> None:
    """½ J ω² on a bore, whose gradient is known all round, and on a straight edge, where it is known along it."""
    quads, cells = rectangle_quads(0.3, 0.1, 3, 2)
    bar = plane(QuadMesh(np.pad(quads, ((0, 0), (0, 1))), cells, 0.02))
    link = disc() if where == "bore" else bar
    surface = joint_surface(link, "joints.A", np.zeros(3), Z)
    assert is_flat(surface) == (where == "edge")
    loaded = with_body(link, surface, 0.0, np.zeros(3), flywheel_tensor(surface, Z, 0.7))
    turning = np.stack([-link.X[:, 1], link.X[:, 0]], axis=1) * 3.0
    added = kinetic_energy(loaded, turning) - kinetic_energy(link, turning)
    assert added == pytest.approx(0.7 * 3.0**2 / 2, rel=1e-9)
