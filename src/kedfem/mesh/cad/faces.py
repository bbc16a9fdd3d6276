"""The faces of a mesh: the face of the CAD solid on which each element side of the surface lies."""

from dataclasses import dataclass, replace
from types import ModuleType

import numpy as np

from kedfem.arrays import Bool, Float, Int
from kedfem.mesh.cad.sides import boundary_sides, side_normals
from kedfem.mesh.cad.solids import CadFace, Solid
from kedfem.mesh.cad.words import face_form
from kedfem.mesh.elements.hexahedra import Face, SolidMesh
from kedfem.mesh.session import boundary, connected_groups

_FLAT = 1e-7  # distance, in sizes of the solid, within which a side lies in a plane
_ALIKE = 1e-5  # difference, in radii, within which two cylinders or spheres are the same
# in sizes of the side: a face farther away than the nearest by less may be the right one, if the nearest ends before
_NEARLY = 0.1


def with_faces(gmsh: ModuleType, solid: Solid, mesh: SolidMesh) -> SolidMesh:
    """The mesh with the faces of its solid, unless it has faces already.

    Each side on the surface belongs to exactly one face. Parts of one cylinder or sphere that meet in a seam are one
    face. A face without a side, because it is narrower than an element, is left out.

    Parameters
    ----------
    gmsh : with the solid in its model
    solid : its faces, in metres
    mesh : in the solid's own frame; nodes of the surface may be off the faces by the sag of a curved element
    """
    if mesh.faces:
        return mesh
    sides = boundary_sides(mesh.cells)
    of_face = _nearest_faces(gmsh, solid, mesh.points, sides)
    of_tag = {face.tag: sides[of_face == i, :4] for i, face in enumerate(solid.faces)}
    return replace(mesh, faces=joined_faces(gmsh, solid, of_tag))


def joined_faces(gmsh: ModuleType, solid: Solid, sides: dict[int, Int[np.ndarray, "_ c"]]) -> tuple[Face, ...]:
    """The faces of a mesh, from the corners of the sides on each face of its solid; faces of one surface are joined."""
    found = []
    for group in faces_by_surface(gmsh, solid):
        found.append(_face(solid, group, np.concatenate([sides[solid.faces[i].tag] for i in group])))
    return tuple(face for face in found if len(face.sides))


def _face(solid: Solid, group: list[int], sides: Int[np.ndarray, "f c"]) -> Face:
    """The face that joins some of a solid's faces, which are parts of one surface."""
    parts = [solid.faces[i] for i in group]
    first = parts[0]
    centre = first.centre
    if first.kind == "cylinder":
        centre = centre + sum(axial_bounds(parts)) / 2 * first.direction
    form = first.kind, centre, first.direction, first.radius, first.inward
    return Face(first.name, *form, sides, words=face_form(first))


def axial_bounds(parts: list[CadFace]) -> tuple[float, float]:
    """Least and greatest place along the axis of faces on one cylinder [m], from the centre of the first."""
    along = np.array([(face.centre - parts[0].centre) @ parts[0].direction for face in parts])
    half = np.array([face.length for face in parts]) / 2
    return float((along - half).min()), float((along + half).max())


def faces_by_surface(gmsh: ModuleType, solid: Solid) -> list[list[int]]:
    """Indices of faces in groups: those that lie on one cylinder or sphere, share an edge and have one name or none."""
    edges = [boundary(gmsh, 2, face.tag) for face in solid.faces]
    return connected_groups(edges, lambda i, j: _same_surface(solid.faces[i], solid.faces[j]))


def _same_surface(a: CadFace, b: CadFace) -> bool:
    """Whether two faces are parts of one cylinder or sphere."""
    unnamed = all(face.name == f"face {face.tag}" for face in (a, b))
    if not (unnamed or a.name == b.name) or a.kind != b.kind or a.kind not in ("cylinder", "sphere"):
        return False
    slack = _ALIKE * a.radius
    if a.inward != b.inward or abs(a.radius - b.radius) > slack:
        return False
    apart = b.centre - a.centre
    if a.kind == "cylinder":
        if np.linalg.norm(np.cross(a.direction, b.direction)) > _ALIKE * 10:
            return False
        apart = np.cross(apart, a.direction)
    return bool(np.linalg.norm(apart) <= 10 * slack)


@dataclass(frozen=True, slots=True)
class _Sides:
    """Sides of elements: nodes (f, m, 3) [m], middles (f, 3), outward normals (f, 3), sizes (f,) [m]."""

    nodes: Float[np.ndarray, "f m 3"]
    middles: Float[np.ndarray, "f 3"]
    normals: Float[np.ndarray, "f 3"]
    sizes: Float[np.ndarray, "f"]

    def chosen(self, which: Bool[np.ndarray, "f"] | Int[np.ndarray, "g"]) -> "_Sides":
        """The sides that a mask or indices select."""
        return _Sides(self.nodes[which], self.middles[which], self.normals[which], self.sizes[which])


def _nearest_faces(
    gmsh: ModuleType, solid: Solid, points: Float[np.ndarray, "n 3"], sides: Int[np.ndarray, "f m"]
) -> Int[np.ndarray, "f"]:
    """For each side the index of the nearest face; of equally near faces the one whose edges it lies within."""
    middles, normals, areas = side_normals(points, sides)
    all_sides = _Sides(points[sides], middles, normals, np.sqrt(areas))
    far = np.full((len(sides), len(solid.faces)), np.inf)
    for i, face in enumerate(solid.faces):
        near = _in_box(gmsh, face, all_sides)
        far[near, i] = _distances(gmsh, face, all_sides.chosen(near))
    nearest = far.argmin(axis=1)
    flat = _FLAT * solid.extent
    slack = np.maximum(flat, _NEARLY * all_sides.sizes * (far.min(axis=1) > flat))
    rivals = far <= (far.min(axis=1) + slack)[:, None]
    lost = ~np.isfinite(far).any(axis=1)
    rivals[lost] = True
    for side in np.flatnonzero(rivals.sum(axis=1) > 1):
        nearest[side] = _closest(gmsh, solid, np.flatnonzero(rivals[side]), middles[side], normals[side])
    return np.asarray(nearest)


def _in_box(gmsh: ModuleType, face: CadFace, sides: _Sides) -> Bool[np.ndarray, "f"]:
    """Whether all nodes of a side are in the bounding box of a face, widened by a part of the side's size."""
    box = np.array(gmsh.model.getBoundingBox(2, face.tag))
    margin = 0.2 * sides.sizes[:, None]
    low, high = sides.nodes.min(axis=1), sides.nodes.max(axis=1)
    return np.asarray(((low >= box[:3] - margin) & (high <= box[3:] + margin)).all(axis=1))


def _distances(gmsh: ModuleType, face: CadFace, sides: _Sides) -> Float[np.ndarray, "f"]:
    """Largest distance of a side's nodes from a face's surface [m], plus the side's size if it faces the other way."""
    X = sides.nodes
    match face.kind:
        case "plane":
            far = np.abs((X - face.centre) @ face.direction)
            facing = sides.normals @ face.direction
        case "cylinder" | "sphere":
            radial, outside = X - face.centre, sides.middles - face.centre
            if face.kind == "cylinder":
                radial = radial - (radial @ face.direction)[..., None] * face.direction
                outside = outside - (outside @ face.direction)[:, None] * face.direction
            far = np.abs(np.linalg.norm(radial, axis=-1) - face.radius)
            facing = np.einsum("fc,fc->f", sides.normals, outside) * (-1 if face.inward else 1)
        case _:
            far, facing = _projected(gmsh, face.tag, X), np.ones(len(X))
    return np.asarray(far.max(axis=1) + np.where(facing > 0, 0.0, sides.sizes))


def _projected(gmsh: ModuleType, tag: int, X: Float[np.ndarray, "f m 3"]) -> Float[np.ndarray, "f m"]:
    """Distances of points from a free-form surface [m]; points that sides share are projected once."""
    if not len(X):
        return np.zeros(X.shape[:2])
    places, back = np.unique(X.reshape(-1, 3), axis=0, return_inverse=True)
    on = np.array(gmsh.model.getClosestPoint(2, tag, places.ravel())[0]).reshape(-1, 3)
    return np.asarray(np.linalg.norm(on - places, axis=1)[back].reshape(X.shape[:2]))


def _closest(
    gmsh: ModuleType,
    solid: Solid,
    rivals: Int[np.ndarray, "r"],
    middle: Float[np.ndarray, "3"],
    normal: Float[np.ndarray, "3"],
) -> int:
    """Of some equally near faces the one within which the projected middle of a side lies and whose normal fits."""
    best, least = int(rivals[0]), np.inf
    for i in rivals:
        tag = solid.faces[i].tag
        on, at = gmsh.model.getClosestPoint(2, tag, middle)
        within = gmsh.model.isInside(2, tag, at, parametric=True) > 0
        away = float(np.linalg.norm(np.array(on) - middle))
        if not within:
            away += edge_distance(gmsh, tag, middle)
        away += (1 - abs(np.array(gmsh.model.getNormal(tag, at)) @ normal)) * 1e-3 * solid.extent
        if away < least:
            best, least = int(i), away
    return best


def edge_distance(gmsh: ModuleType, tag: int, place: Float[np.ndarray, "3"]) -> float:
    """Distance of a point from the edges of a face [m]."""
    on = [gmsh.model.getClosestPoint(1, edge, place)[0] for edge in boundary(gmsh, 2, tag)]
    return min((float(np.linalg.norm(np.array(X) - place)) for X in on), default=0.0)
