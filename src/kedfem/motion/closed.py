"""The scene with its joints closed by small rigid displacements of links, with everything attached to them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import MotionError
from kedfem.motion.joint_equations import moving_pair
from kedfem.motion.newton import rotation
from kedfem.scene import (
    DIRECTED,
    GROUND,
    Arc,
    Bar,
    Cad,
    Extrusion,
    Joint,
    LineSpring,
    LinkScene,
    MeshFile,
    Part,
    PlateLink,
    Polyline,
    RigidBody,
    Scene,
    Spring,
    inertia_tensor,
    moments_of_inertia,
)
from kedfem.scene.records.base import Record
from kedfem.scene.records.joints import FaceName
from kedfem.scene.records.points import XYZ
from kedfem.scene.records.shapes import STEEP

TILTED = 1e-9  # rad: smaller tilts of shapes parallel to the xy plane are rounding
AnyRecord = TypeVar("AnyRecord", bound=Record)


@dataclass(frozen=True, slots=True)
class RigidDisplacement:
    """A rigid motion: x goes to x + d + (R − I)(x − c), R = exp([θ]×).

    centre, d : (3,) c and d [m]
    theta : (3,) θ [rad]
    """

    centre: Float[np.ndarray, "3"]
    d: Float[np.ndarray, "3"]
    theta: Float[np.ndarray, "3"]

    @property
    def R(self) -> Float[np.ndarray, "3 3"]:
        """The rotation."""
        return rotation(self.theta)

    def point(self, x: XYZ) -> XYZ:
        """The displaced point; coordinates that do not change are exact."""
        moved = np.asarray(x) + self.d + (self.R - np.eye(3)) @ (np.asarray(x) - self.centre)
        return _three(moved)

    def rotated(self, a: XYZ) -> XYZ:
        """A rotated direction or vector."""
        return _three(np.asarray(a) + (self.R - np.eye(3)) @ np.asarray(a))


def _three(x: Float[np.ndarray, "3"]) -> XYZ:
    return float(x[0]), float(x[1]), float(x[2])


STILL = RigidDisplacement(np.zeros(3), np.zeros(3), np.zeros(3))


def closed_scene(scene: Scene, shifts: Mapping[str, RigidDisplacement]) -> Scene:
    """A scene with displaced links, whose joints have one point again; the ground does not move.

    Raises
    ------
    MotionError
        Shapes that cannot be placed there, all of them.
    """
    links, faults = {}, []
    for name, link in scene.links.items():
        try:
            links[name] = _link(name, link, shifts[name])
        except MotionError as error:
            faults.append(str(error))
    if faults:
        raise MotionError("\n".join(faults))
    analysis = scene.analysis
    motions = {name: _moved(motion, shifts[name]) for name, motion in analysis.initial_motions.items()}
    deflection = {name: _moved(x, shifts[x.link]) for name, x in analysis.initial_deflection.items()}
    probes = {name: _moved(probe, shifts[probe.link]) for name, probe in scene.output.probes.items()}
    return scene.model_copy(
        update={
            "links": links,
            "joints": {name: _joint(x, {**shifts, GROUND: STILL}) for name, x in scene.joints.items()},
            "loads": {name: _moved(load, shifts[load.link]) for name, load in scene.loads.items()},
            "bodies": {name: _moved(body, shifts[body.link]) for name, body in scene.bodies.items()},
            "springs": {name: _spring(spring, shifts) for name, spring in scene.springs.items()},
            "output": scene.output.model_copy(update={"probes": probes}),
            "analysis": analysis.model_copy(update={"initial_motions": motions, "initial_deflection": deflection}),
        }
    )


def _moved(record: AnyRecord, shift: RigidDisplacement) -> AnyRecord:
    """A record attached to a link: its points, vectors in the link's frame and inertia displaced."""
    given = [key for key in ("at", "centre") if getattr(record, key, None) is not None]
    change: dict[str, Any] = {key: shift.point(getattr(record, key)) for key in given}
    for key in ("vector", "end_vector") if getattr(record, "frame", None) == "link" else ():
        if getattr(record, key, None) is not None:
            change[key] = shift.rotated(getattr(record, key))
    for key in ("chord", "between"):  # of probes and of loads along a line
        if getattr(record, key, None) is not None:
            change[key] = tuple(shift.point(x) for x in getattr(record, key))
    if isinstance(record, RigidBody):
        J = shift.R @ inertia_tensor(record.inertia) @ shift.R.T
        change["inertia"] = moments_of_inertia(J)
    return record.model_copy(update=change)


def _spring(spring: Spring, shifts: Mapping[str, RigidDisplacement]) -> Spring:
    """A spring with its ends displaced with their links."""
    if not isinstance(spring, LineSpring) or spring.between is None:
        return spring
    ends = tuple(_moved(end, shifts.get(end.link, STILL)) for end in spring.between)
    return spring.model_copy(update={"between": ends})


def _joint(joint: Joint, shifts: Mapping[str, RigidDisplacement]) -> Joint:
    """A closed joint: its point and axis are those of the ground; the point of a sliding joint is the moving link's."""
    first, moving = joint.links[0], moving_pair(joint)[0]
    still = GROUND if GROUND in joint.links else first
    of = {"slot": first}.get(joint.kind, moving if joint.kind in DIRECTED else still)
    along = {"slot": joint.links[1], "spherical": moving}.get(joint.kind, still)
    change: dict[str, Any] = {"at": shifts[of].point(joint.on(of))}
    if joint.axis is not None:
        change["axis"] = shifts[along].rotated(joint.axis)
    if joint.axes is not None:
        change["axes"] = tuple(shifts[x].rotated(a) for x, a in zip(joint.links, joint.axes, strict=True))
    if joint.faces:
        every = joint.faces.items()
        change["faces"] = {name: tuple(_face(x, shifts[name]) for x in named) for name, named in every}
    return joint.model_copy(update=change)


def _face(face: FaceName, shift: RigidDisplacement) -> FaceName:
    """A chosen face of a link, with its place and direction displaced."""
    if isinstance(face, str):
        return face
    turned = {key: getattr(face, key) for key in ("plane", "axis") if getattr(face, key) is not None}
    change: dict[str, Any] = {key: shift.rotated(value) for key, value in turned.items()}
    if face.near is not None:
        change["near"] = shift.point(face.near)
    return face.model_copy(update=change)


def _link(name: str, link: LinkScene, shift: RigidDisplacement) -> LinkScene:
    """A link with its shape moved."""
    where = f"links.{name}.shape"
    change: dict[str, Any] = {}
    if link.shape is None or not (shift.d.any() or shift.theta.any()):
        return link
    match link.shape:
        case Polyline() as line:
            points = tuple(shift.point(x) for x in line.points)
            change = {"points": points, "up": _up(where, line, shift)}
        case Bar() as bar:
            up = bar.up if _tilt(shift, bar.upward) == 0.0 else shift.rotated(bar.upward)
            change = {"between": tuple(shift.point(x) for x in bar.between), "up": up}
        case PlateLink() | Part() as shape:
            _check_level(where, shape.kind, shift)
            change = {"between": tuple(shift.point(x) for x in shape.between)}
        case Extrusion() as plate:
            _check_level(where, plate.kind, shift)
            change = {
                "outline": tuple(_item(item, shift) for item in plate.outline),
                "holes": tuple(_moved(hole, shift) for hole in plate.holes),
            }
        case Cad() | MeshFile() as file:
            change = _placing(file, shift)
    return link.model_copy(update={"shape": link.shape.model_copy(update=change)})


def _item(item: XYZ | Arc, shift: RigidDisplacement) -> XYZ | Arc:
    """A corner or an arc of an outline."""
    if isinstance(item, Arc):
        return item.model_copy(update={"via": shift.point(item.via), "to": shift.point(item.to)})
    return shift.point(item)


def _placing(shape: Cad | MeshFile, shift: RigidDisplacement) -> dict[str, Any]:
    """Displaced origin and axes of a file."""
    along = (1.0, 0.0, 0.0) if shape.towards is None else _three(np.subtract(shape.towards, shape.origin))
    flat = math.hypot(*along[:2]) / math.hypot(*along)
    z = shape.z or ((0.0, 0.0, 1.0) if flat > 1e-9 else (1.0, 0.0, 0.0))
    origin, turned = shift.point(shape.origin), shift.rotated(z)
    towards = _three(np.add(origin, shift.rotated(along)))
    return {"origin": origin, "towards": towards, "z": shape.z if turned == z else turned}


def _tilt(shift: RigidDisplacement, *ups: XYZ) -> float:
    """Largest rotation of directions [rad]."""
    return max(math.dist(shift.rotated(up), up) for up in ups)


def _up(where: str, line: Polyline, shift: RigidDisplacement) -> XYZ | None:
    """`up` of a polyline after a displacement; by default it is z, of steep segments x."""
    segments = list(pairwise(line.points))[: 1 if line.smooth else None]
    steep = {abs(Q[2] - P[2]) >= STEEP * math.dist(P, Q) for P, Q in segments}
    ups: list[XYZ] = [(1.0, 0.0, 0.0) if each else (0.0, 0.0, 1.0) for each in sorted(steep)]
    ups = ups if line.up is None else [line.up]
    if _tilt(shift, *ups) == 0.0:
        return line.up
    if len(ups) > 1:
        wanted = "is required where closing the joints rotates a line with steep parts"
        raise MotionError(f"{where}.up: {wanted}, got nothing")
    return shift.rotated(ups[0])


def _check_level(where: str, kind: str, shift: RigidDisplacement) -> None:
    """Refuse to tilt a shape parallel to the xy plane."""
    tilt = _tilt(shift, (0.0, 0.0, 1.0))
    if tilt > TILTED:
        wanted = "must be a polyline, a part from CAD or a mesh where closing the joints tilts it"
        raise MotionError(f"{where}: {wanted}, got a {kind} tilted by {math.degrees(tilt):.3g} deg")
