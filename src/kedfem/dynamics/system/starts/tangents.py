"""Tangents of bodies at a deflection, by central differences of their internal forces, for a Newton–Krylov method.

What the stiffness in mean frames leaves out, as of the axial force of a slender beam, may be far more than its bending. A
body's force depends on its own coordinates alone, so one difference serves a coordinate of all bodies at once.
"""

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.system.record import RIGID_BODY
from kedfem.dynamics.system.sparse import SparsePart
from kedfem.dynamics.system.starts.instant import Flat, Instant
from kedfem.dynamics.system.starts.internal_forces import own
from kedfem.dynamics.system.starts.linear_equations import HeldBody, held_body

MOST = 150  # coordinates of a body: of larger ones, which are not slender, the stiffness stays

Tangents = list[Float[np.ndarray, "N N"]]


def tangents(now: Instant, u: Flat, R: Float[np.ndarray, "L 3 3"], apart: float) -> Tangents:
    """Per small dense body with frames of its own ∂f/∂u in its mean frame, with what holds free motions; of others empty.

    Parameters
    ----------
    R : mean frames of all bodies
    apart : by which coordinates are moved to both sides
    """
    static, of, frames = now.always.static, now.of, now.always.static.frames()
    at, sizes = of.bodies.at, np.diff(of.bodies.at)
    small = [not isinstance(part, SparsePart) and n <= MOST for part, n in zip(of.parts, sizes, strict=True)]
    moved = np.flatnonzero((np.asarray(of.bodies.frame) > RIGID_BODY) & small).tolist()
    out = [np.zeros((int(n), int(n))) if k in moved else np.zeros((0, 0)) for k, n in enumerate(sizes)]
    for j in range(max((int(sizes[k]) for k in moved), default=0)):
        step = np.zeros_like(u)
        wide = [k for k in moved if sizes[k] > j]
        step[[int(at[k]) + j for k in wide]] = apart
        ahead, _ = static.forces(now.motion.R[0], u + step, now.amounts)
        behind, _ = static.forces(now.motion.R[0], u - step, now.amounts)
        for k in wide:
            out[k][:, j] = (ahead[own(of, k)] - behind[own(of, k)]) / (2 * apart)
    static.seek_from(frames)
    for k in moved:
        d = int(of.bodies.components[k])
        T = np.kron(R[k][:d, :d], np.eye(int(sizes[k]) // d))
        out[k] = T.T @ out[k] @ T + now.always.least(k) * np.eye(int(sizes[k]))
    return out


def held_by_tangents(now: Instant, A: Tangents, held: list[HeldBody]) -> list[HeldBody]:
    """Bodies held at their interface points, by their tangents where they have some."""
    return [held_body(a, now.of.parts[k].W) if len(a) else each for k, (a, each) in enumerate(zip(A, held, strict=True))]
