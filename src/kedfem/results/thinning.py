"""The time points of a run that become rows of its file (each n-th, first, last), and the largest values of all."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from kedfem.arrays import Float
from kedfem.results.channels import Channel

Rows = dict[str, Float[np.ndarray, "b ..."]]


@dataclass
class Thinning:
    """Selection of the rows that one run writes to its file.

    channels : of the run
    every : n
    steps : time points so far
    last : the rows of the last of them, where those are not written yet
    largest : name of a channel → time, position of the drive and values at those time points so far at which one of
        its columns, or the length of all of them, is largest: in the order of time, at most one more than it has columns
    """

    channels: Sequence[Channel]
    every: int = 1
    steps: int = 0
    last: Rows | None = None
    largest: dict[str, Float[np.ndarray, "k r"]] = field(default_factory=dict)
    REMEMBERED: ClassVar = ("last", "largest")

    @property
    def rows(self) -> int:
        """Number of time points so far that are written immediately."""
        return -(-self.steps // self.every)

    def chosen(self, rows: Rows, when: tuple[str, str]) -> tuple[Rows, Rows | None]:
        """The rows of more time points that are written immediately, and the last time point if it is not among them.

        Parameters
        ----------
        when : names of time and of the drive's position among the rows
        """
        which = slice(-self.steps % self.every, None, self.every)
        self.steps, self.last = self.steps + len(rows[when[0]]), None
        if self.every > 1:
            self._examine(rows, when)
        waits = {name: block[-1:].copy() for name, block in rows.items()} if (self.steps - 1) % self.every else None
        return {name: block[which] for name, block in rows.items()}, waits

    def _examine(self, rows: Rows, when: tuple[str, str]) -> None:
        for channel in self.channels:
            here = np.column_stack([*(rows[name] for name in when), rows[channel.name]])
            before = self.largest.get(channel.name, here[:0])
            every = np.concatenate([before, here])
            sizes = np.abs(every[:, 2:])
            which = [*sizes.argmax(axis=0), np.linalg.norm(sizes, axis=1).argmax()]  # the first where several are alike
            self.largest[channel.name] = every[np.unique(which)]
