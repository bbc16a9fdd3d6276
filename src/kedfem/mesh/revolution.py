"""Solids of revolution: the axis about which all faces turn, from places and normals on them, and how far they turn."""

from dataclasses import dataclass
from types import ModuleType

import numpy as np
from jaxtyping import Float

from kedfem.mesh.cad.solids import CadFace, OtherWayError, Solid
from kedfem.mesh.cad.words import direction_in_words, face_in_words

_SHARES = np.linspace(0.03, 0.97, 7)  # of a face's parameters: off the poles, where normals are unknown
_OFF = (
    1e-5  # by which normals may miss the axis, in sizes of the solid; singular values of a face's own screws
)
_NO_TURN = 1e-3  # of a singular vector: less turning than that is a translation


@dataclass(frozen=True, slots=True)
class Revolution:
    """How a solid is swept by its meridian section.

    Attributes
    ----------
    origin : (3,) [m]
        A point of the axis.
    axes : (3, 3) [-]
        Rows: the axis; radially at the start; the direction in which the solid turns there.
    angle : float [rad]
        From the first end to the second, 2π of a full turn.
    """

    origin: Float[np.ndarray, "3"]
    axes: Float[np.ndarray, "3 3"]
    angle: float

    @property
    def full(self) -> bool:
        """Whether the end is the start."""
        return bool(self.angle == 2 * np.pi)


@dataclass(frozen=True, slots=True)
class _Looks:
    """Places (q, 3) and unit normals (q, 3) on a face, its lengths in sizes of the solid, from its middle."""

    face: CadFace
    places: Float[np.ndarray, "q 3"]
    normals: Float[np.ndarray, "q 3"]

    def turns_about(self, point: Float[np.ndarray, "3"], axis: Float[np.ndarray, "3"]) -> bool:
        """Whether all normals meet the axis or are along it."""
        return bool(abs(np.cross(self.places - point, self.normals) @ axis).max(initial=0) < _OFF)

    def ends_at(self, point: Float[np.ndarray, "3"], axis: Float[np.ndarray, "3"]) -> bool:
        """Whether it is in a plane that holds the axis."""
        off = abs(((self.places - point) * self.normals).sum(axis=1)).max(initial=0)
        return self.face.kind == "plane" and bool(max(off, abs(self.normals @ axis).max()) < _OFF)


def revolution(gmsh: ModuleType, solid: Solid) -> Revolution:
    """The axis of a solid whose faces all turn about it, but for two plane ones through it, its ends.

    The normals of a surface of revolution meet its axis: n · (a × (x − p)) = 0 of all places x and normals n on it is
    linear in the screw (a, p × a), whose null space of a cone, torus or free form is the axis itself.

    Raises
    ------
    OtherWayError
        There is none; the largest face that is in the way.
    """
    looks = [_looks(gmsh, solid, face) for face in solid.faces]
    obstacles: list[tuple[float, str]] = []
    for point, axis in _axes(solid, looks):
        others = [look for look in looks if not look.turns_about(point, axis)]
        ends = [look.face for look in others if look.ends_at(point, axis)]
        if len(others) == len(ends) and len(ends) in {0, 2}:
            return _turned(gmsh, solid, looks, point, axis)
        faces = [look.face for look in others if look.face not in ends] or ends
        words = face_in_words(max(faces, key=lambda face: face.area))
        obstacles.append(
            (sum(face.area for face in faces), f"the {words} does not turn about {direction_in_words(axis)}")
        )
    reason = min(obstacles)[1] if obstacles else "no face turns about an axis"
    raise OtherWayError(f"{solid.name}: no solid of revolution, as {reason}")


def _looks(gmsh: ModuleType, solid: Solid, face: CadFace) -> _Looks:
    """Places and normals on a face, without those that OpenCASCADE does not know."""
    low, high = (np.array(bound) for bound in gmsh.model.getParametrizationBounds(2, face.tag))
    at = low + np.stack(np.meshgrid(_SHARES, _SHARES), axis=-1).reshape(-1, 2) * (high - low)
    places = np.reshape(gmsh.model.getValue(2, face.tag, at.ravel()), (-1, 3))
    normals = np.reshape(gmsh.model.getNormal(face.tag, at.ravel()), (-1, 3))
    known = np.isfinite(places).all(axis=1) & (abs(np.linalg.norm(normals, axis=1) - 1) < 1e-6)
    return _Looks(face, (places[known] - solid.middle) / solid.extent, normals[known])


def _axes(solid: Solid, looks: list[_Looks]) -> list[tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]]:
    """A point and the direction of axes of single faces, each axis once, of those with the largest area first."""
    found: list[tuple[float, Float[np.ndarray, "3"], Float[np.ndarray, "3"]]] = []
    for look in looks:
        for point, axis in _own_axes(solid, look, looks):
            for i, (area, known, along) in enumerate(found):
                if max(np.linalg.norm(np.cross(axis, d)) for d in (along, point - known)) < 10 * _OFF:
                    found[i] = area + look.face.area, known, along
                    break
            else:
                found.append((look.face.area, point, axis))
    return [(point, axis) for _, point, axis in sorted(found, key=lambda each: -each[0])]


def _own_axes(
    solid: Solid, look: _Looks, looks: list[_Looks]
) -> list[tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]]:
    """Axes about which one face turns; of a sphere those across plane faces, else z."""
    face = look.face
    if face.kind == "plane":
        return []
    if face.kind == "cylinder":
        return [((face.centre - solid.middle) / solid.extent, face.direction)]
    if face.kind == "sphere":
        across = [other.normals[0] for other in looks if other.face.kind == "plane"]
        return [
            ((face.centre - solid.middle) / solid.extent, axis)
            for axis in across or [np.array([0.0, 0.0, 1.0])]
        ]
    screws = np.hstack([np.cross(look.places, look.normals), look.normals])
    values, vectors = np.linalg.eigh(screws.T @ screws / len(screws))
    axis, moment = vectors[:3, 0], vectors[3:, 0]
    length = np.linalg.norm(axis)
    small = np.sqrt(np.maximum(values, 0)) < _OFF
    if small.sum() != 1 or length < _NO_TURN or abs(axis @ moment) > _OFF * length:
        return []
    return [(np.cross(axis, moment) / length**2, axis / length)]


def _turned(
    gmsh: ModuleType,
    solid: Solid,
    looks: list[_Looks],
    point: Float[np.ndarray, "3"],
    axis: Float[np.ndarray, "3"],
) -> Revolution:
    """The record: the axis runs to where more of the volume is, so that it turns with the part."""
    ends = [look.face for look in looks if look.ends_at(point, axis)]
    reach = np.concatenate([look.places for look in looks]) @ axis
    centre = (np.asarray(gmsh.model.occ.getCenterOfMass(3, solid.tag)) - solid.middle) / solid.extent
    axis = axis if centre @ axis >= (reach.max() + reach.min()) / 2 - 1e-6 else -axis
    point = solid.middle + solid.extent * point
    if not ends:
        first = np.eye(3)[int(np.argmin(abs(axis)))]
        radial = first - (first @ axis) * axis
        radial /= np.linalg.norm(radial)
        return Revolution(point, np.stack([axis, radial, np.cross(axis, radial)]), 2 * np.pi)
    radials = [face.centre - point - ((face.centre - point) @ axis) * axis for face in ends]
    if sum(face.direction @ np.cross(axis, r) > 0 for face, r in zip(ends, radials, strict=True)) != 1:
        raise OtherWayError(f"{solid.name}: a solid of revolution must have a first and a last end")
    if ends[0].direction @ np.cross(axis, radials[0]) > 0:
        radials.reverse()
    start = radials[0] / np.linalg.norm(radials[0])
    axes = np.stack([axis, start, np.cross(axis, start)])
    _, x, y = axes @ radials[1]
    return Revolution(point, axes, float(np.arctan2(y, x) % (2 * np.pi)))
