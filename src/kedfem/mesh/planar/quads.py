"""Quadrilateral meshes of plane outlines: gmsh under a few settings, each relaxed, the best one taken."""

from collections.abc import Iterator
from dataclasses import dataclass
from types import ModuleType

import numpy as np
from jaxtyping import Float, Int

from kedfem.errors import MeshError
from kedfem.mesh.planar.areas import PlaneQuads, Quads, directed_sides
from kedfem.mesh.planar.choice import SETTINGS, Setting, best_quads
from kedfem.mesh.planar.outline import Outline, edge_circles, outline_area, scaled_outline
from kedfem.mesh.session import gmsh_model, quadrilaterals

_LARGE = 1000  # quadrilaterals from which time matters: the first good mesh is taken, and relaxed less


@dataclass(frozen=True, slots=True)
class _Curve:
    """A curve in gmsh's model and the circle that it lies on; radius nan: straight."""

    tag: int
    centre: Float[np.ndarray, "2"]
    radius: float


def quad_mesh(where: str, outline: Outline, size: float) -> Quads:
    """quad9 mesh of the area inside an outline, nodes on the boundary exactly on its arcs and holes.

    Parameters
    ----------
    where : str
        What is meshed, for messages.
    outline : Outline
        A checked outline.
    size : float [m]
        Edge length of the elements; arcs take shorter ones where they turn more than 22.5° an element.

    Returns
    -------
    (n, 2) [m] and (e, 9)
        Plane nodes; cells in VTK order, anticlockwise. Of the meshes that are good, or within a tenth of the
        best if none is, the one with the fewest elements.

    Raises
    ------
    MeshError
        gmsh cannot be used, or no setting gives quadrilaterals alone; with what gmsh said.
    """
    said: list[str] = []
    large = outline_area(outline) / size**2 > _LARGE
    extent = float(np.ptp(outline.corners, axis=0).max())  # tolerances are absolute: all see a unit size
    meshes = _gmsh_meshes(scaled_outline(outline, 1 / extent), size / extent, said)
    best = best_quads(meshes, first_good=large, iterations=40 if large else 150)
    if best is None:
        raise MeshError(
            f"{where}: must be an area that quadrilaterals can fill, got no such mesh from gmsh "
            f"({'; '.join(dict.fromkeys(said)) or 'triangles were left'}); change mesh.size or the outline"
        )
    points, cells = best.quads
    return points * extent, cells


def _gmsh_meshes(outline: Outline, size: float, said: list[str]) -> Iterator[PlaneQuads | None]:
    """What gmsh makes under each setting, None if not quadrilaterals alone; its errors go to `said`."""
    with gmsh_model() as gmsh:
        curves: list[_Curve] = []
        for setting in SETTINGS:
            mesh = None
            try:
                curves = curves or _drawn(gmsh, outline, size)
                mesh = _meshed(gmsh, curves, setting)
            except Exception as error:  # noqa: BLE001  (gmsh raises nothing more special)
                said.append(str(error))
            yield mesh


def segment_count(length: float, turn: float, size: float) -> int:
    """Number of quadratic segments of an edge: even, near `size` long, none turning more than 22.5°.

    Even numbers let any outline be filled with quadrilaterals.
    """
    return 2 * max(1, int(np.ceil(length / (2 * size) - 0.25)), int(np.ceil(abs(turn) / (np.pi / 4) - 1e-9)))


def _drawn(gmsh: ModuleType, outline: Outline, size: float) -> list[_Curve]:
    """The outline as a surface of gmsh's model, its curves divided; the curves, those of the holes last."""
    occ, arcs = gmsh.model.occ, edge_circles(outline)
    corners = [occ.addPoint(x, y, 0) for x, y in outline.corners]
    tags, lengths, turns = [], [*arcs.lengths], [*arcs.turns]
    for start, end, via in zip(corners, corners[1:] + corners[:1], outline.via, strict=True):
        if np.isnan(via[0]):
            tags.append(occ.addLine(start, end))
        else:
            tags.append(occ.addCircleArc(start, occ.addPoint(*via, 0), end, center=False))
    loops = [occ.addCurveLoop(tags)]
    for (x, y), radius in zip(outline.centres, outline.radii, strict=True):
        tags.append(occ.addCircle(x, y, 0, radius))
        loops.append(occ.addCurveLoop(tags[-1:]))
        lengths.append(2 * np.pi * radius)
        turns.append(2 * np.pi)
    surface = occ.addPlaneSurface(loops)
    occ.synchronize()
    for tag, length, turn in zip(tags, lengths, turns, strict=True):
        gmsh.model.mesh.setTransfiniteCurve(tag, segment_count(length, turn, size) + 1)
    gmsh.model.mesh.setRecombine(2, surface)
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
    centres, radii = [*arcs.centres, *outline.centres], [*arcs.radii, *outline.radii]
    return [_Curve(*curve) for curve in zip(tags, centres, radii, strict=True)]


def _meshed(gmsh: ModuleType, curves: list[_Curve], setting: Setting) -> PlaneQuads | None:
    """The mesh that gmsh makes of its model under one setting, or None if it is not quadrilaterals alone."""
    gmsh.model.mesh.clear()
    gmsh.option.setNumber("Mesh.Algorithm", setting.algorithm)
    gmsh.option.setNumber("Mesh.RecombinationAlgorithm", setting.recombination)
    gmsh.option.setNumber("Mesh.SubdivisionAlgorithm", setting.subdivision)
    gmsh.model.mesh.generate(2)
    if (found := quadrilaterals(gmsh)) is None:
        return None
    points, cells, used = found
    rims = [
        np.searchsorted(used, gmsh.model.mesh.getElements(1, curve.tag)[2][0]).reshape(-1, 2)
        for curve in curves
    ]
    return _bounded(points, cells, curves, rims)


def _bounded(
    points: Float[np.ndarray, "n 2"],
    cells: Int[np.ndarray, "e 4"],
    curves: list[_Curve],
    rims: list[Int[np.ndarray, "_ 2"]],
) -> PlaneQuads:
    """The record of a mesh: cells anticlockwise, nodes and middles of the boundary on their circles."""
    diagonals = points[cells[:, 2:]] - points[cells[:, :2]]
    if np.linalg.det(diagonals).sum() < 0:
        cells = cells[:, ::-1]
    middles = []
    for curve, rim in zip(curves, rims, strict=True):
        points[rim] = _on_circle(curve, points[rim])
        middles.append(_on_circle(curve, points[rim].mean(axis=1)))
    rim = np.concatenate(rims)
    size = len(points)
    forward = np.isin(rim @ [size, 1], directed_sides(cells) @ [size, 1])
    return PlaneQuads(points, cells, np.where(forward[:, None], rim, rim[:, ::-1]), np.concatenate(middles))


def _on_circle(curve: _Curve, points: Float[np.ndarray, "*p 2"]) -> Float[np.ndarray, "*p 2"]:
    """Points moved radially onto the circle of a curve; left where they are if it is straight."""
    if np.isnan(curve.radius):
        return points
    arm = points - curve.centre
    return np.asarray(curve.centre + curve.radius * arm / np.linalg.norm(arm, axis=-1, keepdims=True))
