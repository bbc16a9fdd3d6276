"""Natural frequencies over the drive's speed, and where its harmonics meet them."""

from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float


@dataclass(frozen=True, slots=True)
class Campbell:
    """Natural frequencies at P positions over the drive's speed.

    Between the speeds f² goes straight over the square of the speed, to which the stresses of a motion are in proportion.

    speeds : (S,) rising, from 0 on [rad/s]
    values : (S, P, f) [Hz]
    varies : whether they change with the speed; else they are known at all speeds
    """

    speeds: Float[np.ndarray, " S"]
    values: Float[np.ndarray, "S P f"]
    varies: bool

    def bands(self, speeds: Float[np.ndarray, " x"]) -> tuple[Float[np.ndarray, "f x"], Float[np.ndarray, "f x"]]:
        """The least and the greatest frequency of all positions."""
        squares = np.moveaxis(self.values**2, 0, -1).reshape(-1, len(self.speeds))
        found = [np.interp(speeds**2, self.speeds**2, f) for f in squares]
        every = np.reshape(found, (*self.values.shape[1:], len(speeds)))
        return np.sqrt(every.min(axis=0)), np.sqrt(every.max(axis=0))

    def meets(self, harmonic: int, place: int, mode: int) -> float:
        """The least speed at which a harmonic of the drive has the frequency of a position; infinite beyond the last."""
        f2, w2 = self.values[:, place, mode] ** 2, self.speeds**2
        if not self.varies:
            return float(2 * np.pi * np.sqrt(f2[0]) / harmonic)
        over = f2 - w2 * (harmonic / (2 * np.pi)) ** 2
        first = np.flatnonzero((over[:-1] > 0) & (over[1:] <= 0))
        if not len(first):
            return np.inf
        k = int(first[0])
        return float(np.sqrt(w2[k] + (w2[k + 1] - w2[k]) * over[k] / (over[k] - over[k + 1])))


@dataclass(frozen=True, slots=True)
class Crossing:
    """Speeds [rad/s] at which a harmonic of the drive meets a natural frequency somewhere in the turn.

    mode, harmonic : numbers from 1
    fastest : infinite where some position's frequency is met beyond the speeds that were examined
    """

    mode: int
    harmonic: int
    slowest: float
    fastest: float


def crossed(over: Campbell, harmonics: int) -> list[Crossing]:
    """Speeds at which harmonic k of the drive has a natural frequency of some position: from its least to its most."""
    out = []
    for mode in range(over.values.shape[2]):
        if np.isnan(over.values[:, :, mode]).any():
            continue
        for k in range(1, harmonics + 1):
            met = [over.meets(k, place, mode) for place in range(over.values.shape[1])]
            if np.isfinite(met).any():
                out.append(Crossing(mode + 1, k, min(met), max(met)))
    return out
