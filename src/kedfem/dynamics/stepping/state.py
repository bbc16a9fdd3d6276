"""What a link carries from step to step."""

from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.stepping.scheme import Scheme

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
    """Elastic state of one link at one time; all (n, d).

    u, v, a : δ, δ', δ'', world components [m, m/s, m/s²; third row of a beam: ψ]
    Mu, Mv, Ma : the same times the mass
    g : δ in the link frame; R : (d, d) the link's orientation
    Kg : K0 g, link frame [N]
    f : internal force K0 g + C0 g', link frame [N]
    C : (3, n, d) C0 times (g, g', g''), link frame, None without damping
    F : P − M R0'', world components [N]
    port_forces : (q,) λ on the link at its ports, link frame [N]
    g1 : g' where a march begins; None later, where C has what is needed of it
    """

    u: Nodal
    v: Nodal
    a: Nodal
    Mu: Nodal
    Mv: Nodal
    Ma: Nodal
    g: Nodal
    R: Float[np.ndarray, "d d"]
    Kg: Nodal
    f: Nodal
    C: Float[np.ndarray, "3 n d"] | None
    F: Nodal
    port_forces: Float[np.ndarray, " q"]
    g1: Nodal | None = None


def accelerated(scheme: Scheme, u1: Nodal, u: Nodal, v: Nodal, a: Nodal) -> tuple[Nodal, Nodal]:
    """Rate and acceleration at the end of the step from the displacement there, Newmark's formulas."""
    a1 = u1 - u
    a1 *= scheme.a0
    b = scheme.acceleration
    a1 -= b[1] * v
    a1 -= b[2] * a
    v1 = (scheme.h * scheme.gamma) * a1
    v1 += v
    v1 += (scheme.h * (1 - scheme.gamma)) * a
    return v1, a1
