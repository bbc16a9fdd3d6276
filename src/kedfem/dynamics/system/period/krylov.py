"""Krylov spaces of the derivative of a period map; each product is a march over the period."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.system.period.map import PeriodMap
from kedfem.dynamics.system.starts.instant import Flat

SMALL = 1e-4  # of the size of the state: differences by which Φ of a system that is not linear is found
WHOLE = 1e-12  # what a new direction adds where a basis holds all that there is
Nearer = Callable[[Flat], Flat]
"""r → about (I − Φ)⁻¹ r."""


@dataclass(frozen=True, slots=True)
class Derivative:
    """Φ at x, of which y = P(x), from the difference that `by` times a vector makes: a march a product."""

    map: PeriodMap
    x: Flat
    y: Flat
    by: float

    def __call__(self, v: Flat) -> Flat:
        """Φ v."""
        moved = self.map.possible(self.x + self.by * v)
        return self.map.change(self.map(moved), self.y) / self.by


def scale_of(of: PeriodMap, y: Flat) -> float:
    """√ of the largest energy in a period; where nothing moves, of what is less than any motion that counts.

    Iterations of a step leave open as much as the floor, which must be no more of that than their tolerance.
    """
    c = of.of.c
    least = c.floor * 2 * np.pi / of.period if of.linear else c.floor / (c.tolerance * c.h)
    return float(np.sqrt(of.largest)) + of.size(y) + least


def combined(c: Flat, basis: Sequence[Flat]) -> Flat:
    """Σ c_i v_i of the first vectors of a basis."""
    out = np.zeros_like(basis[0])
    for k, v in zip(c, basis, strict=False):
        out += k * v
    return out


def arnoldi(
    phi: Derivative, basis: list[Flat], most: int, nearer: Nearer = lambda v: v
) -> Iterator[Float[np.ndarray, "j1 j"]]:  # fmt: skip
    """H of Φ V = V₊ H, on an orthonormal basis that grows by a vector, and a march, each time.

    It ends where the basis holds all that there is, after `most` marches at the latest.

    Parameters
    ----------
    basis : its first vector; the others are added
    nearer : P⁻¹ ≈ (I − Φ)⁻¹, which may differ from vector to vector; H is that of 1 − (I − Φ) P⁻¹ then
    """
    H = np.zeros((most + 1, most))
    for j in range(most):
        z = nearer(basis[j])
        w, H[: j + 2, j] = _orthogonal(phi.map, basis, basis[j] - z + phi(z))
        whole = H[j + 1, j] <= WHOLE * max(1.0, np.abs(H[: j + 2, : j + 1]).max())
        if not whole:
            basis.append(w / H[j + 1, j])
        yield H[: j + 2, : j + 1]
        if whole:
            return


@dataclass(frozen=True, slots=True)
class Solution:
    """What GMRES found of (I − Φ) d = r.

    d : solution; left : r − (I − Φ) d
    nearest : the smallest eigenvalue of (I − Φ) P⁻¹ in the Krylov space, its magnitude
    shape : real and imaginary part of its vector, times P⁻¹
    """

    d: Flat
    left: Flat
    nearest: float
    shape: tuple[Flat, Flat]


def gmres(phi: Derivative, r: Flat, least: float, most: int, nearer: Nearer | None = None) -> Solution:
    """d with (I − Φ) d = r, but for `least`, in the product of the map; a flexible GMRES if it is preconditioned.

    Parameters
    ----------
    most : marches; others as of `arnoldi`
    """
    beta = phi.map.whole(r)
    basis, tried = [r / beta], list[Flat]()

    def kept(v: Flat) -> Flat:
        tried.append(v if nearer is None else nearer(v))
        return tried[-1]

    for H in arnoldi(phi, basis, most, kept):
        rest, asked = np.eye(*H.shape) - H, beta * np.eye(len(H))[0]
        c = np.linalg.lstsq(rest, asked, rcond=None)[0]
        left = asked - rest @ c
        if float(np.linalg.norm(left)) <= least:
            break
    values, shapes = np.linalg.eig(rest[:-1].astype(complex))
    k = int(np.abs(values).argmin())
    shape = combined(shapes[:, k].real, tried), combined(shapes[:, k].imag, tried)
    return Solution(combined(c, tried), combined(left, basis), float(np.abs(values[k])), shape)


def _orthogonal(of: PeriodMap, basis: Sequence[Flat], w: Flat) -> tuple[Flat, Flat]:
    """What is left of w beside a basis, its coefficients there and its size."""
    h = np.zeros(len(basis) + 1)
    for _ in range(2):
        c = of.products(basis, w)
        h[:-1] += c
        w = w - combined(c, basis)
    h[-1] = of.whole(w)
    return w, h
