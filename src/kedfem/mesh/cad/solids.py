"""Records for the meshing methods: a solid from CAD with its faces, and the element sizes asked for."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import KedfemError


class OtherMethodError(KedfemError):
    """A solid cannot be meshed by this method; the reason is reported if none is left, or a worse one taken."""


@dataclass(frozen=True, slots=True)
class CadFace:
    """A face of a solid, as gmsh's model has it: its tag there, the rest as in `Face`; of a cylinder also its length.

    surface : OpenCASCADE's word for it, where `kind` is other
    bend : the least radius of curvature of such a face [m]
    hollow : whether it is bent most towards the outside, as bores and fillets are
    """

    tag: int
    name: str
    kind: Literal["plane", "cylinder", "sphere", "other"]
    centre: Float[np.ndarray, "3"]
    direction: Float[np.ndarray, "3"]
    radius: float
    inward: bool
    area: float
    length: float
    surface: str = ""
    bend: float = np.nan
    hollow: bool = False


@dataclass(frozen=True, slots=True)
class Solid:
    """The one solid in gmsh's model, in metres: its tag, name, volume [m³], box, faces; what was mended at import."""

    tag: int
    name: str
    volume: float
    low: Float[np.ndarray, "3"]
    high: Float[np.ndarray, "3"]
    faces: tuple[CadFace, ...]
    mended: str = ""

    @property
    def extent(self) -> float:
        """Length of the box's diagonal [m]."""
        return float(np.linalg.norm(self.high - self.low))

    @property
    def middle(self) -> Float[np.ndarray, "3"]:
        """Middle of the box [m]."""
        return np.asarray((self.low + self.high) / 2)

    @property
    def area(self) -> float:
        """Area of all faces [m²]."""
        return sum(face.area for face in self.faces)


USUAL = np.pi / 4  # that an element turns along a curved face where nobody asks for less [rad]
AROUND = 0.3  # of a bore's radius: a place so near its middle is in it


@dataclass(frozen=True, slots=True)
class Sizing:
    """How fine a mesh of a solid is to be.

    size : edge length of the hexahedra [m]; None: from `across`
    across : hexahedra across the smallest width, where no size is given
    layers : least number through each thickness of a part made of layers
    turn : most that an element turns along a curved face [rad]
    hollow : the same along a concave one, where stress is highest: fillets, and bores that are around none of the
        places
    ignore : blends smaller than that may be left out [m]; None: convex ones that are very small
    kept, named : places (in the part's frame [m]) and faces where none may
    """

    size: float | None = None
    across: int = 2
    layers: int = 1
    turn: float = USUAL
    hollow: float = USUAL
    ignore: float | None = None
    kept: tuple[tuple[float, float, float], ...] = ()
    named: tuple[str, ...] = ()
