"""The surface of a solid in gmsh's model: nodes of a mesh put on it, and the directions in which they stay on it."""

from types import ModuleType

import numpy as np
from jaxtyping import Float, Int

from kedfem.mesh.cut.tetrahedra import Subdivision

_FREE, _FIXED = np.eye(3), np.zeros((3, 3))


class CadSurface:
    """Which nodes of a mesh lie on which face or curve of gmsh's model.

    A curve with the same face on both sides (the seam of a cylinder) is no edge of the solid: nodes cross it.
    """

    def __init__(self, gmsh: ModuleType, hexahedra: Subdivision, reach: float) -> None:
        """`reach` [m]: a node that the model would move farther stays where it is."""
        n = len(hexahedra.mesh.points)
        self._gmsh, self._reach = gmsh, reach
        self._face, self._curve, curves = (np.zeros(n, dtype=np.int64) for _ in range(3))
        for tag, nodes in hexahedra.on_face.items():
            self._face[nodes] = tag
        for tag, nodes in hexahedra.on_curve.items():
            if len(gmsh.model.getAdjacencies(1, tag)[0]) > 1:
                self._curve[nodes] = tag
                curves[nodes] += 1
        self._corner = curves > 1

    def settled(
        self, nodes: Int[np.ndarray, " m"], points: Float[np.ndarray, "m 3"]
    ) -> tuple[Float[np.ndarray, "m 3"], Float[np.ndarray, "m 3 3"]]:
        """The points of these nodes put on the model, and of each the projector on the directions along it.

        Inner nodes stay where they are and may move anywhere, those on corners of the solid nowhere.
        """
        points, freedom = points.copy(), np.tile(_FREE, (len(nodes), 1, 1))
        curve, corner = self._curve[nodes], self._corner[nodes]
        face = np.where(curve > 0, 0, self._face[nodes])
        freedom[corner] = _FIXED
        for dim, tags in ((1, np.where(corner, 0, curve)), (2, face)):
            for tag in np.unique(tags[tags > 0]):
                there = np.flatnonzero(tags == tag)
                points[there], freedom[there] = self._on(dim, int(tag), points[there])
        return points, freedom

    def _on(
        self, dim: int, tag: int, points: Float[np.ndarray, "m 3"]
    ) -> tuple[Float[np.ndarray, "m 3"], Float[np.ndarray, "m 3 3"]]:
        """Points on one curve or face, and the projectors on its tangents."""
        model = self._gmsh.model
        try:
            flat, parameters = model.getClosestPoint(dim, tag, points.ravel())
            along = model.getDerivative(1, tag, parameters) if dim == 1 else model.getNormal(tag, parameters)
        except Exception:  # noqa: BLE001  (gmsh raises nothing more special; it has no nearest point for some)
            return points, np.tile(_FIXED, (len(points), 1, 1))
        nearest, directions = flat.reshape(-1, 3), along.reshape(-1, 3)
        directions = np.nan_to_num(directions, posinf=0.0, neginf=0.0)  # a pole has none
        lengths = np.linalg.norm(directions, axis=1)[:, None]
        unit = directions / np.where(lengths > 0, lengths, 1.0)
        projector = unit[:, :, None] * unit[:, None, :]
        freedom = projector if dim == 1 else _FREE - projector
        lost = ~np.isfinite(nearest).all(axis=1) | (np.linalg.norm(nearest - points, axis=1) > self._reach)
        still = lost | (lengths == 0)[:, 0]
        return np.where(lost[:, None], points, nearest), np.where(still[:, None, None], _FIXED, freedom)
