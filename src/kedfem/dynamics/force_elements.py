"""Motors, springs and limits of a scene: the law of each, and the coordinate that it acts along."""

from collections.abc import Iterator

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.joints.constraint_joints import coordinate
from kedfem.dynamics.system.record import DISTANCE, OVER, Curve, End, Law, Stop, Term
from kedfem.dynamics.system.record import Spring as SpringLaw
from kedfem.motion.joint_equations import ordered
from kedfem.scene import (
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

Element = Spring | Motor | Limit
Place = tuple[str, Float[np.ndarray, "3"]]


def force_elements(scene: Scene) -> Iterator[tuple[str, Element]]:
    """All motors, springs and limits by their names in the system: `motors.NAME`, `springs.NAME`, `limits.NAME`."""
    for kind in ("motors", "springs", "limits"):
        yield from ((f"{kind}.{name}", each) for name, each in getattr(scene, kind).items())


def places(scene: Scene, element: Element) -> tuple[Place, Place]:
    """The links that a force element acts on, and where, in the reference position [m]."""
    if isinstance(element, LineSpring) and element.between is not None:
        one, other = ((end.link, np.asarray(end.at)) for end in element.between)
    else:
        joint = scene.joints[str(element.joint)]
        one, other = ((link, np.asarray(joint.at)) for link in ordered(joint, getattr(element, "about", None)))
    return one, other


def term_of(scene: Scene, element: Element, one: End, other: End) -> Term:
    """Its coordinate between two ends, 0 and 1: an angle, a travel or a distance."""
    if isinstance(element, LineSpring) and element.between is not None:
        return Term(DISTANCE, 0, 1, one.origin, other.origin, np.zeros(3))
    about, along = getattr(element, "about", None), getattr(element, "along", None)
    return coordinate(scene.joints[str(element.joint)], turns=on_hinge(element), about=about, along=along)


def law_of(element: Element) -> Law:
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


def on_hinge(element: Element) -> bool:
    """Whether a spring, motor or limit acts on an angle of its joint, not on a travel or distance."""
    if isinstance(element, Motor):
        return element.torque is not None
    return isinstance(element, TorsionSpring | AngleLimit)
