"""Sample points and normals on the faces of a solid, and the axes of its faces of revolution."""

from dataclasses import dataclass
from types import ModuleType

import numpy as np

from kedfem.arrays import Float
from kedfem.mesh.cad.solid_faces import places_on
from kedfem.mesh.cad.solids import CadFace, Solid

_SHARES = np.linspace(0.03, 0.97, 7)  # of a face's parameters: off the poles, where normals are unknown
OFF = 1e-5  # by which normals may miss an axis, in sizes of the solid; singular values of a face's own screws
_NO_TURN = 1e-3  # of a singular vector: less turning than that is a translation

#: A point, in sizes of the solid from its middle, and the direction.
Axis = tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]


@dataclass(frozen=True, slots=True)
class Frame:
    """A point [m] and, as rows, three directions square to each other, right-handed."""

    origin: Float[np.ndarray, "3"]
    axes: Float[np.ndarray, "3 3"]


@dataclass(frozen=True, slots=True)
class FaceSamples:
    """Places (q, 3) and unit normals (q, 3) on a face, lengths in sizes of the solid, from its middle."""

    face: CadFace
    places: Float[np.ndarray, "q 3"]
    normals: Float[np.ndarray, "q 3"]

    def revolves_about(self, axis: Axis) -> bool:
        """Whether all normals meet the axis or are along it."""
        return bool(abs(np.cross(self.places - axis[0], self.normals) @ axis[1]).max(initial=0) < OFF)

    def runs_along(self, direction: Float[np.ndarray, "3"]) -> bool:
        """Whether all normals are square to a direction."""
        return bool(abs(self.normals @ direction).max(initial=0) < OFF)


def face_samples(gmsh: ModuleType, solid: Solid) -> dict[int, FaceSamples]:
    """Of each face, by its tag, places and normals, without those that OpenCASCADE does not know."""
    return {face.tag: _face_samples(gmsh, solid, face) for face in solid.faces}


def _face_samples(gmsh: ModuleType, solid: Solid, face: CadFace) -> FaceSamples:
    """Those of one face."""
    on = places_on(gmsh, face.tag, _SHARES)
    known = np.isfinite(on.points).all(axis=1) & (abs(np.linalg.norm(on.normals, axis=1) - 1) < 1e-6)
    return FaceSamples(face, (on.points[known] - solid.middle) / solid.extent, on.normals[known])


def common_axes(solid: Solid, every: list[FaceSamples]) -> list[Axis]:
    """The axes of single faces, each once, of those with the largest area first.

    The normals of a surface of revolution meet its axis: n · (a × (x − p)) = 0 of all places x and normals n on it is
    linear in the screw (a, p × a), whose null space of a cone, torus or free form is the axis itself.
    """
    found: list[tuple[float, Axis]] = []
    for look in every:
        for axis in _own_axes(solid, look, every):
            for i, (area, known) in enumerate(found):
                if max(np.linalg.norm(np.cross(axis[1], d)) for d in (known[1], axis[0] - known[0])) < 10 * OFF:
                    found[i] = area + look.face.area, known
                    break
            else:
                found.append((look.face.area, axis))
    return [axis for _, axis in sorted(found, key=lambda each: -each[0])]


def _own_axes(solid: Solid, look: FaceSamples, every: list[FaceSamples]) -> list[Axis]:
    """Axes about which one face turns; of a sphere those across plane faces, else z."""
    face = look.face
    if face.kind == "plane":
        return []
    if face.kind == "cylinder":
        return [((face.centre - solid.middle) / solid.extent, face.direction)]
    if face.kind == "sphere":
        across = [other.normals[0] for other in every if other.face.kind == "plane"]
        return [((face.centre - solid.middle) / solid.extent, axis) for axis in across or [np.array([0.0, 0.0, 1.0])]]
    screws = np.hstack([np.cross(look.places, look.normals), look.normals])
    values, vectors = np.linalg.eigh(screws.T @ screws / len(screws))
    along, moment = vectors[:3, 0], vectors[3:, 0]
    length = np.linalg.norm(along)
    small = np.sqrt(np.maximum(values, 0)) < OFF
    if small.sum() != 1 or length < _NO_TURN or abs(along @ moment) > OFF * length:
        return []
    return [(np.cross(along, moment) / length**2, along / length)]
