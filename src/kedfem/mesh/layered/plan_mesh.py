"""The mesh of a plan: its regions filled one by one between nodes that they share, put together to quad9 cells."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from kedfem.mesh.cad.solids import OtherMethodError, Sizing
from kedfem.mesh.layered.cusps import CUSP, cusps
from kedfem.mesh.layered.division import Division, divided
from kedfem.mesh.layered.mapping import Mapping, Rim, mapped
from kedfem.mesh.layered.partition import Plan, Region
from kedfem.mesh.layered.polygons import polygon_quads
from kedfem.mesh.places import in_mm
from kedfem.mesh.planar.areas import PlaneQuads, quadratic_quads
from kedfem.mesh.planar.choice import GOOD, SETTINGS, best_quads

_BETTER = 0.05  # by which gmsh's quadrilaterals must be better than mapped ones


@dataclass(frozen=True, slots=True)
class PlanMesh:
    """quad9 cells of a plan.

    points : (n, 2) by the solid's extent [-]
    cells : (e, 9) VTK order, anticlockwise
    regions : (e,) the region that each cell is in
    settings : gmsh's algorithms that made cells; empty: all regions are mapped
    """

    points: Float[np.ndarray, "n 2"]
    cells: Int[np.ndarray, "e 9"]
    regions: Int[np.ndarray, " e"]
    settings: tuple[int, ...]

    @property
    def kind(self) -> str:
        """What is swept, in words."""
        return "quadrilaterals" if self.settings else "mapped blocks,"

    @property
    def made_by(self) -> str:
        """gmsh's algorithms in words, after a semicolon; empty without any."""
        return f"; gmsh algorithm {', '.join(map(str, self.settings))}" if self.settings else ""


def plan_mesh(where: str, plan: Plan, size: float, sizing: Sizing) -> PlanMesh:
    """The mesh of a plan, the nodes and middles of sides on its curves exactly there.

    Raises
    ------
    OtherMethodError
        A region has a cusp, or quadrilaterals do not fill it; with its place.
    """
    _check_cusps(where, plan)
    division, fitting = divided(plan, size, sizing)
    rims = [_rim(division, region) for region in plan.regions]
    fills = [
        _filled(where, plan, region, rim[1], fit)
        for region, rim, fit in zip(plan.regions, rims, fitting, strict=True)
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
    """Refuses a plan where two curves meet at hardly any angle."""
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
    """The boundary of a region: the division's numbers of its nodes, and the same with numbers of its own."""
    loops, middles = [], []
    for loop in region.loops:
        loops.append([division.nodes[i] if forward else division.nodes[i][::-1] for i, forward in loop])
        middles += [division.middles[i] if forward else division.middles[i][::-1] for i, forward in loop]
    numbers = np.unique(np.concatenate([curve for loop in loops for curve in loop]))
    own = tuple(tuple(np.searchsorted(numbers, curve) for curve in loop) for loop in loops)
    return numbers, Rim(division.points[numbers], own, np.concatenate(middles))


def _filled(
    where: str, plan: Plan, region: Region, rim: Rim, mapping: Mapping | None
) -> tuple[PlaneQuads, int]:
    """The cells of one region and gmsh's algorithm that made them, 0 if it is mapped."""
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
