"""Curves as polynomials between their points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from kedfem.scene.records.curves import Curve

Values = Float[np.ndarray, " t"]


@dataclass(frozen=True, slots=True)
class Pieces:
    """A curve as cubics: piece k from at[k] on, the last one beyond; held before the first, or repeated.

    at : (n,) where they begin
    coefficients : (n, 4) of powers of x − at, the constant first
    period : after which the curve repeats itself; 0: not
    """

    at: tuple[float, ...] = ()
    coefficients: tuple[tuple[float, float, float, float], ...] = ()
    period: float = 0.0

    def __call__(self, x: float) -> tuple[float, float]:
        """Value and slope at a place."""
        if self.period:
            x = self.at[0] + (x - self.at[0]) % self.period
        elif x <= self.at[0]:
            return self.coefficients[0][0], 0.0
        k = int(np.searchsorted(self.at, x, side="right")) - 1
        a, b, c, d = self.coefficients[k]
        s = x - self.at[k]
        return a + s * (b + s * (c + s * d)), b + s * (2.0 * c + s * 3.0 * d)


def pieces(curve: Curve) -> Pieces:
    """A curve's polynomials: straight, or the monotone cubics of F. N. Fritsch and J. Butland (SIAM J. Sci. Stat. Comput.
    5, 1984), which nowhere pass beyond the values and have no corners, where it repeats itself neither.
    """
    at, value = np.array(curve.at, float), np.array(curve.value, float)
    period = curve.period or 0.0
    c = np.zeros((len(at), 4))
    c[:, 0] = value
    ends, heights = (np.append(at, at[0] + period), np.append(value, value[0])) if period else (at, value)
    wide = np.flatnonzero(np.diff(ends) > 0.0)  # not the last of a table that ends where it begins anew
    c[wide, 1] = np.diff(heights)[wide] / np.diff(ends)[wide]
    if curve.interpolation == "smooth" and len(at) > 1:
        c[wide] = _smooth(ends, heights, period)[wide]
    return Pieces(tuple(at.tolist()), tuple((a, b, c2, d) for a, b, c2, d in c.tolist()), period)


def _smooth(at: Values, value: Values, period: float) -> Float[np.ndarray, "n 4"]:
    """Coefficients of monotone cubics between points, those of a curve that repeats itself over three periods."""
    from scipy.interpolate import PchipInterpolator

    n = len(at) - 1
    if not period:
        return np.asarray(PchipInterpolator(at, value).c[::-1].T)
    x = np.concatenate([at[:-1] - period, at[:-1], at + period])
    y = np.concatenate([value[:-1], value[:-1], value])
    apart = np.append(True, np.diff(x) > 1e-12 * period)
    found = np.zeros((len(x) - 1, 4))
    found[np.flatnonzero(apart[1:])] = PchipInterpolator(x[apart], y[apart]).c[::-1].T
    return found[n : 2 * n]
