"""Laws of elements of beams in space whose strains are changes of metric: none in any rigid motion."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from kedfem.links.beams.metric import beam_element, node_rotations, pulled_back, strains_of
from kedfem.links.beams.section import rectangle
from kedfem.links.beams.spatial_beam import rigidities, space_strains
from kedfem.links.record import BeamElement
from tests.laws.strategies import LAW, MATERIAL, Motion, motions, seeds
from tests.laws.test_spatial_beams import elements

RIGIDITY = rigidities(rectangle(0.05, 0.03), MATERIAL.youngs_modulus, MATERIAL.shear_modulus)


def element_of(x: np.ndarray, seed: int) -> tuple[BeamElement, np.ndarray, np.ndarray]:
    """An element of these nodes, ends first, some of them corners; its functions X, and which are values."""
    random, m = np.random.default_rng(seed), len(x)
    order, rows, one = np.array([0, m - 1, *range(1, m - 1)]), [], []
    for a in np.argsort(order):
        corner = bool(random.integers(2))
        triad = Rotation.random(random_state=random).as_matrix() if corner else x[a, 1:]
        rows += [x[a, 0], *triad]
        one += [1.0] + [0.0] * len(triad)
    X = np.array(rows)
    return beam_element(x, X, np.array(one), order, RIGIDITY), X, np.array(one)


@LAW
@given(elements(), seeds, motions)
def test_no_rigid_motion_of_any_size_strains_an_element(x: np.ndarray, seed: int, motion: Motion) -> None:
    element, X, one = element_of(x, seed)
    moved = X @ motion.R.T + np.outer(one, motion.v)
    assert_allclose(strains_of(element, moved), 0, atol=1e-12 * (1 + np.abs(moved).max()))


@LAW
@given(elements(), seeds)
def test_small_strains_are_the_linear_ones_of_rigid_cross_sections(x: np.ndarray, seed: int) -> None:
    """u and p, q = θ × n1, θ × n2: `space_strains` at the Gauss points, none within sections; right inverse `share`."""
    element, X, one = element_of(x, seed)
    random, m = np.random.default_rng(seed), len(x)
    u, theta = random.normal(size=(2, m, 3))
    state = np.zeros_like(X)
    order = np.array([0, m - 1, *range(1, m - 1)])
    state[np.flatnonzero(one)[order]] = u
    turned = np.array([np.cross(theta[a], X) for a in element.node])  # (K, n, 3)
    for k, of in enumerate(element.gradients.argmax(axis=1)):
        state[of] = turned[k, of]
    fields = np.stack([u, np.cross(theta, x[:, 1]), np.cross(theta, x[:, 2])], axis=1)
    points = np.polynomial.legendre.leggauss(m - 1)[0]
    wanted = [np.einsum("smfc,mfc->s", space_strains(x, float(r))[0], fields) for r in points]
    got = element.rows @ state.ravel()
    assert_allclose(got[: 6 * len(points)], np.concatenate(wanted), atol=1e-11 * np.abs(element.rows).max())
    assert_allclose(got[6 * len(points) :], 0, atol=1e-12)
    assert_allclose(element.rows @ element.share, np.eye(len(got)), atol=1e-9)


@LAW
@given(elements(), seeds, st.floats(0.01, 0.3))
def test_forces_are_the_gradient_of_the_strain_energy_far_from_the_drawn_shape(
    x: np.ndarray, seed: int, size: float
) -> None:
    """Differences of fourth order; and a force on the elements does no work on rigid motions."""
    element, X, one = element_of(x, seed)
    random = np.random.default_rng(seed)
    y = X + size * random.uniform(-1, 1, X.shape)
    way = random.normal(size=X.shape)

    def energy(step: float) -> float:
        strains = strains_of(element, y + step * way)
        return float(0.5 * strains @ (element.stiffness * strains))

    h = 1e-3 * size
    slope = (8 * (energy(h) - energy(-h)) - (energy(2 * h) - energy(-2 * h))) / (12 * h)
    force = pulled_back(element, y, element.stiffness * strains_of(element, y))
    scale = np.abs(force).max() * np.abs(way).max()
    assert abs(slope - np.vdot(force, way)) < 1e-6 * scale
    assert_allclose(one @ force, 0, atol=1e-12 * np.abs(force).max())
    moment = np.cross(y, force).sum(axis=0)
    assert_allclose(moment, 0, atol=1e-11 * np.abs(force).max() * np.abs(y).max())


@LAW
@given(elements(), seeds)
def test_strains_within_sections_leave_the_beam_alone(x: np.ndarray, seed: int) -> None:
    """Gradient functions stretched by a symmetric U turn by nothing, so that the beam has no strain."""
    element, X, _ = element_of(x, seed)
    random, y = np.random.default_rng(seed), X.copy()
    for a in range(len(x)):
        mine = element.gradients[element.node == a].argmax(axis=1)
        e = element.drawn[element.node == a]
        stretch = random.uniform(-0.1, 0.1, (len(mine), len(mine)))
        y[mine] += (stretch + stretch.T) @ e
    assert_allclose(node_rotations(element, element.gradients @ y), np.tile(np.eye(3), (len(x), 1, 1)), atol=1e-12)
    count = 6 * len(element.tangents)
    assert_allclose(strains_of(element, y)[:count], 0, atol=1e-12)
    assert np.abs(strains_of(element, y)[count:]).max() > 1e-3
