"""The solids of an assembly with their bores, journals and balls, for whoever looks where they meet."""

from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Literal

import numpy as np
from jaxtyping import Float

from kedfem.mesh.cad.faces import one_surface
from kedfem.mesh.cad.file import cad_file
from kedfem.mesh.cad.model import all_solids
from kedfem.mesh.cad.solids import CadFace, Solid
from kedfem.mesh.isolated import LONGEST, PART, apart
from kedfem.mesh.session import gmsh_model

# of a cylinder's full turn: a joint finds no less of it by itself (links/surfaces/round_surfaces.py); keyways are less
CLOSED = 0.75
BALL = 0.2  # of a ball's area: the rounded corner between three walls has an eighth


@dataclass(frozen=True, slots=True)
class RoundFace:
    """A closed cylinder or a ball of a solid, in the file's frame; of a ball direction and length are nan.

    centre : (3,) of a cylinder on its axis half way, [m]
    direction : (3,) unit vector along the axis
    radius, length : [m]
    inward : whether it is a hole: a bore or a ball seat
    """

    kind: Literal["cylinder", "sphere"]
    centre: Float[np.ndarray, "3"]
    direction: Float[np.ndarray, "3"]
    radius: float
    length: float
    inward: bool


@dataclass(frozen=True, slots=True)
class AssemblySolid:
    """A solid of an assembly: its name, the diagonal of its box [m], its round faces."""

    name: str
    extent: float
    rounds: tuple[RoundFace, ...]


def assembly_solids(path: Path, scale: float | None) -> list[AssemblySolid]:
    """All solids of a CAD file, where it has them, in metres; gmsh works in a process of its own.

    Parameters
    ----------
    scale : metres per unit of the file; None: the file's own unit

    Raises
    ------
    MeshError
        The file cannot be read, or one of its solids is not one to mesh.
    """
    return apart(path.name, PART, LONGEST, _read, path, scale)


def _read(path: Path, scale: float | None) -> list[AssemblySolid]:
    """What `assembly_solids` returns, found in this process."""
    file = cad_file(path.name, path, scale)
    with gmsh_model() as gmsh:
        return [
            AssemblySolid(solid.name, solid.extent, tuple(round_faces(gmsh, solid)))
            for solid in all_solids(gmsh, file)
        ]


def round_faces(gmsh: ModuleType, solid: Solid) -> list[RoundFace]:
    """The closed cylinders and the balls of a solid; CAD files divide them along seams."""
    groups = [[solid.faces[i] for i in group] for group in one_surface(gmsh, solid)]
    found = [_round_face(group) for group in groups if group[0].kind in ("cylinder", "sphere")]
    return [each for each in found if each is not None]


def _round_face(parts: list[CadFace]) -> RoundFace | None:
    """What faces of one cylinder or ball are together; None if it is but a part of one, as a fillet is."""
    first, area = parts[0], sum(face.area for face in parts)
    if first.kind == "sphere":
        whole = area >= BALL * 4 * np.pi * first.radius**2
        nowhere = np.full(3, np.nan)
        return (
            RoundFace("sphere", first.centre, nowhere, first.radius, np.nan, first.inward) if whole else None
        )
    along = np.array([(face.centre - first.centre) @ first.direction for face in parts])
    half = np.array([face.length for face in parts]) / 2
    low, high = float((along - half).min()), float((along + half).max())
    if area < CLOSED * 2 * np.pi * first.radius * (high - low):
        return None
    centre = first.centre + (low + high) / 2 * first.direction
    return RoundFace("cylinder", centre, first.direction, first.radius, high - low, first.inward)
