"""Curves as polynomials between their points."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from kedfem.arrays import Float
from kedfem.scene.records.curves import Curve

Values = Float[np.ndarray, " t"]


@dataclass(frozen=True, slots=True, eq=False)
class Pieces:
    """A curve as cubics: piece k starts at at[k]; constant before the first, or periodic.

    at : (n,) starts of the pieces
    coefficients : (n, 4) of powers of x − at, the constant first
    period : period of the curve; 0 without one
    """

    at: Float[np.ndarray, " n"] = field(default_factory=lambda: np.zeros(0))
    coefficients: Float[np.ndarray, "n 4"] = field(default_factory=lambda: np.zeros((0, 4)))
    period: float = 0.0

    @property
    def negative(self) -> Pieces:
        """The curve with the opposite sign: a pull acts against its distance."""
        return replace(self, coefficients=-self.coefficients)

    @property
    def steepest(self) -> float:
        """Largest absolute slope at the ends and middles of the pieces."""
        ends = np.append(self.at[1:], self.at[:1] + self.period if self.period else self.at[-1:])
        places = np.concatenate([self.at, (self.at + ends) / 2, np.nextafter(ends, self.at)])
        return float(np.abs(self(places)[1]).max(initial=0.0))

    def __call__(self, x: Values) -> tuple[Values, Values]:
        """Values (t,) and slopes (t,) at places x (t,)."""
        held = x <= self.at[0]
        if self.period:
            x, held = self.at[0] + np.mod(x - self.at[0], self.period), np.zeros_like(held)
        k = np.maximum(np.searchsorted(self.at, x, side="right") - 1, 0)
        a, b, c, d = np.moveaxis(self.coefficients[k], -1, 0)
        s = np.where(held, 0.0, x - self.at[k])
        return a + s * (b + s * (c + s * d)), np.where(held, 0.0, b + s * (2.0 * c + s * 3.0 * d))


def pieces(curve: Curve) -> Pieces:
    """A curve's polynomials: straight lines, or monotone cubics, which do not overshoot and have no corners.

    The cubics are those of F. N. Fritsch and J. Butland (SIAM J. Sci. Stat. Comput. 5, 1984); periodic curves have no
    corner at the period either.
    """
    at, value = np.array(curve.at, float), np.array(curve.value, float)
    period = curve.period or 0.0
    c = np.zeros((len(at), 4))
    c[:, 0] = value
    ends, heights = (np.append(at, at[0] + period), np.append(value, value[0])) if period else (at, value)
    wide = np.flatnonzero(np.diff(ends) > 0.0)  # not the last of a table that includes the end of its period
    c[wide, 1] = np.diff(heights)[wide] / np.diff(ends)[wide]
    if curve.interpolation == "smooth" and len(at) > 1:
        c[wide] = _smooth(ends, heights, period)[wide]
    return Pieces(at, c, period)


def _smooth(at: Values, value: Values, period: float) -> Float[np.ndarray, "n 4"]:
    """Coefficients of monotone cubics between points; for a periodic curve the middle one of three periods."""
    n = len(at) - 1
    if not period:
        return _monotone(at, value)
    x = np.concatenate([at[:-1] - period, at[:-1], at + period])
    y = np.concatenate([value[:-1], value[:-1], value])
    apart = np.append(True, np.diff(x) > 1e-12 * period)
    found = np.zeros((len(x) - 1, 4))
    found[np.flatnonzero(apart[1:])] = _monotone(x[apart], y[apart])
    return found[n : 2 * n]


def _monotone(at: Values, value: Values) -> Float[np.ndarray, "n 4"]:
    from scipy.interpolate import PchipInterpolator

    with np.errstate(over="ignore"):  # 1/slope of nearly equal values, where the slope is zero
        return np.asarray(PchipInterpolator(at, value).c[::-1].T)
