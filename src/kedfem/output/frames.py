"""Animation frames: elastic links with their stresses, rigid links, and forces of joints and drives as vectors."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.dynamics.history import LinkMoment, Snapshot
from kedfem.dynamics.model import Model
from kedfem.links.beams.spatial_recovery import section_solid
from kedfem.links.record import Link, in_space
from kedfem.links.recovery import StressRecovery, extreme_stresses, nodal_state, nodal_stress, rotated_stress
from kedfem.mesh.cad.sides import boundary_sides, side_corners
from kedfem.motion.joint_equations import coordinate_axis, ordered
from kedfem.motion.linkage import Linkage
from kedfem.motion.rigid import RigidMotion
from kedfem.output.attached import Carriers, ball, ball_words, balls, every_link, rigidly_moved, springs, unstressed
from kedfem.output.fields import DRIVE_FORCE, DRIVE_TORQUE, FORCE, MOMENT, JointField, LinkField, RigidField
from kedfem.results.recorded import drive_effort
from kedfem.scene import Scene, driven_travel

Place = tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3 3"]]
Rows = Mapping[str, Float[np.ndarray, "T c"]]


def _joined(fields: Sequence[LinkField]) -> list[LinkField]:
    """The fields with all segments of a link joined; both sides of a cut keep their own nodes and stresses."""
    out: dict[str, list[LinkField]] = {}
    for field in fields:
        out.setdefault(field.name, []).append(field)
    return [each[0] if len(each) == 1 else _one(each) for each in out.values()]


def _one(parts: Sequence[LinkField]) -> LinkField:
    first = np.cumsum([0, *(len(part.points) for part in parts)])
    cells = np.concatenate([part.cells + n0 for part, n0 in zip(parts, first, strict=False)])
    names = ("points", "displacement", "stress", "von_mises", "principal")
    whole: Any = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    return LinkField(parts[0].name, parts[0].cell_type, cells, **whole, section=parts[0].section)


def link_fields(
    model: Model,
    recoveries: Sequence[StressRecovery],
    snapshot: Snapshot,
    deformation_scale: float,
    scene: Scene | None = None,
) -> list[LinkField]:
    """All links at one time point, with attached masses and springs: R' = R + f, [KED, eqs. (2)(3)], f scaled.

    Parameters
    ----------
    recoveries : one for each link, then one for each prescribed link
    deformation_scale : factor on the elastic displacement of the points [-]; the displacement field itself is not scaled
    scene : the scene whose masses and springs are drawn too; None for links alone
    """
    motion, k = snapshot.motion, snapshot.k
    elastic = zip(model.links, model.bodies, recoveries[: len(model.links)], snapshot.states, strict=True)
    fields = [
        link_field(link, recovery, (motion.p[k, body], motion.R[k, body]), state, deformation_scale)
        for link, body, recovery, state in elastic
    ]
    for prescribed, recovery in zip(model.prescribed, recoveries[len(model.links) :], strict=True):
        X = recovery.at_points((prescribed.link.full or prescribed.link).X)
        points = motion.p[k, prescribed.body] + X @ motion.R[k, prescribed.body].T
        drawn_as = prescribed.link.name, recovery.cell_type, recovery.cells
        fields.append(unstressed(*drawn_as, points, np.zeros_like(X), section=_section(prescribed.link)))
    out = _joined(fields)
    if scene is None or not (scene.bodies or scene.springs):
        return out
    both = zip(every_link(model), recoveries, strict=True)
    places = [recovery.at_points((link.full or link).X) for link, recovery in both]
    carriers = Carriers(model, snapshot, fields, places, deformation_scale)
    return out + balls(carriers, scene.bodies) + springs(carriers, scene)


def link_field(
    link: Link, recovery: StressRecovery, place: Place, moment: LinkMoment, deformation_scale: float
) -> LinkField:
    """One elastic link with its scaled displacement.

    Parameters
    ----------
    place : position and orientation of its rigid-body motion
    """
    shown, (p, R) = link.full or link, place
    displacement = recovery.at_points(in_space(shown, nodal_state(link, moment.u)))
    g = nodal_state(link, moment.g)
    stress, von, least_and_most = nodal_stress(recovery, g), *extreme_stresses(recovery, g)
    if link.rigid:
        stress, von, least_and_most = (np.full_like(of, np.nan) for of in (stress, von, least_and_most))
    points = p + recovery.at_points(shown.X) @ R.T + deformation_scale * displacement
    values = displacement, _in_world(shown, moment, stress), von, least_and_most
    return LinkField(link.name, recovery.cell_type, recovery.cells, points, *values, _section(link))


def _in_world(link: Link, moment: LinkMoment, stress: Float[np.ndarray, "p 6"]) -> Float[np.ndarray, "p 6"]:
    """Stresses of a meshed link in the world's axes; nan of a beam."""
    if not link.meshed:
        return np.full_like(stress, np.nan)
    R = np.eye(3)
    R[: link.d, : link.d] = moment.R
    return rotated_stress(stress, R @ link.axes)


def _section(link: Link) -> tuple[float, float, bool] | None:
    """The section of a planar beam, which is drawn as a line; None for other links."""
    of = (link.full or link).section
    if link.kind != "beam" or of is None:
        return None
    return of.height, of.thickness, of.kind in {"round", "tube"}


@dataclass(frozen=True, slots=True)
class DrawnBody:
    """Visible geometry of a link, or of a mass attached to it.

    body : number of the body in the linkage
    points : (n, 3) in the reference position [m]
    cells, cell_type : (e, k) node numbers, and meshio's name of the cells
    label : as of :class:`LinkField`
    """

    name: str
    body: int
    points: Float[np.ndarray, "n 3"]
    cells: Int[np.ndarray, "e k"]
    cell_type: str
    label: str = ""


def drawn_bodies(scene: Scene, linkage: Linkage, links: Mapping[str, Link]) -> list[DrawnBody]:
    """Geometry of all links and attached masses; links without a record are lines between their joints."""
    out = []
    for name in scene.links:
        link = links.get(name)
        points, cells, kind = _sticks(scene, name) if link is None else _seen(link)
        used, numbers = np.unique(cells, return_inverse=True)
        body = linkage.bodies.index(name)
        out.append(DrawnBody(name, body, points[used], numbers.reshape(cells.shape), kind))
    size = float(np.linalg.norm(np.ptp(np.concatenate([each.points for each in out]), axis=0)))
    for name, mass in scene.bodies.items():
        points = np.asarray(getattr(mass, "centre", mass.at)) + ball(mass.mass, size)
        on, cell = linkage.bodies.index(mass.link), np.arange(27)[None]
        out.append(DrawnBody(name, on, points, cell, "hexahedron27", ball_words(name, mass)))
    return out


def rigid_fields(every: Sequence[DrawnBody], motion: RigidMotion, k: int) -> list[RigidField]:
    """All links at one time point, with velocities and accelerations."""
    out = []
    for each in every:
        moved = rigidly_moved(motion, k, each.body, each.points)
        out.append(RigidField(each.name, each.cell_type, each.cells, *moved, label=each.label))
    return out


def _seen(link: Link) -> tuple[Float[np.ndarray, "n 3"], Int[np.ndarray, "e k"], str]:
    if link.kind == "spatial_beam":
        values, _, cells = section_solid(link)
        return np.asarray(values @ link.X), boundary_sides(cells), "quad"
    if link.kind == "beam":
        return link.X, link.cells, link.cell_type
    if link.kind == "plane":
        return link.X, link.cells[:, :4], "quad"
    sides = boundary_sides(link.cells)
    corners = side_corners(sides.shape[1])
    return link.X, sides[:, :corners], "quad" if corners == 4 else "triangle"


def _sticks(scene: Scene, name: str) -> tuple[Float[np.ndarray, "n 3"], Int[np.ndarray, "e k"], str]:
    """Lines between all joints of a link; a point if all are at one place."""
    at = [joint.at for joint in scene.joints.values() if name in joint.links]
    points = np.array(list(dict.fromkeys(at)))
    if len(points) == 1:
        return points, np.zeros((1, 1), int), "vertex"
    return points, np.array(list(combinations(range(len(points)), 2))), "line"


def joint_field(scene: Scene, linked: Linkage, motion: RigidMotion, rows: Rows, k: int) -> JointField | None:
    """Joints whose forces are recorded, at one time point; None without any.

    Parameters
    ----------
    rows : values of all channels at the times of the motion
    """
    names = [name for name in scene.joints if f"joints/{name}/force" in rows]
    if not names:
        return None
    points = np.zeros((len(names), 3))
    force, moment, push, torque = np.zeros((4, len(names), 3))
    for n, name in enumerate(names):
        joint = scene.joints[name]
        i = linked.bodies.index(ordered(joint)[0])
        points[n] = motion.p[k, i] + motion.R[k, i] @ joint.at
        force[n] = rows[f"joints/{name}/force"][k]
        moment[n] = rows.get(f"joints/{name}/moment", np.zeros((k + 1, 3)))[k]
        on = ""  # the link on which the joint's first drive acts: the arrow shows all efforts on it
        for driven, drive in scene.all_drives.items():
            key, what, _ = drive_effort(scene, driven)
            if drive.joint == name and (found := rows.get(key)) is not None:
                one, other = ordered(joint, drive.about)
                on = on or one
                axis = motion.R[k, linked.bodies.index(other)] @ coordinate_axis(joint, drive.about, drive.along)
                (push if what == "force" else torque)[n] += (1 if one == on else -1) * found[k] * axis
    vectors = {FORCE: force, MOMENT: moment}
    slides = {driven_travel(scene, name) for name in scene.all_drives}
    vectors |= {DRIVE_FORCE: push} if True in slides else {}
    vectors |= {DRIVE_TORQUE: torque} if False in slides else {}
    return JointField(tuple(names), points, vectors)
