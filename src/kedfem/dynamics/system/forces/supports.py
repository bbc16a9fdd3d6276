"""Forces of constraints and laws on bodies, hubs of prescribed bodies, efforts of drives: from a march's multipliers.

A multiplier is a force along its coordinate: on an end i it is the force m ∂e/∂x_i and the moment m ∂e/∂θ_i. A body
that the drive carries has no unknowns; all that acts on it, and P − M R0'', its hub must balance.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from kedfem.dynamics.joints.constraint_joints import ConstraintJoint
from kedfem.dynamics.loads import applied
from kedfem.dynamics.model import PrescribedBody
from kedfem.dynamics.system.ends import corners, end_of, same_end
from kedfem.dynamics.system.forces.poses import Vectors, Wrench, point_forces, poses, resultant, turning
from kedfem.dynamics.system.march import Ready
from kedfem.dynamics.system.record import (
    DISTANCE,
    GAP,
    Constraint,
    Driven,
    End,
    Spring,
    Term,
)
from kedfem.dynamics.system.starts.instant import renumbered
from kedfem.dynamics.system.state import History
from kedfem.motion.constraints import cross
from kedfem.motion.joint_equations import joint_axis
from kedfem.motion.rigid import RigidMotion
from kedfem.scene import GROUND, Scene

"""Force [N] and moment [N m], world components."""


@dataclass(frozen=True, slots=True)
class Supports:
    """A march over T times: its history, the rigid-body motion at these, and what follows for forces.

    Parameters
    ----------
    z : (T, k) interface unknowns in the order of the system
    """

    of: Ready
    scene: Scene
    history: History
    motion: RigidMotion
    z: Float[np.ndarray, "T k"]

    def on(self, body: int, about: Vectors) -> Wrench:
        """What all constraints and laws exert on a body, by its number in the linkage, with the moment about points."""
        force, moment = np.zeros((2, *about.shape))
        system = self.of.system
        for n, each in enumerate(system.constraints):
            for term in each.terms:
                if body in {system.ends[term.i].body, system.ends[term.j].body}:
                    m = term.factor * self.history.multiplier[:, n, None]
                    for end, x, f, t in self.exerted(each, term):
                        if end.body == body:
                            force += m * f
                            moment += m * (t + cross(x - about, f))
        return force, moment

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
        """Where a point of the body of end n, as drawn, is as a constraint sees it."""
        end = self.of.system.ends[n]
        x, Q = poses(end, self.motion, np.zeros_like(self.z) if each.linear else self.z)
        return np.asarray(x + Q @ (at - end.origin))

    def of_joint(self, k: int, joint: str, about: Vectors) -> Wrench:
        """What a joint of shared interface points exerts on body k of the model; these where the rigid-body motion has
        them.

        From all λ and what laws exert on interface points that depend on the joint's, see `Attachment`.
        """
        model, bodies, number = self.of.system.model, self.of.bodies, self.of.system.model.bodies[k]
        ports, beam = model.joints[k], model.links[k].kind == "beam"
        every = np.zeros((len(about), ports.components * len(ports.points)))
        for j, share in enumerate(ports.shares):
            if share.any():
                every += self.history.port_force[:, bodies.port_at[j] : bodies.port_at[j + 1]] @ share.T
        if ports.from_rows.any():
            every += self.on_interface(self.of.system.model.rows) @ ports.from_rows.T
        force, moment = np.zeros((2, *about.shape))
        for port, (X, name) in enumerate(zip(ports.points, ports.joints, strict=True)):
            if name == joint:
                here = every[:, ports.components * port :][:, : ports.components]
                f = np.zeros_like(about)
                flat = 2 if beam else ports.components
                f[:, :flat] = here[:, :flat]
                force, moment = force + f, moment + cross(self.place(number, X) - about, f)
                if beam:
                    moment[:, 2] += here[:, 2]
        return force, moment

    def on_interface(self, rows: Sequence[ConstraintJoint]) -> Float[np.ndarray, "T m"]:
        """What rows of the model exert on interface points of their own, side by side as `coupling` has them.

        Both joints of gears may have one end: what is exerted there is told once.
        """
        out = [np.zeros((len(self.z), 0))]
        for row in rows:
            told: list[End] = []
            for joint in (row, *(other for _, other in row.plus)):
                for side in joint.sides:
                    if side is not None and side.shared:
                        ends = corners(side) if row.name.startswith("rigid.") else [end_of(side, joint)]
                        for end in ends:
                            again = any(same_end(end, other) for other in told)
                            on = self.on_end(row.name, end)
                            out.append((0.0 * on if again else on).reshape(len(self.z), -1))
                        told += ends
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

    def place(self, body: int, at: Float[np.ndarray, "3"]) -> Vectors:
        """Where a point of a body as drawn is in the rigid-body motion."""
        return np.asarray(self.motion.p[:, body] + self.motion.R[:, body] @ at)

    def hub(self, carried: PrescribedBody) -> Wrench:
        """What the driven joint exerts on a body that it carries, with the moment about the joint's point."""
        centre = self.place(carried.body, np.asarray(self.scene.joints[carried.hub].at))
        force, moment = (-x for x in self.on(carried.body, centre))
        rows = applied(carried.link, carried.loads, self.motion, carried.body)
        f, t = resultant(carried.link, rows, self.motion, carried.body, centre)
        force, moment = force - f, moment - t
        for k, link in enumerate(self.of.system.model.links):
            both = {link.name, carried.link.name}
            for name in (name for name, joint in self.scene.joints.items() if both == set(joint.links)):
                f, t = self.of_joint(k, name, centre)
                force, moment = force + f, moment + t
        for rider in self.of.system.model.carried:
            if rider is not carried and carried.link.name in self.scene.joints[rider.hub].links:
                f, t = self.hub(rider)
                arm = self.place(rider.body, np.asarray(self.scene.joints[rider.hub].at)) - centre
                force, moment = force + f, moment + t + cross(arm, f)
        return force, moment

    def effort(self, name: str) -> Float[np.ndarray, " T"]:
        """Torque of the drive on a hinge, force of that on a slide, along its axis [N m or N]."""
        model, joint = self.of.system.model, self.scene.joints[name]
        number = list(self.scene.driven_joints).index(name)
        for n, each in enumerate(self.of.system.constraints):
            if isinstance(each.law, Driven | Spring) and each.law.drive == number:
                return np.asarray(self.history.multiplier[:, n])
        carried = next((x for x in model.carried if x.hub == name), None)
        if carried is not None:
            wrench = self.hub(carried)
        else:
            on = next(link for link in joint.links if link != GROUND)
            own = [(k, model.bodies[k]) for k, link in enumerate(model.links)
                   if link.name == on and name in model.joints[k].joints]  # fmt: skip
            centre = self.place(own[0][1], np.asarray(joint.at))
            force, moment = np.sum([self.of_joint(k, name, centre) for k, _ in own], axis=0)
            wrench = (force, moment)
        return np.asarray((wrench[0 if joint.kind == "prismatic" else 1] * self._axis(name)).sum(axis=1))

    def _axis(self, name: str) -> Vectors:
        """Direction of a joint in its second link, which may be a moving part of the ground."""
        bodies = {x.link.name: x.body for x in self.of.system.model.carried}
        turned = bodies.get(self.scene.joints[name].links[1], 0)
        return np.asarray(self.motion.R[:, turned] @ joint_axis(self.scene.joints[name]))


def supports(of: Ready, scene: Scene, history: History, motion: RigidMotion) -> Supports:
    """What a march says of forces.

    Parameters
    ----------
    history, motion : over the same times
    """
    return Supports(of, scene, history, motion, history.z[:, renumbered(of)])
