"""The system of a scene and its elastic model: constraints of joints, and force elements with their coordinates.

`joints.constraint_joints.constrained` says what each kind of joint constrains; gears, springs, motors and limits are laws
on the same coordinates.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.elastic_model import elastic_model
from kedfem.dynamics.force_elements import Element, force_elements, law_of, places, term_of
from kedfem.dynamics.joints.constraint_joints import ConstraintJoint
from kedfem.dynamics.model import Model
from kedfem.dynamics.system import record
from kedfem.dynamics.system.ends import corners, end_on, rigid_end, same_end
from kedfem.dynamics.system.record import Constraint, End, Held, Law, System, Term
from kedfem.links.record import Link
from kedfem.motion.linkage import Linkage
from kedfem.motion.path import Path
from kedfem.scene import Scene

Vector = Float[np.ndarray, "3"]
HALF = 0.5  # of a cosine: gaps of a line are along it, or at right angles


def system_of(scene: Scene, linkage: Linkage, along: Path | None = None, model: Model | None = None) -> System:
    """The system of a scene.

    Parameters
    ----------
    model : with interface points for force elements (`elastic_model(…, elements=True)`); made if not given

    Raises
    ------
    MeshError
        If a joint or force element finds no place on its links.
    """
    model = model or elastic_model(scene, linkage, along=along, elements=True)
    found = _Builder(scene, linkage, model)
    for joint in model.rows:
        found.joint(joint)
    found.between_prescribed({joint.name for joint in model.rows})
    names = tuple(link.name for link in model.links)
    k = model.interface_unknowns
    bars = {row.bodies[0] for row in model.rows if row.name.startswith("rigid.")}
    links = tuple(
        without_stiffness(x, turned=any(load.own for load in loads)) if n in bars else x
        for x, n, loads in zip(model.links, model.bodies, model.loads, strict=True)
    )
    model = replace(model, links=links)
    return System(names, tuple(found.ends), tuple(found.constraints), k, model)


def without_stiffness(link: Link, turned: bool = False) -> Link:
    """A rigid link, constrained to keep its shape: without stiffness, with a frame only if loads rotate with it."""
    out = replace(link, K0=np.zeros_like(np.asarray(link.K0)))
    return out if turned else replace(out, fit=None, frames=())


@dataclass
class _Builder:
    """Ends and constraints while they are collected."""

    scene: Scene
    linkage: Linkage
    model: Model
    ends: list[End] = field(default_factory=list)
    constraints: list[Constraint] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.elements = dict(force_elements(self.scene))

    def joint(self, joint: ConstraintJoint) -> None:
        """What a joint constrains, a pair of gears couples, a spring, motor or limit acts on."""
        if joint.name.startswith("rigid."):
            self.bars(joint)
        elif joint.name in self.elements:
            self.element(joint, self.elements[joint.name])
        for n, each in enumerate(joint.constraints):
            others = ((share, other, other.constraints[n].terms) for share, other in joint.plus)
            terms = [
                self.numbered(replace(term, factor=share * term.factor), of, of.at)
                for share, of, every in ((1.0, joint, each.terms), *others)
                for term in every
            ]
            self.add(joint.name, terms, each.law, joint, *(other for _, other in joint.plus))

    def bars(self, joint: ConstraintJoint) -> None:
        """A rigid link: all distances between four of its points are in the reference position."""
        side = joint.sides[0]
        if side is None:
            return
        ground, zero = self._numbered(rigid_end(0, np.zeros(3))), np.zeros(3)
        ends = [self._numbered(each) for each in corners(side)]
        for i, j in combinations(range(len(ends)), 2):
            a, b = side.points[i], side.points[j]
            long = Term(record.DISTANCE, ends[i], ends[j], a, b, zero)
            self.add(joint.name, [long, Term(record.DISTANCE, ground, ground, a, b, zero, -1.0)], Held(), joint)

    def between_prescribed(self, known: set[str]) -> None:
        """Springs, motors and limits between the ground and prescribed bodies; drive joints bear their forces."""
        for name, element in self.elements.items():
            if name not in known:
                i, j = (self.linkage.bodies.index(link) for link, _ in places(self.scene, element))
                self.element(ConstraintJoint(name, np.zeros(3), (i, j), (None, None)), element)

    def element(self, joint: ConstraintJoint, element: Element) -> None:
        """The law of a spring, motor or limit on its coordinate, which its links' own motion shows."""
        i, j = (self.end(joint, k, at) for k, (_, at) in enumerate(places(self.scene, element)))
        term = replace(term_of(self.scene, element, self.ends[i], self.ends[j]), i=i, j=j)
        self.constraints.append(Constraint(joint.name, (self.on_line(term),), law_of(element), linear=False))

    def add(self, name: str, terms: Sequence[Term], law: Law, *joints: ConstraintJoint) -> None:
        """A constraint, linear where the frames of all its links are rigid-body ones; else pins are where both are."""
        linear = not {n for joint in joints for n in joint.bodies} & self.own
        if not linear:
            terms = [self.on_line(x) for x in terms]
        self.constraints.append(Constraint(name, tuple(terms), law, linear))

    def on_line(self, term: Term) -> Term:
        """A gap along or across a line as the pin and the bent line show it; others as they are."""
        line = self.ends[term.j].line
        if term.kind != record.GAP or line is None:
            return term
        return replace(term, kind=record.ARC if abs(term.b @ line.axis) > HALF else record.OFFSET)

    def numbered(self, term: Term, joint: ConstraintJoint, at: Vector) -> Term:
        """A term between both ends of a joint."""
        return replace(term, i=self.end(joint, term.i, at), j=self.end(joint, term.j, at))

    def end(self, joint: ConstraintJoint, side: int, at: Vector) -> int:
        """The number of an end of a joint: what it has on one of its links."""
        return self._numbered(end_on(joint, side, at))

    def _numbered(self, end: End) -> int:
        """The number of an end; of one that is there already its own."""
        for n, other in enumerate(self.ends):
            if same_end(other, end):
                return n
        self.ends.append(end)
        return len(self.ends) - 1

    @property
    def own(self) -> set[int]:
        """Numbers of the bodies whose frames are co-rotational."""
        every = zip(self.model.links, self.model.bodies, strict=True)
        return {n for link, n in every if link.fit is not None}
