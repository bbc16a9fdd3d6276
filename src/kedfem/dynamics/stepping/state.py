"""What acts on a link at a time, and its damping."""

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


@dataclass(frozen=True, slots=True)
class ForcingAt:
    """What rigid motion and loads do to one link at one time.

    R : (d, d) orientation, link to world, of a plane link in its plane
    F : (n, d) P − M R0'', world components [N]
    stress : (m,) factors of the link's stress modes; None without stiffening
    """

    R: Float[np.ndarray, "d d"]
    F: Nodal
    stress: Float[np.ndarray, " m"] | None = None


def damping_times(link: Link, damping: Rayleigh, g: Nodal) -> Nodal:
    """C0 g = α M g + β K0 g, link frame."""
    Kg = (link.K0 @ g.ravel()).reshape(g.shape)
    return np.asarray(damping.alpha * mass_times(link.mass, g) + damping.beta * Kg)
