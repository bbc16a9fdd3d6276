"""Static balance of links that only stops constrain, such as an arm pressed against one, by temporary springs.

Iterations that begin away from the stops find no stiffness. Temporary springs on the limited coordinates first keep the
links near the start, and are weakened until the stops take over their forces; the final balance is without springs.
"""

from collections.abc import Callable
from copy import copy

import numpy as np

from kedfem.arrays import Bool
from kedfem.dynamics.system.record import Stop
from kedfem.dynamics.system.starts.instant import Flat, Instant, term_angles
from kedfem.dynamics.system.starts.laws import TemporarySprings
from kedfem.errors import SolveError

STIFFER, STIFFENED = 1e2, 4  # temporary springs than the stops, so many times, until a balance is found
LOOSER, LEAST_LOOSER = 0.1, 0.7  # from one balance to the next, and where that is far too
STILL = 1e-2  # of how far limited coordinates have gone: changes below which temporary springs bear nothing
LAST = 1e-12  # of a stop's stiffness: the loosest

Sought = Callable[[Instant, Flat], Flat]


def has_stops(now: Instant) -> bool:
    """Whether a system has stops, which may hold bodies."""
    return any(isinstance(each.law, Stop) for each in now.of.system.constraints)


def with_temporary_springs(now: Instant, u: Flat, z1: Flat | None, sought: Sought) -> Flat | None:
    """A balance that is found by temporary springs; None if none is.

    Parameters
    ----------
    u : deflection from which the search begins
    z1 : rates of the interface unknowns
    sought : a balance at an instant, from a guess
    """
    laws, static = [each.law for each in now.of.system.constraints], now.always.static
    stiffness = np.array([each.stiffness if isinstance(each, Stop) else 0.0 for each in laws])
    about, bearing = limited(now, u, z1)
    near, frames, at, e = now.near, static.frames(), u, about

    def found(factor: float) -> Flat | None:
        static.seek_from(frames)
        sprung = copy(now)
        sprung.near, sprung.temporary_springs = near, TemporarySprings(factor * stiffness, about) if factor else None
        try:
            return sought(sprung, at)
        except SolveError:
            return None

    factor, looser, first = 1.0, LOOSER, True
    while factor > LAST:
        nearer = found(factor)
        if nearer is None:
            if first and factor >= STIFFER**STIFFENED:
                return None
            if first:
                factor *= STIFFER
                continue
            factor, looser = factor / looser, np.sqrt(looser)
            if looser > LEAST_LOOSER:
                return None
            factor *= looser
            continue
        at, frames, first = nearer, static.frames(), False
        counted = copy(now)
        counted.near = near
        near = term_angles(counted, counted.interface(at))
        before, borne = e, bearing
        e, bearing = limited(counted, at, z1)
        if (bearing & ~borne).any() or np.abs(e - before).max() < STILL * np.abs(e - about).max():
            alone = found(0.0)
            if alone is not None:
                now.near = near
                return alone
        looser = max(LOOSER, looser**2)
        factor *= looser
    return None


def limited(now: Instant, u: Flat, z1: Flat | None) -> tuple[Flat, Bool[np.ndarray, " r"]]:
    """Coordinates that stops limit at a deflection, zero in the place of others, and which stops push."""
    stops = np.array([isinstance(each.law, Stop) for each in now.of.system.constraints], bool)
    e = now.measured(now.interface(u), z1)[1]
    return np.where(stops, e[0], 0.0), np.asarray(stops & (now.forces(e)[:, 0] != 0.0))
