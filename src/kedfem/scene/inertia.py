"""Moments of inertia of rigid bodies."""

from typing import Annotated

import numpy as np

from kedfem.scene.units import Quantity

Inertia = Annotated[float, Quantity("kg*m^2")]


def inertia_tensor(inertia: tuple[float, ...]) -> np.ndarray:
    """The (3, 3) tensor [kg m²] of Ixx, Iyy, Izz, Ixy, Iyz, Izx."""
    xx, yy, zz, xy, yz, zx = inertia
    return np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])


def impossible(inertia: tuple[float, ...]) -> str:
    """What is wrong with moments that no body has; nothing: an empty text."""
    a, b, c = np.linalg.eigvalsh(inertia_tensor(inertia))
    if a >= -1e-9 * abs(c) and c <= (a + b) * (1.0 + 1e-9):
        return ""
    return (
        "must have principal moments that are positive, none larger than the sum of the others [kg*m^2], "
        f"got {a:.6g}, {b:.6g} and {c:.6g}"
    )
