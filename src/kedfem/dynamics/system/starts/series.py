"""Time series to second order: arrays (3, …) of a value and its first and second rates."""

from collections.abc import Callable

import numpy as np

from kedfem.arrays import Complex, Float

Series = Float[np.ndarray, "3 *_"] | Complex[np.ndarray, "3 *_"]


def product(of: Callable[..., np.ndarray], a: Series, b: Series) -> Series:
    """A product of two series, linear in both."""
    return np.stack([of(a[0], b[0]), of(a[1], b[0]) + of(a[0], b[1]),
                     of(a[2], b[0]) + 2 * of(a[1], b[1]) + of(a[0], b[2])])  # fmt: skip


def root(x: Series) -> Series:
    """Square root of a series (3,); of a distance of none nothing, as it has no direction in the steps either."""
    r = np.sqrt(x[0])
    if r == 0:
        return np.zeros(3)
    first = x[1] / (2 * r)
    return np.array([r, first, (x[2] / 2 - first**2) / r])


def inverse(x: Series) -> Series:
    """1/x of a series (3,)."""
    return np.array([1 / x[0], -x[1] / x[0] ** 2, 2 * x[1] ** 2 / x[0] ** 3 - x[2] / x[0] ** 2])
