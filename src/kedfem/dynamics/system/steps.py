"""Steps of links with nominal frames under motors, springs and dampers, taken by the system, as histories of links.

What a force element exerts on its links is part of their forces F there, and forces at ports are those of joints alone.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from kedfem.dynamics.action import Action, kernel_table, vectors
from kedfem.dynamics.coupling import Attachment, joined
from kedfem.dynamics.dense import coordinates, port_rows, work_on, work_over_time
from kedfem.dynamics.history import Block, Forcing, LinkHistory
from kedfem.dynamics.model import Model
from kedfem.dynamics.row_ports import Ways
from kedfem.dynamics.scheme import Scheme
from kedfem.dynamics.state import LinkState
from kedfem.dynamics.system.arrays import History, State
from kedfem.dynamics.system.blank import empty_state
from kedfem.dynamics.system.build import system_of
from kedfem.dynamics.system.instant import Instant, turned
from kedfem.dynamics.system.internal import own
from kedfem.dynamics.system.march import displacements, march, ready
from kedfem.dynamics.system.record import System
from kedfem.errors import MeshError
from kedfem.motion.linkage import linkage
from kedfem.motion.rigid import RigidMotion
from kedfem.scene import Scene

Rows = Float[np.ndarray, "T _ _"]


def nominal_system(scene: Scene, model: Model) -> System | None:
    """The system of a scene whose links have nominal frames.

    None with slots, which it does not know yet, and where a force element's seat does not tell how it turns as a whole.
    """
    kinds = {joint.kind for joint in scene.joints.values()}
    names = [link.name for link in model.links]
    if "slot" in kinds or len(set(names)) < len(names):
        return None
    rigid = linkage(scene)
    ways = Ways({name: k for k, name in enumerate(rigid.bodies)}, {})
    try:
        held = joined(scene, dict(zip(names, model.links, strict=True)), (), ways, elements=True)
    except MeshError:
        return None
    own = replace(model, joints=tuple(held.attachments[name] for name in names), rows=held.rows)
    return system_of(scene, rigid, model=own)


class SystemSteps:
    """Advances all links, block by block.

    Parameters
    ----------
    model : of the links whose states are handed on, without interface points for force elements
    every : motors and springs as actions on it
    """

    stiffening = None

    def __init__(self, system: System, model: Model, scheme: Scheme, every: Sequence[Action]) -> None:
        self.model, self.links, self.ready, self.every = model, model.links, ready(system, scheme), every
        self.factorisations = len(self.ready.parts)
        unit = {"stiffness": 0.0, "damping": 0.0, "over": 0, "at": (0.0,), "value": (1.0,)}
        self._unit = kernel_table([replace(action, **unit) for action in every])  # type: ignore[arg-type]
        names = {each.name: n for n, each in enumerate(system.constraints)}
        self._of = [names.get(action.name.replace("/", "."), -1) for action in every]
        self._W = [
            port_rows(part.T, joint, link.n)
            for part, joint, link in zip(self.ready.parts, model.joints, model.links, strict=True)
        ]
        self._from_work = [np.linalg.pinv(W) for W in self._W]

    def begin(self, states: Sequence[LinkState], motion: RigidMotion) -> State:
        """The system's state from those of links.

        Parameters
        ----------
        motion : nominal motion at that time only
        """
        of = self.ready
        state, now = empty_state(of.bodies, of.constraints), Instant(of, lambda t: motion, float(motion.t[0]))
        bearing = np.zeros(of.system.unknowns)
        state.time[0], state.F[:] = motion.t[0], now.F
        for k, (link, part, joint, s) in enumerate(
            zip(self.links, of.parts, of.system.model.joints, states, strict=True)
        ):
            at = own(of, k)
            for out, x in ((state.u, s.u), (state.v, s.v), (state.a, s.a)):
                out[at] = coordinates(link, part, x).ravel()
            state.f[at] = work_on(part, s.f @ s.R.T).ravel()
            for m, x in enumerate(s.C if s.C is not None else ()):
                N = at.stop - at.start
                state.damped[3 * at.start + m * N :][:N] = work_on(part, x).ravel()
            left = (state.a[at] + state.f[at] - state.F[at]).reshape(link.d, link.n)
            inside = np.linalg.lstsq(part.W.T, (s.R.T @ left).ravel(), rcond=None)[0]
            force = _turned(joint, inside[None], s.R.T[None])[0]
            state.port_force[of.bodies.port_at[k] : of.bodies.port_at[k + 1]] = force
            bearing += joint.B.T @ force
        z = np.stack([now.interface(x) for x in (state.u, state.v, state.a)])
        state.z[:, now.always.number], state.bearing[now.always.number] = z, bearing
        state.e[:], state.turned[:] = now.coordinates(z), turned(now, z[0])
        return state

    def advance(
        self, state: State, forcing: Sequence[Forcing], motion: RigidMotion
    ) -> tuple[list[LinkHistory], State]:
        """All time points of a block; see `DenseSteps.advance`.

        Raises
        ------
        SolveError
            If the iterations of a step do not converge.
        """
        state, found = march(self.ready, state, motion)
        moved = [self._moved(k, found, each) for k, each in enumerate(forcing)]
        acting = self._acting(moved, found, motion)
        return [
            replace(link, F=link.F + F, port_forces=self._at_joints(k, found, link.R, F))
            for k, (link, F) in enumerate(zip(moved, acting, strict=True))
        ], state

    def _moved(self, k: int, found: History, forcing: Forcing) -> LinkHistory:
        """How a link moves; its forces are still those of loads alone."""
        u, v, a, g = (displacements(self.ready, k, x) for x in (found.u, found.v, found.a, found.g))
        strain = found.energy[:, k].copy()
        return LinkHistory(u, v, a, g, forcing.R, forcing.F, np.zeros((len(u), 0)), strain)

    def _acting(self, moved: Sequence[LinkHistory], found: History, motion: RigidMotion) -> list[Rows]:
        """Forces of motors and springs on the rows (T, n, d) of all links, world components."""
        from kedfem.dynamics.actions_kernel import evaluate_all

        out = [np.zeros_like(link.u) for link in moved]
        if not self.every:
            return out
        x, _ = vectors(self.every, Block(0, motion, moved))
        forces, none = np.zeros_like(x), np.zeros((len(x), len(self.every), 4))
        evaluate_all(motion.t, x, np.zeros_like(x), np.zeros(len(self.every)), self._unit, forces, none)
        for i, (action, n) in enumerate(zip(self.every, self._of, strict=True)):
            for e, end in enumerate(action.ends):
                if end.k >= 0:
                    f = found.multiplier[:, n, None, None] * forces[:, i, e, : len(end.weights)] * end.mask
                    out[end.k] += np.einsum("mn,tmc->tnc", end.weights, f)[:, :, : out[end.k].shape[2]]
        return out

    def _at_joints(self, k: int, found: History, R: Rows, F: Rows) -> Float[np.ndarray, "T q"]:
        """Forces of joints on a link at its ports, link frame: those at interface points less those of force elements."""
        bodies, part, joint = self.ready.bodies, self.ready.parts[k], self.ready.system.model.joints[k]
        force = found.port_force[:, bodies.port_at[k] : bodies.port_at[k + 1]]
        work = _turned(joint, force, R) @ part.W - work_over_time(part, F @ R).reshape(len(R), -1)
        return np.asarray(work @ self._from_work[k])


def _turned(joint: Attachment, force: Float[np.ndarray, "T q"], R: Rows) -> Float[np.ndarray, "T q"]:
    """Rᵀ of forces at held components of ports."""
    out = np.zeros((len(force), len(joint.weights), joint.components))
    out.reshape(len(force), -1)[:, joint.keep] = force
    return np.asarray((out @ R).reshape(len(force), -1)[:, joint.keep])
