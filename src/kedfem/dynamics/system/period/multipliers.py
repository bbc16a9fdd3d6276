"""Floquet multipliers of small vibrations about a steady motion: the eigenvalues of Φ.

Arnoldi's method finds them from the state after a random impulse, so that vibrations which the loads do not excite are
included. The largest magnitude is the factor by which a vibration grows, or decays, in a period.
"""

import numpy as np

from kedfem.arrays import Complex
from kedfem.dynamics.system.period.krylov import SMALL, Derivative, arnoldi, combined, scale_of
from kedfem.dynamics.system.period.map import PeriodMap
from kedfem.dynamics.system.starts.instant import Flat

MOST, AGAIN = 80, 5  # marches, at most; those after which no larger one may have come up
SURE, ABOUT = 1e-7, 1e-3  # residuals of multipliers of linear systems, and of others


def multipliers(over: PeriodMap, x: Flat, y: Flat) -> tuple[Complex[np.ndarray, " f"], bool, Flat]:
    """Eigenvalues of Φ, of largest magnitude first, whether the first is certain, and the real part of its vector."""
    tolerance = SURE if over.linear else ABOUT
    links = over.of.system.model.links
    random = np.random.default_rng(0)
    blow = [random.standard_normal((link.n, link.d)) for link in links]
    v, scale = over.change(over(x, blow), y), scale_of(over, y)
    if not over.linear and over.size(v) > 0.0:
        blow = [each * (SMALL * scale / over.size(v)) for each in blow]
        v = over.change(over(x, blow), y)
    over.weighed(v)
    size = over.whole(v)
    if not size > 0.0:
        return np.zeros(1, complex), True, 0 * v
    by, found, since = (scale or 1.0) * (1.0 if over.linear else SMALL), np.zeros(0, complex), 0
    basis = [v / size]
    for H in arnoldi(Derivative(over, x, y, by), basis, MOST):
        values, shapes = np.linalg.eig(H[:-1].astype(complex))
        order = np.argsort(-np.abs(values))
        off = H[-1, -1] * np.abs(shapes[-1, order]) / np.linalg.norm(shapes[:, order], axis=0)
        found = values[order]
        sure = len(found) > 2 and off[0] <= tolerance * max(abs(found[0]), tolerance)
        since = since + 1 if sure else 0
        if since > AGAIN:  # the first that is found need not be the largest: some are hardly struck
            good = off <= max(tolerance, 1e-4) * np.maximum(np.abs(found), tolerance)
            return found[good], True, combined(shapes[:, order[0]].real, basis)
    shape = combined(shapes[:, order[0]].real, basis)
    return (found, True, shape) if len(found) < MOST else (found[:1], since > 0, shape)
