"""What constraints and laws exert over a march, where bodies are: one formula for joints, gears, drives, springs, motors.

A multiplier is a force along its coordinate; `Supports` turns it into forces and moments at the displaced ends.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.history import Exerted
from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.joints.constraint_joints import ConstraintJoint, Side
from kedfem.dynamics.system.ends import end_of, same_end
from kedfem.dynamics.system.forces.poses import Vectors
from kedfem.dynamics.system.forces.supports import Supports
from kedfem.dynamics.system.record import Constraint, Driven, End, Spring
from kedfem.motion.constraints import cross

ELEMENTS = ("motors.", "springs.", "limits.")
Rows = Float[np.ndarray, "T _ _"]


def joints_of(forces: Supports) -> list[ConstraintJoint]:
    """Joints by constraint equations, and gears."""
    return [row for row in forces.of.system.model.rows if not row.name.startswith((*ELEMENTS, "rigid."))]


def exerted(forces: Supports, elements: Sequence[str]) -> Exerted:
    """Of all constraints and laws of a march.

    Parameters
    ----------
    elements : names of motors, springs and limits, as ``motors.NAME``, in the order that is recorded
    """
    T, joints, history = len(forces.z), joints_of(forces), forces.history
    constraints = forces.of.system.constraints
    number = {each.name: n for n, each in enumerate(constraints)}
    which = [number[name] for name in elements]
    e, m = history.e[:, which], history.multiplier[:, which]
    soft = [n for n, each in enumerate(constraints)
            if isinstance(each.law, Spring) and not each.name.startswith(ELEMENTS)]  # fmt: skip
    laws = [constraints[n].law for n in soft]
    return Exerted(
        wrench=_stacked([wrench(forces, joint) for joint in joints], (T, 0, 3, 3)),
        effort=_stacked([effort(forces, joint.name) for joint in joints], (T, 0)),
        spring=np.stack([history.e[:, soft], history.multiplier[:, soft]], axis=1),
        element=np.stack([e, history.rate[:, which], m], axis=1),
        ends=_stacked([at_ends(forces, constraints[n], n) for n in which], (T, 0, 2, 2, 3)),
        ports=_on_ports(forces, joints),
        stiffness=np.array([law.stiffness for law in laws if isinstance(law, Spring)]),
        damping=np.array([law.damping for law in laws if isinstance(law, Spring)]),
    )


def _stacked(each: Sequence[np.ndarray], empty: tuple[int, ...]) -> np.ndarray:
    return np.stack(each, axis=1) if each else np.zeros(empty)


def wrench(forces: Supports, joint: ConstraintJoint) -> Float[np.ndarray, "T 3 3"]:
    """Force of a joint on its link i, moment about its point there, and that point; of gears nothing."""
    out = np.zeros((len(forces.z), 3, 3))
    every = enumerate(forces.of.system.constraints)
    own = [(n, each) for n, each in every if each.name == joint.name and not joint.plus]
    for n, each in own:
        for term, ends in _pairs(forces, each):
            _, x, f, t = ends[0]
            m = term.factor * forces.history.multiplier[:, n, None]
            out[:, 2] = forces.point(each, term.i, joint.at)
            out[:, 0] += m * f
            out[:, 1] += m * (t + cross(x - out[:, 2], f))
    return out


def _pairs(forces: Supports, each: Constraint) -> Iterator[tuple]:  # type: ignore[type-arg]
    """Terms of a constraint, each with both its ends under a unit multiplier."""
    return ((term, forces.exerted(each, term)) for term in each.terms)


def effort(forces: Supports, name: str) -> Float[np.ndarray, " T"]:
    """Along the coordinate of a joint's drive, or between gears; nothing of other joints."""
    for n, each in enumerate(forces.of.system.constraints):
        driven = isinstance(each.law, Driven) or (isinstance(each.law, Spring) and each.law.drive >= 0)
        if each.name == name and (driven or name.startswith("gears.")):
            return np.asarray(forces.history.multiplier[:, n])
    return np.zeros(len(forces.z))


def at_ends(forces: Supports, each: Constraint, n: int) -> Float[np.ndarray, "T 2 2 3"]:
    """Force and moment about the world's origin at both ends of a force element."""
    out = np.zeros((len(forces.z), 2, 2, 3))
    for term, ends in _pairs(forces, each):
        for side, (_, x, f, t) in enumerate(ends):
            m = term.factor * forces.history.multiplier[:, n, None]
            out[:, side, 0] += m * f
            out[:, side, 1] += m * (t + cross(x, f))
    return out


def _on_ports(forces: Supports, joints: Sequence[ConstraintJoint]) -> Float[np.ndarray, "T m"]:
    """Forces on the interface points of joints by constraint equations, side by side, if joint forces need them."""
    if not any(joint.from_rows.nnz for joint in forces.of.system.model.joints):
        return np.zeros((len(forces.z), 0))
    return forces.on_interface(joints)


def on_links(forces: Supports, riders: Mapping[int, tuple[int, np.ndarray]]) -> dict[int, Rows]:
    """Nodal forces (T, n, d) of force elements on the links that they act on, by number, world components.

    Parameters
    ----------
    riders : of rigid sliders, by number in the linkage: the link that carries each, and its weights there
    """
    model, out = forces.of.system.model, dict[int, Rows]()
    for row in model.rows:
        for side in row.sides if row.name.startswith(ELEMENTS) else ():
            if side is None:
                continue
            if side.shared:
                k, W = _placed(model.joints, model.bodies, row.name, side)
                y = forces.on_end(row.name, end_of(side, row))
                f = np.einsum("pn,tpd->tnd", W, y)
                nodes = model.joints[k].nodes
            else:
                k, weights = riders[side.body]
                pull = _on_rider(forces, row.name, end_of(side, row))
                pull[:, 2] *= not model.links[k].planar
                f = np.einsum("n,td->tnd", weights, pull)
                nodes = np.arange(len(weights))
            link = model.links[k]
            total = out.setdefault(k, np.zeros((len(forces.z), link.n, link.d)))
            total[:, nodes] += f[:, :, : link.d]
    return out


def _placed(
    joints: Sequence[Attachment], bodies: Sequence[int], name: str, side: Side
) -> tuple[int, Float[np.ndarray, "p b"]]:
    """The link that has the points of one side of a force element, and their weights on its nodes."""
    for k, joint in enumerate(joints):
        here = np.flatnonzero([each == name for each in joint.joints])
        if bodies[k] == side.body and len(here):
            gaps = np.linalg.norm(joint.points[here][:, None] - side.points[None], axis=2)
            if (gaps.min(axis=0) == 0.0).all():
                return k, joint.weights[here[gaps.argmin(axis=0)]]
    raise KeyError(name)


def _on_rider(forces: Supports, name: str, end: End) -> Vectors:
    """Force of an element on a rigid slider."""
    total = np.zeros((len(forces.z), 3))
    for n, each in enumerate(forces.of.system.constraints):
        for term, ends in _pairs(forces, each) if each.name == name else ():
            for other, _, f, _ in ends:
                if same_end(other, end):
                    total += term.factor * forces.history.multiplier[:, n, None] * f
    return total
