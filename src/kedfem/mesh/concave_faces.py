"""Smaller tetrahedra at the fillets and free bores of a solid, where stress is highest."""

from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType

import numpy as np

from kedfem.mesh.cad.solids import AROUND, USUAL_ANGLE, CadFace, Sizing, Solid
from kedfem.mesh.session import boundary, gmsh_options

_FINEST = 4.0  # ratio of the least size elsewhere to that at concave faces


@contextmanager
def finer_concave_faces(gmsh: ModuleType, solid: Solid, sizing: Sizing, turn: float, finest: float) -> Iterator[None]:
    """Within the context gmsh's elements turn by `concave_angle` along concave faces, elsewhere as its options say.

    gmsh has one angle and one least size for all faces; its sizes are the radius of curvature times that angle. They are
    scaled here on concave faces and their edges, and limited to the least size elsewhere.

    Parameters
    ----------
    gmsh : with the solid, and with the options of a mesh
    turn : angle of elements along all faces under these options [rad]
    finest : their least size [m]
    """
    tags = free_concave_faces(solid, sizing)
    if sizing.concave_angle >= USUAL_ANGLE or not tags:
        yield
        return
    concave = {(2, tag) for tag in tags} | {(1, tag) for tag in boundary(gmsh, 2, *tags)}

    def wanted(dimension: int, tag: int, x: float, y: float, z: float, size: float) -> float:
        if (dimension, tag) in concave:
            return size * sizing.concave_angle / turn
        return max(size, finest) if dimension < 3 else size

    gmsh.model.mesh.setSizeCallback(wanted)
    try:
        with gmsh_options(gmsh, {"Mesh.MeshSizeMin": finest / _FINEST}):
            yield
    finally:
        gmsh.model.mesh.removeSizeCallback()


def free_concave_faces(solid: Solid, sizing: Sizing) -> frozenset[int]:
    """Tags of the fillets, and of the bores and ball seats that contain no joint or load."""
    return frozenset(face.tag for face in solid.faces if face.concave and not _in_use(face, sizing))


def _in_use(face: CadFace, sizing: Sizing) -> bool:
    """Whether a joint or load is in a bore or ball seat."""
    if face.kind not in ("cylinder", "sphere") or not sizing.kept_points:
        return False
    away = np.array(sizing.kept_points) - face.centre
    if face.kind == "cylinder":
        away = away - (away @ face.direction)[:, None] * face.direction
    return bool((np.linalg.norm(away, axis=1) <= AROUND * face.radius).any())
