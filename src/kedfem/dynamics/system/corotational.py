"""Steps of scenes with co-rotational frames, taken by the system, handed on as histories of links.

What a force element exerts on its links is part of their forces F there, and forces at ports are those of joints alone.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.history import Exerted, Forcing, LinkHistory
from kedfem.dynamics.joints.constraint_ports import LinkageLayout
from kedfem.dynamics.joints.coupling import joined
from kedfem.dynamics.joints.ports import port_columns, turned_ports
from kedfem.dynamics.loads import initial_forces
from kedfem.dynamics.matrices.dense import coordinates
from kedfem.dynamics.model import Model, link_keys
from kedfem.dynamics.stepping.scheme import Scheme
from kedfem.dynamics.stepping.start import initial_rates
from kedfem.dynamics.system.blank import empty_history
from kedfem.dynamics.system.build import system_of
from kedfem.dynamics.system.forces.exerted import exerted, on_links
from kedfem.dynamics.system.forces.supports import supports
from kedfem.dynamics.system.forces.turning_loads import turned, turning
from kedfem.dynamics.system.layout import points_of
from kedfem.dynamics.system.march import Motion, displacements, march, ready
from kedfem.dynamics.system.period.krylov import Watch
from kedfem.dynamics.system.period.search import Periodic, Search
from kedfem.dynamics.system.record import TANGENTIAL, System
from kedfem.dynamics.system.starts.accelerations import accelerated_in_a_step
from kedfem.dynamics.system.starts.deflected import plucked, quasi_static
from kedfem.dynamics.system.starts.instant import Instant
from kedfem.dynamics.system.starts.internal import own
from kedfem.dynamics.system.starts.start import rest
from kedfem.dynamics.system.state import History, State
from kedfem.motion.linkage import Linkage, linkage
from kedfem.motion.rigid import RigidMotion
from kedfem.scene import Scene

Rows = Float[np.ndarray, "T _ _"]


def corotational_system(scene: Scene, model: Model) -> tuple[System, Linkage]:
    """The system of a scene, on the links of its model, with interface points for force elements.

    Raises
    ------
    MeshError
        If the coupling surface of a force element does not determine how it turns as a whole.
    """
    rigid = linkage(scene)
    if scene.springs or scene.motors or scene.limits:
        links = dict(zip(link_keys(model), model.links, strict=True))
        layout = LinkageLayout({name: k for k, name in enumerate(rigid.bodies)}, {})
        held = joined(scene, links, model.cuts, layout, elements=True)
        model = replace(model, joints=tuple(held.attachments.values()), rows=held.rows)
    return system_of(scene, rigid, model=model), rigid


class CorotationalSteps:
    """Advances all links, block by block.

    Parameters
    ----------
    model : of the links whose states are handed on, without interface points for force elements
    tolerance : change of an iteration, of what a step moves
    """

    def __init__(self, scene: Scene, model: Model, scheme: Scheme, tolerance: float) -> None:
        system, self.linkage = corotational_system(scene, model)
        self.scene, self.model, self.links = scene, model, model.links
        self.ready = ready(system, scheme, tolerance)
        self.factorisations, self.eased, self.iterations = len(self.ready.parts), 0, 0
        self.steady: Periodic | None = None
        self.watch: Watch = lambda marched: None
        self.search = Search()
        points = system.model.joints is not model.joints  # of force elements, beside those of joints
        self.elements = [f"motors.{name}" for name in scene.motors]
        self.elements += [f"springs.{name}" for name in scene.springs]
        self.elements += [f"limits.{name}" for name in scene.limits]
        self.riders = {
            self.linkage.bodies.index(x.name): (x.carrier, x.weights) for x in system.model.sliders
        }
        every = list(zip(model.links, model.joints, system.model.joints, strict=True))
        self._inverse = [
            np.linalg.pinv(port_columns(joint, link.n)) if points else None for link, joint, _ in every
        ]
        self._to_ports = [
            None if x is None else x @ port_columns(own, link.n)
            for x, (link, _, own) in zip(self._inverse, every, strict=True)
        ]

    def begin(self, motion_at: Motion) -> State:
        """The state at t = 0 that the scene asks for: at rest, without vibration, or as forces are let go.

        Parameters
        ----------
        motion_at : rigid-body motion at given times

        Raises
        ------
        SolveError
            If no deflection without vibration is found.
        """
        if self.scene.analysis.initial_deflection:
            return plucked(self.ready, motion_at, initial_forces(self.scene, self.links))
        rates = initial_rates(self.scene, self.linkage, self.model)
        if self.scene.analysis.initial == "rest":
            return rest(self.ready, motion_at, rates, accelerated=accelerated_in_a_step)
        return quasi_static(self.ready, motion_at, rates)

    def first(
        self, state: State, forcing: Sequence[Forcing], motion_at: Motion, like: Instant | None = None
    ) -> tuple[list[LinkHistory], Exerted]:
        """The time point at which a state is, as histories; `like` is another instant of the same system."""
        now = Instant(self.ready, motion_at, float(state.time[0]), like)
        return self._handed_on(_as_history(now, state), forcing, now.motion)

    def advance(
        self, state: State, forcing: Sequence[Forcing], motion: RigidMotion, motion_at: Motion
    ) -> tuple[list[LinkHistory], Exerted, State]:
        """All time points of a block.

        Raises
        ------
        ConvergenceError
            If the iterations of a step do not, in parts neither; `handed_on` shows what was done before.
        """
        before = state.passes.copy()
        state, found = march(self.ready, state, motion, motion_at, loads=[each.F for each in forcing])
        self.iterations += int(state.passes[0] - before[0])
        self.eased += int(state.passes[1] - before[1])
        return (*self._handed_on(found, forcing, motion), state)

    def handed_on(
        self, found: History, forcing: Sequence[Forcing], motion: RigidMotion
    ) -> tuple[list[LinkHistory], Exerted]:
        """The first time points of a block, as far as a history goes."""
        T = len(found.u)
        return self._handed_on(found, [x.first(T) for x in forcing], motion.part(0, T))

    def _handed_on(
        self, found: History, forcing: Sequence[Forcing], motion: RigidMotion
    ) -> tuple[list[LinkHistory], Exerted]:
        forces = supports(self.ready, found, motion)
        acting = on_links(forces, self.riders)
        every = [self._link(k, found, each, acting.get(k)) for k, each in enumerate(forcing)]
        return self._with_turning_loads(every, motion), exerted(forces, self.elements)

    def _with_turning_loads(self, every: list[LinkHistory], motion: RigidMotion) -> list[LinkHistory]:
        """Forces F with those of loads that turn with links."""
        for k, load in turning(self.model.loads):
            R, factor = motion.R[:, self.model.bodies[k]], load.factor(motion.t, motion.phi)
            every[k] = replace(every[k], F=every[k].F + turned(self.links[k], load, R, every[k].u, factor))
        return every

    def _link(self, k: int, found: History, forcing: Forcing, acting: Rows | None) -> LinkHistory:
        """How a link moves, in its frame as that is, and what acts on it."""
        of, link = self.ready, self.links[k]
        u, v, a = (displacements(of, k, x) for x in (found.u, found.v, found.a))
        R = found.R[:, k, : link.d, : link.d].copy()
        F = forcing.F if acting is None else forcing.F + acting
        at = slice(of.bodies.port_at[k], of.bodies.port_at[k + 1])
        force = turned_ports(of.system.model.joints[k], R.transpose(0, 2, 1), found.port_force[:, at])
        to_ports, inverse = self._to_ports[k], self._inverse[k]
        if to_ports is not None and inverse is not None:
            force = force @ to_ports.T
            if acting is not None:
                force = force - (acting @ R).reshape(len(R), -1) @ inverse.T
        return LinkHistory(u, v, a, self.deformation(k, found), R, F, force, found.energy[:, k].copy())

    def deformation(self, k: int, found: History) -> Rows:
        """What stresses come from; of a planar beam with the strains that its points see."""
        link, bodies = self.links[k], self.ready.bodies
        if bodies.frame[k] != TANGENTIAL:
            return displacements(self.ready, k, found.g)
        points = points_of(link)
        share = np.concatenate([point.share.T for point in points])  # (3E, 3n)
        b, T = int(np.searchsorted(bodies.beams.segment, k)), len(found.u)
        seen = found.strain[:, b, :, : len(points)].transpose(0, 2, 1).reshape(T, 3 * len(points))
        return np.asarray((seen @ share).reshape(T, link.n, link.d))


def _as_history(now: Instant, state: State) -> History:
    """A state as a history of one time point."""
    of = now.of
    out = empty_history(1, of.bodies, of.constraints)
    for name in ("u", "v", "a", "F", "port_force", "multiplier"):
        getattr(out, name)[0] = getattr(state, name)
    out.z[0], out.e[0], out.rate[0], out.strain[0] = state.z[0], state.e[0], state.e[1], state.strain[0]
    for k, each in enumerate(now.inside(state.u, state.v)):
        link, here = of.system.model.links[k], own(of, k)
        g = each.frames[0].g if each.frames else each.g
        out.g[0, here] = coordinates(link, of.parts[k], g).ravel()
        out.R[0, k], out.energy[0, k] = each.R, each.energy
    return out
