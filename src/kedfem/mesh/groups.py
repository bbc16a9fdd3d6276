"""Named groups of faces in mesh files: what meshio reads as physical groups or sets of sides."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from kedfem.mesh.cad.forms import Sample, fitted_form
from kedfem.mesh.cad.sides import boundary_sides, side_corners, side_normals
from kedfem.mesh.hexahedra import Face

_ACCURACY = (
    2e-3  # of nodes, in sizes of the group: numbers in a file may be few, a circle of chords is not round
)
_SKEW = 0.05  # of the sides' normals: a sine
_PHYSICAL = "gmsh:physical"


def named_faces(
    raw: Any, points: Float[np.ndarray, "n 3"], cells: Int[np.ndarray, "e k"]
) -> tuple[Face, ...]:
    """The groups of quadrilaterals or triangles in a mesh file that lie on the outside of its elements.

    Parameters
    ----------
    raw : meshio.Mesh
        As it was read.
    points : (n, 3) [m]
        All nodes of the file.
    cells : (e, 8), (e, 20), (e, 27), (e, 4) or (e, 10)
        The elements, with the file's numbers of nodes.

    Returns
    -------
    tuple of Face
        With the file's numbers of nodes; groups without a side on the outside are left out.
    """
    sides = boundary_sides(cells)
    corners = side_corners(sides.shape[1])
    keys = {tuple(each): i for i, each in enumerate(np.sort(sides[:, :corners], axis=1).tolist())}
    faces = []
    for name, found in _groups(raw, corners):
        on = {keys.get(tuple(each), -1) for each in np.sort(found, axis=1).tolist()} - {-1}
        if on:
            faces.append(group_face(name, points, sides[sorted(on)]))
    return tuple(faces)


def group_face(name: str, points: Float[np.ndarray, "n 3"], sides: Int[np.ndarray, "f m"]) -> Face:
    """The face that some sides of elements are, its form fitted to their nodes and normals.

    Parameters
    ----------
    name : str
        Of the group.
    points : (n, 3) [m]
        Nodes.
    sides : (f, 4), (f, 8), (f, 9), (f, 3) or (f, 6)
        Nodes of the sides, in the order of quad9 or tri6, seen from outside.
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


def _groups(raw: Any, count: int) -> Iterator[tuple[str, Int[np.ndarray, "q c"]]]:
    """Each group's name and the corners of its sides of so many, in the order of the names."""
    found: dict[str, list[Int[np.ndarray, "q c"]]] = {}
    names = {int(number): name for name, (number, dim) in raw.field_data.items() if dim == 2}
    for i, block in enumerate(raw.cells):
        if not block.type.startswith("quad" if count == 4 else "triangle"):
            continue
        corners = np.asarray(block.data)[:, :count].astype(np.int64)
        if _PHYSICAL in raw.cell_data:
            numbers = np.asarray(raw.cell_data[_PHYSICAL][i]).astype(int)
            for number in np.unique(numbers[numbers > 0]).tolist():
                name = names.get(number, f"group {number}")
                found.setdefault(name, []).append(corners[numbers == number])
        for name, members in raw.cell_sets.items():
            on = members[i] if i < len(members) else None
            if on is not None and len(on) and not name.startswith("gmsh:") and name not in names.values():
                found.setdefault(name, []).append(corners[np.asarray(on).astype(np.int64)])
    return ((name, np.concatenate(found[name])) for name in sorted(found))
