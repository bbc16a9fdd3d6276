"""Generalised-α time integration (Chung and Hulbert 1993) with Newmark's average acceleration as undamped member.

From the beginning (0) to the end (1) of a step:

    δ1'' = [(δ1 − δ0)/h − δ0']/(β h) − (1/(2β) − 1) δ0'',   δ1' = δ0' + h [(1 − γ) δ0'' + γ δ1'']
    M [(1 − α_m) δ1'' + α_m δ0''] + (1 − α_f) f1 + α_f f0 = (1 − α_f) F1 + α_f F0 + Wᵀ λ
"""

from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float

# of the rotation 1 − ρ∞ in a step, at which vibration that no step resolves neither grows nor dies (measured,
# docs/theory/errors.md); in space that of a link whose own is 3000/h grows from between 0.7 and 0.8 on
TURNED, TURNED_STIFF = 0.8, 0.5


@dataclass(frozen=True, slots=True)
class Scheme:
    """Coefficients of one member of the family at a fixed step.

    h : step [s]; alpha_m, alpha_f, beta, gamma : the family's parameters [-].
    """

    h: float
    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float

    @property
    def a0(self) -> float:
        """1/(β h²): change of acceleration with displacement [1/s²]."""
        return 1 / (self.beta * self.h**2)

    @property
    def a1(self) -> float:
        """γ/(β h): change of rate with displacement [1/s]."""
        return self.gamma / (self.beta * self.h)

    @property
    def acceleration(self) -> Float[np.ndarray, "3"]:
        """δ'' at the end of a step = a0 · δ there − acceleration · (δ, δ', δ'') at its beginning."""
        return np.array([self.a0, 1 / (self.beta * self.h), 1 / (2 * self.beta) - 1])

    @property
    def rate(self) -> Float[np.ndarray, "3"]:
        """δ' at the end of a step = a1 · δ there − rate · (δ, δ', δ'') at its beginning."""
        return np.array([self.a1, self.gamma / self.beta - 1, self.h * (self.gamma / (2 * self.beta) - 1)])


def stable_rotation(rho_inf: float, stiff: bool = False) -> float:
    """The rotation in a step [rad] up to which numerical damping takes vibration from links that no step resolves.

    Parameters
    ----------
    stiff : whether it is far above that, as of rigid links
    """
    return (TURNED_STIFF if stiff else TURNED) * (1 - rho_inf)


def generalised_alpha(h: float, rho_inf: float) -> Scheme:
    """The second-order member with spectral radius ρ∞ at infinite frequency.

    ρ∞ = 1 is Newmark's average acceleration (α_m = α_f = 0), which has no numerical damping either and evaluates
    everything at the end of the step.

    Parameters
    ----------
    h : step [s]
    rho_inf : 0 ≤ ρ∞ ≤ 1
    """
    if rho_inf == 1.0:
        return Scheme(h, 0.0, 0.0, 0.25, 0.5)
    alpha_m = (2 * rho_inf - 1) / (rho_inf + 1)
    alpha_f = rho_inf / (rho_inf + 1)
    return Scheme(h, alpha_m, alpha_f, (1 - alpha_m + alpha_f) ** 2 / 4, 0.5 - alpha_m + alpha_f)
