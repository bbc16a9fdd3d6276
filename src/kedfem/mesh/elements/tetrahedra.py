"""Conversion of a mesh to 8-, 20- or 27-node hexahedra or 10-node tetrahedra; straightening of folded elements."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from kedfem.arrays import Bool, Float, Int
from kedfem.mesh.cad.sides import boundary_sides
from kedfem.mesh.elements.bounds import valid_everywhere
from kedfem.mesh.elements.hexahedra import SolidMesh, linear, quadratic, serendipity, without_unused_nodes
from kedfem.mesh.elements.mixed import tetrahedra, triangles
from kedfem.mesh.elements.quality import scaled_jacobian
from kedfem.mesh.elements.shape_functions import EDGES, TET10

# shares by which edges of bad elements are straightened, those of folded ones up to the whole
_BLENDS = (0.4, 0.7, 1.0)


def unfolded(
    points: Float[np.ndarray, "n 3"], cells: Int[np.ndarray, "e 10"], least: float
) -> Float[np.ndarray, "n 3"] | None:
    """The nodes with edges straightened where elements are bad, until none is folded; None if straight ones are folded.

    An element with straight edges is valid if its corners are, so that the iteration ends.

    Parameters
    ----------
    least : scaled Jacobian below which an element is bad [-]
    """
    bent, straight = points, points.copy()
    straight[cells[:, 4:]] = edge_middles(points, cells)
    moved = np.zeros(len(points))
    for _ in range(len(_BLENDS) * len(EDGES)):
        folded = ~valid_everywhere(points, cells)
        bad = scaled_jacobian(points, cells) < least
        nodes = np.union1d(cells[folded, 4:], cells[bad, 4:][moved[cells[bad, 4:]] < _BLENDS[-2]])
        if not len(nodes):
            return points
        if (moved[nodes] == 1.0).all():
            return None
        moved[nodes] = _next(moved[nodes])
        points = bent + moved[:, None] * (straight - bent)
    return None


def _next(blend: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """The next larger one of the shares."""
    step: Bool[np.ndarray, "b n"] = np.array(_BLENDS)[:, None] > blend
    return np.where(step.any(axis=0), np.array(_BLENDS)[step.argmax(axis=0)], 1.0)


def tetrahedral(mesh: SolidMesh) -> SolidMesh:
    """10-node tetrahedra: six for each hexahedron, through its 27 nodes; 4-node tetrahedra get straight edges.

    Sides are divided from their corner of least number, so that neighbours agree.
    """
    if mesh.cells.shape[1] == len(TET10):
        return mesh
    corners = 4 if mesh.tetrahedra else 8
    points, cells = tetrahedra(mesh.points, {corners: [mesh.cells]})
    divided = (replace(face, sides=_split(mesh.cells[:, :8], face.sides)) for face in mesh.faces)
    faces = mesh.faces if mesh.tetrahedra else tuple(divided)
    return without_unused_nodes(replace(mesh, points=points, cells=cells, faces=faces))


def edge_middles(points: Float[np.ndarray, "n 3"], cells: Int[np.ndarray, "e k"]) -> Float[np.ndarray, "e 6 3"]:
    """Middles of the straight edges of tetrahedra [m]."""
    return np.asarray(points[cells[:, EDGES]].mean(axis=2))


def _split(corners: Int[np.ndarray, "e 8"], sides: Int[np.ndarray, "f 4"]) -> Int[np.ndarray, "g 3"]:
    """The triangles of some sides on the surface of hexahedra."""
    outer = boundary_sides(corners)
    wanted = {tuple(side) for side in np.sort(sides, axis=1).tolist()}
    found = np.array([tuple(side) in wanted for side in np.sort(outer, axis=1).tolist()], dtype=bool)
    return triangles(outer[found])


def _hexahedra(form: Callable[[SolidMesh], SolidMesh]) -> Callable[[SolidMesh], SolidMesh]:
    """A conversion of hexahedra that leaves tetrahedra as they are, with 10 nodes."""
    return lambda mesh: tetrahedral(mesh) if mesh.tetrahedra else form(mesh)


#: The conversion of a mesh to each element.
FORMS: dict[str, Callable[[SolidMesh], SolidMesh]] = {
    "hex8": _hexahedra(linear),
    "hex20": _hexahedra(serendipity),
    "hex27": _hexahedra(quadratic),
    "tet10": tetrahedral,
}
