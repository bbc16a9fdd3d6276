"""Smaller tetrahedra at the fillets and free bores of a solid, where stress is highest."""

from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType

import numpy as np

from kedfem.mesh.cad.solids import AROUND, USUAL, CadFace, Sizing, Solid
from kedfem.mesh.session import boundary, gmsh_options

_FINEST = 4.0  # the least size elsewhere over the least one here


@contextmanager
def finer_hollows(gmsh: ModuleType, solid: Solid, sizing: Sizing, turn: float, finest: float) -> Iterator[None]:
    """For a while gmsh's elements turn by the sizing's `hollow` along hollow faces, elsewhere as by its own options.

    gmsh knows one angle and one least size for all faces. What it asks for is the radius of curvature times that angle;
    here it is scaled where a face or an edge of it is hollow, and kept from the least size elsewhere.

    Parameters
    ----------
    gmsh : with the solid, and with the options of a mesh
    turn : by which elements turn along all faces with these options [rad]
    finest : their least size [m]
    """
    tags = free_hollows(solid, sizing)
    if sizing.hollow >= USUAL or not tags:
        yield
        return
    hollow = {(2, tag) for tag in tags} | {(1, tag) for tag in boundary(gmsh, 2, *tags)}

    def wanted(dimension: int, tag: int, x: float, y: float, z: float, size: float) -> float:
        if (dimension, tag) in hollow:
            return size * sizing.hollow / turn
        return max(size, finest) if dimension < 3 else size

    gmsh.model.mesh.setSizeCallback(wanted)
    try:
        with gmsh_options(gmsh, {"Mesh.MeshSizeMin": finest / _FINEST}):
            yield
    finally:
        gmsh.model.mesh.removeSizeCallback()


def free_hollows(solid: Solid, sizing: Sizing) -> frozenset[int]:
    """Tags of the fillets, and of the bores and ball seats that no joint or load is in."""
    return frozenset(face.tag for face in solid.faces if face.hollow and not _in_use(face, sizing))


def _in_use(face: CadFace, sizing: Sizing) -> bool:
    """Whether a place where a joint or load is sits in a bore or ball seat."""
    if face.kind not in ("cylinder", "sphere") or not sizing.kept:
        return False
    away = np.array(sizing.kept) - face.centre
    if face.kind == "cylinder":
        away = away - (away @ face.direction)[:, None] * face.direction
    return bool((np.linalg.norm(away, axis=1) <= AROUND * face.radius).any())
