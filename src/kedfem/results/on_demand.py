"""Channels of a large results file, each read on demand, so that the end of a long run needs no more memory."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import OutputError
from kedfem.results.channels import Channel
from kedfem.results.files import reason
from kedfem.results.layout import all_rows, opened_to_read, read_text

AT_ONCE = 64_000_000  # bytes: smaller files are read at once
KEPT = 32_000_000  # bytes of the rows read last, which are kept in memory

Series = tuple[Channel, Float[np.ndarray, "n c"]]


def rows_of(rows: Any, channel: Channel, n: int) -> Float[np.ndarray, "n c"]:
    """The first rows of a channel's dataset; errors as of `all_rows`."""
    return all_rows(rows, n).reshape(n, len(channel.columns))


@dataclass(slots=True, eq=False)
class OnDemand(Mapping[str, Series]):
    """Name → (channel, values (n, columns), read-only).

    file : the results file
    scene : scene of its run in JSON
    known : the channels, in the order recorded
    count : n
    """

    file: Path
    scene: str
    known: Mapping[str, Channel]
    count: int
    cached: dict[str, Float[np.ndarray, "n c"]] = field(default_factory=dict, repr=False)

    def __getitem__(self, name: str) -> Series:
        """A channel with its rows.

        Raises
        ------
        OutputError
            The file is not there any more, corrupt, or that of another run.
        """
        channel = self.known[name]
        values = self.cached.pop(name, None)
        self.cached[name] = self._read(channel) if values is None else values
        size = sum(x.nbytes for x in self.cached.values())
        while size > KEPT and len(self.cached) > 1:
            size -= self.cached.pop(next(iter(self.cached))).nbytes
        return channel, self.cached[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.known)

    def __len__(self) -> int:
        return len(self.known)

    def _read(self, channel: Channel) -> Float[np.ndarray, "n c"]:
        wanted = f"{self.file}: must be the results file that was opened"
        try:
            with opened_to_read(self.file) as file:
                if read_text(file["scene/json"]) != self.scene or len(file[channel.name]) < self.count:
                    raise OutputError(f"{wanted}, got that of another run: open it again")
                return rows_of(file[channel.name], channel, self.count)
        except (OSError, RuntimeError) as error:
            raise OutputError(f"{wanted}, got a corrupt file ({reason(error)})") from error
        except (KeyError, ValueError) as error:
            raise OutputError(f"{wanted}, got one with a gap ({error})") from error


def selection(channels: Mapping[str, Series], names: Iterable[str]) -> Mapping[str, Series]:
    """A selection of channels by name; those that are read on demand still are."""
    if isinstance(channels, OnDemand):
        return replace(channels, known={name: channels.known[name] for name in names})
    return {name: channels[name] for name in names}
