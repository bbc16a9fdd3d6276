"""Large bodies of a system in the modes that hold all their static deflections, in which balances are sought.

A body whose frame does not turn with the rigid-body motion takes no other deflection while it is at rest, or moves on
without vibration: the balance found is that of the unreduced body, without a solution of its factor.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.matrices.dense import coordinates, dense_part
from kedfem.dynamics.modes.static_modes import static_modes
from kedfem.dynamics.reduced_model import reduced_model
from kedfem.dynamics.system.layout import as_arrays
from kedfem.dynamics.system.ready import Motion, Ready
from kedfem.dynamics.system.record import System
from kedfem.dynamics.system.sparse import Part, SparsePart
from kedfem.dynamics.system.starts.initial_states import as_work
from kedfem.dynamics.system.starts.instant import Flat, Instant, instant_near
from kedfem.dynamics.system.starts.internal_forces import own, rows
from kedfem.dynamics.system.state import State
from kedfem.links.record import Link, mass_times
from kedfem.links.reduced import mode_matrix
from kedfem.motion.rigid import RigidMotion

Rows = Sequence[Float[np.ndarray, "_ _"]]


@dataclass(frozen=True, slots=True)
class Condensed:
    """A system, and the one in which its balance is sought: the same, or that with its large bodies in static modes.

    shared : an instant of the latter, with what does not depend on time
    modes : per body (n, s); None where it stays as it is
    """

    full: Ready
    of: Ready
    shared: Instant
    modes: Sequence[Float[np.ndarray, "_ _"] | None]

    def at(self, now: Instant, motion_at: Motion, near: State | None = None) -> Instant:
        """The instant of the condensed system at that of the full one."""
        return now if self.of is now.of else instant_near(self.of, motion_at, now.time, self.shared, near)

    def forces(self, given: Rows) -> Flat:
        """Nodal forces (n, d) of all bodies on coordinates."""
        return as_work(self.of, [x if Q is None else Q.T @ x for Q, x in zip(self.modes, given, strict=True)])

    def onto(self, x: Flat) -> Flat:
        """Coordinates of all bodies of the full system on the condensed one."""
        out = []
        for k, (link, Q) in enumerate(zip(self.full.system.model.links, self.modes, strict=True)):
            here = x[own(self.full, k)]
            if Q is not None:
                on = Q.T @ mass_times(link.mass, rows(self.full, k, here))
                here = coordinates(self.of.system.model.links[k], self.of.parts[k], on).ravel()
            out.append(here)
        return np.concatenate(out)

    def back(self, x: Flat) -> Flat:
        """Coordinates of the full system from those of the condensed one."""
        out = []
        for k, (link, Q) in enumerate(zip(self.full.system.model.links, self.modes, strict=True)):
            here = x[own(self.of, k)]
            if Q is not None:
                here = coordinates(link, self.full.parts[k], Q @ rows(self.of, k, here)).ravel()
            out.append(here)
        return np.concatenate(out)


def condensed(now: Instant, turning: Callable[[], RigidMotion] | None, forces: Rows | None = None) -> Condensed:
    """The system in which the balance at an instant is sought.

    Parameters
    ----------
    turning : motion over the times of the search, if inertia of the deflection counts: a body has it that turns with
        this; asked for where there are large bodies
    forces : per body (n, d), beside its loads
    """
    of, every = now.of, zip(now.of.parts, now.of.system.model.links, strict=True)
    large = [k for k, (part, link) in enumerate(every) if _is_large(part, link)]
    bodies = of.bodies.motion[large]
    if large and turning is not None:
        motion = turning()
        if motion.omega[:, bodies].any() or motion.alpha[:, bodies].any():
            large = []
    if not large or of.c.single or of.stressed is not None:
        return Condensed(of, of, now, [None] * len(of.parts))
    if forces is not None:
        return _made(now, large, forces)
    if not of.condensed:
        of.condensed.append(_made(now, large, [np.zeros((0, 0))] * len(of.parts)))
    found: Condensed = of.condensed[0]
    return found


def _is_large(part: Part, link: Link) -> bool:
    return isinstance(part, SparsePart) and link.meshed and link.full is None


def _made(now: Instant, large: Sequence[int], forces: Rows) -> Condensed:
    of, model, parts = now.of, now.of.system.model, list(now.of.parts)
    modes: list[Float[np.ndarray, "_ _"] | None] = [None] * len(parts)
    for k in large:
        loads = [load.forces for load in model.loads[k]] + [forces[k]]
        modes[k] = static_modes(model.links[k], model.joints[k], loads)
    small = reduced_model(model, modes)
    for k in large:
        modes[k] = mode_matrix(small.links[k])
        parts[k] = dense_part(small.links[k], small.joints[k], of.c.c_M, of.c.c_K)
    system = replace(of.system, model=small)
    made = replace(of, system=system, parts=parts, **_arrays(system, parts), halves=[], condensed=[])
    return Condensed(of, made, Instant(made, lambda t: now.motion, now.time), modes)


def _arrays(system: System, parts: Sequence[Part]) -> dict[str, Any]:
    bodies, ends, constraints = as_arrays(system, parts)
    return {"bodies": bodies, "ends": ends, "constraints": constraints}
