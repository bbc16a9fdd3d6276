"""Sample points and normals on the faces of a solid, and the axes of its faces of revolution."""

from dataclasses import dataclass
from types import ModuleType

import numpy as np

from kedfem.arrays import Float
from kedfem.mesh.cad.solid_faces import places_on
from kedfem.mesh.cad.solids import CadFace, Solid

_SHARES = np.linspace(0.03, 0.97, 7)  # of a face's parameter ranges: away from poles, where normals are undefined
OFF = 1e-5  # most distance of normals from an axis, in sizes of the solid; also for singular values of screws
_NO_TURN = 1e-3  # rotational part of a screw below which it is a translation

#: A point on the axis, in sizes of the solid from its middle, and the axis' direction.
Axis = tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]


@dataclass(frozen=True, slots=True)
class Frame:
    """A right-handed orthonormal frame: its origin (3,) [m] and its axes (3, 3) as rows."""

    origin: Float[np.ndarray, "3"]
    axes: Float[np.ndarray, "3 3"]


@dataclass(frozen=True, slots=True)
class FaceSamples:
    """Points (q, 3), in sizes of the solid from its middle, and unit normals (q, 3) on a face."""

    face: CadFace
    places: Float[np.ndarray, "q 3"]
    normals: Float[np.ndarray, "q 3"]

    def revolves_about(self, axis: Axis) -> bool:
        """Whether all normals intersect the axis or are parallel to it."""
        return bool(abs(np.cross(self.places - axis[0], self.normals) @ axis[1]).max(initial=0) < OFF)

    def runs_along(self, direction: Float[np.ndarray, "3"]) -> bool:
        """Whether all normals are perpendicular to a direction."""
        return bool(abs(self.normals @ direction).max(initial=0) < OFF)


def face_samples(gmsh: ModuleType, solid: Solid) -> dict[int, FaceSamples]:
    """The samples of each face, by its tag, without points at which OpenCASCADE gives no normal."""
    return {face.tag: _face_samples(gmsh, solid, face) for face in solid.faces}


def _face_samples(gmsh: ModuleType, solid: Solid, face: CadFace) -> FaceSamples:
    """The samples of one face."""
    on = places_on(gmsh, face.tag, _SHARES)
    known = np.isfinite(on.points).all(axis=1) & (abs(np.linalg.norm(on.normals, axis=1) - 1) < 1e-6)
    return FaceSamples(face, (on.points[known] - solid.middle) / solid.extent, on.normals[known])


def common_axes(solid: Solid, every: list[FaceSamples]) -> list[Axis]:
    """The axes of the faces of revolution, each once, those of the largest area first.

    The normals of a surface of revolution meet its axis: n · (a × (x − p)) = 0 of all places x and normals n on it is
    linear in the screw (a, p × a); for a cone, torus or free form of revolution its null space is the axis itself.
    """
    found: list[tuple[float, Axis]] = []
    for sample in every:
        for axis in _own_axes(solid, sample, every):
            for i, (area, known) in enumerate(found):
                if max(np.linalg.norm(np.cross(axis[1], d)) for d in (known[1], axis[0] - known[0])) < 10 * OFF:
                    found[i] = area + sample.face.area, known
                    break
            else:
                found.append((sample.face.area, axis))
    return [axis for _, axis in sorted(found, key=lambda each: -each[0])]


def _own_axes(solid: Solid, sample: FaceSamples, every: list[FaceSamples]) -> list[Axis]:
    """The axes of one face; for a sphere those normal to plane faces of the solid, else z."""
    face = sample.face
    if face.kind == "plane":
        return []
    if face.kind == "cylinder":
        return [((face.centre - solid.middle) / solid.extent, face.direction)]
    if face.kind == "sphere":
        across = [other.normals[0] for other in every if other.face.kind == "plane"]
        return [((face.centre - solid.middle) / solid.extent, axis) for axis in across or [np.array([0.0, 0.0, 1.0])]]
    screws = np.hstack([np.cross(sample.places, sample.normals), sample.normals])
    values, vectors = np.linalg.eigh(screws.T @ screws / len(screws))
    along, moment = vectors[:3, 0], vectors[3:, 0]
    length = np.linalg.norm(along)
    small = np.sqrt(np.maximum(values, 0)) < OFF
    if small.sum() != 1 or length < _NO_TURN or abs(along @ moment) > OFF * length:
        return []
    return [(np.cross(along, moment) / length**2, along / length)]
