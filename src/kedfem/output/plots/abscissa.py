"""What curves are drawn over: the drive angle, or time where the drive does not keep turning or there is none."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

TICKS = (1, 2, 5, 10, 15, 30, 45, 60, 90, 180)  # steps of degrees that read well; beyond, whole turns
MOST_TICKS = 13


@dataclass(frozen=True, slots=True)
class Abscissa:
    """Values of the horizontal axis.

    values : (n,) [deg], or [s] over time
    degrees : (n,) the drive angle, when the curves are over time and there is one that moves [deg]
    over_time : whether the curves are over time
    """

    values: Float[np.ndarray, " n"]
    degrees: Float[np.ndarray, " n"] | None = None
    over_time: bool = False


def abscissa(time: Float[np.ndarray, " n"], angle: Float[np.ndarray, " n"]) -> Abscissa:
    """The drive angle in degrees when it keeps on in one direction, else time.

    It keeps on when it never turns back and stands still (a thousandth of its greatest speed) for less than a tenth
    of the steps.
    """
    degrees = np.degrees(angle)
    steps = np.diff(degrees) * (np.sign(degrees[-1] - degrees[0]) or 1.0)
    fastest = np.max(steps, initial=0.0)
    if fastest > 0 and np.min(steps) >= 0 and np.mean(steps < 1e-3 * fastest) < 0.1:
        return Abscissa(degrees)
    return Abscissa(time, degrees if steps.any() else None, over_time=True)


def draw_abscissa(top: Any, bottom: Any, along: Abscissa) -> None:
    """Label, ticks and limits; above, turns where there is more than one.

    Parameters
    ----------
    top, bottom : axes of matplotlib that share the abscissa
    """
    first, last = float(along.values[0]), float(along.values[-1])
    bottom.set_xlabel("time (s)" if along.over_time else "drive angle (°)")
    if first == last:
        return
    bottom.set_xlim(first, last)  # a drive that turns backwards still runs from left to right
    if along.over_time:
        return
    span = abs(last - first)
    bottom.xaxis.set_major_locator(_ticks(span))
    if span > 361.0:
        revolutions = top.secondary_xaxis("top", functions=(lambda x: x / 360.0, lambda x: x * 360.0))
        revolutions.set_xlabel("revolutions")
        revolutions.xaxis.set_major_locator(_turn_ticks(span / 360.0))


def _ticks(span: float) -> Any:
    """Ticks at round degrees."""
    from matplotlib.ticker import MaxNLocator, MultipleLocator

    for step in TICKS:
        if span / step < MOST_TICKS:
            return MultipleLocator(step) if span > TICKS[0] else MaxNLocator()
    revolutions = np.ceil(span / 360.0 / MOST_TICKS)
    return MultipleLocator(360.0 * revolutions)


def _turn_ticks(revolutions: float) -> Any:
    """Ticks at half turns where there are few, else at whole ones."""
    from matplotlib.ticker import MaxNLocator, MultipleLocator

    return MultipleLocator(0.5) if revolutions < 4 else MaxNLocator(MOST_TICKS, integer=True)
