"""Records for the meshing methods: a solid from CAD with its faces, and the element sizes to use."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import KedfemError


class OtherMethodError(KedfemError):
    """A solid cannot be meshed by this method; the reason is reported if no method or only a worse one is left."""


@dataclass(frozen=True, slots=True)
class CadFace:
    """A face of a solid in gmsh's model; `kind` to `inward` as in `Face`.

    tag : gmsh's number of it
    area : [m²]
    length : of a cylinder along its axis [m]; else nan
    surface : OpenCASCADE's type of the surface, where `kind` is other
    least_radius : least radius of curvature of such a face [m]
    concave : whether its largest curvature is concave, as that of bores and fillets
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
    least_radius: float = np.nan
    concave: bool = False


@dataclass(frozen=True, slots=True)
class Solid:
    """The only solid in gmsh's model: its tag, name, volume [m³], bounding box [m], faces; what was mended at import."""

    tag: int
    name: str
    volume: float
    low: Float[np.ndarray, "3"]
    high: Float[np.ndarray, "3"]
    faces: tuple[CadFace, ...]
    mended: str = ""

    @property
    def extent(self) -> float:
        """Diagonal of the bounding box [m]."""
        return float(np.linalg.norm(self.high - self.low))

    @property
    def middle(self) -> Float[np.ndarray, "3"]:
        """Middle of the bounding box [m]."""
        return np.asarray((self.low + self.high) / 2)

    @property
    def area(self) -> float:
        """Area of all faces [m²]."""
        return sum(face.area for face in self.faces)


USUAL_ANGLE = np.pi / 4  # [rad], by which an element turns along a curved face at most unless less is asked for
AROUND = 0.3  # of a bore's radius: a point within this distance of its axis is in the bore
MANY_UNKNOWNS = 45_000  # above them a part without a given size is meshed coarser


@dataclass(frozen=True, slots=True)
class Sizing:
    """The required fineness of a solid's mesh.

    size : edge length of the hexahedra [m]; None: from `across`
    across : hexahedra across the smallest width, where no size is given
    layers : least number of elements through each thickness of a part made of layers
    angle : most by which an element turns along a curved face [rad]
    concave_angle : the same along concave faces, where stress is highest: fillets, and bores that contain none of the
        `kept_points`
    defeature_size : blends smaller than this may be left out [m]; None: only very small convex ones
    kept_points, kept_faces : points (in the part's frame [m]) and names of faces at which no blend is left out
    """

    size: float | None = None
    across: int = 2
    layers: int = 1
    angle: float = USUAL_ANGLE
    concave_angle: float = USUAL_ANGLE
    defeature_size: float | None = None
    kept_points: tuple[tuple[float, float, float], ...] = ()
    kept_faces: tuple[str, ...] = ()
