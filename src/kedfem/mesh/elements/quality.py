"""Quality of meshes: the scaled Jacobian, and the check that every link's mesh must pass."""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.errors import MeshError
from kedfem.mesh.elements.bounds import valid_everywhere
from kedfem.mesh.elements.hexahedra import Face, SolidMesh
from kedfem.mesh.elements.shape_functions import HEX8, HEX20, HEX27, NODES, TET10, shape_gradients
from kedfem.mesh.places import in_mm
from kedfem.mesh.planar.flat import QuadMesh

Mesh = TypeVar("Mesh", SolidMesh, QuadMesh)
LEAST = 0.1  # default of the least scaled Jacobian of hexahedra and quadrilaterals
_CHUNK = 2048  # elements at a time: the Jacobians of one chunk fit in a processor's cache


@dataclass(frozen=True, slots=True)
class Quality:
    """Scaled Jacobians of a mesh: 1 for a cuboid or a regular tetrahedron, at most 0 where folded or inverted.

    scaled_jacobian : (e,) least of each element [-]
    centres : (e, 3) mean of each element's nodes [m]
    """

    scaled_jacobian: Float[np.ndarray, " e"]
    centres: Float[np.ndarray, "e 3"]

    @property
    def worst(self) -> int:
        """The element with the least of all."""
        return int(np.argmin(self.scaled_jacobian))

    @property
    def centre(self) -> Float[np.ndarray, "3"]:
        """Mean of the worst element's nodes [m]."""
        return np.asarray(self.centres[self.worst])

    @property
    def least(self) -> float:
        """The scaled Jacobian of the worst element."""
        return float(self.scaled_jacobian[self.worst])

    def worst_elements(self, count: int) -> Int[np.ndarray, " c"]:
        """The worst elements, the worst first; their places are `centres` of them."""
        return np.argsort(self.scaled_jacobian, kind="stable")[:count]

    def histogram(self, bins: int = 10) -> tuple[Float[np.ndarray, " b"], Int[np.ndarray, " c"]]:
        """Edges of equal bins from 0 to 1, after one of all below 0, and the number of elements in each bin."""
        edges = np.concatenate([[-1.0], np.linspace(0, 1, bins + 1)])
        inside = np.clip(self.scaled_jacobian, -1.0, 1.0)  # rounding may pass 1
        return edges, np.histogram(inside, edges)[0].astype(np.int64)


def scaled_jacobian(points: Float[np.ndarray, "n d"], cells: Int[np.ndarray, "e k"]) -> Float[np.ndarray, " e"]:
    """Least of det J / (|J_1| ··· |J_d|) over the nodes and the Gauss points of each element, J_j = ∂X/∂ξ_j.

    For a tetrahedron it is √2 det J over the largest product of three edges that meet in a corner, edges from J.

    Parameters
    ----------
    points : (n, d) nodes, in the plane (d = 2) or in space [m]
    cells : (e, 9), (e, 8), (e, 20), (e, 27) or (e, 10) quad9, hex8, hex20, hex27 or tet10 in VTK order

    Returns
    -------
    (e,) [-]: between -1 and 1; 0 for an element without extent
    """
    nodes = NODES[cells.shape[1]]
    if len(nodes) == len(TET10):
        factor, scale, places = np.sqrt(2), _largest_corner, np.concatenate([TET10, np.full((1, 3), 0.25)])
    else:
        outer = HEX27 if len(nodes) == len(HEX20) else nodes  # its Gauss points are 3³ too
        inner = np.sqrt(3 / 5 if len(nodes) != len(HEX8) else 1 / 3)
        factor, scale, places = 1.0, _columns, np.concatenate([outer, inner * outer])
    gradients, least = shape_gradients(nodes, places), []
    for chunk in np.array_split(cells, max(1, len(cells) // _CHUNK)):
        J = np.swapaxes(np.tensordot(points[chunk], gradients, axes=(1, 1)), 1, 2)
        size = scale(J)
        least.append((factor * np.linalg.det(J) / np.where(size > 0, size, np.inf)).min(axis=1))
    return np.concatenate(least)


def _columns(J: Float[np.ndarray, "e q d d"]) -> Float[np.ndarray, "e q"]:
    """Product of the lengths of J's columns."""
    return np.asarray(np.linalg.norm(J, axis=2).prod(axis=-1))


def _largest_corner(J: Float[np.ndarray, "e q 3 3"]) -> Float[np.ndarray, "e q"]:
    """Largest product of the three edges that meet in a corner of a tetrahedron."""
    a, b, c = (J[..., j] for j in range(3))
    edge = [np.linalg.norm(v, axis=-1) for v in (a, b - a, b, c, c - a, c - b)]
    corners = [edge[i] * edge[j] * edge[k] for i, j, k in ((0, 2, 3), (0, 1, 4), (1, 2, 5), (3, 4, 5))]
    return np.asarray(np.maximum.reduce(corners))


def mesh_quality(mesh: SolidMesh | QuadMesh) -> Quality:
    """The scaled Jacobians and centres of a mesh's elements."""
    values = scaled_jacobian(mesh.points[:, : _dimension(mesh)], mesh.cells)
    return Quality(values, mesh.points[mesh.cells].mean(axis=1))


def _dimension(mesh: SolidMesh | QuadMesh) -> int:
    """2 for a mesh in a plane, 3 for one in space."""
    return 2 if isinstance(mesh, QuadMesh) else 3


def checked_mesh(where: str, mesh: Mesh, min_quality: float | None) -> Mesh:
    """The mesh itself, checked: scaled Jacobian at the nodes and Gauss points, det J > 0 everywhere.

    Parameters
    ----------
    where : the mesh's link, for messages: ``links.rod``
    min_quality : least scaled Jacobian [-]; None for LEAST, or 0 for tetrahedra

    Raises
    ------
    MeshError
        An element is inverted, folded or of less quality.
    """
    quality = mesh_quality(mesh)
    if min_quality is None:
        min_quality = 0.0 if isinstance(mesh, SolidMesh) and mesh.tetrahedra else LEAST
    if quality.least <= 0:
        mirrored = bool((quality.scaled_jacobian < 0).all())
        cure = "the order of their nodes is mirrored" if mirrored else "refine the mesh or mend the mesh file"
        raise MeshError(
            f"{where}: elements must not be inverted or folded, "
            f"got scaled Jacobian {quality.least:.3g} {_place(mesh, quality, quality.worst, 0.0)}; {cure}"
        )
    if quality.least < min_quality:
        raise MeshError(
            f"{where}: scaled Jacobian must be at least {min_quality:g} everywhere, "
            f"got {quality.least:.3g} {_place(mesh, quality, quality.worst, min_quality)}; "
            f"refine the mesh (mesh.size, mesh.elements_across), {_change(mesh)}, or lower min_quality"
        )
    folded = np.flatnonzero(~valid_everywhere(mesh.points[:, : _dimension(mesh)], mesh.cells))
    if len(folded):
        worst = int(folded[np.argmin(quality.scaled_jacobian[folded])])
        raise MeshError(
            f"{where}: elements must not be inverted or folded anywhere, got det J that is not positive between "
            f"the nodes {_place(mesh, quality, worst, 0.0)}; refine the mesh (mesh.size, mesh.elements_across) "
            "or mend the mesh file"
        )
    return mesh


def _place(mesh: SolidMesh | QuadMesh, quality: Quality, element: int, limit: float) -> str:
    """Place of an element, the nearest face, and how many other elements are below the limit."""
    words = f"in element {element} at {in_mm(quality.centres[element])}"
    if isinstance(mesh, SolidMesh) and mesh.faces:
        words += f" near {_described(_nearest_face(mesh, quality.centres[element]))}"
    others = [other for other in quality.worst_elements(4) if other != element][:3]
    others = [other for other in others if quality.scaled_jacobian[other] < limit]
    count = int((quality.scaled_jacobian < limit).sum()) - 1
    if not others:
        return words
    places = ", ".join(in_mm(quality.centres[other]) for other in others)
    return f"{words} and {count} more, as at {places}"


def _nearest_face(mesh: SolidMesh, place: Float[np.ndarray, "3"]) -> Face:
    """The named face with the node nearest to a place."""
    squares = [((mesh.points[face.sides] - place) ** 2).sum(axis=2) for face in mesh.faces]
    return mesh.faces[int(np.argmin([square.min(initial=np.inf) for square in squares]))]


def _described(face: Face) -> str:
    """A face in words."""
    if face.words:
        return f"the {face.words} ({face.name})"
    if not np.isfinite(face.radius):
        return f"{face.name}, a plane" if face.kind == "plane" else face.name
    return f"{face.name}, a {face.kind} of radius {1e3 * face.radius:.3g} mm"


def _change(mesh: SolidMesh | QuadMesh) -> str:
    """Advice for the shape where elements are bad."""
    named = isinstance(mesh, SolidMesh) and mesh.faces
    return "suppress a fillet or small feature there" if named else "change the shape there"
