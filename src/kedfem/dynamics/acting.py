"""Actions on the steppers' own states: forces of motors and springs on the rows of all segments."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from kedfem.dynamics.action import Action, Table, kernel_table, nominal_vectors
from kedfem.links.record import Link
from kedfem.motion.rigid import RigidMotion

Rows = Float[np.ndarray, "n d"]


@dataclass(frozen=True, slots=True)
class Acting:
    """What the time integration needs of actions.

    every, table : the actions, and as the kernel takes them
    segment : (A, 2) number of each end's segment, −1 where nothing but the nominal motion moves it
    """

    every: tuple[Action, ...]
    table: Table
    segment: np.ndarray


def acting_on(every: Sequence[Action]) -> Acting:
    """Actions made ready."""
    segment = np.array([[end.k for end in action.ends] for action in every], int).reshape(-1, 2)
    return Acting(tuple(every), kernel_table(every), segment)


def nominal_ends(acting: Acting, motion: RigidMotion) -> tuple[Float[np.ndarray, "T A 2 2 3"], ...]:
    """Positions and velocities of all ends, were nothing but the nominal motion."""
    x, v = np.zeros((2, len(motion.t), len(acting.every), 2, 2, 3))
    for i, action in enumerate(acting.every):
        for e, end in enumerate(action.ends):
            x[:, i, e], v[:, i, e] = nominal_vectors(end, motion)
    return x, v


def weights(
    acting: Acting, links: Sequence[Link], on: Callable[[int, Rows], Rows], shape: tuple[int, int]
) -> Float[np.ndarray, "A 2 2 D n"]:
    """Weights of all ends' vectors on a solver's own coordinates, component first and padded.

    Parameters
    ----------
    on : number of a segment and nodal weights (n, d) → weights on its coordinates (d, n)
    shape : (D, n) padded
    """
    out = np.zeros((len(acting.every), 2, 2, *shape))
    for i, action in enumerate(acting.every):
        for e, end in enumerate(action.ends):
            if end.k >= 0:
                d = links[end.k].d
                for m, row in enumerate(end.weights):
                    own = on(end.k, np.outer(row, end.mask[:d]))
                    out[i, e, m, : own.shape[0], : own.shape[1]] = own
    return out


def for_kernel(
    acting: Acting, weight: Float[np.ndarray, "A 2 2 D n"], motion: RigidMotion
) -> tuple[Any, ...] | None:
    """What `acting_kernel.external` takes over a block of time points; None without actions.

    Parameters
    ----------
    weight : of `weights`
    """
    A = len(acting.every)
    if not A:
        return None
    return (acting.segment, weight, acting.table, motion.t, *nominal_ends(acting, motion),
            *np.zeros((3, A, 2, 2, 3)), np.zeros((A, 4)))  # fmt: skip
