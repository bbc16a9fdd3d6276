"""What links bear, in frames of the animation: masses that they carry as balls, springs between points of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.history import Snapshot
from kedfem.dynamics.model import Model, Slider
from kedfem.links.record import Link, in_space
from kedfem.mesh.elements.shape_functions import HEX27
from kedfem.motion.constraints import cross
from kedfem.motion.linkage import Linkage
from kedfem.motion.rigid import RigidMotion
from kedfem.output.fields import LinkField, RigidField
from kedfem.output.springs import drawn_springs, spring_shape, stretched
from kedfem.scene import GROUND, Body, Flywheel, Spring, SpringEnd

STEEL = 7850.0  # kg/m³
BALL = 0.01, 0.03  # least and largest radius of a mass that a link carries, of what is drawn

Point = Float[np.ndarray, "3"]


@dataclass(frozen=True, slots=True)
class Carriers:
    """Links at one time point, to find where they take what they carry.

    fields : of all links of the model, prescribed ones last
    X : (n, 3) the points of each in the reference position [m]
    deformation_scale : by which the fields exaggerate displacements [-]
    """

    model: Model
    snapshot: Snapshot
    fields: Sequence[LinkField]
    X: Sequence[Float[np.ndarray, "n 3"]]
    deformation_scale: float

    def place(self, name: str, at: Point) -> tuple[Point, Point] | None:
        """Where the nearest point of a link takes a drawn point, and its displacement; None of no link that is drawn."""
        if name == GROUND:
            return at, np.zeros(3)
        for slider in self.model.sliders:
            if slider.name == name:
                there, moved = slider_place(self.model, slider, self.snapshot, self.deformation_scale)
                return there + at - slider_drawn(self.model, slider), moved
        motion, k = self.snapshot.motion, self.snapshot.k
        numbers = [*self.model.bodies, *(x.body for x in self.model.prescribed)]
        on = [i for i, link in enumerate(every_link(self.model)) if link.name == name]
        if not on:
            return None
        nearest = {i: np.linalg.norm(self.X[i] - at, axis=1) for i in on}
        i = min(on, key={i: x.min() for i, x in nearest.items()}.__getitem__)
        n = int(nearest[i].argmin())
        place = self.fields[i].points[n] + motion.R[k, numbers[i]] @ (at - self.X[i][n])
        return place, self.fields[i].displacement[n]


def every_link(model: Model) -> list[Link]:
    """Those with unknowns, then those that the drive moves."""
    return [*model.links, *(x.link for x in model.prescribed)]


def slider_drawn(model: Model, slider: Slider) -> Point:
    """Where a slider without a shape is joined to its link, in the reference position [m]."""
    return np.asarray(slider.weights @ model.links[slider.carrier].X)


def slider_place(
    model: Model, slider: Slider, snapshot: Snapshot, deformation_scale: float
) -> tuple[Point, Point]:
    """Where it is at one time point, and its elastic displacement."""
    link, body = model.links[slider.carrier], model.bodies[slider.carrier]
    motion, k = snapshot.motion, snapshot.k
    moved = slider.weights @ in_space(link, snapshot.states[slider.carrier].u)
    rigid = motion.p[k, body] + motion.R[k, body] @ slider_drawn(model, slider)
    return rigid + deformation_scale * moved, moved


def balls(carriers: Carriers, bodies: Mapping[str, Body]) -> list[LinkField]:
    """Masses that links carry; those on a slider without a shape are drawn as that."""
    out, sliders = [], {slider.name for slider in carriers.model.sliders}
    size = _size([x.points for x in carriers.fields])
    for name, body in bodies.items():
        centre = np.asarray(getattr(body, "centre", body.at))
        found = None if body.link in sliders else carriers.place(body.link, centre)
        if found is None:
            continue
        points, none = found[0] + ball(body.mass, size), np.full((27, 6), np.nan)
        moved, cell = np.tile(found[1], (27, 1)), np.arange(27)[None]
        empty = none, none[:, 0], none[:, :2]
        out.append(LinkField(name, "hexahedron27", cell, points, moved, *empty, label=ball_words(name, body)))
    return out


def springs(carriers: Carriers, every: Mapping[str, Spring]) -> list[LinkField]:
    """Springs and dampers between two points."""
    out, size = [], _size(carriers.X)
    for name, spring in drawn_springs(every).items():
        ends = spring.between or ()
        found = [carriers.place(end.link, np.asarray(end.at)) for end in ends]
        if None in found:
            continue
        (a, moved_a), (b, moved_b) = (each for each in found if each is not None)
        shape, cells = spring_shape(spring, size)
        points = stretched(shape, _drawn(ends), np.array([a, b]))
        moved = moved_a + shape[:, 2:] * (moved_b - moved_a)
        none = np.full((len(points), 6), np.nan)
        empty = none, none[:, 0], none[:, :2]
        out.append(LinkField(name, "quad", cells, points, moved, *empty, spring=True))
    return out


def rigid_springs(
    every: Mapping[str, Spring], linkage: Linkage, motion: RigidMotion, k: int, size: float
) -> list[RigidField]:
    """Springs between two points of rigid links at one time point."""
    out = []
    for name, spring in drawn_springs(every).items():
        ends = spring.between or ()
        p, v, a = np.zeros((3, 2, 3))
        for n, end in enumerate(ends):
            if end.link == GROUND:
                p[n] = end.at
                continue
            b, X = linkage.bodies.index(end.link), np.asarray(end.at)
            arm = motion.R[k, b] @ X
            p[n] = motion.p[k, b] + arm
            v[n] = motion.v[k, b] + cross(motion.omega[k, b], arm)
            a[n] = motion.p2[k, b] + motion.R2[k, b] @ X
        shape, cells = spring_shape(spring, size)
        points = stretched(shape, _drawn(ends), p)
        velocity, acceleration = (x[0] + shape[:, 2:] * (x[1] - x[0]) for x in (v, a))
        out.append(RigidField(name, "quad", cells, points, velocity, acceleration, spring=True))
    return out


def _drawn(ends: Sequence[SpringEnd]) -> Point:
    """From one end to the other in the reference position [m]."""
    return np.subtract(ends[1].at, ends[0].at)


def _size(points: Sequence[Float[np.ndarray, "n 3"]]) -> float:
    return float(np.linalg.norm(np.ptp(np.concatenate(points), axis=0)))


def ball_words(name: str, body: Body) -> str:
    """What stands beside a mass; a flywheel may have inertia alone."""
    if isinstance(body, Flywheel) and not body.mass:
        return f"{name}, {body.inertia:.4g} kg m²"
    return f"{name}, {body.mass:.4g} kg"


def ball(mass: float, size: float) -> Float[np.ndarray, "27 3"]:
    """Nodes of a ball as large as one of steel, unless that is too small or too large beside what is drawn."""
    radius = np.clip(np.cbrt(0.75 * mass / (np.pi * STEEL)), BALL[0] * size, BALL[1] * size)
    return np.asarray(radius * HEX27 / np.maximum(np.linalg.norm(HEX27, axis=1, keepdims=True), 1.0))
