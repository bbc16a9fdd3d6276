"""Rayleigh damping of links, on their deformation in co-rotational frames."""

from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.links.record import Link, mass_times

Nodal = Float[np.ndarray, "n d"]
NodalOf = Float[np.ndarray, "_ _"]  # of several links, each with its own n


@dataclass(frozen=True, slots=True)
class Rayleigh:
    """C0 = α M + β K0 on the rate of the co-rotated deformation: R C0 Rᵀ(δ' − ω × δ); alpha [1/s], beta [s]."""

    alpha: float = 0.0
    beta: float = 0.0

    @property
    def present(self) -> bool:
        """Whether there is any damping."""
        return self.alpha != 0 or self.beta != 0


def damping_times(link: Link, damping: Rayleigh, g: Nodal) -> Nodal:
    """C0 g = α M g + β K0 g, link frame."""
    Kg = (link.K0 @ g.ravel()).reshape(g.shape)
    return np.asarray(damping.alpha * mass_times(link.mass, g) + damping.beta * Kg)
