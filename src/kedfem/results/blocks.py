"""Checks of a block of rows before it is written."""

from collections.abc import Mapping, Sequence

import numpy as np

from kedfem.arrays import Float
from kedfem.results.channels import Channel


def require_channels(channels: Sequence[Channel], length: int, values: Mapping[str, Float[np.ndarray, "b c"]]) -> None:
    """Check names and shapes of a block; ValueError if they differ."""
    expected = {channel.name: (length, len(channel.columns)) for channel in channels}
    found = {name: np.shape(block) for name, block in values.items()}
    if found != expected:
        wrong = sorted(set(expected.items()) ^ set(found.items()))
        raise ValueError(f"values: must be the channels with their shapes, differs in {wrong}")


def not_finite(time: Float[np.ndarray, " b"], values: Mapping[str, Float[np.ndarray, "b c"]]) -> tuple[int, str] | None:
    """The first row with a value that is not finite, and the message about it."""
    first, message = len(time), ""
    for name, block in values.items():
        bad = ~np.isfinite(block).all(axis=1)
        if bad.any() and (row := int(np.argmax(bad))) < first:
            got = block[row][~np.isfinite(block[row])][0]
            first = row
            message = f"{name}: must be finite, got {got:g} at t = {time[row]:.6g} s; take a shorter step"
    return (first, message) if message else None
