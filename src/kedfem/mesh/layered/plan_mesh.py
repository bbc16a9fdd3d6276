"""The mesh of a plan as quad9 cells: each region is mapped or filled by gmsh, between nodes that neighbours share."""

from collections.abc import Iterator
from dataclasses import dataclass
from types import ModuleType

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.mesh.cad.solids import OtherMethodError, Sizing
from kedfem.mesh.layered.cusps import CUSP, cusps
from kedfem.mesh.layered.division import Division, divided
from kedfem.mesh.layered.mapping import Mapping, Rim, mapped
from kedfem.mesh.layered.partition import Plan, Region
from kedfem.mesh.places import in_mm
from kedfem.mesh.planar.areas import PlaneQuads, directed_sides, quadratic_quads
from kedfem.mesh.planar.choice import GOOD, SETTINGS, Setting, best_quads
from kedfem.mesh.session import gmsh_errors_at_end, gmsh_model, gmsh_options, quadrilaterals

_BETTER = 0.05  # least improvement of the scaled Jacobian by gmsh's quadrilaterals over mapped ones
_LINE, _POINT = 1, 15  # gmsh's numbers of element types
_MOST_SIDES = 4000  # of a rim, whose sides are all compared; slivers of micrometres would have more
_ROUNDING = 1e-24  # square of the area between sides on one line


@dataclass(frozen=True, slots=True)
class PlanMesh:
    """quad9 cells of a plan.

    points : (n, 2) nodes, by the solid's extent [-]
    cells : (e, 9) VTK order, anticlockwise
    regions : (e,) the region of each cell
    settings : gmsh's algorithms that made cells; empty if all regions are mapped
    """

    points: Float[np.ndarray, "n 2"]
    cells: Int[np.ndarray, "e 9"]
    regions: Int[np.ndarray, " e"]
    settings: tuple[int, ...]

    @property
    def kind(self) -> str:
        """Description of the cells."""
        return "quadrilaterals" if self.settings else "mapped blocks,"

    @property
    def made_by(self) -> str:
        """gmsh's algorithms, after a semicolon; empty without any."""
        return f"; gmsh algorithm {', '.join(map(str, self.settings))}" if self.settings else ""


def plan_mesh(where: str, plan: Plan, size: float, sizing: Sizing) -> PlanMesh:
    """The mesh of a plan; nodes on its curves, also those in the middles of sides, lie exactly on them.

    Raises
    ------
    OtherMethodError
        A region has a cusp or cannot be filled with quadrilaterals; the message has its place.
    """
    _check_cusps(where, plan)
    division, fitting = divided(plan, size, sizing)
    rims = [_rim(division, region) for region in plan.regions]
    fills = [
        _filled(where, plan, region, rim[1], fit) for region, rim, fit in zip(plan.regions, rims, fitting, strict=True)
    ]
    points, cells = [division.points], []
    used = len(division.points)
    for (numbers, _), (fill, _) in zip(rims, fills, strict=True):
        inner = fill.points[len(numbers) :]
        cells.append(np.concatenate([numbers, used + np.arange(len(inner))])[fill.cells])
        points.append(inner)
        used += len(inner)
    sides = np.concatenate([np.stack([nodes[:-1], nodes[1:]], axis=1) for nodes in division.nodes])
    whole = PlaneQuads(np.concatenate(points), np.concatenate(cells), sides, np.concatenate(division.middles))
    full = quadratic_quads(whole)
    regions = np.repeat(np.arange(len(cells)), [len(part) for part in cells])
    return PlanMesh(full.points, full.cells, regions, tuple(sorted({alg for _, alg in fills if alg})))


def _check_cusps(where: str, plan: Plan) -> None:
    """Refuse a plan with cusps."""
    for cusp in cusps(plan):
        region = plan.regions[cusp.region]
        i, forward = region.loops[cusp.loop][cusp.place]
        point = plan.curves[i].samples[0 if forward else -1]
        place = plan.in_space(point, plan.heights[int(np.argmax(region.material))])
        raise OtherMethodError(
            f"{where}: edges of its layers must meet at angles of at least {np.degrees(CUSP):.0f}°, got two that "
            f"touch at {in_mm(place)}"
        )


def _rim(division: Division, region: Region) -> tuple[Int[np.ndarray, " n"], Rim]:
    """The node numbers of a region's boundary, and the boundary with node numbers of its own."""
    loops, middles = [], []
    for loop in region.loops:
        loops.append([division.nodes[i] if forward else division.nodes[i][::-1] for i, forward in loop])
        middles += [division.middles[i] if forward else division.middles[i][::-1] for i, forward in loop]
    numbers = np.unique(np.concatenate([curve for loop in loops for curve in loop]))
    own = tuple(tuple(np.searchsorted(numbers, curve) for curve in loop) for loop in loops)
    return numbers, Rim(division.points[numbers], own, np.concatenate(middles))


def _filled(where: str, plan: Plan, region: Region, rim: Rim, mapping: Mapping | None) -> tuple[PlaneQuads, int]:
    """The cells of one region, and gmsh's algorithm that made them, 0 if it is mapped."""
    best = best_quads([mapped(rim, mapping)]) if mapping else None
    algorithm = 0
    if best is None or best.quality < GOOD:
        other = best_quads(polygon_quads(rim))
        if other is not None and (best is None or other.quality > best.quality + _BETTER):
            best, algorithm = other, SETTINGS[other.tried].algorithm
    if best is None:
        x = plan.in_space(rim.points.mean(axis=0), plan.heights[int(np.argmax(region.material))])
        raise OtherMethodError(
            f"{where}: quadrilaterals must fill the sections of its layers, got none around "
            "({:.6g}, {:.6g}, {:.6g})".format(*x)
        )
    return best.corners, algorithm


def polygon_quads(rim: Rim) -> Iterator[PlaneQuads | None]:
    """gmsh's mesh of a region under each setting, on the nodes of the rim; None if it has other cells or none."""
    if len(rim.sides) > _MOST_SIDES or crosses_itself(rim.points, rim.sides):
        return  # gmsh might hang
    for setting in SETTINGS:
        with gmsh_model() as gmsh:
            try:
                mesh = _meshed(gmsh, rim, setting)
            except Exception:  # noqa: BLE001  (gmsh raises nothing more special)
                mesh = None
        yield mesh


def _meshed(gmsh: ModuleType, rim: Rim, setting: Setting) -> PlaneQuads | None:
    """The mesh under one setting; if that halves all sides, gmsh is given every other node."""
    step = 1 + setting.subdivision
    surface = _surface(gmsh, rim, step)
    sides = np.linalg.norm(np.diff(rim.points[rim.sides], axis=1)[:, 0], axis=1)
    options = {
        "Mesh.ElementOrder": 1,
        "Mesh.Algorithm": setting.algorithm,
        "Mesh.RecombinationAlgorithm": setting.recombination,
        "Mesh.SubdivisionAlgorithm": setting.subdivision,
        "Mesh.MeshSizeExtendFromBoundary": 1,
        "Mesh.MeshSizeMax": step * float(sides.max()),
    }
    gmsh.model.mesh.setRecombine(2, surface)
    with gmsh_options(gmsh, options), gmsh_errors_at_end(gmsh):
        gmsh.model.mesh.generate(2)
    if (found := quadrilaterals(gmsh)) is None:
        return None
    points, cells = found
    return _on_rim(rim, step, points, cells)


def _surface(gmsh: ModuleType, rim: Rim, step: int) -> int:
    """The region as a plane surface between divided curves in gmsh's model."""
    model, loops = gmsh.model, []
    for node in np.unique([curve[[0, -1]] for loop in rim.loops for curve in loop]):
        place = [*rim.points[node], 0.0]
        model.addDiscreteEntity(0, int(node) + 1)
        model.setCoordinates(int(node) + 1, *place)
        model.mesh.addNodes(0, int(node) + 1, [int(node) + 1], place)
        model.mesh.addElementsByType(int(node) + 1, _POINT, [], [int(node) + 1])
    for loop in rim.loops:
        curves = []
        for curve in loop:
            chosen = curve[::step]
            tag = model.addDiscreteEntity(1, -1, [int(chosen[0]) + 1, int(chosen[-1]) + 1])
            inner = np.column_stack([rim.points[chosen[1:-1]], np.zeros(len(chosen) - 2)])
            model.mesh.addNodes(1, tag, chosen[1:-1] + 1, inner.ravel())
            sides = np.stack([chosen[:-1], chosen[1:]], axis=1) + 1
            model.mesh.addElementsByType(tag, _LINE, [], sides.ravel())
            curves.append(tag)
        loops.append(model.geo.addCurveLoop(curves))
    surface = model.geo.addPlaneSurface(loops)
    model.geo.synchronize()
    return int(surface)


def _on_rim(rim: Rim, step: int, points: Float[np.ndarray, "n 2"], cells: Int[np.ndarray, "e 4"]) -> PlaneQuads | None:
    """The mesh with the rim's nodes first and at their places; None if its boundary differs from the rim."""
    diagonals = points[cells[:, 2:]] - points[cells[:, :2]]
    if np.linalg.det(diagonals).sum() < 0:
        cells = cells[:, ::-1]
    where = _given_places(rim, step)
    from scipy.spatial import KDTree

    distance, nearest = KDTree(points).query(where)
    if distance.max() > 1e-6 or len(np.unique(nearest)) < len(nearest):
        return None
    inner = np.setdiff1d(np.arange(len(points)), nearest)
    number = np.empty(len(points), dtype=int)
    number[nearest], number[inner] = np.arange(len(nearest)), len(nearest) + np.arange(len(inner))
    cells = number[cells]
    size = len(points)
    sides = directed_sides(cells) @ [size, 1]
    once = np.sort(sides[~np.isin(sides, directed_sides(cells) @ [1, size])])
    if not np.array_equal(once, np.sort(rim.sides @ [size, 1])):
        return None
    return PlaneQuads(np.concatenate([rim.points, points[inner]]), cells, rim.sides, rim.middles)


def _given_places(rim: Rim, step: int) -> Float[np.ndarray, "n 2"]:
    """The rim's nodes in gmsh's mesh, where those made by halving are half way along straight sides."""
    where = rim.points.copy()
    if step == 2:
        for curve in (curve for loop in rim.loops for curve in loop):
            where[curve[1::2]] = (where[curve[:-1:2]] + where[curve[2::2]]) / 2
    return where


def crosses_itself(points: Float[np.ndarray, "n 2"], sides: Int[np.ndarray, "s 2"]) -> bool:
    """Whether two sides of a polygon that share no node meet."""
    start, end = points[sides[:, 0]], points[sides[:, 1]]
    along = end - start

    def left_of(places: Float[np.ndarray, "s 2"]) -> Float[np.ndarray, "s s"]:
        arms = places - start[:, None]
        return np.asarray(along[:, None, 0] * arms[..., 1] - along[:, None, 1] * arms[..., 0])

    divided = left_of(start) * left_of(end) < -_ROUNDING
    apart = ~(sides[:, None, :, None] == sides[None, :, None, :]).any(axis=(2, 3))
    return bool((divided & divided.T & apart).any())
