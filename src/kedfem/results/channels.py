"""Channels of results: groups of columns that are recorded together, with their units."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float


@dataclass(frozen=True, slots=True)
class Channel:
    """One group of columns that are recorded together.

    name : path in the file, e.g. ``probes/rocker_mid/stress``, ``joints/B/force``, ``drive/torque``
    columns : names of the columns, e.g. ``("x", "y", "z")``
    unit : unit of all columns, e.g. ``Pa``
    frame : ``link``, ``world``, or empty where there is none
    description : a line for titles and readers
    """

    name: str
    columns: tuple[str, ...]
    unit: str
    frame: str
    description: str

    @property
    def vector(self) -> bool:
        """Whether columns are components along axes: three; two in a plane, or where statics leave one indeterminate."""
        return len(self.columns) > 1 and set(self.columns) <= set(XYZ)


NOTHING = 1e-9  # of the largest value of the same unit: rounding
XYZ = ("x", "y", "z")
STRESS = ("xx", "yy", "zz", "xy", "yz", "zx", "von_mises")  # columns of vectors and of stresses
TIME = Channel("time", (), "s", "", "time")
ANGLE = Channel("drive_angle", (), "rad", "", "drive angle from the reference position")
TRAVEL = Channel("drive_travel", (), "m", "", "drive travel from the reference position")


def largest_by_unit(channels: Iterable[tuple[Channel, Float[np.ndarray, "T c"]]], size: float = 0.0) -> dict[str, float]:
    """Unit → the largest magnitude of all channels with this unit, beside which negligible values are rounding.

    Parameters
    ----------
    size : arm at which the largest force is a moment, too [m]
    """
    out: dict[str, float] = {}
    for channel, values in channels:
        finite = float(np.max(np.abs(values), where=np.isfinite(values), initial=0.0))
        out[channel.unit] = max(out.get(channel.unit, 0.0), finite)
    if "N m" in out:
        out["N m"] = max(out["N m"], size * out.get("N", 0.0))
    return out
