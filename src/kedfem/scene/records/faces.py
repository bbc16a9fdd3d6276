"""Faces of links chosen by what they are: a plane, a cylinder or a ball, and what they are near to."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Self

from pydantic import BeforeValidator, model_validator

from kedfem.errors import Fault
from kedfem.scene.records.base import Record, refuse
from kedfem.scene.records.points import Axis, Point
from kedfem.scene.records.units import PositiveLength, fault
from kedfem.scene.records.wording import shown

FORMS = ("plane", "cylinder", "sphere")


class ChosenFace(Record):
    """A face by what it is."""

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
        if self.axis is not None and self.cylinder is None:
            refuse([Fault(("axis",), f"must be combined with cylinder, got it with {given[0]}")])
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
    """A face's name, or a table that says what it is."""
    if isinstance(value, Mapping):
        return ChosenFace.model_validate(value)
    if isinstance(value, ChosenFace) or (isinstance(value, str) and value):
        return value
    raise no_face(value)


def no_face(value: object) -> Exception:
    """The fault of what is no face."""
    wanted = "must be a face's name, a table that says what it is, or a list of these"
    return fault(f"{wanted}, got {shown(value)}")


def several(value: object) -> object:
    """One or several names or choices of faces, as a list that is not empty."""
    listed = [value] if isinstance(value, (str, Mapping, ChosenFace)) else value
    if not isinstance(listed, (list, tuple)) or not listed:
        raise no_face(value)
    return tuple(listed)


Faces = Annotated[tuple[Annotated[FaceName, BeforeValidator(face_choice)], ...], BeforeValidator(several)]
