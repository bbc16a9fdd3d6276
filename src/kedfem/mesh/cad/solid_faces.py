"""The faces of a solid in gmsh's model: what form each has, found from places and normals on it.

Names of types are not asked: the same bore is a cylinder in STEP and a surface of revolution in IGES.
"""

from dataclasses import dataclass
from types import ModuleType

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import MeshError
from kedfem.mesh.cad.forms import Sample, fitted_form
from kedfem.mesh.cad.solids import CadFace
from kedfem.mesh.cad.words import face_form
from kedfem.mesh.places import in_mm
from kedfem.mesh.session import boundary

_ACCURACY = 1e-4  # of points, in sizes of the face: what translators between CAD systems leave
_SKEW = 1e-3
_FINENESS = (5, 11, 25)  # places along each parameter, until some are within the face
_ASIDE = 0.4627  # where in its part of a grid a place is: not in the middle, where edges of holes often are
_LEAST = 4  # places within a face that are enough
_MOST, _FEWEST = 12, 3  # places at which the two sides of a face are examined
_IN_ALL = 100  # such places in all: of a part with many faces a look takes up to 10 ms
SAME_VOLUME = 1e-3  # two ways to a volume: faces from a translator leave gaps
_STEP_OFF = 1e-5  # of the solid's size: from a face to its two sides
_PADDING = 1e-7 * np.array([[1.0], [-1.0]])  # [m], that OpenCASCADE has put around a box
_LEAST_STEP = 2e-7  # [m], above what OpenCASCADE counts as on the face


@dataclass(frozen=True, slots=True)
class Places:
    """Where a face is examined: parameters (q, 2), points (q, 3) [m] and gmsh's unit normals (q, 3)."""

    at: Float[np.ndarray, "q 2"]
    points: Float[np.ndarray, "q 3"]
    normals: Float[np.ndarray, "q 3"]


def cad_faces(gmsh: ModuleType, where: str, solid: int, extent: float, names: dict[int, str]) -> tuple[CadFace, ...]:
    """All faces of a solid, in the order of their tags.

    gmsh's normals point out of a solid, mostly: it is looked whether they do. On faces swept by curves, as IGES has
    them, OpenCASCADE needs a second for twenty looks, and there the volume that they enclose has to be enough.

    Parameters
    ----------
    solid, extent : the solid's tag; the length of its box's diagonal [m]
    names : names of faces that have one; others are called "face" and their tag

    Raises
    ------
    MeshError
        A face has the solid on both sides, or on none: the solid cuts itself or is not closed.
    """
    tags = sorted(boundary(gmsh, 3, solid))
    faces = tuple(_cad_face(gmsh, tag, names.get(tag, f"face {tag}"), 1.0) for tag in tags)
    slow = any(gmsh.model.getType(2, tag).startswith("Surface of") for tag in tags)
    volume = gmsh.model.occ.getMass(3, solid)
    if slow and abs(enclosed_volume(gmsh, faces) - volume) <= SAME_VOLUME * volume:
        return faces
    turned = []
    for face in faces:
        places = _inner_places(gmsh, face.tag, _FEWEST if slow else min(_MOST, max(1, _IN_ALL // len(faces))))
        sign = _outward_sign(gmsh, where, (solid, face), extent, places)
        turned.append(face if sign > 0 else _cad_face(gmsh, face.tag, face.name, sign))
    return tuple(turned)


def enclosed_volume(gmsh: ModuleType, faces: tuple[CadFace, ...]) -> float:
    """What planes, cylinders and spheres enclose, V = ⅓ ∫ x·n dA; nan if a face is of another form.

    On a round face x = c + r n, so that its centroid gives ∫ n dA: nothing is asked of OpenCASCADE's own volume.
    """
    flux = 0.0
    for face in faces:
        if face.kind == "other" or (face.kind != "plane" and not face.radius):
            return float("nan")
        if face.kind == "plane":
            flux += face.area * float(face.centre @ face.direction)
            continue
        sign = -1 if face.inward else 1
        away = np.array(gmsh.model.occ.getCenterOfMass(2, face.tag)) - face.centre
        centre = face.centre
        if face.kind == "cylinder":
            away, centre = (x - (x @ face.direction) * face.direction for x in (away, centre))
        flux += sign * face.area * float(centre @ away / face.radius + face.radius)
    return flux / 3


def solid_box(gmsh: ModuleType, faces: tuple[CadFace, ...]) -> Float[np.ndarray, "2 3"]:
    """Least and greatest coordinates of faces [m]: OpenCASCADE's boxes of free forms are loose, places on them not."""
    boxes = []
    for face in faces:
        box = np.array(gmsh.model.getBoundingBox(2, face.tag)).reshape(2, 3) + _PADDING
        if face.kind == "other":
            points = places_on(gmsh, face.tag, np.linspace(0, 1, 33)).points
            box = np.stack([np.maximum(box[0], points.min(axis=0)), np.minimum(box[1], points.max(axis=0))])
        boxes.append(box)
    return np.stack([np.min(boxes, axis=0)[0], np.max(boxes, axis=0)[1]])


def _cad_face(gmsh: ModuleType, tag: int, name: str, sign: float) -> CadFace:
    """One face: its form, with gmsh's normals times `sign` as the outward ones."""
    all_over = places_on(gmsh, tag, np.linspace(0, 1, 9))
    within = places_on(gmsh, tag, np.linspace(0, 1, 9)[1:-1])
    form = fitted_form(Sample(all_over.points, within.points, sign * within.normals), _ACCURACY, _SKEW)
    centroid = np.array(gmsh.model.occ.getCenterOfMass(2, tag))
    return CadFace(
        tag=tag, name=name, kind=form.kind,
        centre=centroid if form.kind in ("plane", "other") else form.centre, direction=form.direction,
        radius=form.radius, inward=form.inward, area=float(gmsh.model.occ.getMass(2, tag)),
        length=form.length, surface=gmsh.model.getType(2, tag) if form.kind == "other" else "",
        bend=_least_radius(gmsh, tag, within) if form.kind == "other" else np.nan,
        hollow=_hollow(within, sign) if form.kind == "other" else form.inward,
    )  # fmt: skip


def _hollow(within: Places, sign: float) -> bool:
    """Whether a face bends more towards the outside than it does towards the inside, along its parameters."""
    m = int(np.sqrt(len(within.points)))
    X, n = within.points.reshape(m, m, 3), sign * within.normals.reshape(m, m, 3)
    bends = []
    for axis in (0, 1):
        dx, dn = np.diff(X, axis=axis), np.diff(n, axis=axis)
        length2 = (dx**2).sum(axis=2)
        bends.append(((dx * dn).sum(axis=2) / np.where(length2 > 0, length2, np.inf)).ravel())
    bend = np.concatenate(bends)
    return bool(-bend.min() > max(bend.max(), 0.0))


def _least_radius(gmsh: ModuleType, tag: int, places: Places) -> float:
    """The least radius of curvature of a face [m]; nan where it is flat."""
    bend = np.abs(gmsh.model.getPrincipalCurvatures(tag, places.at[::5].ravel())[:2]).max()
    return float(1 / bend) if bend > 0 else np.nan


def places_on(gmsh: ModuleType, tag: int, share: Float[np.ndarray, "m"]) -> Places:
    """Places at shares of both parameters of a face, within it or beside it on the same surface."""
    low, high = (np.array(bound) for bound in gmsh.model.getParametrizationBounds(2, tag))
    at = low + np.stack(np.meshgrid(share, share), axis=-1).reshape(-1, 2) * (high - low)
    points = np.array(gmsh.model.getValue(2, tag, at.ravel())).reshape(-1, 3)
    return Places(at, points, np.array(gmsh.model.getNormal(tag, at.ravel())).reshape(-1, 3))


def _inner_places(gmsh: ModuleType, tag: int, most: int) -> Places:
    """A few places within a face, as far apart as a grid allows; none if it is too narrow for the finest."""
    for fineness in _FINENESS:
        grid = places_on(gmsh, tag, (np.arange(fineness) + _ASIDE) / fineness)
        inside = [i for i, at in enumerate(grid.at) if gmsh.model.isInside(2, tag, at, parametric=True)]
        if len(inside) >= _LEAST:
            break
    chosen = np.array(inside, dtype=int)[np.linspace(0, len(inside) - 1, min(len(inside), most)).astype(int)]
    return Places(grid.at[chosen], grid.points[chosen], grid.normals[chosen])


def _outward_sign(gmsh: ModuleType, where: str, of: tuple[int, CadFace], extent: float, inner: Places) -> float:
    """Whether gmsh's normals of a face point out of the solid (1) or into it (-1), by a step to either side."""
    solid, face = of
    step = max(_STEP_OFF * extent, _LEAST_STEP) * inner.normals
    ahead, behind = (
        np.array([gmsh.model.isInside(3, solid, X) > 0 for X in inner.points + side * step], dtype=bool)
        for side in (1, -1)
    )
    if (ahead == behind).sum() > max(1, len(inner.points) / 8):
        X = inner.points[np.flatnonzero(ahead == behind)[0]]
        both = "both sides" if ahead[np.flatnonzero(ahead == behind)[0]] else "neither side"
        raise MeshError(
            f"{where}: must be a closed solid that does not cut itself, got a {face_form(face)} ({face.name}) with "
            f"material on {both} at {in_mm(X)}; mend the part in CAD"
        )
    return 1.0 if behind.sum() >= ahead.sum() else -1.0
