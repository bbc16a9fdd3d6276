"""Forces of laws at one instant, for the starts of marches."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.system.record import COORDINATE, RATE, TIME, Curve, Law, Spring, Stop, curve_of

Coordinates = Float[np.ndarray, " r"]


@dataclass(frozen=True, slots=True)
class TemporarySprings:
    """Springs on coordinates that stops limit: stiffness (r,), none on others, and where they exert nothing (r,)."""

    stiffness: Coordinates
    about: Coordinates


def exerted(
    laws: Sequence[Law], t: float, e: Float[np.ndarray, "_ r"], temporary: TemporarySprings | None
) -> Float[np.ndarray, "r 3"]:
    """Forces of all laws and temporary springs, and how they fall with coordinate and rate; zero of constraints.

    Parameters
    ----------
    e : coordinates and their rates
    """
    out = np.array([push(law, t, e[0, n], e[1, n]) for n, law in enumerate(laws)]).reshape(-1, 3)
    if temporary is not None:
        out[:, 0] -= temporary.stiffness * (e[0] - temporary.about)
        out[:, 1] += temporary.stiffness
    return out


def push(law: Law, t: float, e: float, rate: float) -> tuple[float, float, float]:
    """Force of a law along its coordinate, and how it falls with the coordinate and with its rate."""
    match law:
        case Spring(stiffness=k, damping=c, free=free):
            beside = (0.0, 0.0, 0.0) if law.curve is None else push(law.curve, t, e, rate)
            return beside[0] - k * (e - free) - c * rate, beside[1] + k, beside[2] + c
        case Curve(over=over, force=force_at):
            x = {TIME: t, RATE: rate, COORDINATE: e}[over]
            value, slope = (float(found[0]) for found in force_at(np.array([x])))
            falls = {TIME: (0.0, 0.0), RATE: (0.0, -slope), COORDINATE: (-slope, 0.0)}[over]
            return value, *falls
        case Stop(lower=lower, upper=upper, stiffness=k, damping=c):
            beyond = max(e - upper, 0.0) + min(e - lower, 0.0)
            force = -k * beyond - c * rate
            return (force, k, c) if force * beyond < 0 else (0.0, 0.0, 0.0)
        case _:
            return 0.0, 0.0, 0.0


def feels_rates(law: Law) -> bool:
    """Whether a law's force depends on a rate."""
    curve = curve_of(law)
    return (isinstance(law, Spring | Stop) and law.damping != 0) or (curve is not None and curve.over == RATE)
