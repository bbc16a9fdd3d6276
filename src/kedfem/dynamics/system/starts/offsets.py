"""Positions of pins along the lines of their slots and distances from these, as series in time; see `coordinate_rates`.

The place s of the pin as a series makes t · (x − c(s)) zero at each order; n is as in `measures_kernel`.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.system.ends import line_of
from kedfem.dynamics.system.forces.lines import feet, stationed
from kedfem.dynamics.system.record import TURNED, End, Term
from kedfem.dynamics.system.starts.series import Series, inverse, product, root

if TYPE_CHECKING:
    from kedfem.dynamics.system.starts.coordinate_rates import Places


@dataclass(frozen=True, slots=True)
class Foot:
    """The place s of a pin on a line, the tangent there, and the way from the line to the pin, as series."""

    s: Series
    tangent: Series
    away: Series


def foot(x: Float[np.ndarray, "3 3"], end: End, at: "Places", z: Float[np.ndarray, "3 k"]) -> Foot:
    """Where a pin stands square to its line.

    Parameters
    ----------
    x : the pin as a series; end : the line's
    """
    along, R = line_of(end).stations, at.R[:, end.body]
    X = stationed(end, R, at.p[:, end.body], z)
    s = np.array([feet(along, X[:1], x[:1])[0], 0.0, 0.0])
    weights = [along.at(s[:1], k)[0] for k in range(4)]

    def of_line(k: int) -> Series:
        """The line's derivative of order k by s where the pin is."""
        N, first, second = weights[k : k + 3]
        return product(np.dot, np.stack([N, first * s[1], second * s[1] ** 2 + first * s[2]]), X)

    tangent, away = of_line(1), x - of_line(0)
    steep = tangent[0] @ tangent[0] - weights[2] @ X[0] @ away[0]
    for order in (1, 2):
        s[order] += product(np.dot, of_line(1), x - of_line(0))[order] / steep
    return Foot(s, of_line(1), x - of_line(0))


def offset(term: Term, on: Foot, end: End, at: "Places") -> Series:
    """An OFFSET as a series (3,)."""
    R, tangent, away = at.R[:, end.body], on.tangent, on.away
    size = root(product(np.dot, tangent, tangent))
    h = R @ line_of(end).axis + product(np.multiply, tangent, inverse(size)[:, None])
    on_b, on_d = product(np.dot, h, b := R @ term.b), product(np.dot, h, away)
    twice = product(np.dot, h, h)
    if twice[0] < TURNED:
        return np.asarray(product(np.dot, b, away))
    share = product(np.multiply, product(np.multiply, on_b, on_d), inverse(twice))
    return np.asarray(product(np.dot, b, away) - 2 * share)
