"""What constraints and laws exert on ends and interface points, from a march's multipliers.

A multiplier is a force along its coordinate: on an end i it is the force m ∂e/∂x_i and the moment m ∂e/∂θ_i.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.joints.constraint_joints import ConstraintJoint
from kedfem.dynamics.system.ends import corners, end_of, same_end
from kedfem.dynamics.system.forces.poses import Vectors, point_forces, poses, turning
from kedfem.dynamics.system.march import Ready
from kedfem.dynamics.system.record import (
    DISTANCE,
    GAP,
    Constraint,
    End,
    Term,
)
from kedfem.dynamics.system.starts.instant import renumbered
from kedfem.dynamics.system.state import History
from kedfem.motion.constraints import cross
from kedfem.motion.rigid import RigidMotion


@dataclass(frozen=True, slots=True)
class Supports:
    """A march over T times: its history, the rigid-body motion at these, and what follows for forces.

    Parameters
    ----------
    z : (T, k) interface unknowns in the order of the system
    """

    of: Ready
    history: History
    motion: RigidMotion
    z: Float[np.ndarray, "T k"]

    def exerted(self, each: Constraint, term: Term) -> list[tuple[End, Vectors, Vectors, Vectors]]:
        """Both ends of a term with their places, and force and moment there of a unit multiplier."""
        ends = [self.of.system.ends[n] for n in (term.i, term.j)]
        z = np.zeros_like(self.z) if each.linear else self.z
        (x_i, Q_i), (x_j, Q_j) = (poses(end, self.motion, z) for end in ends)
        if term.kind in (GAP, DISTANCE):
            a_i, a_j = Q_i @ (term.a - ends[0].origin), Q_j @ (term.a_j - ends[1].origin)
            gap = x_i + a_i - x_j - a_j
            n = Q_j @ term.b if term.kind == GAP else gap / np.linalg.norm(gap, axis=1)[:, None]
            reach = a_j + gap if term.kind == GAP else a_j
            return [(ends[0], x_i, n, cross(a_i, n)), (ends[1], x_j, -n, cross(n, reach))]
        turn = turning(term, Q_i, Q_j)
        return [(ends[0], x_i, 0 * x_i, turn), (ends[1], x_j, 0 * x_j, -turn)]

    def point(self, each: Constraint, n: int, at: Float[np.ndarray, "3"]) -> Vectors:
        """Where a point of the body of end n, in the reference position, is as a constraint sees it."""
        end = self.of.system.ends[n]
        x, Q = poses(end, self.motion, np.zeros_like(self.z) if each.linear else self.z)
        return np.asarray(x + Q @ (at - end.origin))

    def on_interface(self, rows: Sequence[ConstraintJoint]) -> Float[np.ndarray, "T m"]:
        """What rows of the model exert on interface points of their own, side by side as `coupling` has them.

        Both joints of gears may have one end: what is exerted there is reported once.
        """
        out = [np.zeros((len(self.z), 0))]
        for row in rows:
            seen: list[End] = []
            for joint in (row, *(other for _, other in row.plus)):
                for side in joint.sides:
                    if side is not None and side.shared:
                        ends = corners(side) if row.name.startswith("rigid.") else [end_of(side, joint)]
                        for end in ends:
                            again = any(same_end(end, other) for other in seen)
                            on = self.on_end(row.name, end)
                            out.append((0.0 * on if again else on).reshape(len(self.z), -1))
                        seen += ends
        return np.concatenate(out, axis=1)

    def on_end(self, name: str, end: End) -> Float[np.ndarray, "T p d"]:
        """What a joint's constraints and laws exert on the points of one of its ends."""
        y = np.zeros((len(self.z), *end.onto.shape[:2]))
        for n, each in enumerate(self.of.system.constraints):
            for term in each.terms if each.name == name else ():
                for other, _, f, t in self.exerted(each, term):
                    if same_end(other, end):
                        m = term.factor * self.history.multiplier[:, n, None, None]
                        z = np.zeros_like(self.z) if each.linear else self.z
                        y += m * point_forces(end, self.motion, z, f, t)
        return y


def supports(of: Ready, history: History, motion: RigidMotion) -> Supports:
    """What a march says of forces.

    Parameters
    ----------
    history, motion : over the same times
    """
    return Supports(of, history, motion, history.z[:, renumbered(of)])
