"""Laws of planar beams, [KED, eqs. (21)(22)]: rows (u, v, ψ), T a rotation about z."""

import numpy as np
import pytest
from hypothesis import given

from kedfem.dynamics.system.monolithic.monolithic_tangent import rotated_stiffness
from kedfem.links.beams.beam import element_mass, element_stiffness, strain_rows
from tests.laws.strategies import (
    LAW,
    LOBATTO,
    MATERIAL,
    Beam,
    Motion,
    beams,
    curved_elements,
    motions,
    planar_rotations,
    seeds,
)
from tests.laws.test_hexahedra import ROUNDING, dense_mass, node_rotation

RIGIDITY = np.array([7e6, 2e6, 900.0])  # (EA, κGA, EI): a 10 mm aluminium bar, roughly; any would do


def plane_modes(x: np.ndarray) -> np.ndarray:
    """Three columns (3n, 3): translations and a small turn of a planar beam, ψ turning along."""
    modes = np.zeros((len(x), 3, 3))
    modes[:, 0, 0] = modes[:, 1, 1] = 1
    modes[:, 0, 2], modes[:, 1, 2], modes[:, 2, 2] = -x[:, 1], x[:, 0], 1
    return modes.reshape(-1, 3)


@LAW
@given(curved_elements())
def test_rigid_modes_strain_nothing_on_straight_and_curved_elements(x: np.ndarray) -> None:
    """ε = γ = κ = 0 at any point of the element, not only where it is integrated; hence no forces."""
    for r in np.linspace(-1, 1, 5):
        rows, det_J = strain_rows(x, r)
        assert det_J > 0
        assert np.abs(rows @ plane_modes(x)).max() < ROUNDING * np.abs(rows).max()
    K = element_stiffness(x, RIGIDITY)
    assert np.abs(K @ plane_modes(x)).max() < ROUNDING * np.abs(K).max()


@LAW
@given(curved_elements(), seeds)
def test_det_J_of_a_beam_is_the_rate_of_its_arc_length(x: np.ndarray, seed: int) -> None:
    """det J = √(x_r² + y_r²), [KED, eq. (22)], against the chord between two points close by."""
    r, h = np.random.default_rng(seed).uniform(-0.9, 0.9), 1e-4
    curve = np.polynomial.polynomial.polyfit(LOBATTO[len(x)], x, len(x) - 1)
    there, here = (np.polynomial.polynomial.polyval(r + s, curve) for s in (h, -h))
    assert strain_rows(x, r)[1] == pytest.approx(np.linalg.norm(there - here) / (2 * h), rel=1e-7)


@LAW
@given(curved_elements())
def test_stiffness_of_a_beam_element_is_semidefinite_with_exactly_three_zeros(x: np.ndarray) -> None:
    K = element_stiffness(x, RIGIDITY)
    assert np.abs(K - K.T).max() < ROUNDING * np.abs(K).max()
    values = np.linalg.eigvalsh(K)
    assert np.abs(values[:3]).max() < ROUNDING * values[-1]
    assert values[3] > 1e-7 * values[-1]  # EI/L² against EA, far above rounding


@LAW
@given(curved_elements(), planar_rotations)
def test_matrices_of_a_turned_beam_element_are_the_turned_matrices(x: np.ndarray, R: np.ndarray) -> None:
    """m does not change (12), K = T K0 Tᵀ (14), on curved elements too."""
    K, T = element_stiffness(x, RIGIDITY), np.kron(np.eye(len(x)), R)
    turned = x @ R[:2, :2].T + [0.3, -0.7]
    np.testing.assert_allclose(element_stiffness(turned, RIGIDITY), T @ K @ T.T, atol=ROUNDING * np.abs(K).max())
    m = element_mass(x)
    np.testing.assert_allclose(element_mass(turned), m, atol=ROUNDING * m.max())
    assert np.linalg.eigvalsh(m).min() > 0


@LAW
@given(beams(), planar_rotations)
def test_mass_of_a_beam_is_the_same_in_every_frame_and_of_the_right_sum(beam: Beam, R: np.ndarray) -> None:
    """T M Tᵀ = M (12); Σ = ρAL in translation and ρIL in rotation, [KED, eq. (22)]."""
    link, section = beam.link(), beam.section
    M, T = dense_mass(link), node_rotation(link, R)
    np.testing.assert_allclose(T @ M @ T.T, M, atol=ROUNDING * M.max())
    np.testing.assert_allclose(dense_mass(beam.link(R)), M, atol=ROUNDING * M.max())
    assert np.linalg.eigvalsh(M).min() > 0
    assert np.abs(M - M.T).max() == 0
    per_length = MATERIAL.density * np.array([section.area, section.area, section.second_moment])
    np.testing.assert_allclose([m.sum() for m in link.mass], per_length * beam.length, rtol=1e-12)
    assert section.second_moment == pytest.approx(section.thickness * section.height**3 / 12)


@LAW
@given(beams(), planar_rotations)
def test_stiffness_of_a_beam_turns_with_it_and_has_three_zeros(beam: Beam, R: np.ndarray) -> None:
    link = beam.link()
    K0 = link.K0.toarray()
    T, cap = node_rotation(link, R), ROUNDING * np.abs(K0).max()
    K = rotated_stiffness(link.K0, R).toarray()
    np.testing.assert_allclose(K, T @ K0 @ T.T, atol=cap)
    np.testing.assert_allclose(beam.link(R).K0.toarray(), K, atol=10 * cap)
    assert np.abs(K0 @ plane_modes(link.X)).max() < 10 * cap
    values = np.linalg.eigvalsh(K0)
    assert np.abs(values[:3]).max() < ROUNDING * values[-1]
    assert values[3] > 1e-9 * values[-1]  # slender: EI/L³ of the whole beam against EA/h of one element


@LAW
@given(beams(), motions)
def test_strain_energy_of_a_beam_does_not_depend_on_the_frame(beam: Beam, motion: Motion) -> None:
    """½ δᵀ K δ = ½ gᵀ K0 g with δ = T g, [KED, eq. (13)]."""
    link, angle = beam.link(), motion.omega[0]
    R = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    g = np.cos(np.arange(3 * link.n) + motion.p[0]).reshape(-1, 3)
    delta = (g @ R.T).ravel()
    energy = g.ravel() @ link.K0 @ g.ravel() / 2
    assert delta @ rotated_stiffness(link.K0, R) @ delta / 2 == pytest.approx(energy, rel=1e-12)
