"""Nested dissection by coordinates: separators separate, thick bodies have less fill, and solutions stay the same."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose, assert_array_equal
from scipy.sparse.csgraph import connected_components

from kedfem.dynamics.matrices import cholesky, dissection
from kedfem.dynamics.matrices.cholesky import Cholesky, laid_out
from kedfem.dynamics.matrices.dissection import dissected
from tests.moving import inverted, ran, state


def grid(*counts: int, d: int = 1) -> tuple[sp.csr_array, np.ndarray]:
    """A definite matrix of d unknowns a node that couples each node of a grid with all 26 around it; its nodes."""
    lines = [sp.diags_array([1.0, 2.0, 1.0], offsets=[-1, 0, 1], shape=(k, k)) for k in counts]
    joined = sp.kron(sp.kron(lines[0], lines[1]), lines[2])
    A = sp.kron(sp.diags_array(joined.sum(axis=1) + 0.1) - joined, np.eye(d) + 0.1)
    X = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)
    return sp.csr_array(A), X.astype(float)


def order_of(A: sp.csr_array, X: np.ndarray) -> np.ndarray:
    order = dissected(A, X)
    assert order is not None
    return order


@pytest.mark.parametrize("turned", [False, True])
def test_unknowns_of_a_node_follow_each_other(turned: bool) -> None:
    A, X = grid(9, 9, 17, d=3)
    if turned:  # no plane of nodes is at right angles to an axis
        X = X @ np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))[0]
    nodes = order_of(A, X).reshape(-1, 3)
    assert_array_equal(nodes % 3, np.tile([0, 1, 2], (len(X), 1)))
    assert_array_equal(np.sort(nodes[:, 0]) // 3, np.arange(len(X)))


@pytest.mark.parametrize("counts", [(9, 9, 17), (17, 9, 9), (8, 20, 10)])
def test_the_last_nodes_are_a_cross_section(counts: tuple[int, ...]) -> None:
    """A cross-section across the longest side separates a grid into halves, and no node of it can be spared."""
    A, X = grid(*counts)
    order, section = order_of(A, X), int(np.prod(np.sort(counts)[:2]))
    for separator, parts in ((section, 2), (section - 1, 1)):
        rest = order[:-separator]
        assert connected_components(A[rest][:, rest])[0] == parts
    rest = order[:-section]
    assert np.bincount(connected_components(A[rest][:, rest])[1]).min() >= 0.4 * len(rest)


def test_nodes_in_one_place_have_an_order_too() -> None:
    A, X = grid(9, 9, 17)
    assert_array_equal(np.sort(order_of(A, 0 * X)), np.arange(len(X)))


@pytest.mark.parametrize("counts", [(3, 20, 60), (5, 5, 100)])
def test_thin_bodies_are_left_to_minimum_degree(counts: tuple[int, ...]) -> None:
    """Plates and bars: separators of 3 · 20 of 3,600 nodes, 5 · 5 of 2,500, are below 0.4 n^⅔."""
    assert dissected(*grid(*counts)) is None


def test_a_thick_body_is_factored_with_less_fill_and_solved_as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fill of a cube of n nodes grows as n^(4/3) in this order, George (1973), by minimum degree faster."""
    A, X = grid(20, 20, 20)
    N = len(X)
    monkeypatch.setattr(cholesky, "SLOW", N)
    plain, ordered = Cholesky(A, "cube"), Cholesky(A, "cube", X)
    assert laid_out(plain.factor, N) > 1.3 * laid_out(ordered.factor, N)
    B = np.random.default_rng(2).standard_normal((N, 3))
    b = B[:, 0]
    x = ordered.solve(b).copy()
    assert np.abs(A @ x - b).max() < 1e-12 * np.abs(b).max() * N**0.5
    assert_allclose(x, plain.solve(b), rtol=0, atol=1e-11 * np.abs(x).max())
    assert_allclose(ordered.solve_many(B), plain.solve_many(B), rtol=0, atol=1e-11 * np.abs(x).max())


def test_the_order_with_less_fill_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    """A bad order is offered: CHOLMOD takes its own."""
    A, X = grid(12, 12, 12)
    monkeypatch.setattr(cholesky, "SLOW", 0)
    plain = Cholesky(A, "cube")
    monkeypatch.setattr(cholesky, "dissected", lambda A, X: np.random.default_rng(3).permutation(len(X)))
    assert laid_out(Cholesky(A, "cube", X).factor, len(X)) <= laid_out(plain.factor, len(X))


def given_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """All solids are dissected, and CHOLMOD takes that order however much fill it leaves."""
    library = cholesky.cholmod

    def symbolic(A: Any, **order: Any) -> Any:
        monkeypatch.setitem(library.options, "nmethods", int(bool(order)))
        return library.symbolic(A, **order)

    monkeypatch.setitem(library.options, "nmethods", 0)
    monkeypatch.setattr(cholesky, "cholmod", SimpleNamespace(**vars(library) | {"symbolic": symbolic}))
    monkeypatch.setattr(cholesky, "SLOW", 0)
    monkeypatch.setattr(dissection, "THICK", 0.0)


def test_steps_are_those_of_the_former_order(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("numba")
    raw = inverted("solid", "revolute", revolutions=1 / 36, initial="rest")
    for link in raw["links"].values():
        link["reduction"] = "none"
        link["mesh"] = {"elements": [4, 3, 3]}
    _, former = ran(raw)
    given_alone(monkeypatch)
    _, ordered = ran(raw)
    for k in range(3):
        one, other = (state(blocks, k, "u") for blocks in (former, ordered))
        assert_allclose(one, other, rtol=0, atol=1e-9 * np.abs(other).max())
        assert (one != other).any()  # two orders


def test_a_small_body_is_not_dissected(monkeypatch: pytest.MonkeyPatch) -> None:
    A, X = grid(5, 5, 5)
    monkeypatch.setattr(cholesky, "dissected", lambda A, X: pytest.fail("dissected"))
    assert_allclose(A @ Cholesky(A, "cube", X).solve(np.ones(len(X))), 1.0, rtol=1e-12)
