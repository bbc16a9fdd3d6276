"""Extremes of a run's channels over its last turns, and whether it has settled."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from kedfem.results import Results

NOTHING = 1e-6  # of the largest channel with the same unit: what is rounding in a channel that should be zero
MAGNITUDE = "magnitude"
SUMS = "energy/"  # channels that add up over the run: they have no extremes of a turn

Extreme = tuple[float, float, float, float]
"""Maximum, minimum, root of the mean square, time [s] of the largest magnitude."""


def extremes(results: Results, since: float) -> dict[str, tuple[str, Extreme]]:
    """Of every column after a time [s]: name → unit, extremes; of vectors also their magnitude."""
    some = results.time > since
    t = results.time[some]
    return {
        name: (unit, _four(t, values))
        for name, unit, values in columns(results, some)
    }  # fmt: skip


def _four(t: Float[np.ndarray, " n"], values: Float[np.ndarray, " n"]) -> Extreme:
    rms = np.sqrt((values**2).mean())
    return float(values.max()), float(values.min()), float(rms), float(t[np.abs(values).argmax()])


def columns(results: Results, some: np.ndarray) -> Iterator[tuple[str, str, Float[np.ndarray, " n"]]]:
    """Name, unit and values of every column at some of the rows; energies and works are left out."""
    for name, (channel, values) in results.channels.items():
        if name.startswith(SUMS):
            continue
        rows = values[some]
        if not channel.columns or rows.ndim == 1:
            yield name, channel.unit, rows.reshape(len(rows))
            continue
        for k, column in enumerate(channel.columns):
            yield f"{name}/{column}", channel.unit, rows[:, k]
        if channel.columns == ("x", "y", "z"):
            yield f"{name}/{MAGNITUDE}", channel.unit, np.sqrt((rows**2).sum(axis=1))


def change(results: Results, turn: float) -> float:
    """By how much the largest magnitudes of the last turn [s] differ from those of the turn before, relative, at worst.

    Channels that are nothing beside others of the same unit are left out; nan where there are no two turns.
    """
    end = float(results.time[-1])
    half = 0.5 * float(results.time[-1] - results.time[-2])
    if end < 2 * turn - half:
        return float("nan")
    last = results.time > end - turn + half
    before = (results.time > end - 2 * turn + half) & ~last
    now, then = (
        {name: (unit, np.abs(values).max()) for name, unit, values in columns(results, some)}
        for some in (last, before)
    )
    largest: dict[str, float] = {}
    for found in (now, then):
        for unit, size in found.values():
            largest[unit] = max(largest.get(unit, 0.0), size)
    changes = [
        abs(size - then[name][1]) / max(size, then[name][1])
        for name, (unit, size) in now.items()
        if max(size, then[name][1]) > NOTHING * largest[unit]
    ]
    return float(max(changes, default=0.0))
