"""Laws of the bounds of det J: below every sample, sharp for affine elements, positive only where elements are valid."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from kedfem.errors import MeshError
from kedfem.mesh import SolidMesh, checked_mesh, mesh_quality
from kedfem.mesh.elements.bounds import determinant_bounds, valid_everywhere
from kedfem.mesh.elements.shape_functions import HEX8, HEX20, HEX27, NODES, QUAD9, TET10, shape_gradients
from tests.laws.strategies import LAW, hexahedra, seeds

KINDS = st.sampled_from([HEX8, TET10, HEX20, HEX27, QUAD9])
ROUNDING = 1e-11  # of the mean of |det J|: 216 terms, and a change of basis whose condition is near 1e3


def elements(nodes: np.ndarray, size: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Twenty elements apart from each other, all nodes moved at random by at most `size`."""
    moves = np.random.default_rng(seed).uniform(-size, size, (20, *nodes.shape))
    return (nodes + moves).reshape(-1, nodes.shape[1]), np.arange(20 * len(nodes)).reshape(20, -1)


def sampled(points: np.ndarray, cells: np.ndarray, count: int = 13) -> np.ndarray:
    """det J on a grid of count^d places that holds the corners, by the nodes' gradients; (e, q)."""
    nodes = NODES[cells.shape[1]]
    gradients = shape_gradients(nodes, grid(nodes, np.linspace(-1, 1, count)))
    return np.linalg.det(np.einsum("eak,qaj->eqkj", points[cells], gradients))


def grid(nodes: np.ndarray, line: np.ndarray) -> np.ndarray:
    """Places in an element, of a tetrahedron those of its cube that are in it too."""
    places = np.stack(np.meshgrid(*[line] * nodes.shape[1], indexing="ij"), axis=-1).reshape(-1, nodes.shape[1])
    if len(nodes) != len(TET10):
        return places
    return ((places + 1) / 2)[places.sum(axis=1) <= -1 + 1e-12]


@LAW
@given(KINDS, st.floats(0.0, 0.5), seeds)
def test_lower_bound_is_below_every_sample_and_the_upper_is_reached(nodes, size, seed):
    points, cells = elements(nodes, size, seed)
    lower, upper = determinant_bounds(points, cells)
    values = sampled(points, cells)
    scale = abs(values).mean(axis=1)  # near the scale of the bounds, whose samples are others
    assert (lower <= upper + ROUNDING).all()
    signs = values.min(axis=1) / scale
    assert (signs[lower > 0] > 0).all()
    assert (signs[upper <= 0] < 0.02).all()  # 13 samples a direction can miss a dip between them
    first_lower, first_upper = determinant_bounds(points, cells, depth=0)
    assert (first_lower <= lower + ROUNDING).all()
    assert (upper <= first_upper + ROUNDING).all()


@LAW
@given(KINDS, st.floats(0.0, 0.4), seeds)
def test_without_halving_the_bound_is_below_the_least_sample(nodes, size, seed):
    points, cells = elements(nodes, size, seed)
    lower, _ = determinant_bounds(points, cells, depth=0)
    values = sampled(points, cells)
    if len(nodes) <= 10:  # the scale is the mean over the places that are sampled inside; of these only the sign
        assert (values.min(axis=1)[lower > 0] > 0).all()
        return
    ends = -np.cos(np.pi * np.arange(6) / 5)
    J = np.einsum("eak,qaj->eqkj", points[cells], shape_gradients(nodes, grid(nodes, ends)))
    scale = abs(np.linalg.det(J)).mean(axis=1)
    assert (lower <= values.min(axis=1) / scale + ROUNDING).all()


@LAW
@given(KINDS, seeds)
def test_is_sharp_for_affine_elements(nodes, seed):
    d = nodes.shape[1]
    A = np.random.default_rng(seed).uniform(-1, 1, (d, d))
    sign = np.sign(np.linalg.det(A))
    lower, upper = determinant_bounds(nodes @ A.T, np.arange(len(nodes))[None])
    condition = np.abs(A).max() ** d / abs(np.linalg.det(A))
    assert_allclose([lower[0], upper[0]], sign, rtol=ROUNDING * condition)


@LAW
@given(hexahedra(), st.floats(1e-4, 1e4))
def test_does_not_depend_on_the_unit_of_length(mesh, unit):
    for one, other in zip(
        determinant_bounds(mesh.points, mesh.cells), determinant_bounds(unit * mesh.points, mesh.cells), strict=True
    ):
        assert_allclose(one, other, rtol=1e-9, atol=ROUNDING)


@LAW
@given(KINDS, st.floats(0.0, 0.35), seeds)
def test_cheap_test_passes_nothing_that_the_bounds_do_not(nodes, size, seed):
    points, cells = elements(nodes, size, seed)
    assert (valid_everywhere(points, cells) == (determinant_bounds(points, cells)[0] > 0)).all()


def folded_between() -> SolidMesh:
    """A hex27 with a scaled Jacobian of 0.28 at its nodes and Gauss points and det J < 0 between: one of 6,000 tried."""
    moves = np.random.default_rng(4193).uniform(-0.3, 0.3, HEX27.shape)
    return SolidMesh(HEX27 + moves, np.arange(27)[None])


def test_an_element_folded_between_the_places_that_are_sampled_is_refused():
    mesh = folded_between()
    assert mesh_quality(mesh).least > 0.28
    assert sampled(mesh.points, mesh.cells, 41).min() < -0.08
    with pytest.raises(MeshError, match="must not be inverted or folded anywhere, got det J that is not positive"):
        checked_mesh("links.arm", mesh, 0.1)


def test_elements_without_volume_are_not_valid():
    assert not valid_everywhere(HEX8 * [1.0, 1.0, 0.0], np.arange(8)[None]).any()
    assert not valid_everywhere(HEX27 * [1.0, 1.0, 0.0], np.arange(27)[None]).any()
    assert not valid_everywhere(HEX27 * [1.0, 1.0, -1.0], np.arange(27)[None]).any()
