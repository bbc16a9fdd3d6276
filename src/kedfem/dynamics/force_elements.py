"""Motors, springs and limits of a scene as force elements on a model, and hinges whose turn is examined."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.force_element import (
    ANGLE,
    DISTANCE,
    IN_SPACE,
    PAIR,
    POINT,
    SINGLE,
    SLIDE,
    TURN,
    End,
    ForceElement,
    Vector,
)
from kedfem.dynamics.joints.constraint_joints import ordered
from kedfem.dynamics.joints.places import slider_axis, surface_of
from kedfem.dynamics.model import Model, Slider, on_segment
from kedfem.dynamics.system.record import OVER, Curve, Law, Stop
from kedfem.dynamics.system.record import Spring as SpringLaw
from kedfem.errors import MeshError
from kedfem.links.point_rows import point_rows, require_on_axis
from kedfem.links.record import Link
from kedfem.links.surfaces.coupling_surfaces import CouplingSurface, face_normal, holds, port_weights
from kedfem.motion.constraints import perpendiculars
from kedfem.motion.joint_equations import joint_axis
from kedfem.scene import (
    GROUND,
    AngleLimit,
    Limit,
    LineSpring,
    Motor,
    Scene,
    Spring,
    TorsionSpring,
    TravelLimit,
    factor_law,
    is_constant,
    pieces,
)


def force_elements(scene: Scene, model: Model) -> tuple[ForceElement, ...]:
    """All motors, springs and limits of a scene.

    Raises
    ------
    MeshError, SceneError
        If a point or joint is not on its link.
    """
    return _all(_on_model(scene, model))


def rigid_elements(scene: Scene, bodies: Sequence[str]) -> tuple[ForceElement, ...]:
    """The same on links that do not deform, moving as given.

    Parameters
    ----------
    bodies : their names by number in the linkage
    """
    return _all(_Ends(scene, {name: k for k, name in enumerate(bodies)}))


def _all(find: "_Ends") -> tuple[ForceElement, ...]:
    every = (("motors", find.scene.motors), ("springs", find.scene.springs), ("limits", find.scene.limits))
    return tuple(_element(find, kind, name, each) for kind, of in every for name, each in of.items())


def law_of(element: Spring | Motor | Limit) -> Law:
    """The law of a spring, motor or limit of a scene."""
    match element:
        case TorsionSpring() | LineSpring():
            given, factor = element.curve, element.stiffness_factor
            curve = None if given is None else Curve(OVER[given.over], pieces(given).negative)
            if is_constant(factor):
                return SpringLaw(factor.value[0] * element.stiffness, element.damping, element.free, curve=curve)
            return SpringLaw(element.stiffness, element.damping, element.free, factor=factor_law(factor), curve=curve)
        case AngleLimit() | TravelLimit():
            return Stop(*element.range, element.stiffness, element.damping)
        case _:
            return Curve(OVER[element.curve.over], pieces(element.curve))


def on_hinge(element: Spring | Motor | Limit) -> bool:
    """Whether a spring, motor or limit acts on the turn of its joint, not on a travel or distance."""
    if isinstance(element, Motor):
        return element.torque is not None
    return isinstance(element, TorsionSpring | AngleLimit)


def hinges(scene: Scene, model: Model) -> tuple[ForceElement, ...]:
    """A force element without a force for each revolute joint: its turn is examined."""
    find = _on_model(scene, model)
    names = [name for name, joint in scene.joints.items() if joint.kind == "revolute"]
    return tuple(_hinge(find, f"joints/{name}", name) for name in names)


def _on_model(scene: Scene, model: Model) -> "_Ends":
    fixed = {x.link.name: x.body for x in model.prescribed} | {GROUND: 0}
    fixed |= {name: 0 for name in scene.links if slider_axis(scene, name) is not None}
    return _Ends(scene, fixed, model.links, model.bodies, model.sliders)


@dataclass(frozen=True, slots=True)
class _Ends:
    """Where ends are.

    fixed : links that only move as given, with the bodies that they move with
    links, numbers, sliders : of a model
    """

    scene: Scene
    fixed: Mapping[str, int]
    links: Sequence[Link] = ()
    numbers: Sequence[int] = ()
    sliders: Sequence[Slider] = ()

    def point(self, where: str, name: str, at: Vector) -> End:
        """A point of a link, the ground or a slider, which rides on its carrier and never turns."""
        for slider in self.sliders:
            if slider.name == name:
                port = np.asarray(self.scene.joints[slider.joint].at)
                return self._end(slider.carrier, POINT, slider.weights[None], port[None], at - port, name)
        if name in self.fixed:
            return End(-1, self.fixed[name], POINT, np.zeros((1, 0)), at[None], link=name)
        k, rows = on_segment(self.links, name, at, lambda link: point_rows(link, where, at))
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
        if all(holds(surface, e) for e in both):
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
        return on_segment(self.links, name, at, lambda link: surface_of(self.scene, joint, link))

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
    if np.linalg.norm(t) < 1e-6 or not holds(surface, t):
        raise MeshError(f"{where}: must sit on a bore of link '{link.name}' to be turned, got a face across its axis")
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
