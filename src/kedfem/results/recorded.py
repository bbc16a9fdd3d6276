"""A channel and where its rows come from."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from kedfem.dynamics.history import Block
from kedfem.results.records import Channel

Rows = Float[np.ndarray, "T c"]


@dataclass(frozen=True, slots=True)
class Recorded:
    """A channel, and its rows over a block of time points."""

    channel: Channel
    rows: Callable[[Block], Rows]
