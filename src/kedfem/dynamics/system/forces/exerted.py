"""Forces of constraints and laws over a march, at the bodies' positions: one formula for joints, gears and drives.

A multiplier is a force along its coordinate; `Supports` turns it into forces and moments at the displaced ends.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.joints.constraint_joints import ConstraintJoint, Side
from kedfem.dynamics.model import Model
from kedfem.dynamics.system.ends import end_of
from kedfem.dynamics.system.forces.poses import Vectors
from kedfem.dynamics.system.forces.supports import Supports
from kedfem.dynamics.system.record import Spring
from kedfem.vectors import cross

ELEMENTS = ("motors.", "springs.", "limits.")
Rows = Float[np.ndarray, "T _ _"]


def wrench(forces: Supports, joint: ConstraintJoint) -> tuple[Vectors, Vectors, Vectors]:
    """Force of a joint by constraint equations on its link i, moment about its point there, and that point."""
    force, moment, point = np.zeros((3, len(forces), 3))
    for each, term, ends in forces.pushes(joint.name):
        side = 0 if ends[0][0].body == joint.bodies[0] else 1  # a drive's coordinate may be of j against i
        _, x, f, t = ends[side]
        point = forces.point(each, (term.i, term.j)[side], joint.at)
        force += f
        moment += t + cross(x - point, f)
    return force, moment, point


def effort(forces: Supports, of: str | int) -> Float[np.ndarray, " T"]:
    """Along the coordinate of a drive, by its number, or along that of the first joint of gears, by name [N or N m]."""
    known = [each.name if isinstance(of, str) else getattr(each.law, "drive", -1) for each in forces.constraints]
    return np.asarray(forces.of.multiplier[:, known.index(of)])


def springs(forces: Supports) -> tuple[np.ndarray, ...]:
    """Deflections and forces (T, s) of the springs of bushings and shafts, and their stiffness and damping (s,)."""
    every = [(n, each.law) for n, each in enumerate(forces.constraints)
             if isinstance(each.law, Spring) and not each.name.startswith(ELEMENTS)]  # fmt: skip
    soft = [n for n, _ in every]
    laws = np.array([(law.stiffness, law.damping) for _, law in every]).reshape(-1, 2)
    return forces.of.e[:, soft], forces.of.multiplier[:, soft], *laws.T


def at_ends(forces: Supports, name: str) -> Float[np.ndarray, "2 2 T 3"]:
    """Force and moment about the world's origin at both ends of a force element."""
    out = np.zeros((2, 2, len(forces), 3))
    for _, _, ends in forces.pushes(name):
        for side, (_, x, f, t) in enumerate(ends):
            out[side] += f, t + cross(x, f)
    return out


def on_ports(forces: Supports) -> Float[np.ndarray, "T m"]:
    """Forces on interface points of joints by constraint equations, side by side."""
    rows = forces.of.system.model.rows
    return forces.on_interface([row for row in rows if not row.name.startswith((*ELEMENTS, "rigid."))])


def on_links(forces: Supports, on: Model | None = None) -> dict[int, Rows]:
    """Nodal forces (T, n, d) of force elements on the links that they act on, by number, world components.

    Parameters
    ----------
    on : a model of the same scene with interface points for force elements, as with unreduced links; the march's own if
        not given
    """
    model, out = on or forces.of.system.model, dict[int, Rows]()
    for row in forces.of.system.model.rows:
        for side in row.sides if row.name.startswith(ELEMENTS) else ():
            if side is None:
                continue
            y = forces.on_end(row.name, end_of(side, row))
            for k, points, W in _placed(model.joints, model.bodies, row.name, side):
                link = model.links[k]
                total = out.setdefault(k, np.zeros((len(forces), link.n, link.d)))
                total[:, model.joints[k].nodes] += np.einsum("pn,tpd->tnd", W, y[:, points])[:, :, : link.d]
    return out


def _placed(
    joints: Sequence[Attachment], bodies: Sequence[int], name: str, side: Side
) -> Iterator[tuple[int, Int[np.ndarray, " q"], Float[np.ndarray, "q b"]]]:
    """Links, or segments of one, with points of one side of a force element: which, and their weights on its nodes."""
    left = np.ones(len(side.points), bool)
    for k, joint in enumerate(joints):
        here = np.flatnonzero([each == name for each in joint.joints])
        if bodies[k] == side.body and len(here):
            gaps = np.linalg.norm(joint.points[here][:, None] - side.points[None], axis=2)
            points = np.flatnonzero(left & (gaps.min(axis=0) == 0.0))
            left[points] = False
            yield k, points, joint.weights[here[gaps[:, points].argmin(axis=0)]]
    if left.any():
        raise KeyError(name)
