"""Masses and springs attached to links, in frames of the animation."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.dynamics.history import Snapshot
from kedfem.dynamics.model import Model
from kedfem.links.record import Link
from kedfem.mesh.elements.shape_functions import HEX27
from kedfem.motion.linkage import Linkage
from kedfem.motion.rigid import RigidMotion
from kedfem.output.fields import LinkField, RigidField
from kedfem.output.joint_springs import hinge_springs, line_springs
from kedfem.output.springs import stretched
from kedfem.scene import GROUND, Body, Flywheel, Scene
from kedfem.vectors import cross

STEEL = 7850.0  # kg/m³
BALL = 0.01, 0.03  # least and largest radius of an attached mass, in sizes of the mechanism

Point = Float[np.ndarray, "3"]
Points = Float[np.ndarray, "n 3"]


@dataclass(frozen=True, slots=True)
class Carriers:
    """Links at one time point, which determine the positions of attached masses and springs.

    fields : fields of all links of the model, prescribed ones last
    X : (n, 3) points of each link in the reference position [m]
    deformation_scale : factor on the displacements in the fields [-]
    """

    model: Model
    snapshot: Snapshot
    fields: Sequence[LinkField]
    X: Sequence[Float[np.ndarray, "n 3"]]
    deformation_scale: float

    def place(self, name: str, at: Point) -> tuple[Point, Point] | None:
        """Position and displacement of a reference point, from its link's nearest point; None for unknown links."""
        found = self.pose(name, at)
        return None if found is None else found[:2]

    def pose(self, name: str, at: Point) -> tuple[Point, Point, Float[np.ndarray, "3 3"]] | None:
        """As :meth:`place`, and the link's rotation there from the reference position."""
        if name == GROUND:
            return at, np.zeros(3), np.eye(3)
        on = [i for i, link in enumerate(every_link(self.model)) if link.name == name]
        if not on:
            return None
        nearest = {i: np.linalg.norm(self.X[i] - at, axis=1) for i in on}
        i = min(on, key={i: x.min() for i, x in nearest.items()}.__getitem__)
        n, R = int(nearest[i].argmin()), self.turn(i)
        return self.fields[i].points[n] + R @ (at - self.X[i][n]), self.fields[i].displacement[n], R

    def turn(self, i: int) -> Float[np.ndarray, "3 3"]:
        """Rotation of a link's frame from the reference position."""
        motion, k, count = self.snapshot.motion, self.snapshot.k, len(self.model.links)
        if i >= count:
            return np.asarray(motion.R[k, self.model.prescribed[i - count].body])
        R, own = np.eye(3), self.snapshot.states[i].R
        R[: len(own), : len(own)] = own
        return R

    @property
    def outlines(self) -> dict[str, Float[np.ndarray, "n 3"]]:
        """Points of links in the reference position by name, planar beams with their height and thickness [m]."""
        out: dict[str, list[np.ndarray]] = {}
        for link, X, field in zip(every_link(self.model), self.X, self.fields, strict=True):
            height, thickness, _ = field.section or (0.0, 0.0, False)
            sides = np.concatenate([d * np.diag([height, height, thickness]) / 2 for d in (-1, 1)])
            corners = sides if field.section else np.zeros((1, 3))
            out.setdefault(link.name, []).append((X[:, None] + corners).reshape(-1, 3))
        return {name: np.concatenate(parts) for name, parts in out.items()}


def every_link(model: Model) -> list[Link]:
    """Links with unknowns, then links that the drive prescribes."""
    return [*model.links, *(x.link for x in model.prescribed)]


def balls(carriers: Carriers, bodies: Mapping[str, Body]) -> list[LinkField]:
    """Fields of the masses attached to links."""
    out = []
    size = _size([x.points for x in carriers.fields])
    for name, body in bodies.items():
        centre = np.asarray(getattr(body, "centre", body.at))
        found = carriers.place(body.link, centre)
        if found is None:
            continue
        points, moved = found[0] + ball(body.mass, size), np.tile(found[1], (27, 1))
        words, cell = ball_words(name, body), np.arange(27)[None]
        out.append(unstressed(name, "hexahedron27", cell, points, moved, label=words))
    return out


def unstressed(
    name: str, kind: str, cells: Int[np.ndarray, "e k"], points: Points, moved: Points, **more: Any
) -> LinkField:
    """A field of a shape without stresses."""
    none = np.full((len(points), 6), np.nan)
    return LinkField(name, kind, cells, points, moved, none, none[:, 0], none[:, :2], **more)


def springs(carriers: Carriers, scene: Scene) -> list[LinkField]:
    """Fields of springs and dampers between two points, along slides and about hinges."""
    if not scene.springs:
        return []
    out, size, outlines = [], _size(carriers.X), carriers.outlines
    for name, spring in line_springs(scene, outlines, size).items():
        found = [carriers.place(end.link, np.asarray(end.at)) for end in spring.ends]
        if None in found:
            continue
        (a, moved_a), (b, moved_b) = (each for each in found if each is not None)
        shape, cells = spring.shape
        points = stretched(shape, spring.line, np.array([a, b]))
        moved = moved_a + shape[:, 2:] * (moved_b - moved_a)
        out.append(unstressed(name, "quad", cells, points, moved, spring=True))
    for name, winding in hinge_springs(scene, outlines, size).items():
        pose = carriers.pose(winding.link, np.asarray(winding.at))
        if pose is None:
            continue
        place, moved, R = pose
        points, cells = winding.shape
        moved = np.tile(moved, (len(points), 1))
        out.append(unstressed(name, "quad", cells, place + points @ R.T, moved, spring=True))
    return out


def rigidly_moved(motion: RigidMotion, k: int, body: int, X: Points) -> tuple[Points, Points, Points]:
    """Positions, velocities and accelerations of points of a body at one time point."""
    arms = X @ motion.R[k, body].T
    velocity = motion.v[k, body] + cross(np.broadcast_to(motion.omega[k, body], arms.shape), arms)
    return motion.p[k, body] + arms, velocity, motion.p2[k, body] + X @ motion.R2[k, body].T


def rigid_springs(
    scene: Scene, linkage: Linkage, motion: RigidMotion, k: int, seen: Mapping[str, Float[np.ndarray, "n 3"]]
) -> list[RigidField]:
    """Fields of springs between rigid links at one time point.

    Parameters
    ----------
    seen : points of the drawn links in the reference position, by name [m]
    """
    if not scene.springs:
        return []
    out, size = [], _size(list(seen.values()))

    def moved(link: str, X: Points) -> tuple[Points, Points, Points]:
        return rigidly_moved(motion, k, linkage.bodies.index(link), X)

    for name, spring in line_springs(scene, seen, size).items():
        both = [moved(end.link, np.array([end.at])) for end in spring.ends]
        p, *rates = (np.concatenate(each) for each in zip(*both, strict=True))
        shape, cells = spring.shape
        points = stretched(shape, spring.line, p)
        velocity, acceleration = (x[0] + shape[:, 2:] * (x[1] - x[0]) for x in rates)
        out.append(RigidField(name, "quad", cells, points, velocity, acceleration, spring=True))
    for name, winding in hinge_springs(scene, seen, size).items():
        around, cells = winding.shape
        out.append(RigidField(name, "quad", cells, *moved(winding.link, winding.at + around), spring=True))
    return out


def _size(points: Sequence[Float[np.ndarray, "n 3"]]) -> float:
    return float(np.linalg.norm(np.ptp(np.concatenate(points), axis=0)))


def ball_words(name: str, body: Body) -> str:
    """Label of a mass; a flywheel may have inertia alone."""
    if isinstance(body, Flywheel) and not body.mass:
        return f"{name}, {body.inertia:.4g} kg m²"
    return f"{name}, {body.mass:.4g} kg"


def ball(mass: float, size: float) -> Float[np.ndarray, "27 3"]:
    """Nodes of a steel ball of a mass, with limits on its radius relative to the size of the mechanism."""
    radius = np.clip(np.cbrt(0.75 * mass / (np.pi * STEEL)), BALL[0] * size, BALL[1] * size)
    return np.asarray(radius * HEX27 / np.maximum(np.linalg.norm(HEX27, axis=1, keepdims=True), 1.0))
