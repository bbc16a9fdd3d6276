"""Steps by the monolithic solver, returned as those of a march: what `solver = "monolithic"` takes."""

from collections.abc import Sequence

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.frames import frames_of, mean_orientation
from kedfem.dynamics.matrices.dense import coordinates
from kedfem.dynamics.system.layout import points_of
from kedfem.dynamics.system.monolithic.monolithic import Monolithic, Now, Seen
from kedfem.dynamics.system.ready import Motion, Ready, displacements
from kedfem.dynamics.system.starts.instant import Instant, renumbered
from kedfem.dynamics.system.starts.internal_forces import own
from kedfem.dynamics.system.state import History, State, empty_history
from kedfem.links.record import Link
from kedfem.motion.rigid import RigidMotion


def monolithic_march(
    of: Ready, solver: Monolithic, state: State | Now, motion: RigidMotion, motion_at: Motion | None = None
) -> tuple[Now, History]:
    """All steps to the times of a motion; see `march`.

    Parameters
    ----------
    motion_at : rigid-body motion at any times, which co-rotational frames of a state need; without it steps in which
        stops are met stay undivided

    Raises
    ------
    SolveError
        If the iterations of a step do not converge.
    """
    now = begun(of, state, motion_at) if isinstance(state, State) else state
    history, number = empty_history(len(motion.t), of.bodies, of.constraints), renumbered(of)
    for t in range(len(motion.t)):
        before, at = now, motion.part(t, t + 1)
        now = solver.step(before, at, motion_at)
        history.z[t, number], history.e[t], history.multiplier[t] = now.z, now.e[0], now.multiplier
        history.rate[t] = solver.own_rates(now, now.z_rates[1], at)
        history.port_force[t] = now.port_force
        for k, link in enumerate(of.system.model.links):
            whole, here = motion.R[t, of.bodies.motion[k]], solver.of[k]
            for out, x in ((history.u, now.u), (history.v, now.v), (history.a, now.a)):
                out[t, own(of, k)] = _coordinates(of, k, link, x[here].reshape(link.n, link.d))
            u, R = now.u[here].reshape(link.n, link.d), whole[: link.d, : link.d]
            g = [x[0] for _, x in now.g[k]] or [u @ R]
            history.R[t, k] = whole
            history.R[t, k, : link.d, : link.d] = mean_orientation(link, u, R)
            history.g[t, own(of, k)] = _coordinates(of, k, link, g[0])
            K0 = [frame.K0 for frame in frames_of(link)] or [link.K0]
            history.energy[t, k] = sum(0.5 * float(x.ravel() @ (K @ x.ravel())) for K, x in zip(K0, g, strict=True))
            b = np.searchsorted(of.bodies.beams.segment, k)
            for e, (point, x) in enumerate(zip(points_of(link), g, strict=False)):
                history.strain[t, b, :, e] = point.strains @ x.ravel()
    return now, history


def begun(of: Ready, state: State, motion_at: Motion | None) -> Now:
    """A state in nodal rows.

    Parameters
    ----------
    motion_at : rigid-body motion at any times, for co-rotational frames
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
        rates = state.damped[:, here]
        damped.append(np.stack([nodal_forces(of, k, x) for x in rates]))
    seen: list[list[Seen]] = [[] for _ in links]
    if motion_at is not None and any(link.fit is not None for link in links):
        inside = Instant(of, motion_at, float(state.time[0])).internal_states(state.u, state.v)
        seen = [[(x.angle, np.stack([x.g, x.g1, 0 * x.g])) for x in each.frames] for each in inside]
    return Now(
        u, v, a, f, F, seen, state.z[0, number], state.e.copy(), state.term_angles.copy(),
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
