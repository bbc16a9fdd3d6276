"""A second route to coordinates and forces of motors, springs and limits: by vectors of their ends.

A force element has two ends. An end is up to two vectors of a link, linear in its state: a point, or directions across a
hinge. Its coordinate q depends on these vectors alone, and its force Q acts on them as Q ∂q/∂x.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.force_elements import law_of, on_hinge
from kedfem.dynamics.history import LinkHistory
from kedfem.dynamics.joints.places import on_part, surface_of
from kedfem.dynamics.model import Model
from kedfem.dynamics.system.record import Law, Times
from kedfem.links.point_rows import point_rows, require_on_axis
from kedfem.links.record import Link
from kedfem.links.surfaces.coupling_surfaces import CouplingSurface, determines_gradient, face_normal, port_weights
from kedfem.motion.constraints import perpendiculars
from kedfem.motion.joint_equations import joint_axis, ordered
from kedfem.motion.rigid import RigidMotion
from kedfem.scene import GROUND, Limit, LineSpring, Motor, Scene, Spring
from kedfem.vectors import cross

TURN, SLIDE, DISTANCE = 0, 1, 2
POINT, PAIR, SINGLE, ANGLE = 0, 1, 2, 3
IN_SPACE = (1.0, 1.0, 1.0)

Vector = Float[np.ndarray, "3"]


@dataclass(frozen=True, slots=True)
class End:
    """One end of a force element: vectors x_i = rigid_i + mask * Σ_a w_ia u_a, u the link's state in world components.

    k : number of the link in the model; -1: nothing but the rigid-body motion moves it (the ground, what the drive
    carries)
    body : whose rigid-body motion it has, by number in the linkage
    form : POINT: one point; PAIR: two directions across a hinge, e1 × e2 its axis; SINGLE: one direction across, and the
        axis; ANGLE: (0, 0, ψ) of a planar beam
    weights : (m, n) on the rows of the state; (m, 0) for k = -1
    X : (m, 3) the vectors in the reference position [m; -]
    mask : (3,) which components of the state's rows the vectors are made of; forces on them likewise
    offset : (3,) from the point of the link, to which X belongs, to the end itself; does not turn [m]
    link : name of the link in the scene, where that is not the model's: a slider, what the drive prescribes
    """

    k: int
    body: int
    form: int
    weights: Float[np.ndarray, "m n"]
    X: Float[np.ndarray, "m 3"]
    mask: tuple[float, float, float] = IN_SPACE
    offset: Vector = field(default_factory=lambda: np.zeros(3))
    link: str = ""


@dataclass(frozen=True, slots=True)
class ForceElement:
    """A force law on one coordinate: the turn of a hinge, the travel of a slide, the distance of two points.

    name : ``motors/NAME``, ``springs/NAME``, ``limits/NAME`` or ``joints/NAME``
    kind : TURN, SLIDE, DISTANCE
    ends : the coordinate is that of the first against the second
    law : of its force; none of a hinge whose turn alone is examined
    axis : of a hinge or slide, in the reference position
    """

    name: str
    kind: int
    ends: tuple[End, End]
    law: Law | None = None
    axis: Vector = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))


Vectors = Float[np.ndarray, "T 2 2 3"]
"""Two vectors of each of two ends over time; the second is zero where there is none."""


def placed(element: ForceElement, motion: RigidMotion, links: Sequence[LinkHistory] = ()) -> tuple[Vectors, Vectors]:
    """Vectors of both ends and their rates.

    Parameters
    ----------
    links : histories of a model's links; without them none deforms or leaves the rigid-body motion
    """
    x, v = np.zeros((2, len(motion.t), 2, 2, 3))
    for e, end in enumerate(element.ends):
        R, omega, m = motion.R[:, end.body], motion.omega[:, end.body], len(end.X)
        if end.form == ANGLE:
            x[:, e, 0, 2], v[:, e, 0, 2] = np.arctan2(R[:, 1, 0], R[:, 0, 0]), omega[:, 2]
        else:
            x[:, e, :m] = end.X @ R.transpose(0, 2, 1)
            v[:, e, :m] = cross(omega[:, None], x[:, e, :m])
        if end.form == POINT:
            x[:, e, 0] += motion.p[:, end.body] + end.offset
            v[:, e, 0] += motion.v[:, end.body]
        if end.k >= 0 and links:
            for of, u in ((x, links[end.k].u), (v, links[end.k].v)):
                d = u.shape[2]
                of[:, e, :m, :d] += (end.weights @ u) * end.mask[:d]
    return x, v


def coordinate(element: ForceElement, x: Vectors, before: float = 0.0) -> Times:
    """The turn, travel or distance q of the first end against the second, whatever their links do.

    A turn is the mean over two pairs of directions a, b of the ends, drawn across the axis n and seen along it, of
    atan2(n · (b × a), a · b − (n · a)(n · b)), less that in the reference position, counted on beyond ±π. n moves with
    the first end that shows it.

    Parameters
    ----------
    before : a turn before the first time, near which it is
    """
    if element.kind != TURN:
        gap = x[:, 0, 0] - x[:, 1, 0]
        return np.asarray((_axis(element, x) * gap).sum(axis=1) if element.kind == SLIDE else np.linalg.norm(gap, axis=1))
    drawn = np.zeros((1, 2, 2, 3))
    for e, end in enumerate(element.ends):
        drawn[0, e, : len(end.X)] = end.X
    turned = np.full((1 + len(x), 2), before)
    turned[1:] = _angles(element, x) - _angles(element, drawn)
    return np.asarray(np.unwrap(turned, axis=0)[1:].mean(axis=1))


def _angles(element: ForceElement, x: Vectors) -> Float[np.ndarray, "T 2"]:
    n, out = _axis(element, x), []
    for k in range(2):
        a, b = (_direction(element, end.form, x[:, e], k) for e, end in enumerate(element.ends))
        across = (a * b).sum(axis=1) - (n * a).sum(axis=1) * (n * b).sum(axis=1)
        out.append(np.arctan2((n * cross(b, a)).sum(axis=1), across))
    return np.stack(out, axis=1)


def _axis(element: ForceElement, x: Vectors) -> Float[np.ndarray, "T 3"]:
    """The axis of a hinge as its first end shows it that does; of a slide as the second end, if that turns it."""
    if element.kind == SLIDE and x[0, 1, 1].any():
        return x[:, 1, 1]
    for e, end in enumerate(element.ends) if element.kind == TURN else ():
        if end.form in (PAIR, SINGLE):
            n = cross(x[:, e, 0], x[:, e, 1]) if end.form == PAIR else x[:, e, 1]
            return np.asarray(n / np.linalg.norm(n, axis=1)[:, None])
    return np.tile(element.axis, (len(x), 1))


def _direction(element: ForceElement, form: int, x: Float[np.ndarray, "T 2 3"], k: int) -> np.ndarray:
    """The k-th direction of an end across the axis of its hinge: of a planar beam one that ψ turns."""
    if form != ANGLE:
        return x[:, k if form == PAIR else 0]
    e, angle = perpendiculars(element.axis)[k], x[:, 0, 2, None] * element.axis[2]
    return np.asarray(np.cos(angle) * e + np.sin(angle) * cross(element.axis, e))


def wrench(
    end: End, x: Float[np.ndarray, "T 2 3"], f: Float[np.ndarray, "T 2 3"]
) -> tuple[Float[np.ndarray, "T 3"], Float[np.ndarray, "T 3"]]:
    """Force and moment about the world's origin of the forces on an end's vectors."""
    if end.form == POINT:
        return f[:, 0], cross(x[:, 0], f[:, 0])
    moment = f[:, 0] if end.form == ANGLE else cross(x, f).sum(axis=1)
    return np.zeros_like(moment), np.asarray(moment)


def force_elements(scene: Scene, model: Model) -> tuple[ForceElement, ...]:
    """All motors, springs and limits of a scene."""
    return _all(_on_model(scene, model))


def _all(find: "_Ends") -> tuple[ForceElement, ...]:
    every = (("motors", find.scene.motors), ("springs", find.scene.springs), ("limits", find.scene.limits))
    return tuple(_element(find, kind, name, each) for kind, of in every for name, each in of.items())


def _on_model(scene: Scene, model: Model) -> "_Ends":
    fixed = {x.link.name: x.body for x in model.prescribed} | {GROUND: 0}
    return _Ends(scene, fixed, model.links, model.bodies)


@dataclass(frozen=True, slots=True)
class _Ends:
    """Where ends are.

    fixed : links that only move as given, with the bodies that they move with
    links, numbers : of a model
    """

    scene: Scene
    fixed: Mapping[str, int]
    links: Sequence[Link] = ()
    numbers: Sequence[int] = ()

    def point(self, where: str, name: str, at: Vector) -> End:
        """A point of a link or the ground."""
        if name in self.fixed:
            return End(-1, self.fixed[name], POINT, np.zeros((1, 0)), at[None], link=name)
        k, rows = on_part(dict(enumerate(self.links)), name, at, lambda link: point_rows(link, where, at))
        require_on_axis(self.links[k], where, at, rows.X)
        return self._end(k, POINT, rows.value[None], rows.X[None])

    def across(self, joint: str, name: str) -> End:
        """Directions of a link across the axis of a hinge."""
        axis = joint_axis(self.scene.joints[joint])
        both = np.array(perpendiculars(axis))
        if name in self.fixed:
            return End(-1, self.fixed[name], PAIR, np.zeros((2, 0)), both, link=name)
        k, surface = self.surface(joint, name)
        if self.links[k].kind == "beam":
            return replace(self._end(k, ANGLE, surface.fit[:1], np.zeros((1, 3))), mask=(0.0, 0.0, 1.0))
        if all(determines_gradient(surface, e) for e in both):
            return self._end(k, PAIR, both @ surface.fit[1:], both)
        known = np.array([_in_face(f"joints.{joint}", self.links[k], surface, axis), axis])
        return self._end(k, SINGLE, known @ surface.fit[1:], known)

    def port(self, joint: str, name: str, at: Vector) -> End:
        """The middle of a joint on a link: the affine fit of its coupling surface, as where joints hold it."""
        if name in self.fixed:
            return self.point(f"joints.{joint}", name, at)
        k, surface = self.surface(joint, name)
        return self._end(k, POINT, port_weights(surface, at[None]), at[None])

    def surface(self, joint: str, name: str) -> tuple[int, CouplingSurface]:
        """The number of the link, or segment, on which a joint is, and its coupling surface there."""
        at = np.asarray(self.scene.joints[joint].at)
        return on_part(dict(enumerate(self.links)), name, at, lambda link: surface_of(self.scene, joint, link))

    def _end(
        self, k: int, form: int, weights: Float[np.ndarray, "m n"], X: Float[np.ndarray, "m 3"],
        offset: Vector | None = None, link: str = "",
    ) -> End:  # fmt: skip
        """An end on link k; of a planar one without what its rows have beside displacements."""
        mask = (1.0, 1.0, 0.0) if self.links[k].planar else IN_SPACE
        return End(k, self.numbers[k], form, weights, X, mask, np.zeros(3) if offset is None else offset, link)


def _in_face(where: str, link: Link, surface: CouplingSurface, axis: Vector) -> Vector:
    """The direction within a flat coupling surface across an axis."""
    t = np.cross(face_normal(surface), axis)
    assert determines_gradient(surface, t)
    return np.asarray(t / np.linalg.norm(t))


def _hinge(find: _Ends, name: str, joint: str) -> ForceElement:
    """A force element on the turn of a hinge, without a force yet."""
    one, other = ordered(find.scene.joints[joint])
    ends = (find.across(joint, one), find.across(joint, other))
    return ForceElement(name, TURN, ends, axis=joint_axis(find.scene.joints[joint]))


def _slide(find: _Ends, name: str, joint: str) -> ForceElement:
    """A force element on the travel of a slide, without a force yet: the port of its link against the other."""
    at = np.asarray(find.scene.joints[joint].at)
    one, other = ordered(find.scene.joints[joint])
    axis, end = joint_axis(find.scene.joints[joint]), find.point(f"joints.{joint}", other, at)
    if end.k < 0 and other != GROUND:  # it turns with what it is on
        end = replace(end, X=np.array([at, axis]), weights=np.zeros((2, 0)))
    return ForceElement(name, SLIDE, (find.port(joint, one, at), end), axis=axis)


def _element(find: _Ends, kind: str, name: str, element: Spring | Motor | Limit) -> ForceElement:
    if isinstance(element, LineSpring) and element.between is not None:
        one, other = (
            find.point(f"{kind}.{name}.between[{i}].at", end.link, np.asarray(end.at))
            for i, end in enumerate(element.between)
        )
        return ForceElement(f"{kind}/{name}", DISTANCE, (one, other), law_of(element))
    made = (_hinge if on_hinge(element) else _slide)(find, f"{kind}/{name}", str(element.joint))
    return replace(made, law=law_of(element))
