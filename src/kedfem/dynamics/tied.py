"""Steps of a solver that takes one at a time, where joints are enforced by constraint equations."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from kedfem.dynamics.constraint_matrices import JointRows
from kedfem.dynamics.history import Forcing, LinkHistory, history
from kedfem.dynamics.interface import RowState, Tie, after_step, step_tie
from kedfem.dynamics.scheme import Scheme
from kedfem.dynamics.state import LinkState, Nominal


@dataclass(frozen=True, slots=True)
class Begun:
    """What a solver carries from block to block: states of all links, and of joints enforced by constraint equations."""

    links: list[LinkState]
    rows: RowState | None = None


TiedStep = Callable[
    [Sequence[LinkState], Sequence[Nominal], Tie],
    tuple[list[LinkState], Float[np.ndarray, " k"], Float[np.ndarray, " r"]],
]


def stepwise_tied(
    step: TiedStep, state: Begun, forcing: Sequence[Forcing], rows: JointRows, scheme: Scheme
) -> tuple[list[LinkHistory], Begun]:
    """All time points of a block."""
    links, held, taken = state.links, state.rows, []
    if held is None:
        raise ValueError("the rows' state at the first time point must be given, got none")
    for k in range(len(forcing[0].R)):
        tie = step_tie(rows.C[k], rows, scheme, held)
        links, z, m = step(links, [each.at(k) for each in forcing], tie)
        held = after_step(tie, z, m, scheme, held)
        taken.append(links)
    return [history([links[i] for links in taken]) for i in range(len(forcing))], Begun(links, held)
