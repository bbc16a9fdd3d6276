"""Moments of inertia of rigid bodies."""

from collections.abc import Sequence
from typing import Annotated

import numpy as np
from jaxtyping import Float

from kedfem.errors import Fault
from kedfem.scene.records.units import Quantity

Inertia = Annotated[float, Quantity("kg*m^2")]


def inertia_tensor(inertia: Sequence[float]) -> np.ndarray:
    """The (3, 3) tensor [kg m²] of Ixx, Iyy, Izz, Ixy, Iyz, Izx."""
    xx, yy, zz, xy, yz, zx = inertia
    return np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])


def moments_of_inertia(J: Float[np.ndarray, "3 3"]) -> tuple[float, float, float, float, float, float]:
    """Ixx, Iyy, Izz, Ixy, Iyz, Izx of a tensor [kg m²]."""
    xx, yy, zz, xy, yz, zx = J[[0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]].tolist()
    return xx, yy, zz, xy, yz, zx


def inertia_faults(inertia: Sequence[float]) -> list[Fault]:
    """What is wrong with moments that no body has, under the key `inertia`."""
    a, b, c = np.linalg.eigvalsh(inertia_tensor(inertia))
    if a >= -1e-9 * abs(c) and c <= (a + b) * (1.0 + 1e-9):
        return []
    message = (
        "must have principal moments that are positive, none larger than the sum of the others [kg*m^2], "
        f"got {a:.6g}, {b:.6g} and {c:.6g}"
    )
    return [Fault(("inertia",), message)]
