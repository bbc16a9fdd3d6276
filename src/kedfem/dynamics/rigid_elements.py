"""Forces of motors, springs and limits with all links rigid, at any times of the motion, and their ends on links.

Their coordinates depend on earlier times only by the count of revolutions: angles of hinges continue beyond ±π. The path
of the linkage has that count, so that any part of the motion can be evaluated by itself.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.force_elements import force_elements, law_of, places, term_of
from kedfem.dynamics.history import Block, Forcing
from kedfem.dynamics.joints.constraint_joints import ConstraintJoint, direction
from kedfem.dynamics.joints.constraint_ports import LinkageLayout, element_joint
from kedfem.dynamics.loads import initial_forces
from kedfem.dynamics.model import Model, link_keys
from kedfem.dynamics.rigid_body import forcings
from kedfem.dynamics.system.ends import end_of, rigid_end
from kedfem.dynamics.system.forces.poses import forces_in_place, value
from kedfem.dynamics.system.forces.supports import Pushed, exerted
from kedfem.dynamics.system.record import ANGLE, Curve, End, Law, Spring, Stop, Term, Times, stiffness_factors
from kedfem.links.record import Link
from kedfem.links.stations import Stations
from kedfem.motion.counted_revolutions import angle_along
from kedfem.motion.linkage import Linkage
from kedfem.motion.path import Path
from kedfem.motion.rigid import RigidMotion, resting
from kedfem.scene import Scene
from kedfem.vectors import cross

Vectors = Float[np.ndarray, "T 3"]
Acting = Callable[[RigidMotion], Iterable[tuple[int, Float[np.ndarray, "T n d"]]]]
"""Nodal forces on links by number, world components, at the times of a motion."""


@dataclass(frozen=True, slots=True)
class OnLink:
    """An end of a term, on a link of a model: number of the link, and weights (p, n) of the end's points.

    k, d : −1 where nothing but the rigid-body motion moves it; components of the link
    """

    end: End
    k: int = -1
    d: int = 3
    weights: Float[np.ndarray, "p n"] | None = None

    def unknowns(self, block: Block) -> Float[np.ndarray, "T c"]:
        """Displacements of its points, one after the other, on which the end's columns are."""
        if self.weights is None:
            return np.zeros((len(block), 0))
        u = self.weights @ block.links[self.k].u
        return np.asarray(u[:, :, : self.end.onto.shape[1]].reshape(len(block), -1))

    def nodal(self, motion: RigidMotion, force: Vectors, moment: Vectors) -> Float[np.ndarray, "T n d"]:
        """Nodal forces equivalent to a force and a moment on the end in the rigid-body motion, world components."""
        if self.weights is None:
            raise ValueError("an end must be on a link to have nodal forces, got one that is on none")
        y = forces_in_place(self.end, motion, force[:, None], moment[:, None])[:, 0]
        out = np.zeros((len(y), self.weights.shape[1], self.d))
        out[:, :, : y.shape[2]] = self.weights.T @ y
        return out


def on_links(model: Model, joint: ConstraintJoint, at: Sequence[Float[np.ndarray, "3"]]) -> tuple[OnLink, OnLink]:
    """Both sides of a joint without rows, as ends whose unknowns are the displacements of their own points.

    Parameters
    ----------
    at : where each is, in the reference position [m]
    """
    keys, first, found = link_keys(model), 0, list[OnLink]()
    for side, body, point in zip(joint.sides, joint.bodies, at, strict=True):
        if side is None or len(set(side.keys)) > 1:  # frames of a line's segments know what their stresses do
            found.append(OnLink(rigid_end(body, point)))
            continue
        k, d = keys.index(side.keys[0]), side.components
        c = d * len(side.points)
        own = replace(side, onto=np.eye(c).reshape(-1, d, c), columns=first + np.arange(c))
        first += c
        found.append(OnLink(end_of(own, joint), k, model.links[k].d, np.asarray(side.weights)))
    return found[0], found[1]


def links_of(model: Model, names: Sequence[str]) -> tuple[dict[str, Link], LinkageLayout]:
    """Links of a model by their keys, with its lines of slots, for joints."""
    layout = LinkageLayout({name: n for n, name in enumerate(names)}, _lines(model))
    return dict(zip(link_keys(model), model.links, strict=True)), layout


def _lines(model: Model) -> dict[str, Stations]:
    """Stations of all slots on the links that carry them."""
    out, keys = {}, link_keys(model)
    for row in model.rows:
        side = row.sides[1]
        if side is not None and side.stations is not None:
            found: dict[int, tuple[str, np.ndarray]] = {}
            for key, link, joint, body in zip(keys, model.links, model.joints, model.bodies, strict=True):
                for port, name in enumerate(joint.joints) if body == side.body else ():
                    if name == row.name:
                        weights = np.zeros(link.n)
                        weights[joint.nodes] = joint.weights[port]
                        away = np.linalg.norm(side.points - joint.points[port], axis=1)
                        found[int(away.argmin())] = key, weights
            on, every = zip(*(found[k] for k in range(len(side.points))), strict=True)
            out[row.name] = replace(side.stations, weights=every, keys=on)
    return out


@dataclass(frozen=True, slots=True)
class RigidElement:
    """A force element between two ends; `turns`: name of the joint on whose counted angle it acts, empty for others."""

    law: Law
    term: Term
    on: tuple[OnLink, OnLink]
    turns: str = ""

    @property
    def ends(self) -> tuple[End, End]:
        """Of its term."""
        return self.on[0].end, self.on[1].end


@dataclass(frozen=True, slots=True)
class RigidElements:
    """Force elements whose ends move as the rigid-body motion has them; along : path of that motion."""

    every: Sequence[RigidElement]
    scene: Scene
    linkage: Linkage
    along: Path

    def over(self, motion: RigidMotion) -> list[list[Pushed]]:
        """Both ends of each element at the times of a motion, with the force and the moment on them there."""
        return [self._pushed(each, motion) for each in self.every]

    def _pushed(self, each: RigidElement, motion: RigidMotion) -> list[Pushed]:
        unit, q = exerted(each.term, each.ends, motion, None), value(each.term, each.ends, motion, None)
        if each.turns:
            tau = motion.t if motion.drives.shape[1] > 1 else motion.phi
            near = angle_along(self.scene, self.linkage, self.along, each.turns, tau)
            q = q + 2 * np.pi * np.round((near - q) / (2 * np.pi))
        rate = np.zeros(len(q))
        for end, x, f, t in unit:
            omega = motion.omega[:, end.body]
            v = motion.v[:, end.body] + cross(omega, x - motion.p[:, end.body])
            rate += (f * v + t * omega).sum(axis=1)
        Q = effort(each.law, motion, q, rate)[:, None]
        return [(end, x, Q * f, Q * t) for end, x, f, t in unit]

    def wrenches(self, motion: RigidMotion) -> Iterator[tuple[int, Vectors, Vectors]]:
        """Number of the body of every end, and the force and the moment about the world's origin on it (T, 3)."""
        for pushed in self.over(motion):
            yield from ((end.body, f, t + cross(x, f)) for end, x, f, t in pushed)

    def loads(self, motion: RigidMotion) -> Iterator[tuple[int, Float[np.ndarray, "T n d"]]]:
        """Nodal forces on links of the model, by number, world components."""
        for each, pushed in zip(self.every, self.over(motion), strict=True):
            for on, (_, _, f, t) in zip(each.on, pushed, strict=True):
                if on.k >= 0:
                    yield on.k, on.nodal(motion, f, t)

    def unit_loads(self, k: int) -> list[Float[np.ndarray, "n d"]]:
        """Nodal forces, link frame, that those on a link of the model are combinations of at all times.

        Torques about axes of hinges have the same directions on a link at all times, forces at points and torques on a
        cross may have any.
        """
        out, still = list[Float[np.ndarray, "n d"]](), resting(len(self.linkage.bodies), np.zeros(1))
        for each in self.every:
            for on, at in zip(each.on, (each.term.a, each.term.a_j), strict=True):
                if on.k != k:
                    continue
                units = [(e, cross(at - on.end.origin, e)) for e in np.eye(3)]
                if each.term.kind == ANGLE:
                    units = [direction(each.term)] if each.turns else [(np.zeros(3), e) for e in np.eye(3)]
                for f, t in units:
                    out.append(on.nodal(still, f[None], t[None])[0])
        return out


def rigid_elements(scene: Scene, linkage: Linkage, along: Path, model: Model | None = None) -> RigidElements | None:
    """The force elements of a scene on the rigid-body motion along a path; None if there are none.

    Parameters
    ----------
    model : whose links they act on. Without limits then: how hard stops are met depends on what gives, and where stiff
        ones are it is nothing like this

    Raises
    ------
    MeshError, SceneError
        If a point or joint is not on its link.
    """
    every, parts = list[RigidElement](), None if model is None else links_of(model, linkage.bodies)
    for name, element in force_elements(scene if model is None else scene.model_copy(update={"limits": {}})):
        (i, a), (j, a_j) = places(scene, element)
        one, other = (OnLink(rigid_end(linkage.bodies.index(link), at)) for link, at in ((i, a), (j, a_j)))
        if model is not None and parts is not None:
            one, other = on_links(model, element_joint(scene, name, element, *parts), (a, a_j))
        term = term_of(scene, element, one.end, other.end)
        counted = term.kind == ANGLE and getattr(element, "about", None) is None
        every.append(RigidElement(law_of(element), term, (one, other), str(element.joint) if counted else ""))
    return RigidElements(every, scene, linkage, along) if every else None


def nothing(motion: RigidMotion) -> Iterable[tuple[int, Float[np.ndarray, "T n d"]]]:
    """No forces beside loads."""
    return ()


def acting(scene: Scene, linkage: Linkage, along: Path, model: Model) -> Acting:
    """Forces of motors and springs on links of a model in the rigid-body motion, at t = 0 those that are released too."""
    elements = rigid_elements(scene, linkage, along, model)
    released = initial_forces(scene, model.links) if scene.analysis.initial_deflection else []

    def forces(motion: RigidMotion) -> Iterator[tuple[int, Float[np.ndarray, "T n d"]]]:
        yield from elements.loads(motion) if elements else ()
        start = (motion.t == 0.0)[:, None, None]
        yield from ((k, start * F) for k, F in enumerate(released))

    return forces


def whole_forcings(model: Model, motion: RigidMotion, acting: Acting) -> list[Forcing]:
    """Orientation and P − M R0'' of all links over time, P with all that acts in the rigid-body motion: follower loads of
    co-rotational frames too, and motors and springs."""
    loads = tuple(tuple(replace(load, own=False) for load in each) for each in model.loads)
    found = forcings(replace(model, loads=loads), motion)
    for k, more in acting(motion):
        found[k] = replace(found[k], F=found[k].F + more)
    return found


def effort(law: Law, motion: RigidMotion, q: Times, rate: Times) -> Times:
    """The force of a law along its coordinate at the times of a motion."""
    match law:
        case Curve(over=over, force=force):
            return force((motion.t, rate, q)[over])[0]
        case Spring(stiffness=k, damping=c, free=free, factor=factor, curve=curve):
            along = k * stiffness_factors([factor], motion.t, motion.phi)[:, 0] * (free - q) - c * rate
            return along if curve is None else along + effort(curve, motion, q, rate)
        case Stop(lower=lower, upper=upper, stiffness=k, damping=c):
            beyond = q - np.clip(q, lower, upper)
            Q = -k * beyond - c * rate
            return np.where(Q * beyond < 0.0, Q, 0.0)  # it pushes, and only beyond
        case _:
            return np.zeros_like(q)
