"""Krylov spaces of the derivative of a period map: a march over the period a product."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from kedfem.dynamics.system.period_map import PeriodMap
from kedfem.dynamics.system.starts.instant import Flat

WHOLE = 1e-12  # what a new direction adds where a basis holds all that there is
Watch = Callable[[int], None]
"""Told of the periods that were marched so far."""


@dataclass(frozen=True, slots=True)
class Watched:
    """The map, told about."""

    map: PeriodMap
    watch: Watch
    closed: float

    def __call__(self, x: Flat, blow: Sequence[np.ndarray] | None = None) -> Flat:
        """As the map itself."""
        out = self.map(x, blow)
        self.watch(self.map.marches)
        return out

    def product(self, x: Flat, y: Flat, v: Flat, by: float) -> Flat:
        """Φ v at x, of which y = P(x), from the difference that `by` v makes."""
        moved = self.map.possible(x + by * v)
        return self.map.change(self(moved), y) / by


def scale_of(of: PeriodMap, y: Flat) -> float:
    """√ of the largest energy in a period."""
    return float(np.sqrt(of.largest)) + of.size(y)


def combined(c: Flat, basis: Sequence[Flat]) -> Flat:
    """Σ c_i v_i of the first vectors of a basis."""
    out = np.zeros_like(basis[0])
    for k, v in zip(c, basis, strict=False):
        out += k * v
    return out


def arnoldi(
    steps: Watched, at: tuple[Flat, Flat], basis: list[Flat], by: float, most: int
) -> Iterator[Float[np.ndarray, "j1 j"]]:
    """H of Φ V = V₊ H, on an orthonormal basis that grows by a vector, and a march, each time.

    It ends where the basis holds all that there is, after `most` marches at the latest.

    Parameters
    ----------
    at : x and P(x)
    basis : its first vector; the others are added
    by : size of the differences by which Φ is found
    """
    H = np.zeros((most + 1, most))
    for j in range(most):
        w, H[: j + 2, j] = _orthogonal(steps.map, basis, steps.product(*at, basis[j], by))
        yield H[: j + 2, : j + 1]
        if H[j + 1, j] <= WHOLE * max(1.0, np.abs(H[: j + 2, : j + 1]).max()):
            return
        basis.append(w / H[j + 1, j])


def _orthogonal(of: PeriodMap, basis: Sequence[Flat], w: Flat) -> tuple[Flat, Flat]:
    """What is left of w beside a basis, its coefficients there and its size."""
    h = np.zeros(len(basis) + 1)
    for _ in range(2):
        c = of.products(basis, w)
        h[:-1] += c
        w = w - combined(c, basis)
    h[-1] = of.whole(w)
    return w, h
