"""What constraints and laws exert on ends and interface points, from a march's multipliers.

A multiplier is a force along its coordinate: on an end i it is the force m ∂e/∂x_i and the moment m ∂e/∂θ_i.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.history import Block, Multipliers
from kedfem.dynamics.joints.constraint_joints import ConstraintJoint
from kedfem.dynamics.system.ends import corners, end_of, same_end
from kedfem.dynamics.system.forces.lines import on_line
from kedfem.dynamics.system.forces.poses import Vectors, point_forces, poses, unit_moment
from kedfem.dynamics.system.record import DISTANCE, GAP, ON_LINES, Constraint, End, Term
from kedfem.motion.rigid import RigidMotion
from kedfem.vectors import cross

Pushed = tuple[End, Vectors, Vectors, Vectors]
"""An end with its place, and the force and the moment on it there."""


@dataclass(frozen=True, slots=True)
class Supports:
    """A march over T times: its multipliers, the rigid-body motion at these, and what follows for forces."""

    of: Multipliers
    motion: RigidMotion

    def __len__(self) -> int:
        return len(self.motion.t)

    @property
    def constraints(self) -> tuple[Constraint, ...]:
        """Of the system, in the order of its multipliers."""
        every: tuple[Constraint, ...] = self.of.system.constraints
        return every

    def number(self, name: str) -> int:
        """The first constraint of a joint, gears or force element."""
        return [each.name for each in self.constraints].index(name)

    def z(self, each: Constraint) -> Float[np.ndarray, "T k"] | None:
        """Interface unknowns that a constraint sees; None where the rigid-body motion alone shows its directions."""
        return None if each.linear else self.of.z

    def exerted(self, each: Constraint, term: Term) -> list[Pushed]:
        """As the function, of a term of a constraint."""
        ends = self.of.system.ends[term.i], self.of.system.ends[term.j]
        return exerted(term, ends, self.motion, self.z(each))

    def pushes(self, name: str) -> Iterator[tuple[Constraint, Term, list[Pushed]]]:
        """What constraints and laws of a name exert, term by term, on both ends."""
        for n, each in enumerate(self.constraints):
            for term in each.terms if each.name == name else ():
                m = term.factor * self.of.multiplier[:, n, None]
                yield each, term, [(end, x, m * f, m * t) for end, x, f, t in self.exerted(each, term)]

    def point(self, each: Constraint, n: int, at: Float[np.ndarray, "3"]) -> Vectors:
        """Where a point of the body of end n, in the reference position, is as a constraint sees it."""
        end = self.of.system.ends[n]
        x, Q = poses(end, self.motion, self.z(each))
        return np.asarray(x + Q @ (at - end.origin))

    def on_interface(self, rows: Sequence[ConstraintJoint]) -> Float[np.ndarray, "T m"]:
        """What rows of the model exert on interface points of their own, side by side as `coupling` has them.

        Both joints of gears may have one end: what is exerted there is reported once.
        """
        out = [np.zeros((len(self), 0))]
        for row in rows:
            seen: list[End] = []
            for joint in (row, *(other for _, other in row.plus)):
                for side in joint.sides:
                    if side is not None:
                        ends = corners(side) if row.name.startswith("rigid.") else [end_of(side, joint)]
                        for end in ends:
                            again = any(same_end(end, other) for other in seen)
                            on = self.on_end(row.name, end)
                            out.append((0.0 * on if again else on).reshape(len(self), -1))
                        seen += ends
        return np.concatenate(out, axis=1)

    def on_end(self, name: str, end: End) -> Float[np.ndarray, "T p d"]:
        """What a joint's constraints and laws exert on the points of one of its ends."""
        y = np.zeros((len(self), *end.onto.shape[:2]))
        for n, each in enumerate(self.constraints):
            for term in each.terms if each.name == name else ():
                m = term.factor * self.of.multiplier[:, n, None, None]
                for other, _, f, t in self.exerted(each, term):
                    if not same_end(other, end):
                        continue
                    if term.kind in ON_LINES and end.line is not None:
                        pin = self.point(each, term.i, term.a)
                        on = on_line(term, pin, end, self.motion, self.of.z).at_stations(end.line.stations)
                        y += m * on[:, :, : end.onto.shape[1]]
                    else:
                        y += m * point_forces(end, self.motion, self.z(each), f, t)
        return y


def exerted(term: Term, ends: tuple[End, End], motion: RigidMotion, z: Float[np.ndarray, "T k"] | None) -> list[Pushed]:
    """Both ends of a term with their places, and force and moment there of a unit multiplier.

    Parameters
    ----------
    z : interface unknowns, that terms `ON_LINES` need; without them ends are where the rigid-body motion shows
    """
    (x_i, Q_i), (x_j, Q_j) = (poses(end, motion, z) for end in ends)
    if term.kind not in (GAP, DISTANCE, *ON_LINES):
        turn = unit_moment(term, Q_i, Q_j)
        return [(ends[0], x_i, 0 * x_i, turn), (ends[1], x_j, 0 * x_j, -turn)]
    a_i = Q_i @ (term.a - ends[0].origin)
    if term.kind in ON_LINES and z is not None:
        of = on_line(term, x_i + a_i, ends[1], motion, z)
        return [(ends[0], x_i, of.force, cross(a_i, of.force)), (ends[1], of.c, -of.force, cross(of.tangent, of.slope))]
    a_j = Q_j @ (term.a_j - ends[1].origin)
    gap = x_i + a_i - x_j - a_j
    size = np.linalg.norm(gap, axis=1)[:, None]  # zero where ends meet: no direction, as in the steps
    n = gap / np.where(size > 0, size, 1.0) if term.kind == DISTANCE else Q_j @ term.b
    reach = a_j if term.kind == DISTANCE else a_j + gap
    return [(ends[0], x_i, n, cross(a_i, n)), (ends[1], x_j, -n, cross(n, reach))]


def supports(block: Block) -> Supports:
    """What the march that took the steps of a block says of forces."""
    return Supports(block.multipliers, block.motion)
