"""Records of materials, isotropic and linear elastic, a few of them built in, and of the damping of elastic motion."""

from __future__ import annotations

import math
from typing import Annotated, Any, Self

from pydantic import BeforeValidator, SerializerFunctionWrapHandler, model_serializer, model_validator

from kedfem.errors import Fault
from kedfem.scene.records.base import Record, refuse
from kedfem.scene.records.units import PositivePressure, Quantity, fault

LINE = "line of "  # beginning of the name of the material of a rigid link without a shape
Ratio = Annotated[float, Quantity("1", least=0.0, below=1.0)]
Frequency = Annotated[float, Quantity("Hz", above=0.0)]


def for_both(value: Any) -> Any:
    """A single damping ratio, which holds at both frequencies."""
    if isinstance(value, (list, tuple)):
        return (*value, *value) if len(value) == 1 else tuple(value)
    return value if value is None else (value, value)


Ratios = Annotated[tuple[Ratio, Ratio] | None, BeforeValidator(for_both)]


class Damping(Record):
    """Proportional damping C = α M + β K, [KED, eq. (20)]: α and β, or damping ratios at two frequencies."""

    alpha: Annotated[float, Quantity("1/s", least=0.0)] = 0.0
    """mass-proportional α; it also resists the motion of what no drive moves, as a body that a road carries"""
    beta: Annotated[float, Quantity("s", least=0.0)] = 0.0
    """stiffness-proportional β"""
    ratio: Ratios = None
    """instead of α and β: part of the critical damping at the two frequencies, one number for both or two"""
    frequencies: tuple[Frequency, Frequency] | None = None
    """the two frequencies of `ratio`"""

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        refuse(damping_faults(self))
        return self


def damping_faults(damping: Damping) -> list[Fault]:
    """Contradictions in a damping: places and messages."""
    if damping.ratio is None:
        lacking = [Fault(("ratio",), "is required with frequencies, got nothing")]
        return [] if damping.frequencies is None else lacking
    if damping.alpha or damping.beta:
        return [Fault(("ratio",), "cannot be combined with alpha and beta, got both")]
    if damping.frequencies is None:
        return [Fault(("frequencies",), "is required with ratio [Hz], got nothing")]
    first, second = damping.frequencies
    if first == second:
        return [Fault(("frequencies",), f"must be two different frequencies [Hz], got {first:.6g} twice")]
    alpha, beta = rayleigh(damping)
    if min(alpha, beta) < 0.0:
        got = f"got alpha = {alpha:.6g} 1/s, beta = {beta:.6g} s"
        return [Fault(("ratio",), f"must give alpha and beta that are zero or positive, {got}")]
    return []


def rayleigh(damping: Damping) -> tuple[float, float]:
    """α [1/s] and β [s] of C = α M + β K, [KED, eq. (20)].

    With ratios ζ given at two circular frequencies ω, α + β ω² = 2 ζ ω holds at both.
    """
    if damping.ratio is None or damping.frequencies is None:
        return damping.alpha, damping.beta
    (z1, z2), (w1, w2) = damping.ratio, (2.0 * math.pi * f for f in damping.frequencies)
    beta = 2.0 * (z2 * w2 - z1 * w1) / (w2**2 - w1**2)
    return 2.0 * z1 * w1 - beta * w1**2, beta


class Material(Record):
    """An isotropic, linear elastic material; either ``poisson_ratio`` or ``shear_modulus`` is given."""

    density: Annotated[float, Quantity("kg/m^3", above=0.0)]
    """mass per volume"""
    youngs_modulus: PositivePressure
    """Young's modulus E"""
    poisson_ratio: Annotated[float, Quantity("1", above=-1.0, below=0.5)] = math.nan
    """Poisson's ratio ν; from E and G if those are given"""
    shear_modulus: PositivePressure = math.nan
    """shear modulus G; E / (2 (1 + ν)) if ν is given"""
    yield_strength: PositivePressure | None = None
    """with which highest von Mises stresses are compared: links are elastic at any stress"""

    @model_validator(mode="after")
    def _both_moduli(self) -> Self:
        given = self.model_fields_set & {"poisson_ratio", "shear_modulus"}
        if len(given) != 1:
            raise fault(f"must have poisson_ratio or shear_modulus, got {'both' if given else 'neither'}")
        if "poisson_ratio" in given:
            return self.fill(shear_modulus=self.youngs_modulus / (2.0 * (1.0 + self.poisson_ratio)))
        ratio = self.youngs_modulus / (2.0 * self.shear_modulus) - 1.0
        if ratio >= 0.5:
            least = self.youngs_modulus / 3.0
            wanted = f"must be above a third of Young's modulus, {least:.6g} [Pa]"
            refuse([Fault(("shear_modulus",), f"{wanted}, got {self.shear_modulus:.6g}")])
        return self.fill(poisson_ratio=ratio)

    @model_serializer(mode="wrap")
    def _as_given(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        dumped: dict[str, Any] = handler(self)
        derived = "shear_modulus" if "poisson_ratio" in self.model_fields_set else "poisson_ratio"
        dumped.pop(derived, None)
        return dumped

    def lame(self) -> tuple[float, float]:
        """Lamé's constants λ and μ [Pa]."""
        nu, E = self.poisson_ratio, self.youngs_modulus
        return E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), self.shear_modulus


# Typical values at room temperature, as in engineering handbooks. A design that depends on them should have those of
# the supplier in [materials.NAME].
BUILT_IN: dict[str, dict[str, float]] = {
    "steel": {"density": 7850.0, "youngs_modulus": 210e9, "poisson_ratio": 0.3},
    "stainless_steel": {"density": 7900.0, "youngs_modulus": 200e9, "poisson_ratio": 0.3},
    "aluminium": {"density": 2700.0, "youngs_modulus": 70e9, "poisson_ratio": 0.33},
    "titanium": {"density": 4430.0, "youngs_modulus": 114e9, "poisson_ratio": 0.34},
    "cast_iron": {"density": 7200.0, "youngs_modulus": 110e9, "poisson_ratio": 0.26},
    "brass": {"density": 8500.0, "youngs_modulus": 100e9, "poisson_ratio": 0.35},
    "pom": {"density": 1410.0, "youngs_modulus": 2.8e9, "poisson_ratio": 0.37},
    "nylon": {"density": 1140.0, "youngs_modulus": 2.0e9, "poisson_ratio": 0.39},
}
