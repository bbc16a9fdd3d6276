"""Actions as the steppers take them: over a block of time points, on padded states of all links."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from kedfem.dynamics.action import Action, Table, end_weights, kernel_table, nominal_vectors
from kedfem.dynamics.state import Nodal
from kedfem.links.record import Link
from kedfem.motion.rigid import RigidMotion


@dataclass(frozen=True, slots=True)
class Acting:
    """Actions on the states of a solver.

    every, table : the actions, and as the kernel takes them
    owners, weights : of `action.end_weights`
    """

    every: tuple[Action, ...]
    table: Table
    owners: Int[np.ndarray, "A 2"]
    weights: Float[np.ndarray, "A 2 2 D S"]


def acting_on(
    every: Sequence[Action], links: Sequence[Link], bases: Sequence[Sequence[np.ndarray]] | None = None
) -> Acting:
    """Actions on links whose states are padded to the largest, in coordinates of `bases` if given."""
    shape = max(link.d for link in links), max(link.n for link in links)
    return Acting(tuple(every), kernel_table(every), *end_weights(every, shape, bases))


def over_block(acting: Acting, motion: RigidMotion) -> tuple[Any, ...] | None:
    """What `actions_kernel.external` takes over a block of time points; None without actions."""
    A = len(acting.every)
    if not A:
        return None
    x, v = np.zeros((2, len(motion.t), A, 2, 2, 3))
    for i, action in enumerate(acting.every):
        for e, end in enumerate(action.ends):
            x[:, i, e], v[:, i, e] = nominal_vectors(end, motion)
    scratch = (*np.zeros((3, A, 2, 2, 3)), np.zeros((A, 4)))
    return acting.owners, acting.weights, acting.table, motion.t, x, v, *scratch


def first_forces(
    every: Sequence[Action], links: Sequence[Link], motion: RigidMotion, rows: Sequence[tuple[Nodal, Nodal]]
) -> list[Nodal]:
    """Forces of actions on the rows (n, d) of all links at the start, where nothing has turned yet.

    Parameters
    ----------
    motion : at that time only
    rows : δ and δ' of all links
    """
    if not every:
        return [np.zeros_like(u) for u, _ in rows]
    from kedfem.dynamics.actions_kernel import external

    acting = acting_on(every, links)
    u, v, F = np.zeros((3, len(links), *acting.weights.shape[-2:]))
    for k, (link, each) in enumerate(zip(links, rows, strict=True)):
        for padded, own in zip((u, v), each, strict=True):
            padded[k, : link.d, : link.n] = own.T
    external(over_block(acting, motion), 0, u, v, np.zeros(len(every)), F)
    return [F[k, : link.d, : link.n].T for k, link in enumerate(links)]
