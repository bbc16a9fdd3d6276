"""Plates: plane meshes of quadrilaterals with a thickness and a place in the scene."""

from dataclasses import dataclass, replace

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.mesh.elements.hexahedra import SolidMesh, extruded, freeze_arrays, placed
from kedfem.mesh.planar.areas import Quads


@dataclass(frozen=True, slots=True)
class QuadMesh:
    """A mesh of quadrilaterals in a plane z = constant, every node used; the arrays are read-only copies.

    points : (n, 3) nodes in the global reference position [m]
    cells : (e, 9) node numbers in VTK order, anticlockwise (meshio: quad9)
    thickness : extent along z, half of it to either side [m]
    method : how it was made, for reports
    """

    points: Float[np.ndarray, "n 3"]
    cells: Int[np.ndarray, "e 9"]
    thickness: float
    method: str = ""

    def __post_init__(self) -> None:
        freeze_arrays(self)


@dataclass(frozen=True, slots=True)
class Plate:
    """A plate in a frame of its own, its middle plane at z = 0.

    quads : (n, 2) [m] and (e, 9): nodes and cells of the middle plane, all nodes used
    thickness : extent along z [m]
    origin, axes : (3,) [m], (3, 3) [-] place of the frame in the scene, and its x, y, z axes as rows
    method : how its mesh was made, for reports
    """

    quads: Quads
    thickness: float
    origin: Float[np.ndarray, "3"]
    axes: Float[np.ndarray, "3 3"]
    method: str = ""


def swept_mesh(plate: Plate, layers: int) -> SolidMesh:
    """hex27 mesh of a plate with `layers` elements through its thickness."""
    mesh = replace(extruded(*plate.quads, plate.thickness, layers), method=plate.method)
    return placed(mesh, plate.origin, plate.axes)


def middle_mesh(plate: Plate) -> QuadMesh:
    """quad9 mesh of a plate's middle plane."""
    points, cells = plate.quads
    return QuadMesh(plate.origin + points @ plate.axes[:2], cells, plate.thickness, plate.method)
