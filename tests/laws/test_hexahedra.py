"""Laws of solid links, hexahedra and tetrahedra: det J, N, M and K0 depend on no frame, [KED, eqs. (4)-(14), App. A]."""

import numpy as np
import pytest
import scipy.sparse as sp
import skfem
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from skfem.models.elasticity import linear_elasticity

from kedfem.dynamics.system.monolithic.monolithic_tangent import rotated_stiffness
from kedfem.links.point_rows import point_rows
from kedfem.links.record import Link
from kedfem.links.recovery import (
    COMPONENTS,
    nodal_stress,
    principal_stresses,
    rotated_stress,
    stress_of_gradient,
    stress_recovery,
)
from kedfem.links.solid import elastic_stiffness, gradient_products, solid_basis, sparsity_pattern
from kedfem.links.surfaces.surface import surface_quadrature
from kedfem.mesh import SolidMesh
from kedfem.mesh.elements.shape_functions import NODES, shape_gradients
from kedfem.motion.newton import cross_matrix
from tests.laws.strategies import (
    FORMS,
    LAW,
    MATERIAL,
    Motion,
    examples,
    hexahedra,
    motions,
    patch,
    rotated,
    rotations,
    seeds,
    solid,
)

ROUNDING = 1e-12  # of the largest entry: a few thousand operations in double precision


def jacobians(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """J[k, j] = ∂x_k/∂ξ_j (e, q, 3, 3) at 4 × 4 × 4 Gauss points, from nodal vectors."""
    gradients = shape_gradients(NODES[cells.shape[1]], gauss(cells.shape[1])[0])
    return np.einsum("eak,qaj->eqkj", points[cells], gradients)


def gauss(nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """4 Gauss points a direction and their weights; those of a tetrahedron are of the cube shrunk to it."""
    xi, w = np.polynomial.legendre.leggauss(4)
    at = np.stack(np.meshgrid(xi, xi, xi, indexing="ij"), axis=-1).reshape(-1, 3)
    weights = np.einsum("i,j,k->ijk", w, w, w).ravel()
    if nodes != 10:
        return at, weights
    x, y, z = ((at + 1) / 2).T
    return np.stack([x, y * (1 - x), z * (1 - x) * (1 - y)], axis=1), weights / 8 * (1 - x) ** 2 * (1 - y)


def gauss_volume(mesh: SolidMesh) -> float:
    """Σ w det J with 4 Gauss points a direction: exact, det J being of degree 5 at most."""
    weights = gauss(mesh.cells.shape[1])[1]
    return float(np.linalg.det(jacobians(mesh.points, mesh.cells)).sum(axis=0) @ weights)


def three_determinants(J: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """|A|, |B|, |C| of [KED, App. A]: in each, ∂x/∂ξ of one direction ξ is replaced by its time derivative."""
    out = []
    for direction in range(3):
        changed = J.copy()
        changed[..., direction] = rate[..., direction]
        out.append(np.linalg.det(changed))
    return np.stack(out)


def dense_mass(link: Link) -> np.ndarray:
    """M with dof 3·node + component, from one scalar matrix per component, [KED, eq. (9)]."""
    return sum(np.kron(m.toarray(), np.diag(np.eye(3)[k])) for k, m in enumerate(link.mass))


def node_rotation(link: Link, R: np.ndarray) -> np.ndarray:
    """T, [KED, eq. (5)]."""
    return np.kron(np.eye(link.n), R)


def rigid_modes(X: np.ndarray) -> np.ndarray:
    """Six unit columns (3n, 6): translations along, and small turns about, x, y, z."""
    turns = [np.cross(axis, X - X.mean(axis=0)).ravel() for axis in np.eye(3)]
    modes = np.stack([*(np.tile(axis, len(X)) for axis in np.eye(3)), *turns], axis=1)
    return modes / np.linalg.norm(modes, axis=0)


# -- geometry -----------------------------------------------------------------------------------------------


@LAW
@given(hexahedra(), motions)
def test_det_J_keeps_its_value_while_an_element_moves_rigidly(mesh: SolidMesh, motion: Motion) -> None:
    """d(det J)/dt = |A| + |B| + |C| = 0, though no single one of the three need vanish, [KED, App. A]."""
    J = jacobians(motion.moved(mesh.points), mesh.cells)
    velocity = motion.moved(mesh.points) @ cross_matrix(motion.omega).T + motion.v
    rate = jacobians(velocity, mesh.cells)
    parts = three_determinants(J, rate)
    scale = np.prod(np.linalg.norm(J, axis=-1), axis=-1) * max(np.linalg.norm(motion.omega), 1.0)
    assert np.abs(parts.sum(axis=0) / scale).max() < ROUNDING


def test_the_three_determinants_of_det_J_do_not_vanish_one_by_one() -> None:
    """A unit cube sheared by x → x + y/2, turning about z at 1 rad/s: −1/2, 1/2 and 0 by hand."""
    J = np.array([[1.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    parts = three_determinants(J, cross_matrix(np.array([0.0, 0.0, 1.0])) @ J)
    np.testing.assert_allclose(parts, [-0.5, 0.5, 0.0], atol=1e-15)


@LAW
@given(hexahedra(), seeds)
def test_the_three_determinants_give_the_rate_of_det_J_in_any_motion(mesh: SolidMesh, seed: int) -> None:
    """|A| + |B| + |C| against a central difference of det J while nodes move at random."""
    velocity = np.random.default_rng(seed).uniform(-0.1, 0.1, mesh.points.shape)
    J, rate = jacobians(mesh.points, mesh.cells), jacobians(velocity, mesh.cells)
    h = 1e-3  # det is a cubic of time: its central difference is off by h² det(rate), which is taken away
    after, before = (np.linalg.det(J + s * h * rate) for s in (1, -1))
    difference = (after - before) / (2 * h) - h**2 * np.linalg.det(rate)
    np.testing.assert_allclose(three_determinants(J, rate).sum(axis=0), difference, atol=1e-11)


@LAW
@given(hexahedra(), motions)
def test_det_J_of_the_function_space_is_that_of_the_moved_mesh(mesh: SolidMesh, motion: Motion) -> None:
    here, there = solid_basis(mesh), solid_basis(rotated(mesh, motion))
    np.testing.assert_allclose(there.dx, here.dx, rtol=0, atol=ROUNDING * here.dx.max())


@LAW
@given(hexahedra())
def test_functions_sit_on_the_nodes_of_the_mesh_in_its_order(mesh: SolidMesh) -> None:
    """Isoparametric: as many functions as nodes, at the same places, [KED, eqs. (4a)(4b)]."""
    link = solid(mesh)
    assert link.n == len(mesh.points)
    np.testing.assert_allclose(link.X[link.cells], mesh.points[mesh.cells], atol=1e-15)


@LAW
@given(hexahedra(), motions, seeds)
def test_shape_functions_do_not_depend_on_the_frame(mesh: SolidMesh, motion: Motion, seed: int) -> None:
    """N by the moved element's own mapping is N of the element at rest, hence d = N g, [KED, eq. (6)]."""
    here, there = solid(mesh), solid(rotated(mesh, motion))
    np.testing.assert_allclose(there.X, motion.moved(here.X), atol=1e-13)
    random = np.random.default_rng(seed)
    element = here.X[here.basis.element_dofs[:, random.integers(len(mesh.cells))]]
    inside = element.mean(axis=0) + 0.2 * (element[random.integers(len(element))] - element.mean(axis=0))
    N = point_rows(here, "here", inside).value
    N_moved = point_rows(there, "there", motion.moved(inside)).value
    np.testing.assert_allclose(N @ here.X, inside, atol=1e-12)
    # the mapping is inverted to 1e-14 in ξ; the gap grows with the distortion
    np.testing.assert_allclose(N_moved, N, atol=1e-10)
    g = random.uniform(-1, 1, (here.n, 3))
    np.testing.assert_allclose(N_moved @ (g @ motion.R.T), motion.R @ (N @ g), atol=1e-10)


# -- mass ---------------------------------------------------------------------------------------------------


@LAW
@given(hexahedra(), rotations)
def test_mass_is_the_same_in_every_frame(mesh: SolidMesh, R: np.ndarray) -> None:
    """T M Tᵀ = M, [KED, eq. (12)]."""
    link = solid(mesh)
    M, T = dense_mass(link), node_rotation(link, R)
    np.testing.assert_allclose(T @ M @ T.T, M, atol=ROUNDING * M.max())


@LAW
@given(hexahedra(), motions)
def test_mass_does_not_change_while_the_mesh_moves_rigidly(mesh: SolidMesh, motion: Motion) -> None:
    here, there = dense_mass(solid(mesh)), dense_mass(solid(rotated(mesh, motion)))
    np.testing.assert_allclose(there, here, atol=ROUNDING * here.max())


@LAW
@given(hexahedra())
def test_mass_is_symmetric_positive_definite_and_of_the_right_sum(mesh: SolidMesh) -> None:
    """Σ m = ρV, V by an independent quadrature of det J; the first moment is Σ m X = ρ ∫ X dV."""
    link = solid(mesh)
    m = link.mass[0].toarray()
    assert (m == m.T).all() or np.abs(m - m.T).max() < 1e-15 * m.max()
    assert np.linalg.eigvalsh(m).min() > 0
    volume = gauss_volume(mesh)
    assert m.sum() == pytest.approx(MATERIAL.density * volume, rel=1e-12)
    assert link.volume.sum() == pytest.approx(volume, rel=1e-12)
    np.testing.assert_allclose(link.m1.sum(axis=0), MATERIAL.density * volume * np.ones(3), rtol=1e-12)
    np.testing.assert_allclose(link.mX, m @ link.X, atol=1e-12 * np.abs(m).sum())


# -- stiffness ----------------------------------------------------------------------------------------------


@LAW
@given(hexahedra())
def test_six_rigid_modes_cause_no_elastic_force(mesh: SolidMesh) -> None:
    link = solid(mesh)
    forces = link.K0 @ rigid_modes(link.X)
    assert np.linalg.norm(forces) < ROUNDING * sp.linalg.norm(link.K0)


@LAW
@given(hexahedra())
def test_stiffness_is_symmetric_and_semidefinite_with_exactly_six_zeros(mesh: SolidMesh) -> None:
    K = solid(mesh).K0.toarray()
    assert np.abs(K - K.T).max() < ROUNDING * np.abs(K).max()
    values = np.linalg.eigvalsh(K)
    assert np.abs(values[:6]).max() < ROUNDING * values[-1]
    # the softest elastic mode of a valid element of these sides is far above rounding
    assert values[6] > 1e-7 * values[-1]


@LAW
@given(hexahedra(), motions)
def test_stiffness_of_the_turned_mesh_is_the_turned_stiffness(mesh: SolidMesh, motion: Motion) -> None:
    """K = T K0 Tᵀ, [KED, eq. (14)], by assembling anew, by block rotation and by the dense product."""
    here, there = solid(mesh), solid(rotated(mesh, motion))
    K, T = rotated_stiffness(here.K0, motion.R).toarray(), node_rotation(here, motion.R)
    cap = ROUNDING * np.abs(K).max()
    np.testing.assert_allclose(K, T @ here.K0.toarray() @ T.T, atol=cap)
    np.testing.assert_allclose(there.K0.toarray(), K, atol=10 * cap)  # second assembly, in moved coordinates


@LAW
@given(hexahedra(), motions, seeds)
def test_strain_energy_and_stresses_do_not_depend_on_the_frame(mesh: SolidMesh, motion: Motion, seed: int) -> None:
    """½ δᵀ K δ = ½ gᵀ K0 g with δ = T g, [KED, eq. (13)]; stresses in link axes turn with the link."""
    here, there = solid(mesh), solid(rotated(mesh, motion), axes=motion.R)
    g = np.random.default_rng(seed).uniform(-1, 1, (here.n, 3))
    delta = (g @ motion.R.T).ravel()
    energy = g.ravel() @ here.K0 @ g.ravel() / 2
    assert delta @ rotated_stiffness(here.K0, motion.R) @ delta / 2 == pytest.approx(energy, rel=1e-12)
    assert delta @ there.K0 @ delta / 2 == pytest.approx(energy, rel=1e-11)
    centre = here.X[here.basis.element_dofs[:, 0]].mean(axis=0)
    stress = point_rows(here, "here", centre).stress @ g.ravel()
    turned = point_rows(there, "there", motion.moved(centre)).stress @ delta
    np.testing.assert_allclose(turned, stress, atol=1e-9 * np.abs(stress).max())


@pytest.mark.parametrize("nodes", FORMS)
@settings(LAW, max_examples=examples(8))
@given(seeds)
def test_a_linear_displacement_is_held_by_the_surface_alone(nodes: int, seed: int) -> None:
    """The patch test on curved elements: no force at the nodes inside, the one stress at all nodes and points."""
    random = np.random.default_rng(seed)
    link = solid(patch(nodes, random))
    H = random.uniform(-1, 1, (3, 3))
    g = random.uniform(-1, 1, 3) + link.X @ H.T
    forces, scale = (link.K0 @ g.ravel()).reshape(-1, 3), np.abs(link.K0).max() * np.abs(g).max()
    on = surface_quadrature(link, link.basis.mesh.boundary_facets())
    inside = np.setdiff1d(np.arange(link.n), on.dofs[np.abs(on.N).max(axis=1) > ROUNDING])
    assert len(inside) == {8: 1, 10: 27, 20: 7, 27: 27}[nodes]
    assert np.abs(forces[inside]).max() < ROUNDING * scale
    stress = stress_of_gradient(H[None], link)
    tolerance = 1e-11 * np.abs(stress).max()
    np.testing.assert_allclose(nodal_stress(stress_recovery(link), g) - stress, 0, atol=tolerance)
    at = link.X[link.basis.element_dofs[:, 3]].mean(axis=0)
    np.testing.assert_allclose(point_rows(link, "here", at).stress @ g.ravel() - stress[0], 0, atol=tolerance)


def test_20_functions_on_27_node_geometry_would_strain_in_a_rigid_turn() -> None:
    """Why hex20 brings its own geometry: a node moved off the face's middle is no field of the 20 modes."""
    mesh = patch(27, np.random.default_rng(0))
    alien = skfem.Basis(solid_basis(mesh).mesh, skfem.ElementHexS2(), intorder=5)
    K0 = elastic_stiffness(gradient_products(alien, sparsity_pattern(alien)), MATERIAL.lame())
    forces = np.abs(K0 @ rigid_modes(alien.doflocs.T)).max(axis=0) / np.abs(K0).max()
    assert forces[:3].max() < ROUNDING
    assert forces[3:].min() > 1e-5


@LAW
@given(hexahedra())
def test_rigid_modes_cause_no_stress(mesh: SolidMesh) -> None:
    link = solid(mesh)
    rows = point_rows(link, "here", link.X[link.basis.element_dofs[:, 0]].mean(axis=0)).stress
    assert np.abs(rows @ rigid_modes(link.X)).max() < 1e-11 * np.abs(rows.toarray()).max()


@LAW
@given(hexahedra())
def test_stiffness_and_mass_are_symmetric_to_the_bit(mesh: SolidMesh) -> None:
    """Factors read one half alone: what the other has of rounding would be missing of the work of forces."""
    link = solid(mesh)
    for A in (link.K0, link.mass[0]):
        assert (A != A.T).nnz == 0


@settings(LAW, max_examples=examples(6))  # the vector form is slow
@given(hexahedra(), st.floats(-0.5, 0.45))
def test_stiffness_is_that_of_the_vector_form(mesh: SolidMesh, nu: float) -> None:
    """Six scalar matrices against scikit-fem's own linear elasticity on the vector-valued element."""
    basis = solid_basis(mesh)
    lame = (nu / ((1 + nu) * (1 - 2 * nu)), 1 / (2 * (1 + nu)))  # E = 1 Pa
    K0 = elastic_stiffness(gradient_products(basis, sparsity_pattern(basis)), lame).toarray()
    vector = skfem.Basis(basis.mesh, skfem.ElementVector(basis.elem), quadrature=basis.quadrature)
    K = linear_elasticity(*lame).assemble(vector).toarray()
    here = np.empty(len(K), int)
    for component in range(3):
        here[vector.element_dofs[component::3]] = 3 * basis.element_dofs + component
    np.testing.assert_allclose(K0[np.ix_(here, here)], K, atol=ROUNDING * np.abs(K).max())


def test_principal_stresses_are_eigenvalues_in_all_axes() -> None:
    """Of drawn stresses of many sizes, and of all that have two equal ones, or three."""
    rng = np.random.default_rng(3)
    special = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [-1, 0, 0], [-1, -1, 0], [1, 1, 1], [1, -1, 0], [2, 1, 1]]
    S = rng.standard_normal((500, 6)) * 10.0 ** rng.uniform(-30, 12, (500, 1))
    S = np.concatenate([S, np.c_[np.array(special, float), np.zeros((8, 3))]])
    T = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    full = np.zeros((len(S), 3, 3))
    for k, (i, j) in enumerate(COMPONENTS):
        full[:, i, j] = full[:, j, i] = S[:, k]
    size = np.abs(S).max(axis=1, keepdims=True) + 1e-300
    turned = T @ full @ T.T
    components = np.stack([turned[:, i, j] for i, j in COMPONENTS], axis=1)
    assert_allclose(rotated_stress(S, T) / size, components / size, atol=1e-14)
    expected = np.linalg.eigvalsh(full)[:, [0, 2]]
    for stress in (S, components):  # the angle of Lode loses half of the digits where two are equal
        assert_allclose(principal_stresses(stress) / size, expected / size, atol=1e-7)
    assert np.isnan(principal_stresses(np.full((2, 6), np.nan))).all()
