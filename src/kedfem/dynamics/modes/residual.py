"""The residual of a reduced model in the unreduced equation, and the static deflection that it causes."""

from collections.abc import Sequence

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.history import LinkMoment, Snapshot
from kedfem.dynamics.joints.constraint_matrices import constraint_matrices
from kedfem.dynamics.joints.ports import add_port_forces
from kedfem.dynamics.matrices.closed import closed
from kedfem.dynamics.matrices.substructure import Substructure
from kedfem.dynamics.model import Model
from kedfem.dynamics.rigid_body import forcings
from kedfem.dynamics.stepping.state import NodalOf, Rayleigh, damping_times
from kedfem.dynamics.system.forces.exerted import on_links
from kedfem.dynamics.system.forces.follower_loads import own_patterns, rotated_forces
from kedfem.dynamics.system.forces.supports import Supports
from kedfem.links.record import Link, mass_times
from kedfem.motion.newton import cross_matrix
from kedfem.motion.rigid import RigidMotion, joined


def residual_deflections(
    full: Model, parts: Sequence[Substructure], model: Model, snapshots: Sequence[Snapshot], points: Model | None = None
) -> list[list[NodalOf]]:
    """Static answers of the linkage to r = P − M R0'' − M δ'' − C δ' − K δ + Wᵀ λ, [KED, eq. (20)], link frames.

    Their strain energy is the residual in the norm dual to the energy's. P has the forces of force elements.

    Parameters
    ----------
    full : the model that was reduced
    points : it with interface points for force elements, if there are any
    parts : `static_parts` of it
    model, snapshots : the reduced model and its states at some times

    Returns
    -------
    (n, d) of each link, at each of these times
    """
    motions = [snapshot.motion.part(snapshot.k, snapshot.k + 1) for snapshot in snapshots]
    every = [_residuals(full, model, each, x, points) for each, x in zip(motions, snapshots, strict=True)]
    if not every:
        return []
    R = [np.stack([x.states[k].R for x in snapshots]) for k in range(len(parts))]
    frozen = closed(parts, R, constraint_matrices(full.rows, joined(motions), full.interface_unknowns))
    found = frozen.deflections([np.stack(each) for each in zip(*every, strict=True)])
    return [[x[t] for x in found] for t in range(len(snapshots))]


def _residuals(full: Model, model: Model, motion: RigidMotion, now: Snapshot, points: Model | None) -> list[NodalOf]:
    """r of each link, at one time."""
    W, states = cross_matrix(motion.omega[0]), now.states
    F = [each.F[0] for each in forcings(full, motion)]
    for k, load in own_patterns(full.loads):
        u = _unreduced(model.links[k], full.links[k], states[k].u)[None]
        R = motion.R[:, full.bodies[k]]
        F[k] = F[k] + rotated_forces(full.links[k], load, R, u, load.factor(motion.t, motion.phi))[0]
    if points is not None:
        for k, more in on_links(Supports(now.multipliers, motion), points).items():
            F[k] = F[k] + more[0]
    out = [
        _residual(link, full.damping, small, state, each, W[body, : link.d, : link.d])
        for link, small, state, each, body in zip(full.links, model.links, states, F, full.bodies, strict=True)
    ]
    for r, joint, state in zip(out, full.joints, states, strict=True):
        add_port_forces(r, joint, state.port_forces)
    return out


def _residual(
    link: Link, damping: Rayleigh, small: Link, state: LinkMoment, F: Float[np.ndarray, "n d"],
    spin: Float[np.ndarray, "d d"],
) -> Float[np.ndarray, "n d"]:  # fmt: skip
    """Without the port forces; the rate of g is that of the co-rotated deformation, Rᵀ (δ' − ω × δ)."""
    a, g, rate = state.a, state.g, (state.v - state.u @ spin.T) @ state.R
    a, g, rate = (_unreduced(small, link, x) for x in (a, g, rate))
    r = (F - mass_times(link.mass, a)) @ state.R
    r -= (link.K0 @ g.ravel()).reshape(r.shape)
    if damping.present:
        r -= damping_times(link, damping, rate)
    return np.asarray(r)


def _unreduced(small: Link, link: Link, x: NodalOf) -> NodalOf:
    """Rows of a state on the functions of the link that was reduced, if it was."""
    return x if small is link or small.Q is None else np.asarray(small.Q @ x)
