"""Numbers in words."""

import numpy as np

from kedfem.scene import Scene

NOTHING = 1e-9  # of the largest value of the same unit: rounding errors
UNITS = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))


def with_prefix(value: float, unit: str) -> str:
    """A number with an SI prefix: 1.23e7, Pa → 12.3 MPa.

    >>> with_prefix(1.234e7, "Pa")
    '12.34 MPa'
    """
    size = abs(value)
    factor, prefix = next(((f, p) for f, p in UNITS if size >= f), (1.0, ""))
    return f"{value / factor:.4g} {prefix}{unit}"


def moment(scene: Scene, time: float, angle: float) -> str:
    """A drive angle [rad] in degrees; without a drive the time [s]."""
    return with_prefix(time, "s") if scene.driven is None else f"{np.degrees(angle):.1f}°"


def percent(x: float) -> str:
    """A part of one in percent."""
    return f"{100 * x:.2g} %"
