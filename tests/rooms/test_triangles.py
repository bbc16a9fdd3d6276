"""Compiled triangular solves: they solve what was factored, and steps are those of the factorisation's own solves."""

from collections.abc import Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose

pytest.importorskip("numba")

from kedfem.compiled import compiled
from kedfem.dynamics.matrices import cholesky
from kedfem.dynamics.matrices.cholesky import Cholesky, Triangle
from kedfem.dynamics.matrices.triangle_kernel import solved
from kedfem.dynamics.system import sparse
from tests.moving import inverted, ran, state


@compiled
def alone(triangle, b, x, room, out):  # type: ignore[no-untyped-def]
    """`solved`, called."""
    solved(triangle, b, x, room, out)


def arrays(of: Triangle) -> tuple[np.ndarray, ...]:
    return of.first, of.below_at, of.below, of.at, of.L, of.place


def laplacian(n: int, m: int) -> sp.csr_array:
    """Of a grid, definite, with a number on the diagonal that makes each row another."""
    rows, columns = (sp.diags_array([-1.0, 2.0, -1.0], offsets=[-1, 0, 1], shape=(k, k)) for k in (n, m))
    A = sp.kronsum(rows, columns)
    return sp.csr_array(A + sp.diags_array(0.01 * np.arange(1, n * m + 1)))


@pytest.mark.parametrize(("n", "m"), [(1, 1), (1, 2), (3, 1), (5, 7), (13, 11), (40, 23)])
def test_compiled_solves_solve_what_was_factored(n: int, m: int) -> None:
    A = laplacian(n, m)
    b = np.random.default_rng(n).normal(size=n * m)
    triangle, out = Cholesky(A, "grid").taken(), np.empty(n * m)
    alone(arrays(triangle), b, *np.empty((2, n * m)), out)
    # condition numbers up to 1e3 beside 1e-16
    assert_allclose(A @ out, b, rtol=0, atol=1e-12 * np.abs(b).max())


def test_dense_blocks_solve_too() -> None:
    X = np.random.default_rng(0).normal(size=(23, 23))
    A, b = X @ X.T + 23 * np.eye(23), X[0]
    triangle, out = Cholesky(sp.csr_array(A), "block").taken(), np.empty(23)
    assert len(triangle.first) == 2  # one block, of five times four columns and three more
    alone(arrays(triangle), b, *np.empty((2, 23)), out)
    assert_allclose(A @ out, b, rtol=0, atol=1e-12 * np.abs(b).max())


def test_large_matrices_are_factored_and_solved_so_that_an_interruption_ends_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Within two seconds: factoring at once, solves between few right-hand sides, which are as exact."""
    A, B, begun = laplacian(13, 11), np.random.default_rng(0).normal(size=(143, 37)), list[str]()

    @contextmanager
    def watched(words: str) -> Iterator[None]:
        begun.append(words)
        yield

    monkeypatch.setattr(cholesky, "ended_at_once", watched)
    monkeypatch.setattr(cholesky, "LARGE", 0)
    X = Cholesky(A, "grid").solve_many(B)
    assert begun == []
    monkeypatch.setattr(cholesky, "SLOW", 143)
    monkeypatch.setattr(cholesky, "SLOW_SOLVES", 143)
    sizes, spsolve = list[int](), cholesky.cholmod.spsolve

    def counted(factor: Any, block: Any) -> Any:
        sizes.append(block.size[1])
        return spsolve(factor, block)

    monkeypatch.setattr(cholesky, "cholmod", SimpleNamespace(**vars(cholesky.cholmod) | {"spsolve": counted}))
    assert np.array_equal(Cholesky(A, "grid").solve_many(B), X)
    assert begun == ["interrupted while a large matrix was factored"]
    assert max(sizes) == 4


@pytest.mark.parametrize(("frames", "share"), [("rigid-body", 1e-9), ("co-rotational", 1e-8)])
def test_steps_are_those_of_solves_that_stay_with_cholmod(
    frames: str, share: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    raw = inverted("solid", "revolute", frames=frames, revolutions=1 / 36, initial="rest")
    raw["damping"] = {"alpha": 1.0, "beta": 1e-6}
    for link in raw["links"].values():
        link["reduction"] = "none"
    _, taken = ran(raw)
    monkeypatch.setattr(sparse, "TAKEN", 0)
    _, called = ran(raw)
    for k in range(3):
        one, other = (state(blocks, k, "u") for blocks in (taken, called))
        # co-rotational passes end with changes of 1e-9 of what a step moves
        assert_allclose(one, other, rtol=0, atol=share * np.abs(other).max())
        assert (one != other).any()  # two ways
