"""Steps of a system by the oracle, as a march hands them on: what `solver = "monolithic"` takes with force elements."""

from collections.abc import Sequence

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.matrices.dense import coordinates
from kedfem.dynamics.system.blank import empty_history
from kedfem.dynamics.system.march import Ready, displacements
from kedfem.dynamics.system.oracle.monolithic import Monolithic, Now
from kedfem.dynamics.system.starts.instant import renumbered
from kedfem.dynamics.system.starts.internal_forces import own
from kedfem.dynamics.system.state import History, State
from kedfem.links.record import Link
from kedfem.motion.rigid import RigidMotion


def monolithic_march(
    of: Ready, solver: Monolithic, state: State | Now, motion: RigidMotion
) -> tuple[Now, History]:
    """All steps to the times of a motion; see `march`.

    Raises
    ------
    SolveError
        If the iterations of a step do not converge.
    """
    now = begun(of, solver, state, motion) if isinstance(state, State) else state
    history, number = empty_history(len(motion.t), of.bodies, of.constraints), renumbered(of)
    for t in range(len(motion.t)):
        before, at = now, motion.part(t, t + 1)
        now = solver.step(before, at)
        history.z[t, number], history.e[t], history.multiplier[t] = now.z, now.e[0], now.multiplier
        history.rate[t] = solver.own_rates(now, before, at)
        history.port_force[t] = now.port_force
        for k, link in enumerate(of.system.model.links):
            R, here = motion.R[t, of.bodies.motion[k], : link.d, : link.d], solver.of[k]
            g = now.u[here].reshape(link.n, link.d) @ R
            for out, x in ((history.u, now.u), (history.v, now.v), (history.a, now.a)):
                out[t, own(of, k)] = _coordinates(of, k, link, x[here].reshape(link.n, link.d))
            history.g[t, own(of, k)] = _coordinates(of, k, link, g)
            history.energy[t, k] = 0.5 * float(g.ravel() @ (link.K0 @ g.ravel()))
    return now, history


def begun(of: Ready, solver: Monolithic, state: State, motion: RigidMotion) -> Now:
    """A state in nodal rows; its frames are rigid-body ones.

    Parameters
    ----------
    motion : any, for its bodies
    """
    links = of.system.model.links
    u, v, a = (
        np.concatenate([displacements(of, k, x[None])[0].ravel() for k in range(len(links))])
        for x in (state.u, state.v, state.a)
    )
    f, F = (np.concatenate([nodal_forces(of, k, x[own(of, k)]).ravel() for k in range(len(links))])
            for x in (state.f, state.F))  # fmt: skip
    number, damped = renumbered(of), []
    for k in range(len(links)):
        here = own(of, k)
        rates = np.split(state.damped[3 * here.start : 3 * here.stop], 3)
        damped.append(np.stack([nodal_forces(of, k, x) for x in rates]))
    return Now(
        u, v, a, f, F, [[] for _ in links], state.z[0, number], state.e.copy(), state.turned.copy(),
        state.bearing[number], damped, state.z[:, number], state.multiplier.copy(), state.port_force.copy(),
    )  # fmt: skip


def _coordinates(of: Ready, k: int, link: Link, rows: Float[np.ndarray, "n d"]) -> Float[np.ndarray, " N"]:
    return coordinates(link, of.parts[k], rows).ravel()


def nodal_forces(of: Ready, k: int, x: Float[np.ndarray, " N"]) -> Float[np.ndarray, "n d"]:
    """Nodal forces from those on coordinates, T⁻ᵀ = m T."""
    link, T = of.system.model.links[k], of.parts[k].T
    each: Sequence[np.ndarray] = list(x.reshape(link.d, link.n))
    if T:
        each = [link.mass[c] @ (T[c] @ y) for c, y in enumerate(each)]
    return np.stack(each, axis=1)
