"""A link condensed onto its ports, seen from these: what it does while they are held."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.matrices.substructure import Substructure
from kedfem.dynamics.stepping.state import Nodal


@dataclass(frozen=True, slots=True)
class HeldPart:
    """A link with A = c_M M + c_K K0 seen from its ports: g = G r + Y w, λ = S w − Yᵀ r, w = W g; link frame.

    held : r (n, d) → G r (n, d) and Yᵀ r (q,): what r does while ports are held, and what they take
    Y : (dn, q); S : (q, q)
    """

    held: Callable[[Nodal], tuple[Nodal, Float[np.ndarray, " q"]]]
    Y: Float[np.ndarray, "k q"]
    S: Float[np.ndarray, "q q"]


def held_substructure(part: Substructure) -> HeldPart:
    """A link condensed onto ports and anchors, seen from its ports."""
    q = len(part.attachment.keep)
    Y, rows = part.Y @ part.S[:, :q], np.ascontiguousarray(part.Y.T)

    def held(r: Nodal) -> tuple[Nodal, Float[np.ndarray, " q"]]:
        y = part.solve(r)
        at_ports = part.S @ part.seen(y)
        return y - (at_ports @ rows).reshape(y.shape), at_ports[:q]

    return HeldPart(held, Y, part.S[:q, :q])
