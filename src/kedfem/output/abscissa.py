"""The abscissa of curves: the drive's position, or time if the drive changes its direction or there is none."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from kedfem.arrays import Float

TICKS = (1, 2, 5, 10, 15, 30, 45, 60, 90, 180)  # distances of ticks [deg]; larger ones are whole revolutions
MOST_TICKS = 13


@dataclass(frozen=True, slots=True)
class Abscissa:
    """Values of the horizontal axis.

    values : (n,) [deg], [mm] over the travel of a drive, or [s] over time
    degrees : (n,) the drive angle if the curves are over time and the drive moves [deg]; else None
    over_time : whether the curves are over time
    travel : whether they are over the travel of a drive
    """

    values: Float[np.ndarray, " n"]
    degrees: Float[np.ndarray, " n"] | None = None
    over_time: bool = False
    travel: bool = False

    @property
    def ends(self) -> tuple[float, float]:
        """Left and right end; time runs from left to right, also for a drive that rotates backwards."""
        steps = np.diff(self.values)
        if steps.size and (steps >= 0).all() | (steps <= 0).all():
            return float(self.values[0]), float(self.values[-1])
        return float(np.min(self.values)), float(np.max(self.values))


def abscissa(time: Float[np.ndarray, " n"], angle: Float[np.ndarray, " n"]) -> Abscissa:
    """The drive angle in degrees if it is monotonic, else time.

    It is monotonic if it never reverses and rests, with less than a thousandth of its greatest speed, for less than a
    tenth of the steps.
    """
    degrees = np.degrees(angle)
    steps = np.diff(degrees) * (np.sign(degrees[-1] - degrees[0]) or 1.0)
    fastest = np.max(steps, initial=0.0)
    if fastest > 0 and np.min(steps) >= 0 and np.mean(steps < 1e-3 * fastest) < 0.1:
        return Abscissa(degrees)
    return Abscissa(time, degrees if steps.any() else None, over_time=True)


def over_positions(angle: Float[np.ndarray, " n"], slides: bool) -> Abscissa | None:
    """The drive's position as abscissa of static positions; None if the drive rests.

    Parameters
    ----------
    angle : angle of the drive [rad], or its travel [m]
    slides : whether it is a travel
    """
    if not np.ptp(angle) > 0:
        return None
    return Abscissa(1e3 * angle, travel=True) if slides else Abscissa(np.degrees(angle))


def draw_abscissa(top: Any, bottom: Any, along: Abscissa) -> None:
    """Draw label, ticks and limits, and revolutions at the top if there is more than one.

    Parameters
    ----------
    top, bottom : the first and the last of matplotlib's axes that share the abscissa
    """
    first, last = along.ends
    over = "time (s)" if along.over_time else "drive travel (mm)" if along.travel else "drive angle (°)"
    bottom.set_xlabel(over)
    if first == last:
        return
    bottom.set_xlim(first, last)
    if along.over_time or along.travel:
        return
    span = abs(last - first)
    bottom.xaxis.set_major_locator(_ticks(span))
    if span > 361.0:
        revolutions = top.secondary_xaxis("top", functions=(lambda x: x / 360.0, lambda x: x * 360.0))
        revolutions.set_xlabel("revolutions")
        revolutions.xaxis.set_major_locator(_angle_ticks(span / 360.0))


def _ticks(span: float) -> Any:
    """Ticks at round degrees."""
    from matplotlib.ticker import MaxNLocator, MultipleLocator

    for step in TICKS:
        if span / step < MOST_TICKS:
            return MultipleLocator(step) if span > TICKS[0] else MaxNLocator()
    revolutions = np.ceil(span / 360.0 / MOST_TICKS)
    return MultipleLocator(360.0 * revolutions)


def _angle_ticks(revolutions: float) -> Any:
    """Ticks at half revolutions if there are few, else at whole ones."""
    from matplotlib.ticker import MaxNLocator, MultipleLocator

    return MultipleLocator(0.5) if revolutions < 4 else MaxNLocator(MOST_TICKS, integer=True)
