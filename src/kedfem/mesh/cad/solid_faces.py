"""The faces of a solid in gmsh's model: the form of each, fitted to points and normals on it.

OpenCASCADE's surface types are not used: the same bore is a cylinder in STEP and a surface of revolution in IGES.
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

_ACCURACY = 1e-4  # of points, in sizes of the face: the error that translators between CAD systems leave
_SKEW = 1e-3
_FINENESS = (5, 11, 25)  # points along each parameter, tried in turn until some are within the face
_ASIDE = 0.4627  # position of a point in its grid cell: not the middle, where edges of holes often are
_LEAST = 4  # points within a face that suffice
_MOST, _FEWEST = 12, 3  # points at which the two sides of a face are examined
_IN_ALL = 100  # such points of all faces: each takes up to 10 ms for a part with many faces
SAME_VOLUME = 1e-3  # relative difference of two computed volumes: faces from a translator leave gaps
_STEP_OFF = 1e-5  # of the solid's size: from a face to its two sides
_PADDING = 1e-7 * np.array([[1.0], [-1.0]])  # [m], which OpenCASCADE adds around a bounding box
_LEAST_STEP = 2e-7  # [m], above the distance that OpenCASCADE counts as on the face


@dataclass(frozen=True, slots=True)
class Places:
    """Points of a face: parameters (q, 2), coordinates (q, 3) [m] and gmsh's unit normals (q, 3)."""

    at: Float[np.ndarray, "q 2"]
    points: Float[np.ndarray, "q 3"]
    normals: Float[np.ndarray, "q 3"]


def cad_faces(gmsh: ModuleType, where: str, solid: int, extent: float, names: dict[int, str]) -> tuple[CadFace, ...]:
    """All faces of a solid, in the order of their tags.

    gmsh's normals usually point out of a solid, which is checked at some points of each face. On faces swept by
    curves, as in IGES, OpenCASCADE takes a second for twenty points; there the enclosed volume is the check.

    Parameters
    ----------
    solid, extent : the solid's tag; the diagonal of its bounding box [m]
    names : names of faces by tag; others are called "face" and their tag

    Raises
    ------
    MeshError
        A face has material on both sides or on neither: the solid intersects itself or is not closed.
    """
    tags = sorted(boundary(gmsh, 3, solid))
    faces = tuple(_cad_face(gmsh, tag, names.get(tag, f"face {tag}"), 1.0) for tag in tags)
    slow = any(gmsh.model.getType(2, tag).startswith("Surface of") for tag in tags)
    volume = gmsh.model.occ.getMass(3, solid)
    if slow and abs(enclosed_volume(gmsh, faces) - volume) <= SAME_VOLUME * volume:
        return faces
    outward = []
    for face in faces:
        places = _inner_places(gmsh, face.tag, _FEWEST if slow else min(_MOST, max(1, _IN_ALL // len(faces))))
        sign = _outward_sign(gmsh, where, (solid, face), extent, places)
        outward.append(face if sign > 0 else _cad_face(gmsh, face.tag, face.name, sign))
    return tuple(outward)


def enclosed_volume(gmsh: ModuleType, faces: tuple[CadFace, ...]) -> float:
    """Volume that planes, cylinders and spheres enclose [m³], V = ⅓ ∫ x·n dA; nan if a face has another form.

    On a round face x = c + r n, so that its centroid gives ∫ n dA; OpenCASCADE's own volume is not used.
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
    """Least and greatest coordinates of faces [m]; OpenCASCADE's loose boxes of free forms are tightened by points."""
    boxes = []
    for face in faces:
        box = np.array(gmsh.model.getBoundingBox(2, face.tag)).reshape(2, 3) + _PADDING
        if face.kind == "other":
            points = places_on(gmsh, face.tag, np.linspace(0, 1, 33)).points
            box = np.stack([np.maximum(box[0], points.min(axis=0)), np.minimum(box[1], points.max(axis=0))])
        boxes.append(box)
    return np.stack([np.min(boxes, axis=0)[0], np.max(boxes, axis=0)[1]])


def _cad_face(gmsh: ModuleType, tag: int, name: str, sign: float) -> CadFace:
    """The record of one face; gmsh's normals times `sign` are the outward ones."""
    all_over = places_on(gmsh, tag, np.linspace(0, 1, 9))
    within = places_on(gmsh, tag, np.linspace(0, 1, 9)[1:-1])
    form = fitted_form(Sample(all_over.points, within.points, sign * within.normals), _ACCURACY, _SKEW)
    centroid = np.array(gmsh.model.occ.getCenterOfMass(2, tag))
    return CadFace(
        tag=tag, name=name, kind=form.kind,
        centre=centroid if form.kind in ("plane", "other") else form.centre, direction=form.direction,
        radius=form.radius, inward=form.inward, area=float(gmsh.model.occ.getMass(2, tag)),
        length=form.length, surface=gmsh.model.getType(2, tag) if form.kind == "other" else "",
        least_radius=_least_radius(gmsh, tag, within) if form.kind == "other" else np.nan,
        concave=_is_concave(within, sign) if form.kind == "other" else form.inward,
    )  # fmt: skip


def _is_concave(within: Places, sign: float) -> bool:
    """Whether the largest concave curvature along the parameters exceeds the largest convex one."""
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
    """Least radius of curvature of a face [m]; nan if it is flat."""
    bend = np.abs(gmsh.model.getPrincipalCurvatures(tag, places.at[::5].ravel())[:2]).max()
    return float(1 / bend) if bend > 0 else np.nan


def places_on(gmsh: ModuleType, tag: int, share: Float[np.ndarray, "m"]) -> Places:
    """Points at shares of both parameter ranges of a face, within it or beside it on the same surface."""
    low, high = (np.array(bound) for bound in gmsh.model.getParametrizationBounds(2, tag))
    at = low + np.stack(np.meshgrid(share, share), axis=-1).reshape(-1, 2) * (high - low)
    points = np.array(gmsh.model.getValue(2, tag, at.ravel())).reshape(-1, 3)
    return Places(at, points, np.array(gmsh.model.getNormal(tag, at.ravel())).reshape(-1, 3))


def _inner_places(gmsh: ModuleType, tag: int, most: int) -> Places:
    """A few points within a face, as far apart as a grid allows; none if it is too narrow for the finest grid."""
    for fineness in _FINENESS:
        grid = places_on(gmsh, tag, (np.arange(fineness) + _ASIDE) / fineness)
        inside = [i for i, at in enumerate(grid.at) if gmsh.model.isInside(2, tag, at, parametric=True)]
        if len(inside) >= _LEAST:
            break
    chosen = np.array(inside, dtype=int)[np.linspace(0, len(inside) - 1, min(len(inside), most)).astype(int)]
    return Places(grid.at[chosen], grid.points[chosen], grid.normals[chosen])


def _outward_sign(gmsh: ModuleType, where: str, of: tuple[int, CadFace], extent: float, inner: Places) -> float:
    """1 if gmsh's normals of a face point out of the solid, -1 if into it, from points a step to either side."""
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
            f"{where}: must be a closed solid that does not intersect itself, got a {face_form(face)} ({face.name}) with "
            f"material on {both} at {in_mm(X)}; mend the part in CAD"
        )
    return 1.0 if behind.sum() >= ahead.sum() else -1.0
