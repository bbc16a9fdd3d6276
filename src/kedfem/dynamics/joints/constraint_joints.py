"""Joints enforced by constraint equations C(t) z = 0 with directions that vary in time, not by shared interface points.

Constant weights of fixed points cannot express a constraint that slides or rotates relative to both links. Each link
of such a joint has interface points of its own, whose displacements are interface unknowns; the joint constrains them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from kedfem.arrays import Bool, Float, Int
from kedfem.dynamics.system import record
from kedfem.dynamics.system.record import Constraint, Driven, Held, Law, Spring, Term, rotation_term
from kedfem.errors import MeshError
from kedfem.links.record import Link
from kedfem.links.stations import Stations
from kedfem.links.surfaces.coupling_surfaces import CouplingSurface
from kedfem.motion.constraints import CONSTRAINED, perpendiculars
from kedfem.motion.joint_equations import coordinate_axis, ordered, unit
from kedfem.scene import Joint, Scene, driven_travel, enforced_by_equations, moving_grounds
from kedfem.scene.records.points import XYZ

Ports = Float[np.ndarray, "p 3"]


@dataclass(frozen=True, slots=True)
class Side:
    """The side of a joint on one of its links; all in the link frame, in the reference position.

    body : number in the linkage
    points : (p, 3) its ports in the reference position, the first at X₀ of the coupling surface [m]
    components : d of displacements there; turns : whether the last is ψ of a planar beam
    stations : of the link along which a slot's pin slides; its ports are these
    keys, weights : of each port the link, or segment of one, and (n,) weights on it; none once z is known
    onto : (p, d, c) displacements at the ports, world components, from the interface unknowns z[columns]
    """

    body: int
    points: Ports
    components: int = 3
    turns: bool = False
    stations: Stations | None = None
    keys: tuple[str, ...] = ()
    weights: Float[np.ndarray, "p n"] | Sequence[Float[np.ndarray, " _"]] = ()
    onto: Float[np.ndarray, "p d c"] = field(default_factory=lambda: np.zeros((0, 0, 0)))
    columns: Int[np.ndarray, " c"] = field(default_factory=lambda: np.zeros(0, int))


@dataclass(frozen=True, slots=True)
class ConstraintJoint:
    """A joint enforced by constraint equations.

    name, at : of the joint, (3,) [m] in the reference position
    bodies : numbers of links i and j in the linkage; directions are fixed in j
    sides : what it has on both, None where a link has no unknowns (the ground, what the drive prescribes)
    axis : (3,) of the joint, in the reference position
    constraints : what it constrains, and laws beside; ends of their terms are 0 and 1, its sides
    plus : other joints whose constraints these are combined with, each with its coefficient: gears
    """

    name: str
    at: Float[np.ndarray, "3"]
    bodies: tuple[int, int]
    sides: tuple[Side | None, Side | None]
    axis: Float[np.ndarray, "3"] = field(default_factory=lambda: np.eye(3)[2])
    constraints: tuple[Constraint, ...] = ()
    plus: "tuple[tuple[float, ConstraintJoint], ...]" = ()

    @property
    def all_sides(self) -> Iterator[Side]:
        """Those that it has, and of joints that it is combined with."""
        for joint in (self, *(other for _, other in self.plus)):
            yield from (side for side in joint.sides if side is not None)

    @property
    def along(self) -> tuple[Float[np.ndarray, "r 3"], Float[np.ndarray, "r 3"]]:
        """Directions along and about which its own constraints are, in the reference position [-, m]."""
        out = np.zeros((2, len(self.constraints), 3))
        for n, each in enumerate(self.constraints):
            for term in each.terms:
                gap, turn = direction(term)
                out[:, n] += gap, turn
        return out[0], out[1]


def direction(term: Term) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Direction along, and about, which a term is in the reference position, with its factor."""
    n = np.cross(term.a, term.b) if term.kind == record.TURN else term.b
    none = np.zeros(3)
    return (term.factor * n, none) if term.kind == record.GAP else (none, term.factor * n)


def needs_constraints(scene: Scene, name: str) -> bool:
    """Whether a joint is enforced by constraint equations: where shared interface points cannot express it."""
    if name in scene.driven_joints and name in moving_grounds(scene).values():
        return False
    return enforced_by_equations(scene, name)


def bore_axis(joint: Joint, link: str) -> Float[np.ndarray, "3"] | None:
    """Direction of the bore or journal that a joint looks for on a link; None where any face may be its surface."""
    if joint.axes is not None:
        return coordinate_axis(joint, link)
    if joint.axis is None or joint.kind in {"prismatic", "planar", "slot"}:
        return None
    return unit(joint.axis)


def constrained(scene: Scene, name: str) -> tuple[Constraint, ...]:
    """What a joint constrains, each with its law: held, a bushing's spring, drives' motions or their shafts."""
    joint, at, frame = scene.joints[name], np.asarray(scene.joints[name].at), joint_frame(scene.joints[name])
    (gaps, turns), found = CONSTRAINED[joint.kind], list[tuple[Law, tuple[Term, ...]]]()
    for n in map("xyz".index, gaps):
        found.append((bushing(joint, n, turning=False), (Term(record.GAP, 0, 1, at, at, frame[n]),)))
    if joint.kind == "universal":
        one, other = (coordinate_axis(joint, link) for link in ordered(joint))
        found.append((bushing(joint, 2, turning=True), (Term(record.TURN, 0, 1, one, one, other),)))
    for n in map("xyz".index, turns):
        law = bushing(joint, n, turning=True)
        found.append((law, (rotation_term(frame, n, law, tilt=len(turns) < 3),)))
    if joint.kind == "screw":  # its thread, a constraint of two terms
        lead = -(joint.lead or 0.0) / (2 * np.pi)
        found.append((Held(), (coordinate(joint, turns=False), coordinate(joint, lead, turns=True))))
    for number, (key, drive) in enumerate(scene.all_drives.items()):
        if drive.joint == name:
            shaft = drive.shaft_stiffness
            law = Driven(number) if shaft is None else Spring(shaft, drive.shaft_damping, drive=number)
            found.append((law, (driven_coordinate(scene, key),)))
    return tuple(Constraint(name, terms, law, linear=True) for law, terms in found)


def coordinate(
    joint: Joint, factor: float = 1.0, *, turns: bool, about: str | None = None, along: XYZ | None = None
) -> Term:
    """Angle or travel of a joint between the ends of its `ordered` links; about and along as of `coordinate_axis`."""
    axis, at = coordinate_axis(joint, about, along), np.asarray(joint.at)
    if about is not None:
        arm = coordinate_axis(joint, ordered(joint, about)[0])
        return Term(record.ANGLE, 0, 1, arm, arm, axis, factor)
    if turns:
        across = perpendiculars(axis)[0]
        return Term(record.ANGLE, 0, 1, across, across, axis, factor)
    return Term(record.GAP, 0, 1, at, at, axis, factor)


def driven_coordinate(scene: Scene, name: str) -> Term:
    """Angle or travel that one of `Scene.all_drives` prescribes, between its joint's ends."""
    drive = scene.all_drives[name]
    joint = scene.joints[drive.joint]
    term = coordinate(joint, turns=not driven_travel(scene, name), about=drive.about, along=drive.along)
    return term if ordered(joint, drive.about) == ordered(joint) else replace(term, i=1, j=0)


def bushing(joint: Joint, axis: int, turning: bool) -> Law:
    """The law of a constraint along or about an axis of its joint's frame: held, or a bushing's spring."""
    of = joint.bushing
    stiffness = None if of is None else (of.rotational_stiffness if turning else of.stiffness)
    if of is None or stiffness is None:
        return Held()
    return Spring(stiffness[axis], (of.rotational_damping if turning else of.damping)[axis])


def joint_frame(joint: Joint) -> Float[np.ndarray, "3 3"]:
    """Axes x, y, z of a joint as rows, in the reference position: z its axis; those of the world without one."""
    if joint.axis is None:
        return np.eye(3)
    axis = unit(joint.axis)
    return np.stack([*perpendiculars(axis), axis])


def in_plane(gap: Float[np.ndarray, "*r 3"], turn: Float[np.ndarray, "*r 3"]) -> Bool[np.ndarray, "*r"]:
    """Directions whose constraints are not trivial for links that move in a plane z = constant."""
    return np.asarray((np.abs(gap[..., :2]).max(axis=-1) > 1e-9) | (np.abs(turn[..., 2]) > 1e-9))


def surface_ports(surface: CouplingSurface, link: Link, where: str) -> Ports:
    """Interface points of a coupling surface: its middle, and one off it in each direction with a gradient.

    Raises
    ------
    MeshError
        If the coupling surface is a point or a line that does not know its turn.
    """
    if link.kind == "beam":
        return surface.origin[None]
    known = [k for k in range(link.d) if surface.spread[k] > 0]
    if len(known) < link.d - 1:
        raise MeshError(
            f"{where}: must sit on a bore or a face of link '{link.name}', got a coupling surface "
            "whose points do not determine a rotation"
        )
    return np.array([surface.origin, *(surface.origin + 2 * surface.spread[k] * surface.directions[k] for k in known)])
