"""Refinement of the grid of a path until poses between its points are interpolated to rounding."""

from dataclasses import replace

import numpy as np

from kedfem.motion.batch import RowSelection, newton_solution, solved_motion
from kedfem.motion.linkage import Linkage
from kedfem.motion.newton import OPEN, BlockFactor, Factor, target
from kedfem.motion.path.continuation import shapes
from kedfem.motion.path.record import Path, predicted, target_on_path, with_points

FINE = 6e-14  # of the size: error of a prediction whose rates are exact to rounding
NEAR = 1e-8  # of large linkages, where one more Newton iteration costs less than a finer grid
HALVES = 64  # ratio of the errors of quintics on a grid and on its bisection
REFINEMENTS, MOST_POINTS = 5, 20_000


def bisected(link: Linkage, along: Path) -> tuple[Path, bool, Factor | BlockFactor | None]:
    """The path with a grid point more in each interval; whether all of these can be closed; its factored rows, if known.

    In small linkages all points are solved to rounding, in large ones only the new points.
    """
    middles = np.arange(1, len(along.phi))
    phi, near = (np.insert(x, middles, (x[:-1] + x[1:]) / 2, axis=0) for x in (along.phi, along.near))
    if link.blocks is not None:
        phi, near, old = phi[1::2], near[1::2], along
    else:
        old = replace(along, phi=phi[:0], shape=along.shape[:, :0], near=near[:0])
    wanted, rates = target(link, phi, near), link.drives.at(phi)[1:]
    got = newton_solution(link, RowSelection(link.rows), predicted(along, phi), wanted, rates)
    fine = got.gap <= OPEN
    kept = fine | np.isin(phi, along.phi)
    closes = bool(fine.all())
    whole = got.factor if closes and old is not along else None
    return with_points(old, phi[kept], shapes(got)[:, kept], near[kept])[0], closes, whole


def refined(link: Linkage, along: Path) -> Path:
    """The path with grid points added where the middle between two is not predicted to rounding."""
    fresh, enough = np.ones(len(along.phi) - 1, bool), FINE if link.blocks is None else NEAR
    for _ in range(REFINEMENTS):
        middle = (along.phi[:-1] + along.phi[1:])[fresh] / 2
        if not len(middle) or len(along.phi) + len(middle) > MOST_POINTS:
            break
        aim, (R, p) = target_on_path(link, along, middle), predicted(along, middle)
        got = solved_motion(link, along.rows, (R, p), aim, link.drives.at(middle)[1:])
        apart = np.maximum(
            np.abs(got.poses[0] - R).max(axis=(1, 2, 3)), np.abs(got.poses[1] - p).max(axis=(1, 2)) / link.size
        )
        off = np.isfinite(got.gap) & (apart > enough)
        still = np.append(np.zeros(len(along.phi), bool), (apart > HALVES * enough)[off])
        along, order = with_points(along, middle[off], shapes(got)[:, off], aim.near[off])
        fresh = still[order][:-1] | still[order][1:]
    return along
