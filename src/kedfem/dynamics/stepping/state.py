"""What acts on a link at a time, its damping, and its state where a march begins."""

from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float

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


@dataclass(frozen=True, slots=True)
class LinkState:
    """Elastic state of one link where a march begins; all (n, d).

    u, v, a : δ, δ', δ'', world components [m, m/s, m/s²; third row of a beam: ψ]
    Mu, Mv, Ma : the same times the mass
    R : (d, d) the link's orientation
    f : internal force K0 g + C0 g', link frame [N], with g = δ there
    C : (3, n, d) C0 times (g, g', g''), link frame, None without damping
    port_forces : (q,) λ on the link at its ports, link frame [N]
    """

    u: Nodal
    v: Nodal
    a: Nodal
    Mu: Nodal
    Mv: Nodal
    Ma: Nodal
    R: Float[np.ndarray, "d d"]
    f: Nodal
    C: Float[np.ndarray, "3 n d"] | None
    port_forces: Float[np.ndarray, " q"]
