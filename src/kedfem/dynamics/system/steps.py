"""Steps of a scene's links by its system, returned as histories of links.

The forces F on links include those of force elements; forces at ports are those of joints alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.history import Forcing, LinkHistory, Multipliers, Products
from kedfem.dynamics.joints.coupling import joined
from kedfem.dynamics.joints.ports import port_columns, rotated_ports
from kedfem.dynamics.loads import initial_forces
from kedfem.dynamics.matrices.dense import coordinates
from kedfem.dynamics.model import Model
from kedfem.dynamics.rigid_elements import links_of
from kedfem.dynamics.stepping.scheme import Scheme
from kedfem.dynamics.stiffening import Stiffening
from kedfem.dynamics.system.build import system_of
from kedfem.dynamics.system.forces.exerted import on_links
from kedfem.dynamics.system.forces.follower_loads import own_patterns, rotated_forces
from kedfem.dynamics.system.forces.supports import Supports
from kedfem.dynamics.system.layout import points_of
from kedfem.dynamics.system.march import march
from kedfem.dynamics.system.period.map import PeriodMap, Watch
from kedfem.dynamics.system.period.search import Periodic, Search
from kedfem.dynamics.system.ready import Motion, Ready, displacements, ready
from kedfem.dynamics.system.record import TANGENTIAL, System
from kedfem.dynamics.system.starts.accelerations import accelerated_in_a_step, accelerations
from kedfem.dynamics.system.starts.deflected import plucked, quasi_static
from kedfem.dynamics.system.starts.initial_states import rest
from kedfem.dynamics.system.starts.instant import Instant, renumbered
from kedfem.dynamics.system.starts.internal_forces import own
from kedfem.dynamics.system.state import History, State, empty_history
from kedfem.motion.linkage import Linkage, linkage
from kedfem.motion.rigid import RigidMotion
from kedfem.scene import Scene, corotational

if TYPE_CHECKING:
    from kedfem.dynamics.system.monolithic.monolithic import Now

Rows = Float[np.ndarray, "T _ _"]


def scene_system(scene: Scene, model: Model, stresses: Stiffening | None = None) -> System:
    """The system of a scene on the links of its model, with interface points for force elements.

    Parameters
    ----------
    stresses : stress modes of the links, if geometric stiffening counts

    Raises
    ------
    MeshError
        If the coupling surface of a force element does not determine how it turns as a whole.
    """
    rigid = linkage(scene)
    return replace(system_of(scene, rigid, model=with_element_points(scene, rigid, model)), stiffening=stresses)


def with_element_points(scene: Scene, rigid: Linkage, model: Model) -> Model:
    """The model with interface points for springs, motors and limits."""
    if not (scene.springs or scene.motors or scene.limits):
        return model
    links, layout = links_of(model, rigid.bodies)
    held = joined(scene, links, model.cuts, layout, elements=True)
    return replace(model, joints=tuple(held.attachments.values()), rows=held.rows)


class Steps:
    """Advances all links, block by block.

    Parameters
    ----------
    system : of `scene_system`
    model : of the links whose states are handed on, without interface points for force elements
    tolerance : change of an iteration, of what a step moves; that of `ready` if not given
    monolithic : whether the monolithic solver takes the steps
    """

    def __init__(
        self, scene: Scene, system: System, model: Model, scheme: Scheme, tolerance: float | None = None,
        monolithic: bool = False,
    ) -> None:  # fmt: skip
        self.scene, self.model, self.links = scene, model, model.links
        self.corotational, self.stiffening = corotational(scene), system.stiffening
        self.ready = ready(system, scheme) if tolerance is None else ready(system, scheme, tolerance)
        self.factorisations, self.eased, self.iterations = len(self.ready.parts), 0, 0
        self.unstable: list[str] = []  # positions whose balance is, in words
        self.steady: Periodic | None = None
        self.over: PeriodMap | None = None  # whose steady state that is
        self.watch: Watch = lambda marched: None
        self.search = Search()
        self.monolithic = None
        if monolithic:
            from kedfem.dynamics.system.monolithic.monolithic import Monolithic

            self.monolithic = Monolithic(system, scheme)
        self.elements = bool(scene.motors or scene.springs or scene.limits)
        joints = list(zip(model.links, model.joints, system.model.joints, strict=True))
        self._inverse = [
            np.linalg.pinv(port_columns(joint, link.n)) if self.elements else None for link, joint, _ in joints
        ]
        self._to_ports = [
            None if x is None else x @ port_columns(held, link.n)
            for x, (link, _, held) in zip(self._inverse, joints, strict=True)
        ]

    def start(self, motion_at: Motion, rates: Sequence[Float[np.ndarray, "_ _"]]) -> State:
        """The state at t = 0 that the scene specifies: at rest, without vibration, or as forces are released.

        Parameters
        ----------
        motion_at : rigid-body motion at given times
        rates : per link (n, d) δ' of rigid motions, world components; none if not given

        Raises
        ------
        SolveError
            If no deflection without vibration is found.
        """
        analysis = self.scene.analysis
        if analysis.initial_deflection:
            return plucked(self.ready, motion_at, initial_forces(self.scene, self.links))
        if analysis.initial != "rest":
            return quasi_static(self.ready, motion_at, rates)
        found = accelerated_in_a_step if self.corotational else accelerations
        return rest(self.ready, motion_at, rates, accelerated=found)

    def first(
        self, state: State, forcing: Sequence[Forcing], motion_at: Motion, like: Instant | None = None
    ) -> tuple[list[LinkHistory], Multipliers]:
        """The time point at which a state is, as histories; `like` is another instant of the same system."""
        motion = motion_at(state.time[:1])
        found = _as_history(self.ready, state, motion)
        if self.corotational:
            _deformed(Instant(self.ready, motion_at, float(state.time[0]), like), state, found)
        return self.handed_on(found, forcing, motion)

    def advance(
        self, state: State | Now, forcing: Sequence[Forcing], motion: RigidMotion, motion_at: Motion | None = None
    ) -> tuple[list[LinkHistory], Multipliers, State | Now]:
        """All time points of a block, one step after the other, [KED, eq. (20)].

        Parameters
        ----------
        motion_at : rigid-body motion at any times; without it steps in which stops are met stay undivided

        Raises
        ------
        ConvergenceError
            If the iterations of a step do not, in parts neither; `handed_on` shows what was done before.
        SolveError
            If those of the monolithic solver do not.
        """
        later: State | Now
        if self.monolithic is not None:
            from kedfem.dynamics.system.monolithic.monolithic_steps import monolithic_march

            later, found = monolithic_march(self.ready, self.monolithic, state, motion, motion_at)
        elif not isinstance(state, State):
            raise ValueError("state: must be a state of the condensed solver, got one of the monolithic solver")
        else:
            between = motion_at if self.corotational or self.ready.constraints.jumps.any() else None
            later, found = march(self.ready, state, motion, between, loads=[each.F for each in forcing])
            self.iterations += int(later.passes[0] - state.passes[0])
            self.eased += int(later.passes[1] - state.passes[1])
        return (*self.handed_on(found, forcing, motion), later)

    def handed_on(
        self, found: History, forcing: Sequence[Forcing], motion: RigidMotion
    ) -> tuple[list[LinkHistory], Multipliers]:
        """All links over the first time points of a block, as far as a history goes."""
        T = len(found.u)
        forcing, motion = [x.part(0, T) for x in forcing], motion.part(0, T)
        multipliers = multipliers_of(self.ready, found)
        acting = on_links(Supports(multipliers, motion)) if self.elements else {}
        every = [self._link(k, found, each, acting.get(k)) for k, each in enumerate(forcing)]
        return self._with_follower_loads(every, motion) if self.corotational else every, multipliers

    def _with_follower_loads(self, every: list[LinkHistory], motion: RigidMotion) -> list[LinkHistory]:
        """Forces F with those of follower loads."""
        for k, load in own_patterns(self.model.loads):
            R, factor = motion.R[:, self.model.bodies[k]], load.factor(motion.t, motion.phi)
            every[k] = replace(every[k], F=every[k].F + rotated_forces(self.links[k], load, R, every[k].u, factor))
        return every

    def _link(self, k: int, found: History, forcing: Forcing, acting: Rows | None = None) -> LinkHistory:
        """How a link moves, in its frame as that is, and what acts on it."""
        of, link = self.ready, self.links[k]
        u, v, a = (displacements(of, k, x) for x in (found.u, found.v, found.a))
        R = found.R[:, k, : link.d, : link.d].copy() if self.corotational else forcing.R
        F = forcing.F if acting is None else forcing.F + acting
        at = slice(of.bodies.port_at[k], of.bodies.port_at[k + 1])
        force = rotated_ports(of.system.model.joints[k], R.transpose(0, 2, 1), found.port_force[:, at])
        to_ports, inverse = self._to_ports[k], self._inverse[k]
        if to_ports is not None and inverse is not None:
            force = force @ to_ports.T
            if acting is not None:
                force = force - (acting @ R).reshape(len(R), -1) @ inverse.T
        g, energy, products = (self.deformation(k, found), found.energy[:, k].copy(), self._products(found, k, v))
        return LinkHistory(u, v, a, g, R, F, force, energy, products)

    def deformation(self, k: int, found: History) -> Rows:
        """What stresses of link k come from; of a co-rotational planar beam with the strains that its points see."""
        link, bodies = self.links[k], self.ready.bodies
        if bodies.frame[k] != TANGENTIAL:
            return displacements(self.ready, k, found.g)
        points = points_of(link)
        share = np.concatenate([point.share.T for point in points])  # (3E, 3n)
        b, T = int(np.searchsorted(bodies.beams.segment, k)), len(found.u)
        seen = found.strain[:, b, :, : len(points)].transpose(0, 2, 1).reshape(T, 3 * len(points))
        return np.asarray((seen @ share).reshape(T, link.n, link.d))

    def _products(self, found: History, k: int, v: Rows) -> Products | None:
        """Products with the state of link k that its steps have at hand."""
        part, link = self.ready.parts[k], self.links[k]
        if self.corotational or not part.unit or not found.Kg.size or self.monolithic is not None:
            return None
        Kg = displacements(self.ready, k, found.Kg)
        if link.unknowns == part.G.shape[0]:
            return Products(v, Kg, None)
        Cg = displacements(self.ready, k, found.Cg) if self.model.damping.present else None
        return Products(displacements(self.ready, k, found.Mv), Kg, Cg)


def multipliers_of(of: Ready, found: History) -> Multipliers:
    """Of all times of a history."""
    return Multipliers(of.system, found.z[:, renumbered(of)], found.e, found.rate, found.multiplier)


def _as_history(of: Ready, state: State, motion: RigidMotion) -> History:
    """A state as a history of one time point, deformations as rigid-body frames see them."""
    out = empty_history(1, of.bodies, of.constraints)._replace(Kg=np.zeros((1, 0)))
    for name in ("u", "v", "a", "F", "port_force", "multiplier"):
        getattr(out, name)[0] = getattr(state, name)
    out.z[0], out.e[0], out.rate[0], out.strain[0] = state.z[0], state.e[0], state.e[1], state.strain[0]
    for k, link in enumerate(of.system.model.links):
        here, R = own(of, k), motion.R[0, of.bodies.motion[k]]
        out.R[0, k] = R
        out.g[0, here] = (R[: link.d, : link.d].T @ state.u[here].reshape(link.d, -1)).ravel()
        g = displacements(of, k, out.g)[0].ravel()
        out.energy[0, k] = 0.5 * float(g @ (link.K0 @ g))
    return out


def _deformed(now: Instant, state: State, out: History) -> None:
    """Deformations, orientations and energies of a history of one time point, as co-rotational frames see them."""
    of = now.of
    for k, each in enumerate(now.internal_states(state.u, state.v)):
        link, here = of.system.model.links[k], own(of, k)
        g = each.frames[0].g if each.frames else each.g
        out.g[0, here] = coordinates(link, of.parts[k], g).ravel()
        out.R[0, k], out.energy[0, k] = each.R, each.energy
