"""Records handed to compiled code by address are the records themselves."""

from typing import Any, NamedTuple

import numpy as np
import pytest

pytest.importorskip("numba")

from kedfem.compiled import compiled, inner
from kedfem.dynamics.system.reference import by_address


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
    filled(x)


def test_what_is_written_by_a_record_s_address_is_in_the_arrays_of_the_record() -> None:
    x = Outside(2.0, True, (1.0, 2.0), np.zeros((3, 2)), Inside(np.arange(3), np.zeros(1, bool)))
    outer(by_address(x))
    np.testing.assert_array_equal(x.grid, 2.0 * np.arange(3)[:, None] + [1.0, 2.0] + 100.0)
    assert x.inside.flag[0]
    y = x._replace(whether=False, rates=(0.0, 0.0))
    outer(by_address(y))
    np.testing.assert_array_equal(y.grid, 2.0 * np.arange(3)[:, None] + np.zeros(2))


class Record(NamedTuple):
    """Of all that records have."""

    a: Any
    h: float
    place: Any
    whether: bool
    inside: Inside
    rates: Any
    count: int
    last: Any


@compiled
def read(record, which):  # type: ignore[no-untyped-def]
    """One number of a record."""
    total = record.h if record.whether else -record.h
    if which == 1:
        return total + record.a[2, 1] + record.place[1][0] + record.inside.numbers[1, 0, 1] + record.rates[2]
    return total + record.count + record.last[-1] + record.inside.flag[1] + record.place[0][3] + len(record.last)


def test_a_record_is_handed_on_as_it_is() -> None:
    x = np.random.default_rng(1).standard_normal((8, 5))
    for whether in (True, False):
        inside = Inside(x.reshape(2, 4, 5), np.array([3, 4, 5]))
        record = Record(x[:4, :3], 0.5, (x[0], x[:, 1].copy()), whether, inside, (1.0, 2.0, 4.0), 7, np.arange(4.0))
        for which in (1, 2):
            assert read(by_address(record), which) == read.py_func(record, which)
    assert by_address(None) is None
