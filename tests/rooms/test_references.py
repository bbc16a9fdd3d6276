"""Records handed on by address in compiled code are the records themselves."""

from typing import Any, NamedTuple

import numpy as np
import pytest

pytest.importorskip("numba")

from kedfem.compiled import compiled, inner
from kedfem.dynamics.system.reference import reference


class Inside(NamedTuple):
    """A record in a record."""

    numbers: Any
    flag: Any


class Outside(NamedTuple):
    """Numbers, arrays, tuples and records."""

    factor: float
    whether: bool
    rates: Any
    grid: Any
    inside: Any


@inner
def filled(x):  # type: ignore[no-untyped-def]
    """The grid becomes what the other attributes say."""
    for i in range(x.grid.shape[0]):
        for j in range(x.grid.shape[1]):
            x.grid[i, j] = x.factor * x.inside.numbers[i] + x.rates[j] + (100.0 if x.whether else 0.0)
    x.inside.flag[0] = True


@compiled
def outer(x):  # type: ignore[no-untyped-def]
    """Hands its record on."""
    filled(reference(x))


def test_what_a_reference_writes_is_in_the_arrays_of_the_record() -> None:
    x = Outside(2.0, True, (1.0, 2.0), np.zeros((3, 2)), Inside(np.arange(3), np.zeros(1, bool)))
    outer(x)
    np.testing.assert_array_equal(x.grid, 2.0 * np.arange(3)[:, None] + [1.0, 2.0] + 100.0)
    assert x.inside.flag[0]
    y = x._replace(whether=False, rates=(0.0, 0.0))
    outer(y)
    np.testing.assert_array_equal(y.grid, 2.0 * np.arange(3)[:, None] + np.zeros(2))
