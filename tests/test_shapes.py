"""Array shapes in annotations are checked while the tests run: arguments, results, and results against arguments."""

import numpy as np
import pytest
from jaxtyping import Float, TypeCheckError

from kedfem.links.record import mass_times
from tests.conftest import CALLS, FIRST, jaxtyped_arrays, shapes_checked

checked = jaxtyped_arrays(shapes_checked)


@checked
def first(u: Float[np.ndarray, "n 3"], m: Float[np.ndarray, " n"], rows: int) -> Float[np.ndarray, "n 3"]:
    return u[:rows] * m[:rows, None]


def test_right_shapes_pass() -> None:
    assert first(np.ones((4, 3)), np.ones(4), 4).shape == (4, 3)


@pytest.mark.parametrize(
    ("u", "m", "rows"),
    [
        (np.ones((4, 2)), np.ones(4), 4),
        (np.ones((4, 3)), np.ones(5), 4),
        (np.ones((4, 3), int), np.ones(4), 4),
        (np.ones((4, 3)), np.ones(4), 2),
    ],
    ids=["argument", "argument against argument", "kind of number", "result against argument"],
)
def test_wrong_ones_do_not(u: np.ndarray, m: np.ndarray, rows: int) -> None:
    with pytest.raises(TypeCheckError):
        first(u, m, rows)


def test_the_first_calls_of_each_test_are_checked() -> None:
    for _ in range(FIRST):
        first(np.ones((4, 3)), np.ones(4), 4)
    first(np.ones((4, 2)), np.ones(4), 4)
    assert CALLS
    CALLS.clear()  # as before each test
    with pytest.raises(TypeCheckError):
        first(np.ones((4, 2)), np.ones(4), 4)


def test_what_has_no_arrays_costs_nothing() -> None:
    def plain(x: int) -> str:
        return str(x)

    assert checked(plain) is plain


def test_the_package_is_checked() -> None:
    with pytest.raises(TypeCheckError, match="mass_times"):
        mass_times((), np.zeros(3))
