"""Steps of links with rigid-body frames, taken by the system, as histories of links.

What a force element exerts on its links is part of their forces F there, and forces at ports are those of joints alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.dynamics.history import Forcing, LinkHistory, Products
from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.joints.constraint_joints import ConstraintJoint
from kedfem.dynamics.joints.constraint_ports import LinkageLayout
from kedfem.dynamics.joints.coupling import joined
from kedfem.dynamics.joints.ports import port_columns, turned_ports
from kedfem.dynamics.loads import initial_forces
from kedfem.dynamics.model import Model
from kedfem.dynamics.stepping.scheme import Scheme
from kedfem.dynamics.stiffening import Stiffening
from kedfem.dynamics.system.build import system_of
from kedfem.dynamics.system.ends import end_of
from kedfem.dynamics.system.forces.exerted import ELEMENTS
from kedfem.dynamics.system.forces.supports import supports
from kedfem.dynamics.system.march import displacements, march, ready
from kedfem.dynamics.system.period.krylov import Watch
from kedfem.dynamics.system.period.map import PeriodMap
from kedfem.dynamics.system.period.search import Periodic, Search
from kedfem.dynamics.system.record import End, System
from kedfem.dynamics.system.starts.deflected import plucked, quasi_static
from kedfem.dynamics.system.starts.instant import Motion
from kedfem.dynamics.system.starts.start import rest
from kedfem.dynamics.system.state import History, State
from kedfem.links.stations import Stations
from kedfem.motion.linkage import linkage
from kedfem.motion.rigid import RigidMotion
from kedfem.scene import Scene

if TYPE_CHECKING:
    from kedfem.dynamics.system.oracle.monolithic import Now

Rows = Float[np.ndarray, "T _ _"]


def rigid_frame_system(scene: Scene, model: Model, stresses: Stiffening | None = None) -> System:
    """The system of a scene whose links have rigid-body frames.

    Parameters
    ----------
    stresses : stress modes of the links, if geometric stiffening counts

    Raises
    ------
    MeshError
        If a force element finds no coupling surface on its link that shows how it turns.
    """
    names, rigid = [link.name for link in model.links], linkage(scene)
    layout = LinkageLayout({name: k for k, name in enumerate(rigid.bodies)}, _lines(model))
    held = joined(scene, dict(zip(names, model.links, strict=True)), (), layout, elements=True)
    here = replace(model, joints=tuple(held.attachments[name] for name in names), rows=held.rows)
    return replace(system_of(scene, rigid, model=here), stiffening=stresses)


def _lines(model: Model) -> dict[str, Stations]:
    """Stations of all slots on the links that carry them."""
    out = {}
    for row in model.rows:
        side = row.sides[1]
        if side is not None and side.stations is not None:
            k = model.bodies.index(side.body)
            weights = np.zeros((len(side.points), model.links[k].n))
            own = [name == row.name for name in model.joints[k].joints]
            weights[:, model.joints[k].nodes] = model.joints[k].weights[own]
            out[row.name] = replace(side.stations, weights=weights)
    return out


@dataclass(frozen=True, slots=True)
class Bearing:
    """An end of a force element on link k: interface points (p, b) on some of its nodes, and their part of its ports.

    bears : number of components that it bears on: a slider has no moment
    to_ports : (q, m) forces at ports of joints that are on the link what forces at these points are, link frame
    """

    name: str
    k: int
    end: End
    nodes: Int[np.ndarray, " b"]
    weights: Float[np.ndarray, "p b"]
    bears: int
    to_ports: Float[np.ndarray, "q m"]


class SystemSteps:
    """Advances all links, block by block.

    Parameters
    ----------
    model : of the links whose states are handed on, without interface points for force elements
    monolithic : whether the oracle takes the steps

    Raises
    ------
    SolveError
        If links are too large for the oracle.
    """

    def __init__(
        self, scene: Scene, system: System, model: Model, scheme: Scheme, monolithic: bool = False
    ) -> None:
        self.scene, self.model, self.links = scene, model, model.links
        self.ready = ready(system, scheme)
        self.steady: Periodic | None = None
        self.over: PeriodMap | None = None  # whose steady state that is
        self.watch: Watch = lambda marched: None
        self.search = Search()
        self.oracle = None
        if monolithic:
            from kedfem.dynamics.system.oracle.monolithic_steps import oracle

            self.oracle = oracle(self.ready)
        self.stiffening = system.stiffening
        self.factorisations = len(self.ready.parts)
        self._bearings, self._to_ports = _bearings(model, system.model, linkage(scene).bodies)

    def start(self, at_rest: bool, motion_at: Motion, rates: Sequence[Float[np.ndarray, "_ _"]]) -> State:
        """The state at t = 0.

        Parameters
        ----------
        rates : per link (n, d) δ' at rest, world components; none if not given

        Raises
        ------
        SolveError
            If no quasi-static deflection is found.
        """
        if self.scene.analysis.initial_deflection:
            return plucked(self.ready, motion_at, initial_forces(self.scene, self.links))
        return rest(self.ready, motion_at, rates) if at_rest else quasi_static(self.ready, motion_at, rates)

    def first(self, state: State, forcing: Sequence[Forcing], motion: RigidMotion) -> list[LinkHistory]:
        """A state as histories of one time point."""
        bodies, g = self.ready.bodies, np.zeros_like(state.u)
        for k, link in enumerate(self.links):
            here = slice(int(bodies.at[k]), int(bodies.at[k + 1]))
            g[here] = (forcing[k].R[0].T @ state.u[here].reshape(link.d, -1)).ravel()
        found = History(
            u=state.u[None], v=state.v[None], a=state.a[None], F=state.F[None], g=g[None], strain=state.strain[:1],
            R=motion.R[:, bodies.motion], port_force=state.port_force[None], energy=np.zeros((1, len(self.links))),
            z=state.z[:1], e=state.e[:1], multiplier=state.multiplier[None], rate=state.e[1:2],
            Kg=g[None, :0], Mv=g[None, :0], Cg=g[None, :0],
        )  # fmt: skip
        out = self.handed_on(found, forcing, motion)
        for k, (x, link) in enumerate(zip(out, self.links, strict=True)):
            flat = x.g.ravel()
            out[k] = replace(x, strain=np.array([0.5 * float(flat @ (link.K0 @ flat))]))
        return out

    def advance(
        self,
        state: State | Now,
        forcing: Sequence[Forcing],
        motion: RigidMotion,
        motion_at: Motion | None = None,
    ) -> tuple[list[LinkHistory], State | Now]:
        """All time points of a block, one step after the other, [KED, eq. (20)].

        Parameters
        ----------
        motion_at : rigid-body motion at any times; without it steps in which stops are met stay undivided

        Raises
        ------
        SolveError
            If the iterations of a step do not converge.
        """
        if self.oracle is not None:
            from kedfem.dynamics.system.oracle.monolithic_steps import monolithic_march

            later, found = monolithic_march(self.ready, self.oracle, state, motion)
            return self.handed_on(found, forcing, motion), later
        if not isinstance(state, State):
            raise ValueError("a march must begin with a state of the system, got one of the oracle")
        between = motion_at if self.ready.constraints.jumps.any() else None
        state, found = march(self.ready, state, motion, between, loads=[each.F for each in forcing])
        return self.handed_on(found, forcing, motion), state

    def handed_on(self, found: History, forcing: Sequence[Forcing], motion: RigidMotion) -> list[LinkHistory]:
        """All links, with what force elements exert on them."""
        acting, bodies, out = [each.F for each in forcing], self.ready.bodies, []
        at_ports = [
            _turned_back(joint, found.port_force[:, bodies.port_at[k] : bodies.port_at[k + 1]], each.R)
            for k, (joint, each) in enumerate(zip(self.ready.system.model.joints, forcing, strict=True))
        ]
        if self._bearings:
            seen, acting = supports(self.ready, found, motion), [each.F.copy() for each in forcing]
            at_ports = [force @ to.T for force, to in zip(at_ports, self._to_ports, strict=True)]
        for one in self._bearings:
            R, c = forcing[one.k].R, one.bears
            y = np.zeros((len(R), len(one.weights), R.shape[1]))
            y[:, :, :c] = seen.on_end(one.name, one.end)[:, :, :c]
            acting[one.k][:, one.nodes] += np.einsum("pb,tpd->tbd", one.weights, y)
            at_ports[one.k] -= (y @ R).reshape(len(y), -1) @ one.to_ports.T
        for k, (each, F) in enumerate(zip(forcing, acting, strict=True)):
            u, v, a, g = (displacements(self.ready, k, x) for x in (found.u, found.v, found.a, found.g))
            out.append(
                LinkHistory(u, v, a, g, each.R, F, at_ports[k], found.energy[:, k].copy(),
                            self._products(found, k, v))
            )  # fmt: skip
        return out

    def deformation(self, k: int, found: History) -> Rows:
        """What stresses of link k come from."""
        return displacements(self.ready, k, found.g)

    def _products(self, found: History, k: int, v: Rows) -> Products | None:
        """Products with the state of link k that its steps have at hand."""
        part, link = self.ready.parts[k], self.links[k]
        if not part.unit or not found.Kg.size or self.oracle is not None:
            return None
        Kg = displacements(self.ready, k, found.Kg)
        if link.unknowns == part.G.shape[0]:
            return Products(v, Kg, None)
        Cg = displacements(self.ready, k, found.Cg) if self.model.damping.present else None
        return Products(displacements(self.ready, k, found.Mv), Kg, Cg)


def _bearings(
    model: Model, seen: Model, bodies: Sequence[str]
) -> tuple[list[Bearing], list[Float[np.ndarray, "_ _"]]]:
    """Ends of all force elements, and per link what turns forces at interface points into those at ports of joints.

    Parameters
    ----------
    seen : the model with interface points for force elements
    bodies : of the linkage
    """
    elements = [row for row in seen.rows if row.name.startswith(ELEMENTS)]
    if not elements:
        return [], []
    every = list(zip(model.links, model.joints, seen.joints, strict=True))
    inverse = [np.linalg.pinv(port_columns(joint, link.n)) for link, joint, _ in every]
    to_ports = [x @ port_columns(own, link.n) for x, (link, _, own) in zip(inverse, every, strict=True)]
    found = [
        _bearing(row, side, bodies, seen, inverse)
        for row in elements for side in (0, 1) if row.sides[side] is not None
    ]  # fmt: skip
    return found, to_ports


def _bearing(
    row: ConstraintJoint,
    side: int,
    bodies: Sequence[str],
    model: Model,
    inverse: Sequence[Float[np.ndarray, "_ _"]],
) -> Bearing:
    """What an end of a force element has on a link, or on the link that its slider rides on."""
    on = row.sides[side]
    if on is None:
        raise ValueError(f"{row.name}: must have an end on a link, got none")
    slider = next((x for x in model.sliders if x.name == bodies[on.body]), None)
    if slider is not None:
        k, weights = slider.carrier, slider.weights[None]
    else:
        k = model.bodies.index(on.body)
        before = row.sides[0]
        first = len(before.points) if side and before is not None and before.body == on.body else 0
        ports = [p for p, name in enumerate(model.joints[k].joints) if name == row.name][first:][
            : len(on.points)
        ]
        weights = np.zeros((len(ports), model.links[k].n))
        weights[:, model.joints[k].nodes] = model.joints[k].weights[ports]
    link, nodes = model.links[k], np.flatnonzero(weights.any(axis=0))
    bears = 2 if slider is not None and link.planar else link.d
    columns = np.zeros((link.n, link.d, len(weights), link.d))
    for c in range(bears):
        columns[:, c, :, c] = weights.T
    to_ports = inverse[k] @ columns.reshape(link.n * link.d, -1)
    return Bearing(row.name, k, end_of(on, row), nodes, weights[:, nodes], bears, to_ports)


def _turned_back(joint: Attachment, force: Float[np.ndarray, "T q"], R: Rows) -> Float[np.ndarray, "T q"]:
    """Rᵀ of forces at held components of ports."""
    return turned_ports(joint, R.transpose(0, 2, 1), force)
