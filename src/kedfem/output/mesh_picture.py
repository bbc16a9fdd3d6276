"""Pictures of meshes: elements coloured by quality, with a histogram."""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.links.surfaces.part_candidates import PartCandidate
from kedfem.mesh import SolidMesh, mesh_quality
from kedfem.mesh.cad.sides import owned_sides
from kedfem.mesh.elements.shape_functions import QUAD9, TRI6, shape_functions
from kedfem.mesh.elements.tetrahedra import FORMS
from kedfem.output.picture import draw_in_process

FINENESS = 4  # straight segments for a side of an element


@dataclass(frozen=True, slots=True)
class MeshSurface:
    """The surface of a mesh for VTK.

    points : (n, 3) [m]
    patches : (p, 4) small quadrilaterals
    values : (p,) scaled Jacobian of each patch's element [-]
    lines : (l, FINENESS + 1) edges of elements
    """

    points: Float[np.ndarray, "n 3"]
    patches: Int[np.ndarray, "p 4"]
    values: Float[np.ndarray, " p"]
    lines: Int[np.ndarray, "l k"]


def mesh_surface(mesh: SolidMesh) -> MeshSurface:
    """The curved outer sides of the elements in small patches; those of triangular sides end in a point."""
    full = FORMS["hex27"](mesh)
    quality = mesh_quality(mesh).scaled_jacobian
    sides, owners = owned_sides(full.cells)
    k = FINENESS + 1
    r = np.linspace(0, 1, k)
    places = np.stack(np.meshgrid(r, r, indexing="ij"), axis=-1).reshape(-1, 2)
    at = np.arange(k * k).reshape(k, k)
    square = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1).reshape(-1, 4)
    rim = np.stack([at[0], at[-1], at[:, 0], at[:, -1]])
    if full.tetrahedra:
        functions = shape_functions(TRI6, np.stack([places[:, 0], places[:, 1] * (1 - places[:, 0])], axis=1))
        rim = np.stack([at[0], at[:, 0], at[:, -1]])
    else:
        functions = shape_functions(QUAD9, 2 * places - 1)
    points = (functions @ full.points[sides]).reshape(-1, 3)
    start = k * k * np.arange(len(sides))[:, None, None]
    patches, lines = (start + square).reshape(-1, 4), (start + rim).reshape(-1, k)
    return MeshSurface(points, patches, np.repeat(quality[owners], FINENESS**2), lines)


def write_mesh_picture(
    meshes: Sequence[tuple[str, SolidMesh]], png: Path, title: str, found: Sequence[PartCandidate] = ()
) -> None:
    """Draw meshes side by side, or a single one with the histogram of its quality.

    Parameters
    ----------
    meshes : caption and mesh of each
    found : faces of the first mesh that get numbers

    Raises
    ------
    OutputError
        VTK cannot draw here, or the PNG cannot be written.
    """
    arrays: dict[str, np.ndarray] = {"title": np.array(title)}
    for i, (words, mesh) in enumerate(meshes):
        each = mesh_surface(mesh)
        arrays |= {f"words{i}": np.array(words), f"quality{i}": mesh_quality(mesh).scaled_jacobian}
        arrays |= {f"{key}{i}": getattr(each, key) for key in ("points", "patches", "values", "lines")}
    if found:
        arrays |= _numbers(meshes[0][1], found)
    with tempfile.TemporaryDirectory() as folder:
        given = Path(folder) / "meshes.npz"
        np.savez(given, allow_pickle=False, **arrays)
        draw_in_process("mesh_rendering.py", (given, Path(png)), (len(meshes),), "the mesh: must be one")


def _numbers(mesh: SolidMesh, found: Sequence[PartCandidate]) -> dict[str, np.ndarray]:
    """Possible positions and normals of the numbers of faces: one on a plane, else one on each element side."""
    places, numbers, normals = [], [], []
    for each in found:
        plane = each.kind == "plane"
        at = each.at[None] if plane else mesh.points[each.face.sides].mean(axis=1)
        places.append(at)
        numbers.append(np.full(len(at), each.number))
        normals.append(np.broadcast_to(each.face.direction if plane else np.zeros(3), at.shape))
    labels = {"places": places, "numbers": numbers, "normals": normals}
    return {f"label_{what}": np.concatenate(each) for what, each in labels.items()}
