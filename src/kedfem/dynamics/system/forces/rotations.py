"""Rotation vectors of one end against another and of the tilt of an axis, and moments by their components, at many times.

The formulas are those of `measures_kernel`. arccos(c) / √(1 − c²), which is t / sin t at c = cos t, is a power series of
(1 − c)/2 near c = 1.
"""

import numpy as np

from kedfem.arrays import Float
from kedfem.vectors import cross

NEAR = 0.5  # c from which on the series is taken: what 32 of its terms leave is rounding
SERIES = np.polynomial.Polynomial(np.cumprod([1.0, *((2 * n + 2) / (2 * n + 3) for n in range(31))]))
LEAST = 1e-3  # half angle below which (1 − x cot x) / x² is what it is there, but for 1e-7 of a third

Vectors = Float[np.ndarray, "T 3"]
Orientations = Float[np.ndarray, "T 3 3"]


def arc(c: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """arccos(c) / √(1 − c²) and its first two derivatives; of complex c only near one."""
    c = np.asarray(c)
    y = np.where(c.real < NEAR, NEAR / 2, (1 - c) / 2)
    f0, f1, f2 = SERIES(y), -SERIES.deriv()(y) / 2, SERIES.deriv(2)(y) / 4
    x = np.clip(c.real, -1.0, NEAR)
    square = 1 - x * x
    g0 = np.arccos(x) / np.sqrt(square)
    g1 = (x * g0 - 1) / square
    g2 = (g0 + 3 * x * g1) / square
    return tuple(np.where(c.real < NEAR, g, f) for g, f in ((g0, f0), (g1, f1), (g2, f2)))  # type: ignore[return-value]


def rotation_moment(Q_i: Orientations, Q_j: Orientations, b: Vectors) -> Vectors:
    """Gradient of b · θ by the rotation of i, b fixed in j; all in world components."""
    trace, twice = (Q_i * Q_j).sum(axis=(1, 2)), cross(Q_j.swapaxes(1, 2), Q_i.swapaxes(1, 2)).sum(axis=1)
    cosine = np.sqrt(1 + trace) / 2
    theta = (arc(cosine)[0] / (2 * cosine))[:, None] * twice
    x = np.maximum(np.linalg.norm(theta, axis=1) / 2, LEAST)[:, None]
    once = cross(theta, b)
    return np.asarray(b + once / 2 + (1 - x / np.tan(x)) / (2 * x) ** 2 * cross(theta, once))


def tilt_moment(a: Vectors, n: Vectors, b: Vectors) -> Vectors:
    """The same of the shortest rotation from n, fixed in j, to a, fixed in i."""
    across = cross(b, n)
    f, slope, _ = (x[:, None] for x in arc((a * n).sum(axis=1)))
    return np.asarray(f * cross(a, across) + slope * (a * across).sum(axis=1)[:, None] * cross(a, n))
