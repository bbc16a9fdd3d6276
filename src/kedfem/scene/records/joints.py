"""Records of joints, of their bushings, and of the faces to which they are attached."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from kedfem.errors import Fault
from kedfem.scene.records.base import EndName, Record, refuse
from kedfem.scene.records.points import XYZ, Apart, Axis, JointPoint, Point, apart
from kedfem.scene.records.units import Damper, PositiveLength, Quantity, RotationalDamper, fault
from kedfem.scene.records.units import PositiveRotationalStiffness as RotationalSpring
from kedfem.scene.records.units import PositiveStiffness as Rate
from kedfem.scene.records.wording import one_of, shown, unknown_name

FORMS = ("plane", "cylinder", "sphere")


class ChosenFace(Record):
    """Choice of a face by its form and place."""

    only_with = (("axis", "cylinder"),)
    plane: Axis | None = None
    """of a plane face: a direction square to it, of either sign"""
    cylinder: PositiveLength | None = None
    """of a bore or journal, or a part of one: its diameter"""
    sphere: PositiveLength | None = None
    """of a ball or ball seat: its diameter"""
    axis: Axis | None = None
    """of a cylinder: the direction of its axis; any if not given"""
    near: Point | None = None
    """a point of the scene: the nearest of several such faces is meant, which the next must be clearly farther from
    than; if not given, the link must have only one"""

    @model_validator(mode="after")
    def _of_one_form(self) -> Self:
        given = [form for form in FORMS if getattr(self, form) is not None]
        if len(given) != 1:
            got = " and ".join(given) or "none of them"
            refuse([Fault((), f"must say what the face is by one of {', '.join(FORMS)}, got {got}")])
        return self

    @property
    def form(self) -> str:
        """``plane``, ``cylinder`` or ``sphere``."""
        return next(form for form in FORMS if getattr(self, form) is not None)

    @property
    def label(self) -> str:
        """The choice as it is written in a scene: ``{ cylinder = "8 mm", axis = [0, 0, 1], near = [0.1, 0, 0] }``."""
        parts = []
        for key in (*FORMS, "axis", "near"):
            value = getattr(self, key)
            if isinstance(value, float):
                parts.append(f'{key} = "{1e3 * value:.5g} mm"')
            elif value is not None:
                parts.append(f"{key} = [{', '.join(f'{x + 0.0:.7g}' for x in value)}]")
        return "{ " + ", ".join(parts) + " }"


FaceName = str | ChosenFace


def face_choice(value: object) -> Any:
    """The name of a face, or a table that describes it."""
    if isinstance(value, Mapping):
        return ChosenFace.model_validate(value)
    if isinstance(value, ChosenFace) or (isinstance(value, str) and value):
        return value
    raise no_face(value)


def no_face(value: object) -> Exception:
    """The fault of a value that is no face."""
    wanted = "must be a face's name, a table that says what it is, or a list of these"
    return fault(f"{wanted}, got {shown(value)}")


def several(value: object) -> object:
    """One or more names or choices of faces, as a list that is not empty."""
    listed = [value] if isinstance(value, (str, Mapping, ChosenFace)) else value
    if not isinstance(listed, (list, tuple)) or not listed:
        raise no_face(value)
    return tuple(listed)


Faces = Annotated[tuple[Annotated[FaceName, BeforeValidator(face_choice)], ...], BeforeValidator(several)]


JointKind = Literal["revolute", "spherical", "weld", "prismatic", "cylindrical", "screw", "universal", "planar", "slot"]
DIRECTED = ("prismatic", "cylindrical", "screw", "planar", "slot")  # points may separate along or across an axis
ROTARY = ("revolute", "cylindrical", "screw")  # joints that rotate about their axis
SQUARE = 1e-6  # largest cosine of axes of a cross that count as perpendicular
COUPLINGS = ("distributing", "rigid")
Coupling = Literal["distributing", "rigid"]


def three(value: object) -> Any:
    """One number for all directions, or three."""
    if isinstance(value, (list, tuple)) and len(value) != 3:
        raise fault(f"must be one number or three, along x, y, z of the joint, got {shown(value)}")
    return value if value is None or isinstance(value, (list, tuple)) else (value, value, value)


Rates = Annotated[tuple[Rate, Rate, Rate], BeforeValidator(three)]
Dampers = Annotated[tuple[Damper, Damper, Damper], BeforeValidator(three)]
RotationalSprings = Annotated[tuple[RotationalSpring, RotationalSpring, RotationalSpring], BeforeValidator(three)]
RotationalDampers = Annotated[tuple[RotationalDamper, RotationalDamper, RotationalDamper], BeforeValidator(three)]


class Bushing(Record):
    """Springs and dampers in place of the constraints of a joint; motions released by the joint stay free.

    One number for all directions, or three along the axes x, y, z of the joint. z is its `axis`; x is at right angles to
    z and to that world axis which is farthest from it in the reference position (of equals the first), y at right angles
    to both. Without an `axis` they are the world's in the reference position. They are fixed in the joint's second link,
    or the ground if that is one."""

    at_least_one = ("stiffness", "rotational_stiffness"), " [N/m], or rotational_stiffness [N m/rad]"
    only_with = ("damping", "stiffness"), ("rotational_damping", "rotational_stiffness")
    stiffness: Rates | None = None
    """against displacements; rigid if not given"""
    damping: Dampers = (0.0, 0.0, 0.0)
    """of displacements"""
    rotational_stiffness: RotationalSprings | None = None
    """against rotations; rigid if not given. A universal joint constrains one rotation, about the normal of its cross:
    the third. About the axis of a hinge nothing resists but a torsion spring of that joint"""
    rotational_damping: RotationalDampers = (0.0, 0.0, 0.0)
    """of rotations"""


def of_links(value: object, what: Callable[[object], Any]) -> dict[str, Any]:
    """A table with an entry for each of several links."""
    if not isinstance(value, Mapping) or not all(isinstance(name, str) for name in value):
        raise fault(f"must be a table by names of links, got {shown(value)}")
    return {name: what(each) for name, each in value.items()}


def couplings(value: object) -> object:
    """Kind of coupling of a joint to its surfaces: one word, or one for each link."""
    if isinstance(value, Mapping):
        return of_links(value, couplings)
    if value not in COUPLINGS:
        raise fault(one_of(list(COUPLINGS), value))
    return value


def by_link(value: object) -> object:
    """A table by names of links."""
    return of_links(value, lambda each: each)


class Joint(Record):
    """A joint between two links, or a link and the ground."""

    kind: JointKind
    """revolute: hinge; spherical: ball; weld: rigid connection; prismatic: slides along its axis without rotation;
    cylindrical: slides along its axis and rotates about it; screw: the same, one tied to the other; universal: cross of
    two axes; planar: slides in a plane and rotates about its normal; slot: a pin of the first link slides along a line
    of the second"""
    links: tuple[EndName, EndName]
    """the two links that it joins; `"ground"` for the frame; of a slot first the link with the pin"""
    at: JointPoint
    """its centre; where the two links are given a little apart that on each of them, by link (`ground` too):
    `{ crank = [0.1, 0], rod = "P" }`. The links are then moved as little as can be so that all joints close"""
    axis: Axis | None = None
    """`"x"`, `"y"`, `"z"`, a vector or `{ from = point, to = point }`: a hinge's axis (`"z"` if not given), the direction
    of what slides, the normal of a planar joint (required for those); for a ball or a weld the axis of the bore that
    it acts on"""
    axes: tuple[Axis, Axis] | None = None
    """of a universal joint: the axis in the first link and that in the second, at right angles"""
    lead: Annotated[float, Quantity("m")] | None = None
    """of a screw: travel in one revolution, positive if right-handed"""
    coupling: Annotated[Coupling | dict[str, Coupling], BeforeValidator(couplings)] = "distributing"
    """how it constrains bores and faces of solids and plane links: their mean displacement and rotation, or all their
    points, so that they keep their shape, as with a pressed-in pin; for both links or by link, `{ rod = "rigid" }`"""
    faces: Annotated[dict[str, Faces], BeforeValidator(by_link)] = Field(default_factory=dict)
    """of a solid link: the face that the joint acts on, or a list of them, by link: by name (parts from CAD, mesh
    files with groups), `{ rod = "pin_bore" }`, or by what it is, `{ rod = { cylinder = "8 mm", axis = "z", near = "B"
    } }`; if not given, what lies about `at`"""

    bushing: Bushing | None = None
    """springs and dampers in place of its constraints: `{ stiffness = 1e7 }`; rigid if not given"""

    def stiff(self, link: str) -> bool:
        """Whether the coupling surface on a link is rigid."""
        return (self.coupling.get(link) if isinstance(self.coupling, dict) else self.coupling) == "rigid"

    def face_names(self, link: str) -> tuple[str, ...]:
        """Names, or descriptions in words, of the faces of a link to which the joint is attached."""
        return tuple(each if isinstance(each, str) else each.label for each in self.faces.get(link, ()))

    def chosen_faces(self, link: str) -> tuple[ChosenFace, ...]:
        """Faces of a link that are chosen by form and place."""
        return tuple(each for each in self.faces.get(link, ()) if not isinstance(each, str))

    @property
    def points(self) -> dict[str, XYZ]:
        """Points by link [m], if the joint has one for each."""
        return self.at.points if isinstance(self.at, Apart) else {}

    @property
    def open(self) -> bool:
        """Whether the joint has a separate point on each link."""
        return len(set(self.points.values())) > 1

    def on(self, link: str) -> XYZ:
        """Point of the joint on a link [m]."""
        return self.points.get(link, self.at)

    @model_validator(mode="after")
    def _point_of_each_link(self) -> Self:
        if not isinstance(self.at, Apart):
            return self
        given, names = self.at.points, list(self.links)
        others = (name for name in given if name not in names)
        wrong = [Fault(("at", x), unknown_name("a link of the joint", x, names)) for x in others]
        lacking = [Fault(("at", name), "is required [m], got nothing") for name in names if name not in given]
        refuse([*wrong, *lacking])
        return self.fill(at=apart({name: given[name] for name in names}))

    @model_validator(mode="after")
    def _hinge_along_z(self) -> Self:
        return self.fill(axis=(0.0, 0.0, 1.0)) if self.kind == "revolute" and self.axis is None else self
