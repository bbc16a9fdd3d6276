"""Named sets of sides and of nodes in mesh files, as faces of a mesh."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float, Int

from kedfem.mesh.cad.forms import Sample, fitted_form
from kedfem.mesh.cad.sides import boundary_sides, side_corners, side_normals
from kedfem.mesh.elements.hexahedra import Face
from kedfem.mesh.files.mixed import triangles
from kedfem.mesh.files.raw import RawMesh

_ACCURACY = (
    2e-3  # of nodes, in sizes of the group: numbers in a file may be few, a circle of chords is not round
)
_SKEW = 0.05  # of the sides' normals: a sine


def named_faces(
    raw: RawMesh, points: Float[np.ndarray, "n 3"], cells: Int[np.ndarray, "e k"]
) -> tuple[Face, ...]:
    """The sets of sides and nodes in a mesh file that lie on the outside of its elements, in the order of their names.

    Sets without a side on the outside are left out; of a set of nodes the sides all of whose corners are in it.

    Parameters
    ----------
    raw : as it was read
    points : (n, 3) all nodes, the file's first [m]
    cells : (e, 8), (e, 20), (e, 27), (e, 4) or (e, 10) the elements; their corners have the file's numbers
    """
    sides = boundary_sides(cells)
    corners = np.sort(sides[:, : side_corners(sides.shape[1])], axis=1)
    keys = {tuple(each): i for i, each in enumerate(corners.tolist())}
    faces = []
    for name, found in _sets(raw, corners):
        on = {keys.get(tuple(each), -1) for each in np.sort(found, axis=1).tolist()} - {-1}
        if on:
            faces.append(group_face(name, points, sides[sorted(on)]))
    return tuple(faces)


def group_face(name: str, points: Float[np.ndarray, "n 3"], sides: Int[np.ndarray, "f m"]) -> Face:
    """The face that some sides of elements are, its form fitted to their nodes and normals.

    Parameters
    ----------
    name : of the group
    points : (n, 3) nodes [m]
    sides : (f, 4), (f, 8), (f, 9), (f, 3) or (f, 6) nodes of the sides, in the order of quad9 or tri6, seen from
        outside
    """
    places, normals, areas = side_normals(points, sides)
    form = fitted_form(Sample(points[np.unique(sides)], places, normals), _ACCURACY, _SKEW)
    centroid = areas @ places / areas.sum()
    centre = centroid if form.kind in ("plane", "other") else form.centre
    return Face(
        name,
        form.kind,
        centre,
        form.direction,
        form.radius,
        form.inward,
        sides[:, : side_corners(sides.shape[1])],
    )


def _sets(raw: RawMesh, corners: Int[np.ndarray, "f c"]) -> Iterator[tuple[str, Int[np.ndarray, "q c"]]]:
    """Each set's name and corners of its sides, divided into triangles where the elements' are."""
    count = corners.shape[1]
    for name in sorted(raw.sides.keys() | raw.nodes.keys()):
        if name in raw.sides:
            each = [triangles(x) if (count, x.shape[1]) == (3, 4) else x for x in raw.sides[name]]
            fitting = [x for x in each if x.shape[1] == count]
            if fitting:
                yield name, np.concatenate(fitting)
        else:
            yield name, corners[np.isin(corners, raw.nodes[name]).all(axis=1)]
