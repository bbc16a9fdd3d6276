"""Division of the curves of a plan: element sizes along them, equal numbers on opposite sides, nodes."""

from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Bool, Float, Int
from kedfem.mesh.cad.solids import AROUND, Sizing
from kedfem.mesh.layered.mapping import Mapping, mappings
from kedfem.mesh.layered.partition import Curve, Loop, Plan, Region

_MOST = 1500  # squares of the default size in the plan
_GROWTH = 0.4  # increase of an element's length with the distance [-]
_SLENDER = 1.5  # length of an element along a rib, in widths of the rib
_FINEST = 0.2  # least length due to the accuracy of an arc, in sizes
_THINNEST = 0.05  # least length due to the width of a rib, in sizes
_LOST = 1e-5  # volume by which parabolas may miss a whole circle, of the solid's
_LOST_AT_45 = 2.44e-3  # of R²: area between a circle and eight parabolas of θ = 45° each,
# 8 ((θ − sin θ) / 2 − 4/3 sin(θ/2) (1 − cos(θ/2))); it is proportional to θ⁴


@dataclass(frozen=True, slots=True)
class Division:
    """Nodes on the curves of a plan.

    points : (n, 2) the nodes, each vertex once [-]
    nodes : node numbers of each curve from start to end; a closed curve ends at its first node
    middles : (c, 2) points of each curve half way between its nodes [-]
    """

    points: Float[np.ndarray, "n 2"]
    nodes: tuple[Int[np.ndarray, " _"], ...]
    middles: tuple[Float[np.ndarray, "_ 2"], ...]


def plan_size(plan: Plan, sizing: Sizing) -> float:
    """Edge length of the elements, by the solid's extent [-].

    It is the size asked for; else the plan's mean width, 2 · area / perimeter of all sections together, over
    `sizing.across`, but large enough for at most 1500 squares. Ribs and walls that are thinner do not reduce it:
    elements are only shorter there, one and a half times as long as the rib is thick.
    """
    if sizing.size is not None:
        return sizing.size / plan.extent
    area = sum(region.area for region in plan.regions)
    met = np.bincount([i for region in plan.regions for loop in region.loops for i, _ in loop])
    perimeter = sum(curve.length for curve, regions in zip(plan.curves, met, strict=True) if regions == 1)
    return max(2 * area / perimeter / sizing.across, float(np.sqrt(area / _MOST)))


def divided(plan: Plan, size: float, sizing: Sizing) -> tuple[Division, tuple[Mapping | None, ...]]:
    """Nodes on all curves, and the mapping of each region that these allow.

    Elements are `size` long, and shorter along thin ribs and where a curve would turn by more than the sizing's `angle`
    or `concave_angle`, or be missed by a parabola; they grow with the distance from there. Each curve has an even
    number of elements, so that quadrilaterals can fill any region; opposite sides get equal numbers where that costs
    little.

    Parameters
    ----------
    plan : within its context
    size : by the solid's extent [-]
    sizing : its angles and `kept_points` are used
    """
    sizes = _sizes(plan, size, _angles(plan, sizing))
    measures = [_measure(curve, local) for curve, local in zip(plan.curves, sizes, strict=True)]
    counts = [2 * max(1, int(np.ceil(measure[-1] / 2 - 0.25))) for measure in measures]
    fitting = mappings(plan, counts)
    return _nodes(plan, counts, measures, fitting), fitting


def _angles(plan: Plan, sizing: Sizing) -> list[Float[np.ndarray, " m"]]:
    """Largest angle of an element at the samples of each curve [rad]: smaller along concave walls."""
    out = [np.full(len(curve.samples), sizing.angle) for curve in plan.curves]
    if sizing.concave_angle >= sizing.angle:
        return out
    kept = ((np.array(sizing.kept_points).reshape(-1, 3) - plan.origin) @ plan.axes.T)[:, :2] / plan.extent
    sides: list[list[Bool[np.ndarray, " slabs"]]] = [[] for _ in plan.curves]
    runs = [(region, i, way) for region in plan.regions for loop in region.loops for i, way in loop]
    for region, i, _ in runs:
        sides[i].append(region.material)
    for region, i, forward in runs:
        wall = region.material.copy()
        for other in sides[i]:
            wall &= (other is region.material) | ~other
        if not wall.any():
            continue
        points, inwards = _points_and_normals(plan.curves[i], forward)
        along = np.stack([inwards[:, 1], -inwards[:, 0]], axis=1)
        curvatures = plan.curves[i].curvatures if forward else plan.curves[i].curvatures[::-1]
        radii = 1 / np.maximum(curvatures, 1e-9)
        centres = points - radii[:, None] * inwards
        off = np.linalg.norm(centres[:, None] - kept, axis=2).min(axis=1, initial=np.inf)
        concave = ((np.gradient(along, axis=0) * inwards).sum(axis=1) < 0) & (off > AROUND * radii)
        turns = np.where(concave & (curvatures > 0), sizing.concave_angle, sizing.angle)
        out[i] = np.minimum(out[i], turns if forward else turns[::-1])
    return out


def _sizes(plan: Plan, size: float, turns: list[Float[np.ndarray, " m"]]) -> list[Float[np.ndarray, " m"]]:
    """Required length of the elements at the samples of each curve [-]."""
    wanted = []
    for curve, gap, height, turn in zip(plan.curves, _gaps(plan), plan.wall_heights, turns, strict=True):
        radii = 1 / np.maximum(curve.curvatures, 1e-9)
        share = _LOST * plan.volume / (_LOST_AT_45 * radii**2 * max(height, 1e-9))
        exact = np.maximum(radii * np.pi / 4 * share**0.25, _FINEST * size)
        by_gap = np.maximum(_SLENDER * gap, _THINNEST * size)
        fair = np.full(len(gap), min(size, curve.length / 2))
        wanted.append(np.minimum.reduce([exact, radii * turn, by_gap, fair]))
    points, flat = np.concatenate([curve.samples for curve in plan.curves]), np.concatenate(wanted)
    from scipy.spatial.distance import cdist

    graded = (flat + _GROWTH * cdist(points, points)).min(axis=1)
    return np.split(graded, np.cumsum([len(one) for one in wanted])[:-1])


def _gaps(plan: Plan) -> list[Float[np.ndarray, " m"]]:
    """Least distance from each sample through a region to an opposite side [-]."""
    gaps = [np.full(len(curve.samples), np.inf) for curve in plan.curves]
    for region in plan.regions:
        sides = [(i, *_points_and_normals(plan.curves[i], way)) for loop in region.loops for i, way in loop]
        points, normals = (np.concatenate([side[k] for side in sides]) for k in (1, 2))
        arms = points - points[:, None]
        distances = np.linalg.norm(arms, axis=2)
        ahead = np.einsum("pqi,pi->pq", arms, normals) > 0.85 * distances
        opposed = normals @ normals.T < -0.7
        least = np.where(ahead & opposed & (distances > 0), distances, np.inf).min(axis=1)
        for (i, own, _), gap in zip(sides, np.split(least, np.cumsum([len(s[1]) for s in sides])[:-1]), strict=True):
            forward = gap if np.array_equal(own, plan.curves[i].samples) else gap[::-1]
            gaps[i] = np.minimum(gaps[i], forward)
    return gaps


def _points_and_normals(curve: Curve, forward: bool) -> tuple[Float[np.ndarray, "m 2"], Float[np.ndarray, "m 2"]]:
    """Samples in the direction of a loop, and the unit normals to its left."""
    points = curve.samples if forward else curve.samples[::-1]
    along = np.gradient(points, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return points, np.stack([-along[:, 1], along[:, 0]], axis=1)


def _measure(curve: Curve, local: Float[np.ndarray, " m"]) -> Float[np.ndarray, " m"]:
    """Number of elements from the start to each sample, ∫ ds / size [-]."""
    density = 1 / local
    steps = np.diff(curve.lengths) * (density[1:] + density[:-1]) / 2
    return np.concatenate([[0.0], np.cumsum(steps)])


def _nodes(
    plan: Plan, counts: list[int], measures: list[Float[np.ndarray, " m"]], fitting: tuple[Mapping | None, ...]
) -> Division:
    """The nodes; those of a free closed curve inside a ring lie opposite the nodes of the outer loop."""
    ends = sorted({end for curve in plan.curves for end in curve.ends})
    places = {  # equal shares of the measure between neighbours
        i: np.interp(np.linspace(0, measure[-1], count + 1), measure, curve.lengths)
        for i, (curve, count, measure) in enumerate(zip(plan.curves, counts, measures, strict=True))
    }
    for region, mapping in _from_outside(plan, fitting):
        inner = region.loops[1][0][0]
        if mapping.kind == "ring" and len(region.loops[1]) == 1 and plan.curves[inner].free:
            places[inner] = _opposite(plan, places, region)
    points = [np.full((len(ends), 2), np.nan)]
    nodes, middles, used = [], [], len(ends)
    for i, curve in enumerate(plan.curves):
        at, (start, end) = places[i], np.searchsorted(ends, curve.ends)
        points[0][[start, end]] = curve.places(at[[0, -1]] % curve.length if curve.free else at[[0, -1]])
        points.append(_wrapped(curve, at[1:-1]))
        nodes.append(np.array([start, *range(used, used + len(at) - 2), end]))
        middles.append(_wrapped(curve, (at[1:] + at[:-1]) / 2))
        used += len(at) - 2
    return Division(np.concatenate(points), tuple(nodes), tuple(middles))


def _wrapped(curve: Curve, lengths: Float[np.ndarray, " s"]) -> Float[np.ndarray, "s 2"]:
    """Points of a curve at arc lengths, which may exceed the length of a closed one."""
    return curve.places(lengths % curve.length if curve.free else lengths)


def _from_outside(plan: Plan, fitting: tuple[Mapping | None, ...]) -> list[tuple[Region, Mapping]]:
    """The mapped rings, outer ones first."""
    rings = [(region, mapping) for region, mapping in zip(plan.regions, fitting, strict=True) if mapping]
    rings = [(region, mapping) for region, mapping in rings if len(region.loops) == 2]

    def extent(ring: tuple[Region, Mapping]) -> float:
        outer = [plan.curves[i].samples for i, _ in ring[0].loops[0]]
        return float(np.ptp(np.concatenate(outer), axis=0).max())

    return sorted(rings, key=extent, reverse=True)


def _opposite(plan: Plan, places: dict[int, Float[np.ndarray, " n"]], region: Region) -> Float[np.ndarray, " n"]:
    """Arc lengths of nodes along the inner curve of a ring, nearly even, opposite the nodes of the outer loop."""
    (number, _), *_ = region.loops[1]
    curve, outer = plan.curves[number], _loop_nodes(plan, places, region.loops[0])
    count = len(outer)
    centre = curve.samples[:-1].mean(axis=0)
    finer = np.linspace(0, curve.length, 32 * count, endpoint=False)
    around = np.unwrap(np.angle((curve.places(finer) - centre) @ [1, 1j]))
    towards = np.unwrap(np.angle((outer - centre) @ [1, 1j]))
    turned = np.sign(around[-1] - around[0])
    if turned != np.sign(towards[-1] - towards[0]):
        towards = towards[::-1]
    # the mean of the opposite places and an even division keeps both angles and lengths good
    facing = np.interp(
        np.maximum.accumulate(turned * (towards - around[0])), turned * (around - around[0]), finer, period=2 * np.pi
    )
    facing = np.unwrap(facing * 2 * np.pi / curve.length) * curve.length / (2 * np.pi)
    even = np.arange(count) * curve.length / count
    shift = float((facing - even).mean())
    lengths = (facing + even + shift) / 2
    steps = np.diff(np.append(lengths, lengths[0] + curve.length))
    if steps.min() < even[1] / 3:  # the outer loop reverses somewhere, seen from the centre
        lengths = even + shift
    return np.append(lengths, lengths[0] + curve.length)


def _loop_nodes(plan: Plan, places: dict[int, Float[np.ndarray, " n"]], loop: Loop) -> Float[np.ndarray, "_ 2"]:
    """Nodes along a loop, each once."""
    parts = []
    for i, forward in loop:
        points = _wrapped(plan.curves[i], places[i])
        parts.append((points if forward else points[::-1])[:-1])
    return np.concatenate(parts)
