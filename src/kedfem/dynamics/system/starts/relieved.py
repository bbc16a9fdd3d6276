"""Deflection of a system that nothing drives, accelerating without vibration: K δ = P − M a, its links rigid in a."""

import numpy as np

from kedfem.dynamics.matrices.bordered import ConstraintTerms
from kedfem.dynamics.system.starts.accelerations import accelerations, own_spin
from kedfem.dynamics.system.starts.initial_states import as_coordinates
from kedfem.dynamics.system.starts.instant import Flat, Instant
from kedfem.dynamics.system.starts.internal_forces import drawn, own, rotated_rate, rows
from kedfem.dynamics.system.starts.modified_newton import FREE, equilibrium


def relieved(now: Instant, v: Flat) -> tuple[Flat, Flat]:
    """Deflection of a system that nothing drives, and its rates: it turns with its links."""
    of, links = now.of, now.of.system.model.links
    spins = [
        own_spin(link, rows(of, k, v[own(of, k)]), drawn(link) @ now.R[k][: link.d, : link.d].T)
        for k, link in enumerate(links)
    ]

    def rate(u: Flat) -> Flat:
        turning = [rotated_rate(S, rows(of, k, u[own(of, k)])) for k, S in enumerate(spins)]
        return np.asarray(v + as_coordinates(of, turning))

    def inertia(u: Flat, f: Flat) -> Flat:
        z, moving = now.interface(u), rate(u)
        C, e = now.gradients(z), now.coordinates(np.stack([z, now.interface(moving), 0 * z]))
        hard = now.hard(C)
        m = np.where(hard, 0.0, now.forces(e)[:, 0])
        asked = ConstraintTerms(C[hard], -e[2, hard], np.zeros(int(hard.sum())), C.T @ m)
        return -accelerations(now, now.F - f, u, moving, asked, rigid=True).x

    u = equilibrium(now, np.zeros_like(v), inertia, None, now.interface(v), FREE)
    return u, rate(u)
