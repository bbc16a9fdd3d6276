"""Quality of meshes: the scaled Jacobian, and the gate that a link's mesh must pass."""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from jaxtyping import Float, Int

from kedfem.errors import MeshError
from kedfem.mesh.flat import QuadMesh
from kedfem.mesh.hexahedra import HEX8, HEX27, QUAD9, HexMesh, shape_gradients

Mesh = TypeVar("Mesh", HexMesh, QuadMesh)
_CHUNK = 2048  # elements at a time: the Jacobians of one chunk fit in a processor's cache


@dataclass(frozen=True, slots=True)
class Quality:
    """Scaled Jacobians of a mesh: 1 for a cuboid, at most 0 for an element that is folded or inverted.

    Attributes
    ----------
    scaled_jacobian : (e,) [-]
        Least of each element.
    worst : int
        The element with the least of all.
    centre : (3,) [m]
        Mean of the worst element's nodes.
    """

    scaled_jacobian: Float[np.ndarray, " e"]
    worst: int
    centre: Float[np.ndarray, "3"]

    @property
    def least(self) -> float:
        """The scaled Jacobian of the worst element."""
        return float(self.scaled_jacobian[self.worst])


def scaled_jacobian(
    points: Float[np.ndarray, "n d"], cells: Int[np.ndarray, "e k"]
) -> Float[np.ndarray, " e"]:
    """Least of det J / (|J_1| ··· |J_d|) over the nodes and the Gauss points of each element, J_j = ∂X/∂ξ_j.

    Parameters
    ----------
    points : (n, d) [m]
        Nodes, in the plane (d = 2) or in space.
    cells : (e, 9), (e, 8) or (e, 27)
        quad9, hex8 or hex27 in VTK order.

    Returns
    -------
    (e,) [-]
        Between -1 and 1; 0 where an element has no extent.
    """
    nodes = {len(kind): kind for kind in (QUAD9, HEX8, HEX27)}[cells.shape[1]]
    inner = np.sqrt(3 / 5 if len(nodes) != len(HEX8) else 1 / 3)
    gradients = shape_gradients(nodes, np.concatenate([nodes, inner * nodes]))
    chunks = np.array_split(cells, max(1, len(cells) // _CHUNK))
    return np.concatenate([_scaled_determinants(points[chunk], gradients).min(axis=1) for chunk in chunks])


def _scaled_determinants(
    corners: Float[np.ndarray, "e k d"], gradients: Float[np.ndarray, "q k d"]
) -> Float[np.ndarray, "e q"]:
    """det J over the product of the lengths of its columns, at each place of each element."""
    J = np.swapaxes(np.tensordot(corners, gradients, axes=(1, 1)), 1, 2)
    lengths = np.linalg.norm(J, axis=2).prod(axis=-1)
    determinants = np.linalg.det(J)
    return np.asarray(determinants / np.where(lengths > 0, lengths, np.inf))


def mesh_quality(mesh: HexMesh | QuadMesh) -> Quality:
    """The scaled Jacobians of a mesh and its worst element."""
    values = scaled_jacobian(mesh.points[:, : 2 if isinstance(mesh, QuadMesh) else 3], mesh.cells)
    worst = int(np.argmin(values))
    return Quality(values, worst, mesh.points[mesh.cells[worst]].mean(axis=0))


def checked_mesh(name: str, mesh: Mesh, min_quality: float) -> Mesh:
    """The mesh itself, if it is good enough.

    Raises
    ------
    MeshError
        The worst element, where it is, and what to change.
    """
    quality = mesh_quality(mesh)
    x, y, z = quality.centre
    where = f"in element {quality.worst} at ({x:.6g}, {y:.6g}, {z:.6g})"
    if quality.least <= 0:
        mirrored = bool((quality.scaled_jacobian < 0).all())
        cure = "the order of their nodes is mirrored" if mirrored else "refine the mesh or mend the mesh file"
        raise MeshError(
            f"links.{name}: elements must not be inverted or folded, "
            f"got scaled Jacobian {quality.least:.3g} {where}; {cure}"
        )
    if quality.least < min_quality:
        raise MeshError(
            f"links.{name}: scaled Jacobian must be at least {min_quality:g} everywhere, "
            f"got {quality.least:.3g} {where}; refine the mesh (mesh.size, mesh.elements_across), "
            "change the shape there, or lower min_quality"
        )
    return mesh
