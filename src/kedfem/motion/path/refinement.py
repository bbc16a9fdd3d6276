"""Grid points added to a path until poses between two of them can be predicted to rounding."""

from dataclasses import replace

import numpy as np

from kedfem.arrays import Bool, Float
from kedfem.motion.batch import Moving, moving
from kedfem.motion.linkage import Linkage
from kedfem.motion.newton import OPEN, Target, orthonormal
from kedfem.motion.path.continuation import quintics, shapes
from kedfem.motion.path.record import Path, aimed, predicted

FINE = 3e-14  # of the size: error of a prediction from which rates can be taken
NEAR = 1e-8  # of large linkages: one more iteration of Newton costs less than a finer grid
REFINEMENTS, MOST_POINTS = 5, 20_000


def halved(link: Linkage, along: Path) -> tuple[Path, bool]:
    """The path with a grid point more in each interval, and whether all of these can be closed."""
    middle = (along.phi[:-1] + along.phi[1:]) / 2
    if not len(middle):
        return along, True
    got, aim = _between(link, along, middle)
    fine = got.gap <= OPEN
    return _inserted(along, fine, middle, aim, got)[0], bool(fine.all())


def refined(link: Linkage, along: Path) -> Path:
    """Grid points added where the middle between two is not predicted to rounding."""
    fresh, enough = np.ones(len(along.phi) - 1, bool), FINE if link.blocks is None else NEAR
    for _ in range(REFINEMENTS):
        middle = (along.phi[:-1] + along.phi[1:])[fresh] / 2
        if not len(middle) or len(along.phi) + len(middle) > MOST_POINTS:
            break
        got, aim = _between(link, along, middle)
        R, p = predicted(along, middle)
        apart = np.maximum(
            np.abs(got.poses[0] - R).max(axis=(1, 2, 3)),
            np.abs(got.poses[1] - p).max(axis=(1, 2)) / link.size,
        )
        off = np.isfinite(got.gap) & (apart > enough)
        if not off.any():
            break
        along, fresh = _inserted(along, off, middle, aim, got)
    return along


def _between(link: Linkage, along: Path, tau: Float[np.ndarray, " T"]) -> tuple[Moving, Target]:
    """Poses and rates by τ at places of the path, and what the rows were to be."""
    aim, (_, q1, q2) = aimed(link, along, tau), link.drives.at(tau)
    return moving(link, along.rows, predicted(along, tau), aim, (q1, q2)), aim


def _inserted(
    along: Path, which: Bool[np.ndarray, " T"], tau: Float[np.ndarray, " T"], aim: Target, got: Moving
) -> tuple[Path, Bool[np.ndarray, " I"]]:
    """The path with some further grid points, and which of its intervals end or begin at one of these."""
    at = np.searchsorted(along.phi, tau[which])

    def both(old: np.ndarray, more: np.ndarray) -> np.ndarray:
        return np.insert(old, at, more[which], axis=0)

    phi, near = both(along.phi, tau), both(along.near, aim.near)
    R, p = both(along.R, orthonormal(got.poses[0])), both(along.p, got.poses[1])
    first, second = (
        (both(old[0], more[0]), both(old[1], more[1]))
        for old, more in ((along.first, got.first), (along.second, got.second))
    )
    added = np.insert(np.zeros(len(along.phi), bool), at, True)
    curve = quintics(shapes(R, p, first, second), np.diff(phi))
    along = replace(along, phi=phi, R=R, p=p, first=first, second=second, near=near, curve=curve)
    return along, added[:-1] | added[1:]
