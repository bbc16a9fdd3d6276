"""Descriptions of faces in a designer's terms, such as bore, fillet or conical face, with their places."""

import re
from collections.abc import Iterable

import numpy as np

from kedfem.arrays import Float
from kedfem.mesh.cad.solids import CadFace
from kedfem.mesh.places import in_mm

_CLOSED = 0.9  # of a full cylinder: with a keyway it is still a bore or a journal
_QUARTER = 100.0  # [deg], largest angle of a fillet between two walls
_EIGHTH = 0.02  # of a ball's area: tolerance of the eighth that the rounded corner between three walls has
_PART = 0.3  # of a ball's area, below which a face is called a part of it
_AXES = ("x", "y", "z")


def face_form(face: CadFace) -> str:
    """A designer's term for a face: ``fillet of radius 2 mm``, ``bore of radius 6 mm along z``."""
    radius = f"of radius {1e3 * face.radius:.4g} mm"
    match face.kind:
        case "plane":
            return f"plane face facing {direction_in_words(face.direction)}"
        case "sphere":
            whole = 4 * np.pi * face.radius**2
            if abs(face.area - whole / 8) < _EIGHTH * whole:
                return f"rounded corner {radius}"
            return f"{'part of a ' * (face.area < _PART * whole)}{'ball seat' if face.inward else 'ball'} {radius}"
        case "cylinder":
            return f"{_cylinder(face)} {radius} along {direction_in_words(face.direction)}"
        case _:
            return _free_form(face)


def _free_form(face: CadFace) -> str:
    """The description of a face that is neither plane nor cylinder nor sphere."""
    if face.surface == "Cone":
        return "conical face (chamfer, draft or countersink)"
    if not np.isfinite(face.least_radius):
        return "free-form face"
    bend = f"radius {1e3 * face.least_radius:.4g} mm"
    return f"fillet of {bend}" if face.surface == "Torus" else f"free-form face bent to {bend}"


def face_in_words(face: CadFace) -> str:
    """The description, place and name of a face: ``fillet of radius 2 mm near (10, 0, 3) mm (face 7)``."""
    return f"{face_form(face)} near {in_mm(face.centre)} ({face.name})"


def with_faces_in_words(text: str, faces: Iterable[CadFace], failed: Iterable[int] = ()) -> str:
    """A report of gmsh with descriptions in place of its surface numbers; without numbers, with the faces that failed.

    Parameters
    ----------
    failed : tags of the faces at which gmsh failed, by its own record
    """
    known = {face.tag: face for face in faces}

    def words(found: re.Match[str]) -> str:
        face = known.get(int(found[1]))
        return found[0] if face is None else face_in_words(face)

    in_words = re.sub(r"(?i)\bsurfaces? (\d+)(?: surface \1\b)?", words, text)  # of facets of one face it names both
    named = [face_in_words(known[tag]) for tag in failed if tag in known]
    return in_words if in_words != text or not named else f"{text} at the {', '.join(named[:3])}"


def direction_in_words(direction: Float[np.ndarray, "3"]) -> str:
    """``x``, ``-y``, ``z``, or the direction's components."""
    for axis, name in zip(np.eye(3), _AXES, strict=True):
        if abs(direction @ axis) > 1 - 1e-9:
            return name if direction @ axis > 0 else f"-{name}"
    return "({:.3g}, {:.3g}, {:.3g})".format(*(np.round(direction, 9) + 0.0))


def _cylinder(face: CadFace) -> str:
    """The term for a cylinder: a bore or journal, a part of one, or the rounding between two walls."""
    around = 2 * np.pi * face.radius * face.length  # may be zero in a damaged file
    if face.area > _CLOSED * around:
        return "bore" if face.inward else "journal"
    if face.area > _QUARTER / 360 * around:
        return "part of a bore" if face.inward else "part of a journal"
    return "fillet" if face.inward else "rounded edge"
