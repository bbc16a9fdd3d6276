"""Motors, springs and limits of a scene as force elements on a model, and hinges whose turn is examined."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.force_element import (
    ANGLE,
    DISTANCE,
    IN_SPACE,
    OVER,
    PAIR,
    POINT,
    SINGLE,
    SLIDE,
    TURN,
    End,
    ForceElement,
    Vector,
)
from kedfem.dynamics.joints.places import slider_axis, surface_of
from kedfem.dynamics.model import Model, Slider, on_segment
from kedfem.errors import MeshError
from kedfem.links.point_rows import point_rows, require_on_axis
from kedfem.links.record import Link
from kedfem.links.surfaces.coupling_surfaces import CouplingSurface, face_normal, holds, port_weights
from kedfem.motion.constraints import perpendiculars
from kedfem.motion.joint_equations import joint_axis
from kedfem.scene import GROUND, Limit, LineSpring, Motor, Scene, Spring, TravelLimit, factor_law, pieces


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
    motors = [_motor(find, name, motor) for name, motor in find.scene.motors.items()]
    springs = [_spring(find, name, spring) for name, spring in find.scene.springs.items()]
    limits = [_limit(find, name, limit) for name, limit in find.scene.limits.items()]
    return (*motors, *springs, *limits)


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
        return End(
            k, self.numbers[k], form, weights, X, mask, np.zeros(3) if offset is None else offset, link
        )


def _in_face(where: str, link: Link, surface: CouplingSurface, axis: Vector) -> Vector:
    """The direction within a flat coupling surface across an axis."""
    t = np.cross(face_normal(surface), axis)
    if np.linalg.norm(t) < 1e-6 or not holds(surface, t):
        raise MeshError(
            f"{where}: must sit on a bore of link '{link.name}' to be turned, got a face across its axis"
        )
    return np.asarray(t / np.linalg.norm(t))


def _ordered(links: tuple[str, str]) -> tuple[str, str]:
    """The links of a joint: the first that is not the ground, and the other."""
    return (links[1], links[0]) if links[0] == GROUND else links


def _hinge(find: _Ends, name: str, joint: str) -> ForceElement:
    """A force element on the turn of a hinge, without a force yet."""
    one, other = _ordered(find.scene.joints[joint].links)
    ends = (find.across(joint, one), find.across(joint, other))
    return ForceElement(name, TURN, ends, axis=joint_axis(find.scene.joints[joint]))


def _slide(find: _Ends, name: str, joint: str) -> ForceElement:
    """A force element on the travel of a slide, without a force yet: the port of its link against the other."""
    at = np.asarray(find.scene.joints[joint].at)
    one, other = _ordered(find.scene.joints[joint].links)
    axis, end = joint_axis(find.scene.joints[joint]), find.point(f"joints.{joint}", other, at)
    if end.k < 0 and other != GROUND:  # it turns with what it is on
        end = replace(end, X=np.array([at, axis]), weights=np.zeros((2, 0)))
    return ForceElement(name, SLIDE, (find.port(joint, one, at), end), axis=axis)


def _motor(find: _Ends, name: str, motor: Motor) -> ForceElement:
    curve = motor.curve
    made = (_hinge if motor.torque is not None else _slide)(find, f"motors/{name}", motor.joint)
    return replace(made, over=OVER[curve.over], curve=pieces(curve))


def _spring(find: _Ends, name: str, spring: Spring) -> ForceElement:
    factor = factor_law(spring.stiffness_factor)
    law: dict[str, Any] = {
        "stiffness": spring.stiffness, "damping": spring.damping, "free": spring.free, "factor": factor,
    }  # fmt: skip
    if spring.curve is not None:
        law |= {"over": OVER[spring.curve.over], "curve": pieces(spring.curve).negative}
    if not isinstance(spring, LineSpring) or spring.between is None:
        made = _slide if isinstance(spring, LineSpring) else _hinge
        return replace(made(find, f"springs/{name}", str(spring.joint)), **law)
    one, other = (
        find.point(f"springs.{name}.between[{i}].at", end.link, np.asarray(end.at))
        for i, end in enumerate(spring.between)
    )
    return ForceElement(f"springs/{name}", DISTANCE, (one, other), **law)


def _limit(find: _Ends, name: str, limit: Limit) -> ForceElement:
    made = (_slide if isinstance(limit, TravelLimit) else _hinge)(find, f"limits/{name}", limit.joint)
    return replace(made, stiffness=limit.stiffness, damping=limit.damping, limits=limit.range)
