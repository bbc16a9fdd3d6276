"""Solids of revolution: the axis about which all faces turn, from places and normals on them."""

from dataclasses import dataclass
from types import ModuleType

import numpy as np
from jaxtyping import Float

from kedfem.mesh.cad.looks import Axis, Looks, common_axes, looks
from kedfem.mesh.cad.solids import OtherMethodError, Solid
from kedfem.mesh.cad.words import direction_in_words, face_in_words


@dataclass(frozen=True, slots=True)
class Revolution:
    """The axis of a solid of revolution.

    origin : (3,) a point of the axis [m]
    axes : (3, 3) rows: the axis, and two directions square to it, right-handed [-]
    """

    origin: Float[np.ndarray, "3"]
    axes: Float[np.ndarray, "3 3"]


def revolution(gmsh: ModuleType, solid: Solid) -> Revolution:
    """The axis of a solid whose faces all turn about it.

    Raises
    ------
    OtherMethodError
        There is none; the largest face that is in the way.
    """
    every = list(looks(gmsh, solid).values())
    obstacles: list[tuple[float, str]] = []
    for axis in common_axes(solid, every):
        others = [look.face for look in every if not look.turns_about(axis)]
        if not others:
            return _framed(gmsh, solid, every, axis)
        words = face_in_words(max(others, key=lambda face: face.area))
        reason = f"the {words} does not turn about {direction_in_words(axis[1])}"
        obstacles.append((sum(face.area for face in others), reason))
    reason = min(obstacles)[1] if obstacles else "no face turns about an axis"
    raise OtherMethodError(f"{solid.name}: no solid of revolution, as {reason}")


def _framed(gmsh: ModuleType, solid: Solid, every: list[Looks], axis: Axis) -> Revolution:
    """The record: the axis runs to where more of the volume is, so that it turns with the part."""
    point, along = axis
    reach = np.concatenate([look.places for look in every]) @ along
    centre = (np.asarray(gmsh.model.occ.getCenterOfMass(3, solid.tag)) - solid.middle) / solid.extent
    along = along if centre @ along >= (reach.max() + reach.min()) / 2 - 1e-6 else -along
    first = np.eye(3)[int(np.argmin(abs(along)))]
    radial = first - (first @ along) * along
    radial /= np.linalg.norm(radial)
    return Revolution(solid.middle + solid.extent * point, np.stack([along, radial, np.cross(along, radial)]))
