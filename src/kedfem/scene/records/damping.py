"""Damping of the elastic motion."""

from __future__ import annotations

import math
from typing import Annotated, Any, Self

from pydantic import BeforeValidator, model_validator

from kedfem.errors import Fault
from kedfem.scene.records.base import Record, refuse
from kedfem.scene.records.units import Quantity

Ratio = Annotated[float, Quantity("1", least=0.0, below=1.0)]
Frequency = Annotated[float, Quantity("Hz", above=0.0)]


def for_both(value: Any) -> Any:
    """One ratio for both frequencies."""
    if isinstance(value, (list, tuple)):
        return (*value, *value) if len(value) == 1 else tuple(value)
    return value if value is None else (value, value)


Ratios = Annotated[tuple[Ratio, Ratio] | None, BeforeValidator(for_both)]


class Damping(Record):
    """Proportional damping C = α M + β K, [KED, eq. (20)]: α and β, or damping ratios at two frequencies."""

    alpha: Annotated[float, Quantity("1/s", least=0.0)] = 0.0
    """mass-proportional α"""
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
    """What is contradictory in a damping: places and messages."""
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

    From ratios ζ at two circular frequencies ω: α + β ω² = 2 ζ ω at both.
    """
    if damping.ratio is None or damping.frequencies is None:
        return damping.alpha, damping.beta
    (z1, z2), (w1, w2) = damping.ratio, (2.0 * math.pi * f for f in damping.frequencies)
    beta = 2.0 * (z2 * w2 - z1 * w1) / (w2**2 - w1**2)
    return 2.0 * z1 * w1 - beta * w1**2, beta
