"""Ends of constraints: coupling surfaces, points of rigid links, prescribed bodies."""

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.dynamics.joints.constraint_joints import ConstraintJoint, Side
from kedfem.dynamics.system import record
from kedfem.dynamics.system.record import End, Line, System
from kedfem.motion.rigid import RigidMotion, seen_from

NOTHING = 1e-12  # entries of a selection that are rounding
Vector = Float[np.ndarray, "3"]


def corners(side: Side) -> list[End]:
    """The points of a rigid link, each an end."""
    every = zip(side.points, side.onto, strict=True)
    return [
        End(side.body, record.POINT, X, np.eye(3), np.ones(3), 0, *_selected(onto[None], side.columns))
        for X, onto in every
    ]


def same_end(one: End, other: End) -> bool:
    """Whether two ends are one: on the same points of the same body, of a line with the same pin."""
    return (
        one.body == other.body
        and _pinned_alike(one.line, other.line)
        and all(
            x.shape == y.shape and np.array_equal(x, y)
            for x, y in ((one.origin, other.origin), (one.columns, other.columns), (one.onto, other.onto))
        )
    )


def _pinned_alike(one: Line | None, other: Line | None) -> bool:
    """Whether two lines have one pin, whose place is from one point on; also of none."""
    if one is None or other is None:
        return one is other
    return one.pin == other.pin and np.array_equal(one.at, other.at) and np.array_equal(one.axis, other.axis)


def _selected(
    onto: Float[np.ndarray, "p d c"], columns: Int[np.ndarray, " c"]
) -> tuple[Float[np.ndarray, "p d _"], Int[np.ndarray, " _"]]:
    """Those of some unknowns that move points of an end."""
    moving = (np.abs(onto) >= NOTHING).any(axis=(0, 1))
    some = onto[:, :, moving]
    return np.where(np.abs(some) < NOTHING, 0.0, some), columns[moving]


def rigid_end(body: int, at: Vector) -> End:
    """An end on the ground or on a prescribed body."""
    return End(body, record.RIGID, at, np.eye(3), np.ones(3), 0, np.zeros((1, 3, 0)), np.zeros(0, int))


def end_of(side: Side, joint: ConstraintJoint) -> End:
    """An end on a body, or on a line along which the joint's pin slides."""
    onto = side.onto
    p, d, _ = onto.shape
    if side.stations is not None:
        line = Line(side.stations, joint.axis, joint.bodies[0], joint.at)
        onto = onto * np.array([1, 1, not side.turns][:d])[:, None]  # of a planar beam not ψ
        return End(side.body, record.LINE, side.points[0], np.eye(3), np.ones(3), 0, *_selected(onto, side.columns), line)
    directions, lengths, known = np.eye(3), np.ones(3), p - 1
    arms = side.points[1:] - side.points[0]
    if known:
        lengths[:known] = np.linalg.norm(arms, axis=1)
        directions[:known] = arms / lengths[:known, None]
        if d == 2:
            directions[1] = np.cross([0, 0, 1], directions[0]) if known == 1 else directions[1]
            directions[2] = [0, 0, 1]
        elif known == 2:
            directions[2] = np.cross(directions[0], directions[1])
    form, moved = _form(side, d, known), _selected(onto, side.columns)
    return End(side.body, form, side.points[0], directions, lengths, known, *moved)


def end_on(joint: ConstraintJoint, side: int, at: Vector) -> End:
    """The end of a joint on one of its links; a point of it where that has no unknowns."""
    found = joint.sides[side]
    return rigid_end(joint.bodies[side], at) if found is None else end_of(found, joint)


def line_of(end: End) -> Line:
    """The line of an end that has one."""
    if end.line is None:
        raise ValueError("an end must be on a line to have stations, got one that is not")
    return end.line


def line_weights(end: End, motion: RigidMotion) -> Float[np.ndarray, "T p"]:
    """Weights of the stations of a line where its pin is, in the rigid-body motion."""
    line = line_of(end)
    return line.stations.at(seen_from(motion, (line.pin, end.body), line.at) @ line.axis)


def left_line(system: System, end: int, t: float) -> str:
    """The message where a pin slides beyond the line of an end."""
    line = line_of(system.ends[end])
    every = ((each.name, system.ends[term.j].line) for each in system.constraints for term in each.terms)
    name = next(name for name, other in every if _pinned_alike(line, other))  # joints stand before springs along them
    carrier = system.model.links[system.model.bodies.index(system.ends[end].body)].name
    s = line.stations.s
    return (
        f"joints.{name}: the pin must stay on link '{carrier}', which reaches from {s[0]:.6g} to {s[-1]:.6g} m along the "
        f"line, got one that slides off it at t = {t:.6g} s: give a longer line, or constrain the pin"
    )


def _form(side: Side, d: int, known: int) -> int:
    """What an end knows of its orientation."""
    if known:
        return record.PLANAR if d == 2 else {2: record.FACE, 3: record.SOLID}[known]
    return record.PLANAR_BEAM if side.turns else record.POINT
