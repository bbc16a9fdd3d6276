"""From a scene and its elastic model to a system: what each joint constrains and releases, force elements on coordinates.

One table says what a kind of joint constrains (`motion.constraints.CONSTRAINED`); bushings, gears, drives, springs,
motors and limits are laws on the same coordinates.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Any

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.elastic_model import elastic_model
from kedfem.dynamics.force_elements import law_of, on_hinge
from kedfem.dynamics.joints.constraint_joints import ConstraintJoint, bore_axis, in_plane, joint_frame, mounted, ordered
from kedfem.dynamics.model import Model
from kedfem.dynamics.system import record
from kedfem.dynamics.system.ends import corners, end_of, rigid_end, same_end
from kedfem.dynamics.system.record import Constraint, Driven, End, Held, Law, Spring, System, Term, rotation_term
from kedfem.links.record import Link
from kedfem.motion.constraints import CONSTRAINED, perpendiculars
from kedfem.motion.joint_equations import joint_axis
from kedfem.motion.linkage import Linkage
from kedfem.motion.path import Path
from kedfem.scene import Scene

ELEMENTS = ("springs", "motors", "limits")  # sections of a scene
Vector = Float[np.ndarray, "3"]


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
    """A rigid link whose bars hold it: it has no stiffness, and a frame of its own only if that turns its loads."""
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

    def joint(self, joint: ConstraintJoint) -> None:
        """What a joint constrains, a pair of gears couples, a spring, motor or limit acts on."""
        scene, (kind, _, name) = self.scene, joint.name.rpartition(".")
        if kind == "rigid":
            self.bars(joint)
        elif kind == "gears":
            factor, first = joint.plus[0]
            of = scene.gears[name].joints
            terms = self.coordinate(of[1], joint, 1.0), self.coordinate(of[0], first, factor)
            self.add(joint.name, terms, Held(), joint, first)
        elif kind in ELEMENTS:
            self.element(joint, getattr(scene, kind)[name])
        else:
            for term, law in self.constrained(joint):
                self.add(joint.name, (term,), law, joint)

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
            self.add(joint.name, (long, Term(record.DISTANCE, ground, ground, a, b, zero, -1.0)), Held(), joint)

    def between_prescribed(self, known: set[str]) -> None:
        """Springs, motors and limits between the ground and what drives carry: no unknowns, but hubs bear them."""
        for kind in ELEMENTS:
            for name, element in getattr(self.scene, kind).items():
                if f"{kind}.{name}" in known:
                    continue
                points = getattr(element, "between", None)
                links = [end.link for end in points] if points else ordered(self.scene.joints[str(element.joint)])
                i, j = (self.linkage.bodies.index(link) for link in links)
                none = ConstraintJoint(f"{kind}.{name}", np.zeros(3), (i, j), (None, None))
                self.element(none, element)

    def element(self, joint: ConstraintJoint, element: Any) -> None:
        """The law of a spring, motor or limit on its coordinate, which its links' own motion shows."""
        if (between := getattr(element, "between", None)) is not None:
            i, j = (self.end(joint, k, np.asarray(end.at)) for k, end in enumerate(between))
            a, a_j = (self.ends[n].origin for n in (i, j))
            term = Term(record.DISTANCE, i, j, a, a_j, np.zeros(3))
        else:
            term = self.coordinate(str(element.joint), joint, 1.0, on_hinge(element))
        self.constraints.append(Constraint(joint.name, (term,), law_of(element), linear=False))

    def add(self, name: str, terms: tuple[Term, ...], law: Law, *joints: ConstraintJoint) -> None:
        """A constraint, linear where the frames of all its links are rigid-body ones."""
        numbers = {n for joint in joints for n in joint.bodies}
        self.constraints.append(Constraint(name, terms, law, linear=not numbers & self.own))

    def coordinate(self, name: str, joint: ConstraintJoint, factor: float, turns: bool | None = None) -> Term:
        """Turn or travel of a joint; if not said which, the turn of all but slides."""
        axis, at = joint_axis(self.scene.joints[name]), np.asarray(self.scene.joints[name].at)
        i, j = self.end(joint, 0, at), self.end(joint, 1, at)
        if self.scene.joints[name].kind != "prismatic" if turns is None else turns:
            across = perpendiculars(axis)[0]
            return Term(record.ANGLE, i, j, across, across, axis, factor)
        return Term(record.GAP, i, j, at, at, axis, factor)

    def constrained(self, joint: ConstraintJoint) -> Iterator[tuple[Term, Law]]:
        """What a joint constrains, each with its law: held, a bushing's spring, the drive's motion or its shaft."""
        made, frame = self.scene.joints[joint.name], joint_frame(self.scene.joints[joint.name])
        at = np.asarray(made.at)
        i, j = self.end(joint, 0, at), self.end(joint, 1, at)
        gaps, turns = CONSTRAINED[made.kind]
        slides = self.ends[j].form == record.LINE and bool(set(joint.bodies) & self.own)
        for axis in gaps:
            n = "xyz".index(axis)
            if self.determines(joint, frame[n], np.zeros(3)):
                kind = record.OFFSET if slides else record.GAP
                yield Term(kind, i, j, at, at, frame[n]), self.bushing(joint.name, n, turning=False)
        if made.kind == "universal":
            one, other = (np.asarray(bore_axis(made, link)) for link in ordered(made))
            yield Term(record.TURN, i, j, one, one, other), self.bushing(joint.name, 2, turning=True)
        for axis in turns:
            n = "xyz".index(axis)
            if self.determines(joint, np.zeros(3), frame[n]):
                law = self.bushing(joint.name, n, turning=True)
                yield rotation_term(i, j, frame, n, law, tilt=len(turns) < 3), law
        if made.kind == "screw":  # its thread, a constraint of two terms
            along, across = frame[2], frame[0]
            turn = Term(record.ANGLE, i, j, across, across, along, -(made.lead or 0.0) / (2 * np.pi))
            self.add(joint.name, (Term(record.GAP, i, j, at, at, along), turn), Held(), joint)
        if (drive := self.scene.driven_joints.get(joint.name)) is not None:
            number = list(self.scene.driven_joints).index(joint.name)
            term = self.coordinate(joint.name, joint, 1.0)
            shaft, damping = drive.shaft_stiffness, drive.shaft_damping
            yield term, Driven(number) if shaft is None else Spring(shaft, damping, drive=number)

    def determines(self, joint: ConstraintJoint, gap: Vector, turn: Vector) -> bool:
        """Whether a direction says something of a joint's links: of planar ones only what is in their plane."""
        here = [x for x, n in zip(self.model.links, self.model.bodies, strict=True) if n in joint.bodies]
        return not all(link.planar for link in here) or bool(in_plane(gap[None], turn[None])[0])

    def bushing(self, name: str, axis: int, turning: bool) -> Law:
        """The law of a constraint along or about an axis of its joint."""
        found = mounted(self.scene.joints[name], axis, turning)
        return Held() if found is None else Spring(*found)

    def end(self, joint: ConstraintJoint, side: int, at: Vector) -> int:
        """The number of an end of a joint: what it has on one of its links."""
        found = joint.sides[side]
        end = rigid_end(joint.bodies[side], at) if found is None else end_of(found, joint)
        return self._numbered(end)

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
